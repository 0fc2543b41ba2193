"""How soon maps are named right: `evaluate --maps-every`."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pandas as pd
import pytest

from haptic_lab.analysis.through_time import COLUMNS
from haptic_lab.commands import evaluate
from haptic_lab.conditions import Condition
from haptic_lab.sweeps import options
from haptic_lab.sweeps.tasks import STREAM, SweepTask
from haptic_lab.sweeps.worker import make_trial

NAMERS = ("overlap_nearest_neighbour", "squared_nearest_neighbour")
FEW = ["--shapes", "cube", "sphere", "--sigmas", "3", "--seconds", "1", "--trials", "1", "--first-seed", "900000"]
FEW += ["--particles", "2", "--exemplars", "2", "--jobs", "1", "--classifiers", *NAMERS]


def test_the_last_of_the_names_are_those_of_the_end(tmp_path: Path, capsys: pytest.CaptureFixture) -> None:
    flags = [*FEW, "--maps-every", "0.25", "--observers", "smoother_pose", "haptic_slam", "ceiling"]
    assert evaluate.main([*flags, "--out", str(tmp_path)]) == 0
    assert "Named right through time" in capsys.readouterr().out
    assert (tmp_path / "names_through_time.png").stat().st_size > 10_000
    lines = pd.read_csv(tmp_path / "names_through_time.csv")
    assert list(lines) == COLUMNS
    assert set(lines["seconds"]) == {0.25, 0.5, 0.75, 1.0}
    assert set(lines["trials"]) == {2}
    of_poses = lines[lines["observer"] == "smoother_pose"]
    assert set(of_poses["namer"]) == {STREAM}, "who has no map has none to name"
    summary = pd.read_csv(tmp_path / "summary.csv").query("shape == 'all'").set_index(["observer", "measure"])["mean"]
    for (observer, namer), mine in lines.groupby(["observer", "namer"]):
        assert mine["mean"].iloc[-1] == pytest.approx(summary[observer, f"{namer}_correct"])
    assert lines.groupby(["observer", "namer"]).ngroups == 7


@pytest.mark.parametrize(("every", "steps"), [("0.3", (15, 30, 45)), ("0.25", (13, 25, 38, 50))])
def test_the_maps_that_are_named_are_those_in_hindsight_of_their_moment(every, steps, tmp_path: Path) -> None:
    """Of the first step that is not before it, where the time is no whole number of steps of 0.02 s."""
    plan = options.check(None, [*FEW, "--maps-every", every, "--observers", "haptic_slam", "--out", str(tmp_path)])
    task = SweepTask(plan.settings, Condition(3.0, seconds=1.0), "cube", 900_000)
    kept = make_trial(task, naming=True)
    kept.run()
    maps = kept.finish()[1]["haptic_slam"].maps
    again = make_trial(task, naming=False)
    slam = again.observer_runs["haptic_slam"].observer
    found = [slam.map_now() for step in again if step in steps]
    assert len(maps) == len(found) == len(steps)
    assert all((mine == other).all() for mine, other in zip(maps, found, strict=True))
    assert (np.diff([np.abs(each - 0.5).sum() for each in maps]) > 0).all(), "ever more is known"
    assert again.finish()[1]["haptic_slam"].maps == (), "exemplars need the last alone"


@pytest.mark.parametrize(
    ("flags", "told"),
    [
        (["--maps-every", "0"], "--maps-every must be"),
        (["--maps-every", "0.01"], "--maps-every must be a finite number in [0.02, 1] s, got 0.01"),
        (["--maps-every", "5"], "--maps-every must be a finite number in [0.02, 1] s, got 5"),
        (["--maps-every", "1", "--classifiers"], "there are no --classifiers to name them"),
        (["--maps-every", "1", "--names-only"], "--names-only makes no maps, which --maps-every is about"),
    ],
)
def test_what_makes_no_sense_is_refused_in_a_line(flags, told, tmp_path, capsys):
    with pytest.raises(SystemExit) as ended:
        options.check(None, ["--seconds", "1", *flags, "--out", str(tmp_path / "out")])
    line = capsys.readouterr().err
    assert ended.value.code == 2
    assert told in line
    assert line.count("\n") == 1
