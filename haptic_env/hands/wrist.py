"""A wrist that moves: what holds a hand goes along three axes and turns about three, each by a motor of its own.

The axes are the world's where the wrist is at rest; there it is in its middle. Roll, pitch and yaw are turns about x, y
and z, the last one first: R = Rx(roll)·Ry(pitch)·Rz(yaw). An arm's worth of mass comes with the wrist, its weight is
borne, and at full force it moves at the speeds of a person's hand that feels an object: 0.27 m/s and 170°/s.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from haptic_env import validate
from haptic_env.arrays import Array
from haptic_env.composer import mjcf
from haptic_env.hands.drives import Drive, add_joint

WRISTS = ("fixed", "free")
ONLY = {"two_finger": "fixed", "two_finger_arm": "free"}  # of hands that have no choice
NAMES = ("wrist_x", "wrist_y", "wrist_z", "wrist_roll", "wrist_pitch", "wrist_yaw")
LEVER_ARM = 0.1  # m in one radian: a hand's length, so that a joint's σ moves it as far either way
FARTHEST = 0.2  # m from the middle
TURNED = (np.pi, 0.5 * np.pi, np.pi)  # rad from the middle: all directions there are
MASS, INERTIA = 1.0, 3e-3  # kg and kg·m² about the wrist, of what goes with the hand
FORCE, RESISTANCE, PULL = 4.0, 15.0, 20.0  # N at most, N·s/m and N/m, to the middle
ALONG = Drive(FORCE * LEVER_ARM, RESISTANCE * LEVER_ARM**2, PULL * LEVER_ARM**2, 0.0)
ABOUT = Drive(0.3, 0.1, 0.12, 0.0)


def check(hand: str, wrist: str) -> bool:
    """Check how a hand is to be held.

    Args:
        hand: its name.
        wrist: as it was asked for, one of `WRISTS`.

    Returns:
        Whether it is free.

    Raises:
        ValueError: for another one.
    """
    chosen = validate.choice("wrist", wrist, WRISTS)
    only = ONLY.get(hand, chosen)
    if chosen != only:
        told = "has no wrist that moves" if chosen == "free" else "has a wrist that always moves"
        raise ValueError(f"hand {hand!r} {told}: wrist must be {only!r}, got {chosen!r}")
    return chosen == "free"


def add(tree: mjcf.RootElement, body: Any, place: ArrayLike, turn: Array) -> None:
    """Hang a hand on a wrist that moves.

    Args:
        tree: the hand's MJCF.
        body: of the tree, fixed in the world so far, from which the hand hangs.
        place: (3,) m in the body's frame, about which the wrist turns.
        turn: (3, 3) of the body in the world.
    """
    body.add("inertial", mass=MASS, pos=place, diaginertia=(INERTIA,) * 3)
    limits = np.array([FARTHEST / LEVER_ARM] * 3 + list(TURNED))
    for index, name in enumerate(NAMES):
        told = {"axis": turn[index % 3], "range": _in_the_unit_of(tree, limits[index], index), "limited": True}
        kind = {"type": "slide", "user": [LEVER_ARM]} if index < 3 else {"type": "hinge", "pos": place}
        add_joint(tree, body, name, ALONG if index < 3 else ABOUT, **told, **kind)


def _in_the_unit_of(tree: mjcf.RootElement, limit: float, index: int) -> tuple[float, float]:
    """Range of a joint as the compiler reads it, who takes no slide's for degrees."""
    degrees = index >= 3 and tree.compiler.angle != "radian"
    end = float(np.rad2deg(limit)) if degrees else float(limit)
    return -end, end
