"""`--wrist free` in every command that explores: the hand is one that moves, and others are refused in a line."""

from __future__ import annotations

from pathlib import Path

import gymnasium as gym
import pandas as pd
import pytest

from haptic_env import hand_of
from haptic_lab.commands import benchmark, evaluate, figures, train
from haptic_lab.learning import presets
from haptic_lab.learning.explored import unobserved
from haptic_lab.sweeps import options
from haptic_lab.tasks.worlds import evaluation_set

GRIPPER = str(Path(__file__).parents[2] / "examples" / "gripper" / "gripper.toml")
FEW = ["--shapes", "cube", "--sigmas", "3", "--seconds", "0.3", "--trials", "1", "--observers", "haptic_slam"]


@pytest.mark.parametrize("command", [evaluate, figures, train, benchmark], ids=lambda each: each.__name__)
@pytest.mark.parametrize(("wrist", "told"), [("free", "'two_finger' has no wrist that moves"), ("loose", "'loose'")])
def test_a_wrist_that_a_hand_has_not_is_refused_in_a_line(command, wrist, told, tmp_path, capsys):
    if command is train:
        pytest.importorskip("sb3_contrib", reason="needs sb3-contrib")
    with pytest.raises(SystemExit) as ended:
        command.main(["--wrist", wrist, "--out", str(tmp_path / "out")])
    line = capsys.readouterr().err
    assert ended.value.code == 2
    assert told in line
    assert line.count("\n") == 1
    assert not (tmp_path / "out").exists()


@pytest.mark.usefixtures("coarse", "serially")
def test_a_sweep_explores_with_it_and_its_table_says_so(tmp_path):
    few = [*FEW, "--hand", GRIPPER, "--classifiers", "--particles", "2", "--jobs", "1"]
    assert evaluate.main([*few, "--wrist", "free", "--policy", "coverage", "--out", str(tmp_path / "free")]) == 0
    assert evaluate.main([*few, "--out", str(tmp_path / "usual")]) == 0
    free, usual = (pd.read_csv(tmp_path / name / "trials.csv") for name in ("free", "usual"))
    assert free["wrist"].tolist() == ["free"]
    assert "wrist" not in usual
    plans = [options.check(None, [*few, "--wrist", each]).settings for each in ("fixed", "free")]
    assert [each.make_hand().joints for each in plans] == [9, 15]


def test_recordings_say_themselves_how_their_hand_moved(capsys):
    with pytest.raises(SystemExit):
        options.check(None, ["--recordings", "some.npz", "--wrist", "free"])
    assert "--wrist is for a hand that explores" in capsys.readouterr().err


def test_figures_explore_with_it():
    plan = figures.parse(["figure4", "film", "--hand", GRIPPER, "--wrist", "free"])
    assert plan.sweep.settings.make_hand().joints == 15


def test_a_preset_may_have_it(tmp_path):
    search = 'algorithm = "CMA-ES"\n[learner]\npopulation = 4\nworlds = 1\nstep = 0.1\n'
    text = f'{search}[world]\nobservation = ["pose"]\nenv = "{GRIPPER}"\nwrist = "free"\n'
    (tmp_path / "own.toml").write_text(text, encoding="utf-8")
    preset = presets.read(str(tmp_path / "own.toml"))
    assert hand_of(unobserved(preset.world)).joints == 15
    assert presets.configuration(preset)["world"]["wrist"] == "free"
    assert "wrist" not in presets.configuration(presets.read("trained"))["world"]


@pytest.mark.parametrize("task", ["Name", "Map"])
def test_tasks_and_their_worlds_take_it(task):
    env = gym.make(f"HapticSLAM/{task}-v0", hand=GRIPPER, wrist="free", seconds=0.2)
    assert env.action_space.shape == (15,)
    env.reset(seed=900_100)
    env.close()
    with pytest.raises(ValueError, match="hand 'two_finger' has no wrist that moves: wrist must be 'fixed'"):
        gym.make(f"HapticSLAM/{task}-v0", wrist="free")
    world, _ = evaluation_set(task).world(0, GRIPPER, "free")
    assert hand_of(unobserved(world)).joints == 15


def test_a_benchmark_is_one_with_it(tmp_path):
    flags = ["--hand", GRIPPER, "--wrist", "free", "--policies", "random_torque", "--tasks", "Map"]
    plan, _ = benchmark.parse([*flags, "--worlds", "1", "--out", str(tmp_path)])
    assert plan.configuration()["wrist"] == "free"
    assert "wrist" not in benchmark.parse(["--policies", "random_torque"])[0].configuration()
