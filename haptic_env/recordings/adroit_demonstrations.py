"""Demonstrations with a CyberGlove on the Adroit hand (Rajeswaran et al. 2018, hand_dapg), as `.npz`.

Each demonstration X has an array `X_obs` (T, 27 or more): arm and hand joints in rad, 100 a second.
"""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from haptic_env import validate
from haptic_env.recordings.recording import Recording

RATE = 100.0  # Hz
ARM = ("ARRx", "ARRy", "ARRz")  # which the hand alone does not have
FINGERS = {"FF": 4, "MF": 4, "RF": 4, "LF": 5, "TH": 5}  # joints of each, numbered down to 0
JOINTS = ("WRJ1", "WRJ0", *(f"{name}J{j}" for name, count in FINGERS.items() for j in reversed(range(count))))
SUFFIX = "_obs"


def recognise(content: Mapping[str, NDArray[Any]]) -> bool:
    """Tell whether the arrays of a file are demonstrations.

    Args:
        content: the arrays by their names.

    Returns:
        Whether they are.
    """
    return "joint_angles" not in content and any(name.endswith(SUFFIX) for name in content)


def pick(path: Path, content: Mapping[str, NDArray[Any]], part: str | None) -> Recording:
    """Take one demonstration of a file.

    Args:
        path: of the file, for messages.
        content: its arrays by their names.
        part: name of the demonstration; None where there is but one.

    Returns:
        The recording.

    Raises:
        ValueError: where it is not there, or several are and none is named.
    """
    parts = [name.removesuffix(SUFFIX) for name in content if name.endswith(SUFFIX)]
    if part is None and len(parts) > 1:
        raise ValueError(f"{path}: it holds several recordings; choose a part from {validate.listed(parts)}")
    name = parts[0] if part is None else validate.choice(f"part of {path}", part, parts)
    seen = content[name + SUFFIX]
    first = len(ARM)
    if seen.ndim != 2 or seen.shape[1] < first + len(JOINTS):
        raise ValueError(f"{path}: {name}{SUFFIX} must have shape (T, {first + len(JOINTS)} or more), got {seen.shape}")
    return Recording(
        source=f"{path} ({name})",
        time=np.arange(len(seen)) / RATE,
        joint_names=JOINTS,
        joint_angles=np.array(seen[:, first : first + len(JOINTS)]),
    )
