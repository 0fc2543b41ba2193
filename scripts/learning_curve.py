"""The picture of a training run."""

from __future__ import annotations

from pathlib import Path

import numpy as np
from files import atomic
from matplotlib.figure import Figure
from numpy.typing import NDArray
from style import OBSERVER_COLOURS

Array = NDArray[np.float64]


def draw(path: Path, steps: Array, seconds: Array, right: NDArray[np.bool_]) -> None:
    """Draw to `path` how long decisions took, `seconds` (E, K), and how many were `right` (E, K), of K explorations
    at each of E evaluations, after so many `steps` (E,)."""
    figure = Figure(figsize=(7.0, 5.0), layout="constrained")
    upper, lower = figure.subplots(2, 1, sharex=True)
    colour = OBSERVER_COLOURS["haptic_slam"]
    at = steps / 1e6
    low, middle, high = np.quantile(seconds, (0.25, 0.5, 0.75), axis=1)
    upper.fill_between(at, low, high, color=colour, alpha=0.25, lw=0, label="middle half")
    upper.plot(at, middle, color=colour, marker="o", ms=3, label="median")
    upper.set(ylabel="time until sure (s)", ylim=(0, None), title="Learning to decide, on sizes not trained with")
    upper.legend(frameon=False)
    lower.plot(at, 100 * right.mean(axis=1), color=colour, marker="o", ms=3)
    lower.set(ylabel="named right (%)", ylim=(0, 102), xlabel="steps of the environment (millions)")
    for axes in (upper, lower):
        axes.grid(alpha=0.3)
        axes.spines[["top", "right"]].set_visible(False)
    with atomic(path) as place:
        figure.savefig(place, dpi=110)
