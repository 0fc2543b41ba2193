"""What pictures of results show: no bar of what was not measured, no interval of too few, something in each panel."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any

import numpy as np
import pandas as pd
import pytest
from matplotlib.axes import Axes
from matplotlib.collections import LineCollection
from matplotlib.figure import Figure

from haptic_env import shapes
from haptic_env.grid import Grid
from haptic_lab.analysis import policy_comparison, summary
from haptic_lab.analysis.statistics import FEW
from haptic_lab.commands import scaling
from haptic_lab.conditions import FACTORS, Condition
from haptic_lab.figures import figure2, figure4, figure6, time_course
from haptic_lab.style import OBSERVER_NAMES
from haptic_lab.sweeps.measures import AFTER_SECONDS

CONDITION = {name: getattr(Condition(sigma_deg=3.0), name) for name in FACTORS}
OBSERVERS = ("floor", "haptic_slam", "ceiling")


def words(axes: Axes) -> str:
    return " ".join(each.get_text() for each in axes.texts)


def title(figure: Figure) -> str:
    return figure.get_suptitle()


def intervals(axes: Axes) -> int:
    """How many error bars are drawn in a panel."""
    lines = [each for each in axes.collections if isinstance(each, LineCollection)]
    return sum(
        len(segment) > 1 and bool(np.isfinite(segment).all()) for each in lines for segment in each.get_segments()
    )


def trials(count: int, sigmas: tuple[float, ...], observers: tuple[str, ...] = OBSERVERS, **told: Any) -> pd.DataFrame:
    rng = np.random.default_rng(0)
    lines = [
        {
            **CONDITION,
            "sigma_deg": sigma,
            "shape": shape,
            "seed": seed,
            "observer": observer,
            "candidates": "cube sphere",
            "pose_error_lagged_deg": sigma * rng.uniform(0.2, 0.4),
            **{f"correct_{after}s": float(rng.random() < 0.9) for after in AFTER_SECONDS},
            **{f"{name}_correct": float(rng.random() < 0.7) for name in figure6.TITLES},
            **told,
        }
        for sigma in sigmas
        for shape in ("cube", "sphere")
        for seed in range(count)
        for observer in observers
    ]
    return pd.DataFrame(lines)


def policies(count: int, **told: Any) -> pd.DataFrame:
    return pd.DataFrame(
        [
            {
                **CONDITION,
                "policy": policy,
                "shape": "cube",
                "seed": seed,
                "observer": "haptic_slam",
                "time_to_decision": 1.0 + 0.1 * seed,
                "step_accuracy_5s": 0.5,
                "correct_10s": 1.0,
                **told,
            }
            for policy in ("slow", "quick")
            for seed in range(count)
        ]
    )


@pytest.mark.parametrize("count", [2, 20])
def test_policies_have_no_bar_of_what_no_trial_tells(count: int) -> None:
    figure = policy_comparison.draw(policy_comparison.compare(policies(count, correct_10s=np.nan)))
    *measured, nothing = figure.axes
    assert policy_comparison.NOTHING in words(nothing)
    drawn = [line.get_xdata() for line in nothing.lines if line.get_color() != "#000000"]
    assert not any(np.isfinite(np.asarray(each, dtype=float)).any() for each in drawn)
    for axes in measured:
        assert policy_comparison.NOTHING not in words(axes)
        bars = [line for line in axes.lines if line.get_linewidth() == 2]
        assert len(bars) == (2 if count >= FEW else 0)
    assert ("too few for intervals" in title(figure)) == (count < FEW)


def test_who_never_decides_is_said_to_be_undecided(capsys: pytest.CaptureFixture, tmp_path: Any) -> None:
    rows = policies(9, time_to_decision=np.nan, correct_10s=np.nan)
    figure = policy_comparison.draw(policy_comparison.compare(rows))
    assert words(figure.axes[0]).count(policy_comparison.LATER) == 2
    policy_comparison.save(rows, tmp_path)
    policy_comparison.print_table(tmp_path / "policies.csv", summary.Console(width=150))
    told = capsys.readouterr().out
    assert "nan" not in told
    assert "–" in told


@pytest.mark.parametrize("sigmas", [(3.0,), (3.0, 5.0)])
@pytest.mark.parametrize("count", [1, 10])
def test_an_evaluation_fills_its_panels(sigmas: tuple[float, ...], count: int) -> None:
    rows = trials(count, sigmas)
    rows.loc[rows["observer"] == "floor", "nearest_neighbour_correct"] = np.nan
    namers = ["shape_posterior", "nearest_neighbour"]
    found = summary.summarise(rows, ["pose_error_lagged_deg"], namers)
    pose, named, without = summary.draw(found, namers, 0.5).axes[:3]
    assert bool(pose.patches) == (len(sigmas) == 1)
    assert len(named.patches) == len(OBSERVERS) * len(sigmas)
    assert intervals(named) == (0 if 2 * count < FEW else len(named.patches))
    heights = [each.get_height() for each in without.patches]
    assert int(np.isnan(heights).sum()) == words(without).count(summary.NOT_MADE) == len(sigmas)


def panels_of(rows: pd.DataFrame) -> tuple[Figure, list[Axes]]:
    figure = figure6.draw(rows).figure
    return figure, figure.axes


def test_figure_6_begins_with_the_papers_own_recursion_beside_this_one() -> None:
    own = trials(6, (1.0, 5.0), ("paper",), nearest_neighbour_correct=0.0, shape_posterior_correct=np.nan)
    figure, (paper, ours, both, *times) = panels_of(pd.concat([trials(9, (1.0, 5.0)), own]))
    assert "its recursion" in paper.get_title()
    assert "this recursion" in ours.get_title()
    curves = [each for each in paper.lines if len(each.get_xdata()) == 2 and each.get_linestyle() == "-"]
    assert all((np.asarray(each.get_ydata()) == 0).all() for each in curves)
    assert len(curves) == 3  # two shapes and their average
    assert "as the paper has it" in both.get_legend_handles_labels()[1]
    assert [each.get_title().split()[-2:] for each in times] == [[str(after), "s"] for after in AFTER_SECONDS]
    assert all("as the paper has it" not in each.get_legend_handles_labels()[1] for each in times)
    assert "9 explorations" in title(figure)
    assert "(6 of the paper" in title(figure)


def test_figure_6_says_what_it_has_too_little_of() -> None:
    figure, (paper, *_) = panels_of(trials(2, (1.0, 5.0)))
    assert figure6.MISSING in words(paper)
    assert "too few" in title(figure)
    assert all(intervals(each) == 0 for each in figure.axes)


@pytest.mark.parametrize("count", [1, 9])
def test_figure_6_has_one_row_where_no_map_was_named_by_one_that_was_learnt(count: int) -> None:
    figure, panels = panels_of(trials(count, (1.0, 5.0)).drop(columns="nearest_neighbour_correct"))
    assert [each.get_title() for each in panels] == [f"shapes known,\nafter {after} s" for after in AFTER_SECONDS]
    (row,) = figure.subfigs
    (legend,) = row.legends
    assert {each.get_text() for each in legend.get_texts()} == {OBSERVER_NAMES[name] for name in OBSERVERS}
    assert figure.get_figheight() < panels_of(trials(count, (1.0, 5.0)))[0].get_figheight()
    assert [intervals(each) > 0 for each in panels] == [count >= FEW] * len(panels)


def test_figure_6_asks_for_names_when_there_are_some() -> None:
    short = trials(9, (1.0, 5.0), seconds=3.0, correct_5s=np.nan, correct_10s=np.nan)
    times = panels_of(short)[1][3:]
    assert [each.get_title().split()[-2] for each in times] == ["2", "3"]
    low, high = times[0].get_ylim()
    assert 0 < low < 100 < high, "the axis is of what there is to see"


def showing(occupied: list[tuple[float, float]]) -> Any:
    """An exploration of a second; `occupied`: from when on how much of the map is solid."""
    grid = Grid((-0.064,) * 3, 0.004, (32, 32, 32))
    step = np.arange(5, 51, 5)
    occupancy = np.full((len(step), 32, 32, 32), 0.5)
    for frame, now in enumerate(step * 0.02):
        for begins, probability in occupied:
            if now >= begins:
                occupancy[frame, 3, 9, 4] = probability
    return SimpleNamespace(
        grid=grid,
        solid=shapes.make("cube"),
        occupancy=occupancy,
        step=step,
        seconds=0.02 * np.arange(1, 51),
        frame_at=lambda seconds: max(0, int(np.searchsorted(step * 0.02, seconds + 1e-9)) - 1),
        sigma_deg=3.0,
    )


@pytest.mark.parametrize("begins", [0.1, 0.6])
def test_figure_4_begins_when_there_is_a_map(begins: float) -> None:
    drawn = figure4.draw([("cube", 1.0)], lambda *_: showing([(begins, 0.9)]), None)  # type: ignore[arg-type]
    panels = drawn.figure.axes[: len(figure4.MOMENTS)]
    assert all(figure2.NOTHING not in words(each) for each in panels)
    assert drawn.data["seconds"].min() >= begins
    assert drawn.data["seconds"].max() == pytest.approx(1.0)


def test_figure_4_says_where_there_is_none() -> None:
    drawn = figure4.draw([("cube", 1.0)], lambda *_: showing([]), None)  # type: ignore[arg-type]
    assert all(figure2.NOTHING in words(each) for each in drawn.figure.axes[: len(figure4.MOMENTS)])


@pytest.mark.parametrize(("probability", "y"), [(0.9, -26), (0.2, 0)])
def test_the_section_of_figure_2_is_of_something(probability: float, y: float) -> None:
    shown = showing([(0.0, probability)])
    shown.occupancy = np.where(shown.occupancy == 0.5, 0.03, shown.occupancy)
    axes = Figure().subplots()
    figure2._section(axes, shown.occupancy[-1], shown)
    assert (figure2.NOTHING in axes.get_title()) == (probability < 0.5)
    told = float(axes.get_title().split("y = ")[1].removesuffix(" mm"))
    assert told == pytest.approx(y, abs=4.5)  # it is three voxels thick


@pytest.mark.parametrize(
    ("times", "grows"), [((1.0, 2.0, 3.0), True), ((1.1, 1.0, 1.05), False), ((1.0, 0.9, 0.8), False)]
)
def test_time_that_does_not_grow_has_no_falling_line(times: tuple[float, ...], grows: bool) -> None:
    rows = [
        {"axis": axis, "value": n, "ms": ms} for axis in scaling.AXES for n, ms in zip((10, 20, 40), times, strict=True)
    ]
    for axes in scaling.draw(pd.DataFrame(rows)).axes:
        assert ("no longer with more" in axes.get_title()) != grows
        line = next(each for each in axes.lines if each.get_color() == "#999999")
        first, last = np.asarray(line.get_ydata(), dtype=float)[[0, -1]]
        assert last > first if grows else last == first


@pytest.mark.parametrize("count", [1, 9])
def test_the_course_of_time_is_shaded_where_there_are_enough_trials(count: int) -> None:
    told = {"course_p": "0.3 0.6", "course_correct": "0 1", "time_to_decision": 0.5}
    figure = time_course.draw(trials(count, (3.0,), **told)).figure
    enough = 2 * count >= FEW
    assert all(bool(axes.collections) == enough for axes in figure.axes)
    assert ("too few" in title(figure)) != enough


def test_no_title_needs_a_dictionary() -> None:
    told = " ".join([*summary.TITLES.values(), *figure6.TITLES.values()])
    assert not any(word in told for word in ("Hamming", "Jaccard"))
