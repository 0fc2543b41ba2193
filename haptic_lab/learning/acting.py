"""How a candidate of a search acts.

Shapes: J joints, D numbers of an observation.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from agents.rhythm import Memory, Rhythm
from haptic_env.arrays import Array

Candidate = Array | Rhythm  # (J, 1 + D) of a linear policy, the constant first
CHANCE = np.random.default_rng(0)  # which no candidate asks


def act(candidate: Candidate, shown: Any, memory: Memory, began: bool) -> tuple[NDArray[np.float32], Memory]:
    """Compute an action.

    Args:
        candidate: that acts.
        shown: (D,) what it is shown.
        memory: what the last call returned.
        began: whether it is the first of an episode.

    Returns:
        Torques (J,), and what to hand to the next call as `memory`.
    """
    if isinstance(candidate, Rhythm):
        return candidate.predict(shown, memory, began, True, CHANCE)
    return np.clip(candidate[:, 0] + candidate[:, 1:] @ shown, -1.0, 1.0).astype(np.float32), memory
