"""What differs between two spaces is told in a line."""

from __future__ import annotations

import numpy as np
import pytest
from gymnasium.spaces import Box, Dict, Discrete, MultiBinary

from agents.space_difference import difference

ANGLES = Box(-1.0, 1.0, (8,), np.float32)
SPACES = {
    "angles": ANGLES,
    "more angles": Box(-1.0, 1.0, (24,), np.float32),
    "wide angles": Box(np.r_[-1.0, -2.0, -np.ones(6)].astype(np.float32), 1.0, (8,), np.float32),
    "fine angles": Box(-1.0, 1.0, (8,), np.float64),
    "touch": MultiBinary(40),
    "felt": Dict(contacts=MultiBinary(40), joint_angles=ANGLES),
    "felt by more": Dict(contacts=MultiBinary(60), joint_angles=ANGLES, torque=ANGLES),
    "told": Dict(names=Box(0.0, 1.0, (4,), np.float32), joint_angles=ANGLES),
    "choice": Discrete(3),
}


@pytest.mark.parametrize(
    ("trained", "here", "told"),
    [
        ("angles", "more angles", "Box(8,) float32, and here Box(24,) float32"),
        ("angles", "fine angles", "Box(8,) float32, and here Box(8,) float64"),
        ("angles", "wide angles", "Box(8,) float32 with low -1 at index 1, and here -2"),
        ("angles", "felt", "Box(8,) float32, and here Dict(contacts: MultiBinary(40,), joint_angles: Box(8,) float32)"),
        (
            "felt",
            "felt by more",
            "torque Box(8,) float32 here and not there; contacts: MultiBinary(40,), and here MultiBinary(60,)",
        ),
        ("felt", "told", "contacts MultiBinary(40,) missing here; names Box(4,) float32 here and not there"),
        ("choice", "touch", "Discrete(3), and here MultiBinary(40,)"),
    ],
)  # fmt: skip
def test_what_differs_is_told(trained: str, here: str, told: str) -> None:
    assert difference(SPACES[trained], SPACES[here]) == told


def test_spaces_differ_from_all_others_and_not_from_themselves() -> None:
    for name, space in SPACES.items():
        for other, there in SPACES.items():
            told = difference(space, there)
            assert (told == "") == (name == other)
            assert "\n" not in told
            assert len(told) < 200
