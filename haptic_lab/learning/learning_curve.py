"""The picture of a training run."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from numpy.typing import NDArray

from haptic_env.arrays import Array
from haptic_lab.analysis.statistics import interval
from haptic_lab.files import atomic
from haptic_lab.style import BETTER, styled


@styled
def draw(
    path: Path, steps: Array, rewards: Array, seconds: Array, right: NDArray[np.bool_], longest: float, best: int
) -> None:
    """Draw what E evaluations found, over the same K explorations.

    Args:
        path: of the picture.
        steps: (E,) of the environment, before each evaluation.
        rewards: (E, K).
        seconds: (E, K), when each exploration ended.
        right: (E, K) whether it ended with the right name.
        longest: s, when an exploration ends undecided.
        best: index of the evaluation whose model is kept.
    """
    decided = right.astype(bool) & (seconds < longest - 1e-9)
    figure = Figure(figsize=(7.0, 5.0), layout="constrained")
    upper, lower = figure.subplots(2, 1, sharex=True)
    at = steps / 1e3
    for axes, values, scale in ((upper, rewards, 1.0), (lower, decided, 100.0)):
        _curve(axes, at, scale * values, best)
    upper.set_ylabel("reward of an exploration (nats)")
    upper.legend(frameon=False, loc="lower right")
    lower.set(
        ylabel=f"sure and right within {longest:g} s (%)", ylim=(0, 100), xlabel="thousand steps of the environment"
    )
    figure.suptitle(
        f"Learning to decide: {rewards.shape[1]} explorations of sizes not trained with", fontsize=11, fontweight="bold"
    )
    with atomic(path) as place:
        figure.savefig(place, dpi=110)


@styled
def draw_touched(path: Path, steps: Array, touched: Array, when: str, best: int) -> None:
    """Draw how much of a surface was touched in E evaluations, over the same K explorations.

    Args:
        path: of the picture.
        steps: (E,) of the environment, before each evaluation.
        touched: (E, K) shares.
        when: they were touched, in words.
        best: index of the evaluation whose model is kept.
    """
    figure = Figure(figsize=(7.0, 3.4), layout="constrained")
    axes = figure.subplots()
    _curve(axes, steps / 1e3, 100.0 * touched, best)
    axes.set(ylabel=f"surface touched {when} (%)", xlabel="thousand steps of the environment")
    axes.legend(frameon=False, loc="lower right")
    figure.suptitle(
        f"Learning to touch: {touched.shape[1]} explorations of sizes not trained with", fontsize=11, fontweight="bold"
    )
    with atomic(path) as place:
        figure.savefig(place, dpi=110)


@styled
def draw_runs(path: Path, steps: Array, measures: Mapping[str, Array], seeds: Sequence[int]) -> None:
    """Draw what E evaluations of R runs found that differ in their seed alone.

    Args:
        path: of the picture.
        steps: (R, E) of the environment, before each evaluation.
        measures: (R, E) each, by what the picture calls them.
        seeds: R, of the runs.
    """
    figure = Figure(figsize=(7.0, 1.0 + 2.2 * len(measures)), layout="constrained")
    panels = figure.subplots(len(measures), 1, sharex=True, squeeze=False)[:, 0]
    at = steps.mean(axis=0) / 1e3
    for axes, (name, values) in zip(panels, measures.items(), strict=True):
        mean, low, high, _ = np.transpose([interval(each) for each in values.T])
        axes.fill_between(at, low, high, color=BETTER, alpha=0.2, lw=0, label="95 % interval of the mean")
        for index, (when, run) in enumerate(zip(steps / 1e3, values, strict=True)):
            axes.plot(when, run, color="0.45", lw=0.8, label=None if index else "a run each")
        axes.plot(at, mean, color=BETTER, marker="o", ms=4, label="mean", clip_on=False)
        axes.set_ylabel(name)
        _tidy(axes)
    panels[0].legend(frameon=False)
    panels[-1].set_xlabel("thousand steps of the environment")
    told = ", ".join(map(str, seeds))
    figure.suptitle(f"Learning with seeds {told}: sizes not trained with", fontsize=11, fontweight="bold")
    with atomic(path) as place:
        figure.savefig(place, dpi=110)


def _tidy(axes: Axes) -> None:
    axes.grid(alpha=0.3)
    axes.spines[["top", "right"]].set_visible(False)


def _curve(axes: Axes, at: NDArray[Any], values: NDArray[Any], best: int) -> None:
    """Means over K explorations of (E, K), with intervals."""
    mean = values.mean(axis=1)
    error = 1.96 * values.std(axis=1) / np.sqrt(values.shape[1])
    axes.fill_between(at, mean - error, mean + error, color=BETTER, alpha=0.2, lw=0, label="95 % interval")
    axes.plot(at, mean, color=BETTER, marker="o", ms=4, clip_on=False)  # a share may be 100 %
    axes.plot(at[best], mean[best], "o", ms=11, mfc="none", mec="black", label="kept", clip_on=False)
    _tidy(axes)
