"""Policies × tasks: what is judged, kept, taken up again and said."""

from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path

import numpy as np
import pandas as pd
import pytest

import agents
from haptic_lab.commands import benchmark as command
from haptic_lab.tasks import benchmark, judging, registry, report
from haptic_lab.tasks.guessing import SCALE, guess_of, guessing
from haptic_lab.tasks.judging import ACCURACY, COVERED, DECISION, RIGHT
from haptic_lab.tasks.worlds import evaluation_set

WRITTEN = {"trials.csv", "benchmark.csv", "benchmark.md", "benchmark.png", "config.json"}


@pytest.fixture
def short(monkeypatch: pytest.MonkeyPatch) -> None:
    """Tasks of a few steps."""
    for name, world in registry.TASKS.items():
        monkeypatch.setitem(registry.TASKS, name, replace(world, seconds=0.4))


def run(out: Path, *flags: str) -> int:
    return command.main(["--jobs", "1", "--out", str(out), *flags])


def test_a_stopped_run_goes_on_and_adds_worlds_and_policies(tmp_path, short, monkeypatch):
    judged, asked = benchmark.judged, []

    def noted(*call):
        asked.append((call[0], call[2], call[1]))
        if len(asked) == 2:
            raise KeyboardInterrupt
        return judged(*call)

    monkeypatch.setattr(benchmark, "judged", noted)
    flags = ("--tasks", "Name", "--policies", "random_torque")
    assert run(tmp_path, *flags, "--worlds", "2") == 130
    assert len(pd.read_csv(tmp_path / "trials.csv")) == 1
    assert run(tmp_path, *flags, "enclosure", "--worlds", "2") == 0
    assert sorted(asked[2:]) == [("Name", "enclosure", 0), ("Name", "enclosure", 1), ("Name", "random_torque", 1)]
    rows = pd.read_csv(tmp_path / "trials.csv")
    assert rows[["policy", "world"]].values.tolist() == [
        ["enclosure", 0], ["enclosure", 1], ["random_torque", 0], ["random_torque", 1]
    ]  # fmt: skip
    assert set(rows["seed"]) == {81000, 81001}
    assert {each.name for each in tmp_path.iterdir()} == WRITTEN
    before = len(asked)
    assert run(tmp_path, *flags, "--worlds", "1") == 0
    assert len(asked) == before, "nothing is judged twice"
    assert set(pd.read_csv(tmp_path / "benchmark.csv")["worlds"]) == {1}


def test_learners_learn_and_are_judged_by_their_own_guesses(tmp_path, short):
    pytest.importorskip("sb3_contrib", reason="needs sb3-contrib")
    learners = ("ppo", "recurrent_ppo", "apple_lstm")
    assert run(tmp_path, "--tasks", "Name", "--policies", *learners, "--worlds", "1", "--steps", "160") == 0
    rows = pd.read_csv(tmp_path / "trials.csv").set_index("policy")
    assert set(rows.index) == set(learners)
    assert rows[ACCURACY].between(0.0, 1.0).all()
    written = sorted(each.name for each in (tmp_path / "models").iterdir())
    assert written == [f"Name_{each}.npz" for each in sorted(learners)]
    for each in written:
        with np.load(tmp_path / "models" / each, allow_pickle=False) as kept:
            assert all(array.dtype.kind in "fU" for array in kept.values())
    page = (tmp_path / "benchmark.md").read_text(encoding="utf-8")
    assert "| `recurrent_ppo` | 160 | 1 |" in page
    assert "judged by their own guesses" in page


def test_the_surface_is_judged_where_nothing_is_to_be_named(tmp_path, short, capsys):
    assert run(tmp_path, "--tasks", "Map", "--policies", "random_torque", "trained", "--worlds", "1") == 0
    rows = pd.read_csv(tmp_path / "trials.csv")
    assert rows["policy"].tolist() == ["random_torque"]
    assert "explorations: 1 of 1 after" in capsys.readouterr().out, "away from a terminal there are lines"
    assert rows[COVERED].between(0.0, 1.0).all()
    page = (tmp_path / "benchmark.md").read_text(encoding="utf-8")
    assert "surface covered after 20 s" in page
    assert "`trained` is left out: the model trained.npz was trained for another hand or observation" in page


@pytest.mark.parametrize(
    ("flags", "told"),
    [
        (("--tasks", "Nam"), "unknown --tasks 'Nam'"),
        (("--policies", "randomm"), "randomm"),
        (("--policies", "missing.npz"), "missing.npz"),
        (("--worlds", "0"), "--worlds must be an integer in [1, 400], got 0"),
        (("--hand", "claw"), "claw"),
        (("--steps", "-3"), "--steps must be"),
    ],
)
def test_what_makes_no_sense_is_refused_in_a_line(tmp_path, capsys, flags, told):
    out = tmp_path / "out"
    with pytest.raises(SystemExit) as ended:
        run(out, *flags)
    assert ended.value.code == 2
    line = capsys.readouterr().err
    assert told in line
    assert line.count("\n") == 1
    assert not out.exists()


def test_a_folder_of_another_benchmark_is_refused(tmp_path, short, capsys):
    flags = ("--tasks", "Map", "--policies", "random_torque", "--worlds", "1")
    assert run(tmp_path, *flags) == 0
    with pytest.raises(SystemExit):
        run(tmp_path, *flags, "--steps", "7")
    assert "steps = 1000000, not 7" in capsys.readouterr().err
    kept = json.loads((tmp_path / "config.json").read_text(encoding="utf-8"))
    assert kept["worlds"]["Map"]["version"] == 1


class Squeeze(agents.Policy):
    """One of a user's own."""

    def decide(self, observation, state, deterministic):
        return np.full(self.joints, 0.5, np.float32), None


HEAD = f"task,policy,world,seed,sigma_deg,shape,{DECISION},{ACCURACY},{RIGHT},{COVERED}\n"
WHOLE = "Name,enclosure,0,81000,3.0,cube,2.1,0.9,1.0,\nMap,enclosure,0,83000,3.0,cube,,,,0.2\n"


def test_rows_that_are_whole_are_kept(tmp_path):
    (tmp_path / "trials.csv").write_text(HEAD + WHOLE + "Name,coverage,1,81001,5,cube,,0,0.0,\n")
    rows = benchmark.read(tmp_path / "trials.csv")
    assert [(row["task"], row["policy"], row["world"]) for row in rows] == [
        ("Name", "enclosure", 0),
        ("Map", "enclosure", 0),
        ("Name", "coverage", 1),
    ]


@pytest.mark.parametrize(
    "row",
    [
        "Name,enclosure,1,",  # cut off
        "Name,enclosure,1,81001,5.0,cube,2.1,0.9,,",
        "Name,enclosure,1,81001,5.0,cube,2.1,inf,1.0,",
        "Name,enclosure,1,81001,5.0,cube,2.1,much,1.0,",
        "Name,enclosure,1.5,81001,5.0,cube,2.1,0.9,1.0,",
        "Name,enclosure,400,81001,5.0,cube,2.1,0.9,1.0,",
        "Name,enclosure,-1,81001,5.0,cube,2.1,0.9,1.0,",
        "Name,enclosure,0,81000,3.0,cube,2.1,0.9,1.0,",  # twice
        "Map,enclosure,1,83001,5.0,cube,2.1,0.9,1.0,",
    ],
)
def test_a_row_that_is_broken_is_told(tmp_path, row):
    (tmp_path / "trials.csv").write_text(HEAD + WHOLE + row)
    with pytest.raises(ValueError, match=r"trials\.csv is no table of this command: line 4 is broken, or there twice"):
        benchmark.read(tmp_path / "trials.csv")


def test_a_class_of_one_s_own_is_judged(short):
    row = judging.judge(evaluation_set("Name"), 0, Squeeze)
    assert row["policy"] == "Squeeze"
    assert str(row) == str(judging.judge(evaluation_set("Name"), 0, Squeeze)), "a world is always the same"


def rows_of(policy: str, times: list[float]) -> list[dict]:
    world = {"task": "Name", "policy": policy, RIGHT: 1.0, ACCURACY: 0.75, COVERED: np.nan}
    return [{**world, "world": index, DECISION: time} for index, time in enumerate(times)]


def test_who_has_not_decided_is_later_than_all():
    rows = pd.DataFrame([*rows_of("soon", [1.0, 2.0, 3.0, 4.0, np.nan]), *rows_of("late", [1.0, np.nan, np.nan])])
    table = report.table_of(rows).set_index(["policy", "measure"])
    assert table.loc[("soon", "median decision time"), "value"] == 3.0
    assert np.isinf(table.loc[("late", "median decision time"), "value"])
    assert table.loc[("soon", "median decision time"), "decided"] == 0.8
    assert table.loc[("soon", "step-averaged accuracy over 5 s"), ["value", "low", "high"]].tolist() == [0.75] * 3
    page = report.page(report.table_of(rows), "haptic-slam benchmark", 10, {})
    assert "| `late` | – | 3 | later" in page


def test_a_guess_is_paid_by_its_cross_entropy():
    env = guessing(replace(registry.TASKS["Name"], seconds=0.4))
    env.reset(seed=900_000)
    truth = env.get_wrapper_attr("truth")
    action = np.zeros(env.action_space.shape, np.float32)
    assert env.step(action)[1] == pytest.approx(-1.0), "knowing nothing costs 1"
    action[8 + truth] = 1.0
    expected = np.log(np.exp(SCALE) / (np.exp(SCALE) + 3)) / np.log(4)
    assert env.step(action)[1] == pytest.approx(expected)
    assert guess_of(action, 8).argmax() == truth
    assert env.reset(seed=900_000)[1] == {}, "the truth is not told"
