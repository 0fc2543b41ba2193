"""Confusion matrices of the object's name: true shape against named shape, by observer, classifier and noise."""

from __future__ import annotations

import pandas as pd
from matplotlib.figure import Figure

from haptic_lab.analysis.summary import SLAM
from haptic_lab.figures.figure6 import TITLES
from haptic_lab.figures.paper_figure import WIDTH, PaperFigure
from haptic_lab.style import as_drawn, colours_of, titles_of
from haptic_lab.sweeps.results import labels_in, names_in, right_names

USUAL = len("cylinder")  # letters of a name that the height has room for
LETTER = 0.07  # inches


def table(rows: pd.DataFrame) -> pd.DataFrame:
    """Count what objects were named.

    Args:
        rows: of the table of trials.

    Returns:
        A line for each namer, observer, noise, true `shape` and the one it is `named`: the `share` of `trials`.
    """
    labels = labels_in(rows)
    lines = []
    named_right = rows.assign(shape=right_names(rows))
    for (observer, sigma, shape), group in named_right.groupby(["observer", "sigma_deg", "shape"], sort=False):
        for namer in TITLES:
            if namer not in rows:
                continue
            names = group[namer].dropna().map(names_in)
            if names.empty:
                continue  # of an observer without a map
            for label in labels:
                share = names.map(lambda each, label=label: each.count(label) / len(each)).mean()
                lines.append((namer, observer, sigma, shape, label, share, len(group)))
    return pd.DataFrame(lines, columns=["namer", "observer", "sigma_deg", "shape", "named", "share", "trials"])


def draw(rows: pd.DataFrame) -> PaperFigure:
    """Draw the matrices of haptic SLAM.

    Args:
        rows: of the table of trials.

    Returns:
        One for each way to name (down) and noise (across).
    """
    data = table(rows)
    mine = data[data["observer"] == SLAM]
    namers, sigmas = list(dict.fromkeys(mine["namer"])), sorted(set(mine["sigma_deg"]))
    labels = list(dict.fromkeys(mine["named"]))
    colours, titles = colours_of(labels), titles_of(labels)
    ticks = {as_drawn(titles[each]): colours[each] for each in labels}
    longer = max(0, max(map(len, ticks)) - USUAL)
    figure = Figure(figsize=(WIDTH, 0.9 + 1.35 * len(namers) + LETTER * longer), layout="constrained")
    panels = figure.subplots(len(namers), len(sigmas), sharex=True, sharey=True, squeeze=False)
    for row, namer in enumerate(namers):
        for column, sigma in enumerate(sigmas):
            axes = panels[row, column]
            cells = mine[(mine["namer"] == namer) & (mine["sigma_deg"] == sigma)]
            matrix = cells.pivot(index="shape", columns="named", values="share").reindex(index=labels, columns=labels)
            image = axes.imshow(100 * matrix, cmap="Greys", vmin=0, vmax=100, aspect="auto")
            for i, j in ((i, j) for i in range(len(labels)) for j in range(len(labels))):
                percent = 100 * matrix.iat[i, j]
                if percent == percent:
                    colour = "white" if percent > 55 else "black"
                    axes.text(j, i, f"{percent:.0f}", ha="center", va="center", fontsize=7, color=colour)
            axes.set(
                xticks=range(len(labels)), yticks=range(len(labels)), xticklabels=list(ticks), yticklabels=list(ticks)
            )
            axes.tick_params(axis="x", rotation=90)
            axes.tick_params(length=0)
            for told in (*axes.get_xticklabels(), *axes.get_yticklabels()):
                told.set_color(ticks[told.get_text()])
            if row == 0:
                axes.set_title(f"σ = {sigma:g}°")
        panels[row, 0].set_ylabel(f"{TITLES[namer]}\ntrue shape")
    figure.supxlabel("named", fontsize=8)
    figure.colorbar(image, ax=panels, label="share of the trials of a shape (%)", aspect=40, pad=0.01)
    return PaperFigure(figure, data)
