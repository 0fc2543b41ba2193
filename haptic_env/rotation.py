"""How far an object may be turned about any axis, and such turns at random."""

from __future__ import annotations

import numpy as np
from scipy.spatial.transform import Rotation

from haptic_env import validate


def jitter(degrees: float, yaw: float = 0.0) -> float:
    """Check how far an object may be turned about any axis.

    Args:
        degrees: in [0, 180]; 180 is any turn at all.
        yaw: degrees by which it is turned about the vertical instead.

    Returns:
        The degrees.

    Raises:
        ValueError: for a value out of range, or where both are above 0.
    """
    checked = validate.number("rotation_jitter", degrees, 0.0, 180.0, unit="degrees")
    if checked and yaw:
        raise ValueError(
            f"rotation_jitter={checked:g} turns an object about any axis, the vertical too: it needs yaw_jitter=0, got "
            f"{yaw:g}"
        )
    return checked


def drawn(rng: np.random.Generator, most: float, count: int) -> Rotation:
    """Draw turns uniformly among those by no more than an angle.

    Args:
        rng: draws.
        most: rad, in [0, pi].
        count: of turns.

    Returns:
        The turns.
    """
    axis = rng.standard_normal((count, 3))
    axis /= np.linalg.norm(axis, axis=1, keepdims=True)
    angles = np.linspace(0.0, most, 1001)
    # The angle of a uniform turn has the density (1 - cos) / pi (Miles 1965, Biometrika 52, 636-639).
    angle = np.interp(rng.random(count) * (most - np.sin(most)), angles - np.sin(angles), angles)
    return Rotation.from_rotvec(angle[:, None] * axis)
