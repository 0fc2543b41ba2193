"""How soon maps are named right: `evaluate --maps-every`."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pandas as pd
import pytest
from rich.console import Console

from haptic_lab.analysis import through_time
from haptic_lab.analysis.through_time import COLUMNS
from haptic_lab.commands import evaluate
from haptic_lab.conditions import Condition
from haptic_lab.sweeps import options
from haptic_lab.sweeps.tasks import STREAM, SweepTask
from haptic_lab.sweeps.worker import make_trial

NAMERS = ("overlap_nearest_neighbour", "squared_nearest_neighbour")
FEW = ["--shapes", "cube", "sphere", "--sigmas", "3", "--seconds", "1", "--trials", "1", "--first-seed", "900000"]
FEW += ["--particles", "2", "--exemplars", "2", "--jobs", "1", "--classifiers", *NAMERS]


def lines_of(*curves: tuple[str, str, dict[float, float]]) -> pd.DataFrame:
    """Of observers and namers, and how often each was right when; intervals of 0.1 to both sides."""
    told = [(3.0, *who, t, p, p - 0.1, p + 0.1, 20) for *who, course in curves for t, p in course.items()]
    return pd.DataFrame(told, columns=COLUMNS)


CURVES = (
    ("haptic_slam", STREAM, {0.25: 0.3, 0.5: 0.6}),
    ("haptic_slam", "nearest_neighbour", {0.5: 0.4}),
    ("floor", STREAM, {0.25: 0.2, 0.5: 0.5}),
)


def test_the_picture_has_each_curve_the_intervals_of_the_observer_and_chance() -> None:
    figure = through_time.draw(lines_of(*CURVES), 0.35)
    (axes,) = figure.axes
    drawn = [dict(zip(line.get_xdata(), line.get_ydata(), strict=True)) for line in axes.lines if len(line.get_xdata())]
    assert drawn == [*(course for *_, course in CURVES), {0.0: 0.35, 1.0: 0.35}]
    bands = [{tuple(corner) for corner in band.get_paths()[0].vertices.round(6)} for band in axes.collections]
    assert bands == [{(0.25, 0.2), (0.25, 0.4), (0.5, 0.5), (0.5, 0.7)}, {(0.5, 0.3), (0.5, 0.5)}]
    assert "20 explorations for each noise, shaded: 95 % intervals of haptic SLAM" in figure.get_suptitle()


def test_what_is_printed_is_of_the_times_at_which_all_were_asked() -> None:
    console = Console(record=True, width=120)
    through_time.print_table(lines_of(*CURVES), console)
    printed = [line.split() for line in console.export_text().splitlines() if line.strip()]
    heading = printed.index(["σ", "observer", "namer", "0.5", "s"])
    rows = printed[heading + 2 :]
    assert [(observer, namer, share) for _, observer, namer, share in rows] == [
        (observer, namer, f"{course[0.5]:.0%}") for observer, namer, course in CURVES
    ]


@pytest.mark.usefixtures("serially")
def test_the_last_of_the_names_are_those_of_the_end(
    tmp_path: Path, capsys: pytest.CaptureFixture, monkeypatch: pytest.MonkeyPatch
) -> None:
    chances, draw = [], through_time.draw
    monkeypatch.setattr(through_time, "draw", lambda lines, chance: chances.append(chance) or draw(lines, chance))
    flags = [*FEW, "--maps-every", "0.25", "--observers", "smoother_pose", "haptic_slam", "ceiling"]
    assert evaluate.main([*flags, "--out", str(tmp_path)]) == 0
    assert chances == [0.5], "of two shapes"
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
