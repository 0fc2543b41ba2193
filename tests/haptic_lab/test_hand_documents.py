"""The tables of joints in docs/hands.md are those that `haptic-slam check-hand` tells."""

from __future__ import annotations

import pytest

from haptic_env import hands
from haptic_lab.hand_check.listing import joint_table
from tests.scripts.documents import ROOT


@pytest.mark.parametrize("name", [*hands.HANDS, str(ROOT / "examples" / "gripper" / "gripper.toml")])
def test_every_joint_is_told_as_it_is(name):
    written = (ROOT / "docs" / "hands.md").read_text()
    for row in joint_table(hands.make(name)).itertuples():
        numbers = f"{row.least:g} | {row.largest:g} | {row.rest:g}"
        told = f"| `{row.joint}` | {row.unit} | {numbers} | {row.positive} | {row.torque:g} | {row.patches} |"
        assert told in written


@pytest.mark.parametrize("name", hands.HANDS)
def test_every_hand_has_a_picture(name):
    written = (ROOT / "docs" / "hands.md").read_text()
    assert f"(hand_{name}.png)" in written.partition(f"### {name}\n")[2].partition("###")[0]
