"""What is told of fitted models: tables, what is kept, and a picture."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from typing import Any

import matplotlib
import numpy as np
import pandas as pd
from matplotlib.figure import Figure
from rich.console import Console
from rich.table import Table

from haptic_env import validate
from haptic_lab.analysis.statistics import share_interval
from haptic_lab.people.courses import Courses
from haptic_lab.people.fitting import Fit
from haptic_lab.people.models import LOGARITHMIC, UNITS, Model
from haptic_lab.people.predictions import predicted
from haptic_lab.people.trial_columns import DEADLINE
from haptic_lab.style import BETTER, WORSE, as_drawn

FILES = ("fit.csv", "predicted.csv", "fit.json", "fit.png")
FEW = 4.0  # draws that count: below it the repeats are too few for as many trials
CUT = 0.5  # of its maximum: a posterior that is as high at the end of its range goes on beyond
# Ends of ranges at which there is no such limit.
NO_LIMIT_LOW, NO_LIMIT_HIGH = ("lapse", "decision_noise", "price"), ("memory_seconds", "stop_at")
LISTED = 12  # subjects that a picture names
LABELS = {
    "sigma_deg": "σ (degrees)",
    "memory_seconds": "memory (s)",
    "decision_noise": "decision noise (nats)",
    "stop_at": "answers at a probability of",
    "price": "price (per s)",
    "lapse": "lapse rate",
}


def table(fits: Mapping[str, Fit]) -> pd.DataFrame:
    """Put down what was found.

    Args:
        fits: by subject.

    Returns:
        A row for each subject and parameter: `estimate`, the median of the posterior; `low` and `high`, the ends of its
        95 % interval; `best`, the most probable value together with those of the others; `log_likelihood`, nats, of all
        trials at these; `log_evidence`; `effective_draws`.
    """
    rows = []
    for subject, each in fits.items():
        for name in each.model.parameters:
            estimate, low, high = each.interval(name)
            rows.append(
                {
                    "subject": subject,
                    "model": each.model.name,
                    "parameter": name,
                    "unit": UNITS[name],
                    "estimate": estimate,
                    "low": low,
                    "high": high,
                    "best": each.best[name],
                    "trials": each.trials,
                    "log_likelihood": each.log_likelihood,
                    "log_evidence": each.log_evidence,
                    "effective_draws": each.effective_draws,
                }
            )
    columns = ["subject", "model", "parameter", "unit", "estimate", "low", "high", "best", "trials"]
    return pd.DataFrame(rows, columns=[*columns, "log_likelihood", "log_evidence", "effective_draws"])


def content(fits: Mapping[str, Fit], draws: int, seed: int) -> dict[str, Any]:
    """Put together what fit.json keeps.

    Args:
        fits: by subject.
        draws: of repeats.
        seed: of chance.

    Returns:
        Numbers and texts.
    """
    model = next(iter(fits.values())).model
    ranges = {
        name: {"low": grid.low, "high": grid.high, "scale": "logarithmic" if grid.logarithmic else "linear"}
        for name, grid in model.grids.items()
    }
    posteriors = {
        subject: {
            name: {"values": model.grids[name].values.tolist(), "probability": each.marginals[name].tolist()}
            for name in model.parameters
        }
        for subject, each in fits.items()
    }
    told = {"draws": draws, "seed": seed, "repeats": model.courses.repeats}
    return (
        {"model": model.name, "intervals": "posterior, 2.5 % beyond each end", "prior": ranges}
        | told
        | {"posteriors": posteriors}
    )


def tell(found: pd.DataFrame, model: Model, console: Console) -> None:
    """Print what was found.

    Args:
        found: of `table`.
        model: that was fitted.
        console: to print on.
    """
    shown = Table(title="Parameters, 95 % intervals of the posterior", title_justify="left")
    for head in ("subject", "parameter", "estimate", "from", "to", "unit", "trials", "nats a trial"):
        shown.add_column(head)
    for row in found.itertuples():
        numbers = (f"{value:.3g}" for value in (row.estimate, row.low, row.high))
        shown.add_row(
            row.subject, row.parameter, *numbers, row.unit, str(row.trials), f"{row.log_likelihood / row.trials:.3f}"
        )
    console.print(shown)
    few = sorted(set(found.loc[found["effective_draws"] < FEW, "subject"]))
    if few and found["effective_draws"].max() > 1.0:
        console.print(
            f"note: {model.courses.repeats} repeats are few for what {validate.listed(few)} answered: intervals may be "
            "too narrow; explore more repeats",
            highlight=False,
        )


def notes(fits: Mapping[str, Fit]) -> list[str]:
    """Say where what was found is not to be believed.

    Args:
        fits: by subject.

    Returns:
        Notes on subjects whom guesses explain better, and on posteriors that only the range of a parameter ends.
    """
    model = next(iter(fits.values())).model
    chance = chance_of(model.courses)
    guessed = [
        subject for subject, each in fits.items() if not model.timed and each.log_likelihood / each.trials < chance
    ]
    told = [worse_than_guesses(guessed, chance)] if guessed else []
    cut: dict[str, list[str]] = {}
    for subject, each in fits.items():
        for name in each.model.parameters:
            marginal, grid = each.marginals[name], each.model.grids[name]
            for place, value, natural in ((0, grid.low, NO_LIMIT_LOW), (-1, grid.high, NO_LIMIT_HIGH)):
                if name not in natural and marginal[place] >= CUT * marginal.max():
                    cut.setdefault(f"{name} at {value:g}", []).append(subject)
    if cut:
        places = "; ".join(f"{place} (of {validate.listed(subjects)})" for place, subjects in cut.items())
        told.append(
            f"the range of a parameter cuts its posterior off, so that its interval says nothing there: {places}"
        )
    return told


def unheeded(tables: Mapping[str, pd.DataFrame], models: Sequence[Model]) -> list[str]:
    """Say whose answers came before they were asked for, where no model heeds that.

    Args:
        tables: of trials, by subject.
        models: that are fitted.

    Returns:
        A note, or none.
    """
    if any(model.timed for model in models):
        return []
    early = [name for name, table in tables.items() if DEADLINE in table and (table["seconds"] < table[DEADLINE]).any()]
    if not early:
        return []
    return [
        f"{validate.listed(early)} answered before being asked: that tells of what was believed too, which --model "
        "stop_at heeds and this does not"
    ]


def chance_of(courses: Courses) -> float:
    """Say how probable guesses hold an answer.

    Args:
        courses: with the names that can be answered.

    Returns:
        Nats a trial.
    """
    return -math.log(len(courses.names))


def worse_than_guesses(subjects: Sequence[str], chance: float) -> str:
    """Say whom no model explains.

    Args:
        subjects: of whom no model says as much as guesses do.
        chance: nats a trial, of guesses.

    Returns:
        The note.
    """
    return (
        f"guesses, {chance:.3f} nats a trial, explain {validate.listed(subjects)} better than this: what was found is "
        "no description of these answers"
    )


def picture(fits: Mapping[str, Fit]) -> Figure:
    """Draw the posterior of each parameter, and right answers against what is expected.

    Args:
        fits: by subject.

    Returns:
        The figure.
    """
    model = next(iter(fits.values())).model
    names = model.parameters
    figure = Figure(figsize=(2.9 * (len(names) + 1), 3.0), layout="constrained")
    axes = figure.subplots(1, len(names) + 1, squeeze=False)[0]
    shades = matplotlib.colormaps["viridis"](np.linspace(0.0, 0.85, len(fits)))
    for axis, name in zip(axes, names, strict=False):
        grid = model.grids[name]
        for (subject, each), shade in zip(fits.items(), shades, strict=True):
            density = each.marginals[name] / each.marginals[name].max()
            axis.plot(grid.values, density, color=shade, lw=1.3, label=as_drawn(subject))
            estimate, *_ = each.interval(name)
            axis.plot([estimate], [1.06], "v", color=shade, ms=4, clip_on=False)
        if name in LOGARITHMIC:
            axis.set_xscale("log")
            ticks = [tick for tick in (0.1, 0.2, 0.5, 1, 2, 5, 10, 20, 50, 100) if grid.low <= tick <= grid.high]
            axis.set_xticks(ticks, [f"{tick:g}" for tick in ticks])
            axis.xaxis.minorticks_off()
        axis.set(xlabel=LABELS[name], ylim=(0.0, 1.1), yticks=[])
    axes[0].set_ylabel("posterior / its maximum")
    if names and 1 < len(fits) <= LISTED:
        axes[0].legend(fontsize=6)
    _draw_predicted(axes[-1], predicted(fits), model.timed)
    figure.suptitle(f"What the answers say of {'each subject' if len(fits) > 1 else 'the subject'} (▼ the estimate)")
    return figure


def _draw_predicted(axis: Any, found: pd.DataFrame, timed: bool) -> None:
    groups = found.groupby(["condition", "seconds"], sort=True)
    rows = [
        (condition, seconds, (part["right"] * part["trials"]).sum(), (part["expected"] * part["trials"]).sum(),
         part["trials"].sum())
        for (condition, seconds), part in groups
    ]  # fmt: skip
    conditions = list(dict.fromkeys(condition for condition, *_ in rows))
    colours = matplotlib.colormaps["cividis"](np.linspace(0.0, 0.8, max(len(conditions), 1)))
    for condition, colour in zip(conditions, colours, strict=False):
        mine = [each for each in rows if each[0] == condition]
        seconds = [each[1] for each in mine]
        share = np.array([right / whole for _, _, right, _, whole in mine])
        ends = np.array([share_interval(round(right), int(whole)) for _, _, right, _, whole in mine])
        named = f"{as_drawn(condition)}, " if condition else ""
        colour = BETTER if len(conditions) == 1 else colour
        axis.errorbar(
            seconds, share, np.abs(ends.T - share), fmt="o", ms=4, lw=1, color=colour, label=f"{named}answered"
        )
        drawn = WORSE if len(conditions) == 1 else colour
        axis.plot(seconds, [e / w for _, _, _, e, w in mine], "-", lw=1.3, color=drawn, label=f"{named}expected")
    told = "answered rightly by then" if timed else "share right"
    axis.set(xlabel="seconds explored", ylabel=told, ylim=(0.0, 1.02))
    axis.legend(fontsize=6, loc="lower right")
