"""How fast the object is known: accuracy, posterior and decisions against the time of exploration."""

from __future__ import annotations

import numpy as np
import pandas as pd
from matplotlib.figure import Figure

from haptic_env import validate
from haptic_lab.analysis.reliability import numbers_of
from haptic_lab.analysis.statistics import FEW, interval, told_of_trials
from haptic_lab.analysis.summary import CEILING, FLOOR, SLAM
from haptic_lab.figures.paper_figure import WIDTH, PaperFigure
from haptic_lab.style import OBSERVER_COLOURS, noise_colours
from haptic_lab.sweeps.measures import COURSE_SECONDS
from haptic_lab.sweeps.results import names_in
from observer import metrics

PANELS = {
    "correct": ("Named right", "share of explorations (%)"),
    "posterior": ("Probability of the true shape", "mean posterior (%)"),
    "decided": ("Sure for good (p > 95 %)", "share of explorations (%)"),
}


def curves(rows: pd.DataFrame) -> pd.DataFrame:
    """Summarise how soon the object is known.

    Args:
        rows: of the table of trials.

    Returns:
        A line for each noise, observer, measure of `PANELS` and time: `mean`, 95 % interval (`low`, `high`), `trials`.
    """
    lines = []
    for (sigma, observer), group in rows.groupby(["sigma_deg", "observer"], sort=False):
        posterior, correct = numbers_of(group["course_p"]), numbers_of(group["course_correct"])
        decision = group["time_to_decision"].to_numpy()
        for k in range(posterior.shape[1]):
            seconds = (k + 1) * COURSE_SECONDS
            decided = decision <= seconds + 1e-9  # never where there is none
            lines += [
                (sigma, observer, "correct", seconds, *metrics.accuracy(correct[:, k])),
                (sigma, observer, "posterior", seconds, *interval(posterior[:, k])),
                (sigma, observer, "decided", seconds, *metrics.accuracy(decided)),
            ]
    names = ["sigma_deg", "observer", "measure", "seconds", "mean", "low", "high", "trials"]
    return pd.DataFrame(lines, columns=names)


def draw(rows: pd.DataFrame) -> PaperFigure:
    """Draw how soon the object is known.

    Args:
        rows: of the table of trials.

    Returns:
        A panel for each of `PANELS`; a curve for each noise, and the brackets of the largest.

    Raises:
        ValueError: for trials that are shorter than `COURSE_SECONDS`, after which the first point of a curve is.
    """
    data = curves(rows)
    if data.empty:
        raise ValueError(f"time_course has a point each {COURSE_SECONDS:g} s, and these trials are shorter")
    sigmas = sorted(set(data["sigma_deg"]))
    colours = noise_colours(sigmas)
    figure = Figure(figsize=(WIDTH, 3.3), layout="constrained")
    panels = figure.subplots(1, len(PANELS), sharex=True, sharey=True)
    for axes, (measure, (title, axis)) in zip(panels, PANELS.items(), strict=True):
        mine = data[data["measure"] == measure]
        for sigma, observer, style in (
            *((sigma, SLAM, {"color": colours[sigma], "label": f"σ = {sigma:g}°"}) for sigma in sigmas),
            (sigmas[-1], FLOOR, {"color": OBSERVER_COLOURS[FLOOR], "label": f"floor, σ = {sigmas[-1]:g}°"}),
            (sigmas[-1], CEILING, {"color": OBSERVER_COLOURS[CEILING], "label": "ceiling (true pose)"}),
        ):
            line = mine[(mine["observer"] == observer) & (mine["sigma_deg"] == sigma)]
            if len(line) == 0:
                continue
            dashes = "-" if observer == SLAM else "--"
            axes.plot(line["seconds"], 100 * line["mean"], linestyle=dashes, linewidth=1.4, **style)
            if line["trials"].max() < FEW:
                continue
            low, high = (np.clip(100 * line[end].to_numpy(), 0, 100) for end in ("low", "high"))
            axes.fill_between(line["seconds"], low, high, color=style["color"], alpha=0.12, linewidth=0)
        axes.set(title=title, xlabel="exploration (s)", ylabel=axis, ylim=(0, 102))
        axes.set_xlim(left=0)
        if measure != "decided":
            chance = 100 / len(names_in(rows["candidates"].iloc[0]))
            axes.axhline(chance, color="#777777", linestyle=":", linewidth=1, label="chance")
    handles, labels = panels[0].get_legend_handles_labels()
    figure.legend(handles, labels, loc="outside lower center", ncols=(len(labels) + 1) // 2)
    trials = int(data["trials"].max())
    figure.suptitle(
        f"{validate.counted(trials, 'exploration')} for each σ; {told_of_trials(trials, 'shaded: 95 % intervals')}",
        fontsize=8,
    )
    return PaperFigure(figure, data)
