"""Patches that lie: what commands are told of them reaches the hand, the observers and the table, or is refused."""

from __future__ import annotations

import argparse
import json
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
import pytest

from haptic_env import hands
from haptic_lab import faults
from haptic_lab.commands import evaluate, explore, figures, train
from haptic_lab.conditions import CONTACTS, DEFAULTS, FACTORS, LATER, UNTOLD, Condition
from haptic_lab.exploration import playing
from haptic_lab.exploration.run import begin, make_trial
from haptic_lab.learning.environments import make_env
from haptic_lab.learning.presets import TrainingWorld
from haptic_lab.sweeps import options, worker
from tests.haptic_lab.test_believed import task_of

pytestmark = pytest.mark.usefixtures("coarse")
PARSERS: dict[str, Any] = {
    "explore": explore.parse,
    "evaluate": lambda arguments: options.check(None, arguments),
    "figures": lambda arguments: figures.parse(arguments),
    "train": train.parse,
}
TINY = ["--shapes", "cube", "--trials", "1", "--seconds", "0.2", "--sigmas", "3", "--observers", "floor", "--jobs", "1"]


@pytest.mark.parametrize(
    ("text", "read", "keyword"),
    [
        ("0", 0.0, 0.0),
        ("2e-3", 0.002, 0.002),
        (0.5, 0.5, 0.5),
        ("3,7", "3,7", (3, 7)),
        ("3,", "3,", (3,)),
        (" 3 , index_distal_tip, ", "3,index_distal_tip", (3, "index_distal_tip")),
        ("index_distal_tip", "index_distal_tip", ("index_distal_tip",)),
        ("x,", "x", ("x",)),
    ],
)
def test_faults_are_read_from_a_word(text: Any, read: float | str, keyword: Any) -> None:
    assert faults.as_faults(text) == read
    assert faults.as_keyword(read) == faults.as_keyword(faults.as_faults(str(text))) == keyword
    assert faults.as_faults(str(read)) == read, "as a table has it"


@pytest.mark.parametrize("text", ["", " ", ",", "3,,4", ",3"])
def test_a_word_that_names_nothing_is_refused(text: str) -> None:
    with pytest.raises(argparse.ArgumentTypeError, match="probability of each patch, or patches"):
        faults.as_faults(text)
    with pytest.raises(ValueError, match="probability of each patch, or patches"):
        faults.as_keyword(text)


@pytest.mark.parametrize("command", PARSERS)
@pytest.mark.parametrize(
    ("flags", "told"),
    [
        (
            ["--patches-stuck", "3"],
            "patches_stuck must be a finite number in [0, 1], the probability of each patch, or",
        ),
        (["--patches-dead", "x"], "unknown patch of patches_dead 'x'; choose from index_distal_0_dorsal"),
        (["--patches-stuck", "3,50"], "patch of patches_stuck must be an integer in [0, 49], got 50"),
        (["--patches-stuck", "0.6", "--patches-dead", "0.5"], "cannot be both stuck and dead"),
        (["--patches-stuck", "1,2", "--patches-dead", "2,"], "cannot be both stuck and dead"),
        (["--patches-stuck", "1,2", "--believed-patches-dead", "2,"], "what observers believe: patch 'thumb"),
        (["--patches-dead", "x", "--believed-patches-dead", "0"], "error: unknown patch of patches_dead 'x'; choose"),
        (["--believed-patches-stuck", "x"], "what observers believe: unknown patch of patches_stuck 'x'"),
        (["--believed-patches-stuck", "0.6", "--believed-patches-dead", "0.6"], "cannot be both stuck and dead"),
        (["--patches-stuck", ","], "argument --patches-stuck: must be the probability of each patch, or patches"),
        (["--contact-confusion", "2"], "contact_confusion must be a finite number in [0, 1], got 2"),
    ],
)
def test_what_patches_cannot_do_is_one_line(
    command: str, flags: list[str], told: str, tmp_path: Path, capsys: pytest.CaptureFixture
) -> None:
    with pytest.raises(SystemExit) as ended:
        PARSERS[command]([*flags, "--out", str(tmp_path / "out")])
    error = capsys.readouterr().err
    assert ended.value.code == 2
    assert told in error
    assert error.count("\n") == 1
    assert not list(tmp_path.iterdir())


def test_explore_tells_hand_and_observers(tmp_path: Path) -> None:
    noise = ["--contact-confusion", "0.25", "--patches-stuck", "21,thumb_distal_tip", "--patches-dead", "0.01"]
    given = [*noise, "--believed-patches-stuck", "0.002", "--shape", "cube", "--particles", "2", "--out", str(tmp_path)]
    settings, recording = explore.parse(given)
    assert json.loads(json.dumps({name: getattr(settings, name) for name in CONTACTS}))["patches_stuck"] == noise[3]
    session = begin(settings, recording)
    trial = make_trial(settings, session)
    world: Any = session.env.unwrapped
    tip = world.hand.patches.names.index("thumb_distal_tip")
    assert [*np.flatnonzero(world.contact_detection.chances[0])] == sorted({21, tip})
    assert world.contact_detection.confusion == 0.25
    slam: Any = trial.observer_runs["haptic_slam"].observer
    slam.reset(seed=0)
    np.testing.assert_allclose(slam.patch_reliability, 1.0 - 0.01 - 0.002)
    trial.env.close()


@pytest.mark.parametrize("name", LATER)
def test_in_a_sweep_observers_believe_what_is_so_or_what_they_are_told(name: str) -> None:
    so, told = task_of({name: 0.01}), task_of({}, **{f"believed_{name}": 0.01})
    for task in (so, told):
        trial = worker.make_trial(task, naming=False)
        made: dict[str, Any] = {each: run.observer for each, run in trial.observer_runs.items()}
        assert made["haptic_slam"].patch_reliability.min() < 1.0 or name == "contact_confusion"
        assert made["haptic_slam"]._reports is not None
        assert made["white"]._reports is None
        trial.env.close()


def test_a_learner_s_hand_has_them_too(tmp_path: Path) -> None:
    preset, _ = train.parse(["--patches-stuck", "3,", "--bias-deg", "2", "--believed-contact-miss", "0.1"])
    assert preset.world.told(preset.world.noise)["contact_miss"] == 0.1
    assert (preset.world.noise["patches_stuck"], preset.world.bias_deg) == ((3,), 2.0)
    small: dict[str, Any] = {"seconds": 0.1, "observation": ("time",), "variants": 2, "samples": 1}
    env = make_env(TrainingWorld(**small, patches_stuck=(3, "index_distal_tip"), sigma_deg=(2.0, 2.0)))
    env.reset(seed=0)
    stuck = hands.make("two_finger").patches.names.index("index_distal_tip")
    assert [*np.flatnonzero(env.unwrapped.contact_detection.stuck)] == [3, stuck]
    assert not env.get_wrapper_attr("observer").patch_reliability[[3, stuck]].any()


def test_files_are_as_they_were_where_no_patch_lies() -> None:
    usual, lying = task_of({}), task_of({"patches_stuck": "3,"})
    assert not any(name in usual.name for name in UNTOLD)
    assert "patches_stuck=3" in lying.name
    assert Condition(sigma_deg=3.0, patches_dead="0.5").values[FACTORS.index("patches_dead")] == "0.5"
    assert usual.key == (*usual.condition.values, "cube", 3)


@pytest.mark.usefixtures("serially")
def test_a_table_gets_their_columns_when_they_are_asked_for_and_goes_on(tmp_path: Path) -> None:
    folder = ["--classifiers", "--out", str(tmp_path)]
    assert evaluate.main([*TINY, *folder]) == 0
    before = (tmp_path / "trials.csv").read_bytes()
    assert not {*UNTOLD} & {*pd.read_csv(tmp_path / "trials.csv")}
    assert not {*UNTOLD} & {*pd.read_csv(tmp_path / "summary.csv")}
    lying = ["--patches-stuck", "0", "21,", "--contact-confusion", "0.2"]
    assert evaluate.main([*TINY, *folder, *lying]) == 0
    rows = pd.read_csv(tmp_path / "trials.csv")
    assert [*zip(rows["contact_confusion"], rows["patches_stuck"], strict=True)] == [
        (0.0, "0.0"), (0.2, "0.0"), (0.2, "21,"),
    ]  # fmt: skip
    after = (tmp_path / "trials.csv").read_bytes()
    assert evaluate.main([*TINY, *folder]) == 0
    assert (tmp_path / "trials.csv").read_bytes() == after, "of what is there nothing is run again"
    first = dict(zip(*(line.split(",") for line in before.decode().splitlines()[:2]), strict=True))
    assert rows.iloc[0]["pose_error_online_deg"] == float(first["pose_error_online_deg"])
    named = {
        each.name.rpartition("patches_stuck=")[2][:3] for each in tmp_path.iterdir() if "patches_stuck" in each.name
    }
    assert named == {"0.0", "21-"}
    summary = pd.read_csv(tmp_path / "summary.csv")
    assert len(summary[["contact_confusion", "patches_stuck"]].drop_duplicates()) == 3


def test_a_file_says_them_too(tmp_path: Path) -> None:
    file = tmp_path / "sweep.toml"
    file.write_text('patches_stuck = [0, 0.002, "3,7"]\ncontact_confusion = 0.1\nbelieved_patches_dead = "4,"')
    plan = options.check(None, ["--config", str(file), "--sigmas", "3"])
    assert [each.patches_stuck for each in plan.conditions] == [0.0, 0.002, "3,7"]
    assert plan.settings.told(plan.conditions[2].noise)["patches_dead"] == (4,)


@pytest.mark.parametrize("name", DEFAULTS)
def test_what_a_recording_refuses_is_told_by_flags_that_there_are(
    name: str, tmp_path: Path, capsys: pytest.CaptureFixture
) -> None:
    flag = f"--{name.replace('_', '-')}"
    with pytest.raises(ValueError, match=f"{flag} is for angles") as refused:
        playing.refuse_noise(dict.fromkeys(DEFAULTS) | {name: 0.5})
    with pytest.raises(SystemExit):
        explore.parse(["--help"])
    known = capsys.readouterr().out
    for word in str(refused.value).replace(",", " ").split():
        assert not word.startswith("--") or f"{word} " in known
