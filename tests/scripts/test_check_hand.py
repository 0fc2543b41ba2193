"""The command that draws a hand, lists its joints and says what is wrong with it."""

from __future__ import annotations

import pandas as pd
import pytest
from matplotlib.image import imread

from haptic_env import hands
from haptic_lab.commands import check_hand, explore
from haptic_lab.hand_check.listing import joint_table
from haptic_lab.sweeps.tasks import files_of
from tests.haptic_env.own_hands import GRIPPER, gripper

HAND = str(GRIPPER / "gripper.toml")


@pytest.mark.parametrize("lattice", [True, False])
def test_it_lists_and_draws(lattice, tmp_path, capsys):
    path = HAND if lattice else str(GRIPPER / "taxels.toml")
    assert check_hand.main([path, "--out", str(tmp_path / "out")]) == 0
    told = capsys.readouterr().out
    assert "left_close" in told
    assert "Nothing is wrong" in told
    hand = hands.make(path)
    assert imread(tmp_path / "out" / "hand.png")[..., :3].std() > 0.05
    read = {name: pd.read_csv(tmp_path / "out" / f"{name}.csv") for name in ("joints", "links", "patches")}
    assert tuple(read["joints"]["joint"]) == hand.joint_names
    assert tuple(read["patches"]["patch"]) == hand.patches.names
    assert read["links"]["patches"].sum() == len(hand.patches)


@pytest.mark.parametrize("name", ["two_finger", "two_finger_arm"])
def test_signs_and_units_are_those_of_the_joints(name):
    table = joint_table(hands.make(name)).set_index("joint")
    for finger in ("thumb", "index"):
        assert (
            table.loc[[f"{finger}_{joint}_flexion" for joint in ("mcp", "pip", "dip")], "positive"] == "closes"
        ).all()
        assert table.loc[f"{finger}_mcp_flexion", "largest"] == 90.0
    if name == "two_finger_arm":
        assert table.loc["wrist_x", ["unit", "largest", "positive"]].tolist() == ["mm", 200.0, "to +x"]


@pytest.mark.parametrize(
    ("centre", "told"),
    [("[0.0, 0.0, 0.5]", "no finger reaches it"), ("[0.052, 0.0, 0.0]", "lies where the hand rests")],
)
def test_a_hand_that_cannot_explore_is_told_so(centre, told, tmp_path, capsys):
    path = gripper(tmp_path, ("[0.0, 0.0, 0.0]", centre))
    assert check_hand.main([str(path)]) == 1
    assert told in " ".join(capsys.readouterr().out.split())


@pytest.mark.parametrize("command", [check_hand.main, lambda told: explore.main(["--hand", *told])])
@pytest.mark.parametrize(
    ("name", "told"), [("nowhere.toml", "No such file"), ("two_fingr", "did you mean 'two_finger'?")]
)
def test_what_is_no_hand_is_one_clear_line(command, name, told, capsys, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    with pytest.raises(SystemExit) as ended:
        command([name])
    error = capsys.readouterr().err
    assert ended.value.code == 2
    assert told in error
    assert error.count("\n") == 1
    assert not list(tmp_path.iterdir())


def test_a_sweep_goes_on_with_the_same_hand_alone(tmp_path):
    path = gripper(tmp_path)
    settings, _ = explore.parse(["--hand", str(path)])
    told = type("Settings", (), {"shapes": (), "known": (), "recordings": (), "env": settings.env})
    before = files_of(told)
    assert list(before) == [f"file {path}"]
    gripper(tmp_path, ("rest_deg = -15.0", "rest_deg = -10.0"))
    assert files_of(told) != before
