"""Pictures of what people and observers answered: confusions, accuracy through time, psychometric functions."""

from __future__ import annotations

import math
import textwrap
from collections.abc import Mapping, Sequence

import numpy as np
import pandas as pd
from matplotlib.axes import Axes
from matplotlib.colors import LinearSegmentedColormap
from matplotlib.figure import Figure

from haptic_lab.figures.paper_figure import WIDTH
from haptic_lab.people.psychometric import Psychometric
from haptic_lab.people.summaries import PEOPLE
from haptic_lab.style import BETTER, WORSE, as_drawn, titles_of

PEOPLE_COLOUR = "#000000"
COLOURS = ("#0072B2", "#D55E00", "#009E73")  # of the observers that are shown
MOST_OBSERVERS = len(COLOURS)
MOST_PANELS = 4
MOST_CONDITIONS = 24  # on one axis
SUBJECTS = "#B8B8B8"
LETTER = 0.065  # inches
NUMBERED = 10  # answers, up to which the cells of a matrix have numbers
# White where people and an observer agree; blue where people answer so more often, orange where less often.
DIFFERENCE = LinearSegmentedColormap.from_list("difference", [WORSE, "#FFFFFF", BETTER])


def colours_of_observers(labels: Sequence[str]) -> dict[str, str]:
    """Choose colours.

    Args:
        labels: of the observers that are shown, `MOST_OBSERVERS` at most.

    Returns:
        A colour for each, and for `PEOPLE`.
    """
    return {PEOPLE: PEOPLE_COLOUR, **dict(zip(labels, COLOURS, strict=False))}


def confusions(table: pd.DataFrame, observers: Sequence[str], answers: Sequence[str]) -> Figure:
    """Draw what objects are taken for, by people and by observers, and the difference between the two.

    Args:
        table: of `summaries.confusion`.
        observers: whose are shown.
        answers: (C,) in order.

    Returns:
        The matrices, and below those of observers what people have more of.
    """
    objects = list(dict.fromkeys(table["object"]))
    rows = [each for each in answers if each in objects] + [each for each in objects if each not in answers]
    titles = titles_of([*dict.fromkeys([*rows, *answers])])
    names = [[as_drawn(titles[each]) for each in side] for side in (rows, answers)]
    across, down = 1 + len(observers), 1 + bool(observers)
    beside, below = (LETTER * max(map(len, side)) for side in names)
    # The labels of rows stand twice where there are observers.
    wide = min(0.5, (WIDTH - 0.4 - down * beside) / (across * len(answers)))
    high = min(0.42, 3.4 / len(rows))
    size = 0.5 + down * beside + across * (wide * len(answers) + 0.15), 0.8 + down * (high * len(rows) + below + 0.35)
    figure = Figure(figsize=(max(size[0], 3.8), size[1]), layout="constrained")
    panels = figure.subplots(1 + bool(observers), across, squeeze=False, sharex=True, sharey=True)
    people = _matrix(table[table["kind"] == PEOPLE], rows, answers)
    _show_matrix(panels[0, 0], people, f"{PEOPLE}", difference=False)
    for column, label in enumerate(observers, start=1):
        theirs = _matrix(table[(table["kind"] == "observer") & (table["who"] == label)], rows, answers)
        _show_matrix(panels[0, column], theirs, wrapped(label), difference=False)
        _show_matrix(panels[1, column], people - theirs, "people − observer", difference=True)
    if observers:
        panels[1, 0].axis("off")
        panels[1, 0].text(
            0.5, 0.5, "blue: people\nanswer so\nmore often\n\norange:\nless often", ha="center", va="center",
            fontsize=8, transform=panels[1, 0].transAxes,
        )  # fmt: skip
    for row in panels:
        row[0].set(yticks=range(len(rows)), yticklabels=names[0])
    for axes in panels[-1]:
        axes.set(xticks=range(len(answers)), xticklabels=names[1])
        axes.tick_params(axis="x", rotation=90)
    if observers:
        panels[0, 0].tick_params(axis="x", labelbottom=True, rotation=90)
        panels[1, 1].tick_params(axis="y", labelleft=True)
    figure.supylabel("object", fontsize=9)
    figure.supxlabel("answer", fontsize=9)
    figure.suptitle("What each object is taken for (% of its trials)", fontweight="bold", fontsize=10)
    return figure


def wrapped(label: str, width: int = 18) -> str:
    """Break a title into lines.

    Args:
        label: of an observer.
        width: letters of a line.

    Returns:
        The title, as a picture can show it.
    """
    return "\n".join(textwrap.wrap(as_drawn(label).replace("σ = ", "σ\u00a0=\u00a0"), width)) or label


def _matrix(lines: pd.DataFrame, rows: Sequence[str], answers: Sequence[str]) -> pd.DataFrame:
    return 100.0 * lines.pivot(index="object", columns="response", values="share").reindex(index=rows, columns=answers)


def _show_matrix(axes: Axes, matrix: pd.DataFrame, title: str, *, difference: bool) -> None:
    limits = (-100, 100) if difference else (0, 100)
    axes.imshow(matrix, cmap=DIFFERENCE if difference else "Greys", vmin=limits[0], vmax=limits[1], aspect="auto")
    axes.set_title(title, fontsize=8.5)
    axes.tick_params(length=0, labelsize=7.5)
    if matrix.shape[1] > NUMBERED:
        return
    for (i, j), value in np.ndenumerate(matrix.to_numpy()):
        if not math.isnan(value):
            told = f"{round(value) or 0:+d}".replace("-", "−").replace("+0", "0") if difference else f"{value:.0f}"
            dark = value > 55 if not difference else abs(value) > 70
            axes.text(j, i, told, ha="center", va="center", fontsize=7.5, color="white" if dark else "black")


def accuracies(table: pd.DataFrame, observers: Sequence[str], chance: float) -> Figure:
    """Draw how often people and observers are right, against the time explored.

    Args:
        table: of `summaries.accuracy`.
        observers: whose are shown.
        chance: how often a guess is.

    Returns:
        A panel for each condition, of `MOST_PANELS` at most; one of all where there is one time alone.
    """
    conditions = list(dict.fromkeys(table["condition"]))[:MOST_CONDITIONS]
    timed = table[table["seconds"].notna() & table["condition"].isin(conditions)]
    once = timed["seconds"].nunique() == 1  # then conditions are what varies
    if once:
        places = {each: float(index) for index, each in enumerate(conditions)}
        parts = [("", timed.assign(place=timed["condition"].map(places)))]
    else:
        timed = timed.assign(place=timed["seconds"])
        parts = [(each, timed[timed["condition"] == each]) for each in conditions[:MOST_PANELS]]
    figure = Figure(figsize=(min(WIDTH, 1.2 + 2.6 * max(len(parts), 1.5)), 3.3), layout="constrained")
    panels = figure.subplots(1, len(parts), sharey=True, squeeze=False)[0]
    for axes, (title, part) in zip(panels, parts, strict=True):
        _draw_accuracy(axes, part, colours_of_observers(observers))
        axes.axhline(100 * chance, color="#777777", linestyle=":", linewidth=1, label="chance")
        axes.set(ylim=(0, 103), title=wrapped(title, 60 // len(parts)))
        if once:
            crowded = len(conditions) > MOST_PANELS
            axes.set_xticks(range(len(conditions)), [wrapped(each, 40 if crowded else 14) for each in conditions])
            axes.tick_params(axis="x", rotation=90 if crowded else 0)
            axes.set_xlim(-0.6, len(conditions) - 0.4)
        else:
            axes.set_xlabel("time explored (s)")
            axes.set_xticks(sorted(set(part["place"])), [f"{each:.3g}" for each in sorted(set(part["place"]))])
    panels[0].set_ylabel("right answers (%)")
    _legend(figure, panels[0], subjects=bool((table["kind"] == "subject").any()))
    after = f" after {timed['seconds'].iloc[0]:g} s" if once else ""
    figure.suptitle(f"How often the answer is right{after} (95 % intervals)", fontweight="bold", fontsize=10)
    return figure


def _draw_accuracy(axes: Axes, part: pd.DataFrame, colours: Mapping[str, str]) -> None:
    """Shares against `place`."""
    for _, mine in part[part["kind"] == "subject"].groupby("who", sort=False):
        axes.plot(mine["place"], 100 * mine["share"], color=SUBJECTS, linewidth=0.8, marker=".", markersize=3, zorder=1)
    shown = [each for each in colours if len(_of(part, each))]
    apart = 0.012 * (np.ptp(part["place"]) or 8.0)  # so that no interval hides another
    for index, who in enumerate(shown):
        mine = _of(part, who)
        place = mine["place"] + apart * (index - 0.5 * (len(shown) - 1))
        errors = 100 * np.abs(mine[["low", "high"]].to_numpy().T - mine["share"].to_numpy())
        axes.errorbar(
            place, 100 * mine["share"], errors, color=colours[who], marker="o" if who == PEOPLE else "s", markersize=5,
            linewidth=2.2 if who == PEOPLE else 1.4, capsize=2.5, label=as_drawn(who), zorder=3,
        )  # fmt: skip


def psychometrics(
    counted: pd.DataFrame,
    found: Mapping[tuple[str, str, str], Psychometric],
    observers: Sequence[str],
    what: str,
    guess: float,
) -> Figure:
    """Draw psychometric functions.

    Args:
        counted: of `curves.shares`.
        found: the functions, by kind, `who` and condition.
        observers: whose are shown.
        what: varies, for the axis.
        guess: share at which people guess, for the axis of 2AFC; 0 otherwise.

    Returns:
        A panel for each condition, of `MOST_PANELS` at most.
    """
    conditions = list(dict.fromkeys(counted["condition"]))[:MOST_PANELS]
    colours = colours_of_observers(observers)
    figure = Figure(figsize=(min(WIDTH, 1.4 + 2.7 * max(len(conditions), 1.4)), 3.5), layout="constrained")
    panels = figure.subplots(1, len(conditions), sharey=True, sharex=True, squeeze=False)[0]
    line = np.linspace(counted["level"].min(), counted["level"].max(), 200)
    for axes, condition in zip(panels, conditions, strict=True):
        for (kind, _, under), function in found.items():
            if kind == "subject" and under == condition:
                axes.plot(line, 100 * function.share(line), color=SUBJECTS, linewidth=0.8, zorder=1)
        mine = counted[counted["condition"] == condition]
        for index, (who, colour) in enumerate(colours.items()):
            points = _of(mine, who)
            if points.empty:
                continue
            errors = 100 * np.abs(points[["low", "high"]].to_numpy().T - points["share"].to_numpy())
            axes.errorbar(
                points["level"], 100 * points["share"], errors, linestyle="none", color=colour, capsize=2, markersize=5,
                marker="o" if who == PEOPLE else "s", zorder=3, label=as_drawn(who),
            )  # fmt: skip
            mine_fitted = found.get((PEOPLE if who == PEOPLE else "observer", who, condition))
            if mine_fitted is not None:
                axes.plot(
                    line, 100 * mine_fitted.share(line), color=colour, linewidth=2.2 if who == PEOPLE else 1.4, zorder=2
                )
                _mark_threshold(axes, mine_fitted, colour, index, (line[0], line[-1]))
        axes.set_title(wrapped(condition, 60 // len(conditions)))
        axes.set(xlabel=as_drawn(what), ylim=(-14, 103), yticks=range(0, 101, 25))
        if guess:
            axes.axhline(100 * guess, color="#777777", linestyle=":", linewidth=1)
    panels[0].set_ylabel("right interval chosen (%)" if guess else "“yes” (%)")
    _legend(figure, panels[0], subjects=any(kind == "subject" for kind, *_ in found))
    figure.suptitle("Psychometric functions; bars at the bottom: thresholds (95 %)", fontweight="bold", fontsize=10)
    return figure


def _mark_threshold(axes: Axes, function: Psychometric, colour: str, index: int, within: tuple[float, float]) -> None:
    value, low, high = function.threshold
    place = -4.0 - 2.8 * index
    axes.plot(np.clip([low, high], *within), [place] * 2, color=colour, linewidth=2, clip_on=False)
    if within[0] <= value <= within[1]:
        axes.plot(value, place, "|", color=colour, markersize=7, markeredgewidth=2)


def _of(table: pd.DataFrame, who: str) -> pd.DataFrame:
    """The lines of all people, or of an observer: a subject may be called as either is."""
    return table[(table["who"] == who) & (table["kind"] == (PEOPLE if who == PEOPLE else "observer"))]


def _legend(figure: Figure, axes: Axes, *, subjects: bool) -> None:
    handles, labels = axes.get_legend_handles_labels()
    if subjects:
        handles += axes.plot([], [], color=SUBJECTS, linewidth=1)
        labels.append("each subject")
    figure.legend(handles, labels, loc="outside lower center", ncols=min(len(labels), 3))
