"""What an off-policy learner has lived through, as an .npz file of plain arrays.

Stable-Baselines3 would pickle it, and whoever reads a pickle runs what is in it.
"""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray
from stable_baselines3.common.buffers import ReplayBuffer

from haptic_env import reading, validate

KEPT = ("observations", "next_observations", "actions", "rewards", "dones", "timeouts")
SLACK = 2**20  # bytes of a file beside its arrays


def save(path: Path, buffer: ReplayBuffer) -> None:
    """Write what a replay buffer holds.

    Args:
        path: of the .npz file.
        buffer: with the transitions.
    """
    held = {name: array[: buffer.size()] for name, array in _arrays(buffer).items()}
    np.savez(path, allow_pickle=False, position=np.array(buffer.pos), **held)


def restore(path: Path, buffer: ReplayBuffer) -> None:
    """Read what a replay buffer held.

    Args:
        path: of the .npz file.
        buffer: an empty one, into which it is put.

    Raises:
        ValueError: for the file of a buffer of other shapes.
    """
    arrays = _arrays(buffer)
    kept = reading.npz(path, sum(array.nbytes for array in arrays.values()) + SLACK)
    if kept.keys() != {*arrays, "position"} or kept["position"].shape != () or kept["position"].dtype.kind != "i":
        raise ValueError(f"{path} is of another replay buffer: it holds {', '.join(kept)}")
    rows = len(np.atleast_1d(kept["rewards"]))
    for name, array in arrays.items():
        held = kept[name]
        if held.dtype != array.dtype or held.shape != (rows, *array.shape[1:]) or rows > len(array):
            raise ValueError(
                f"{path} is of another replay buffer: {name} is {held.dtype} {held.shape}, not {array.dtype} "
                f"({rows}, …) of at most {array.shape}"
            )
        array[:rows] = held
    buffer.full = rows == buffer.buffer_size
    last = buffer.buffer_size - 1
    buffer.pos = validate.integer(f"position in {path}", kept["position"].item(), 0, last) if buffer.full else rows


def _arrays(buffer: ReplayBuffer) -> dict[str, NDArray[Any]]:
    """The arrays of `buffer`, by name; a view of each entry where observations have several."""
    found: dict[str, NDArray[Any]] = {}
    for name in KEPT:
        array: Any = getattr(buffer, name, None)
        if isinstance(array, dict):
            found |= {f"{name}.{entry}": each for entry, each in array.items()}
        elif array is not None:
            found[name] = array
    return found
