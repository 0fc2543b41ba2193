"""What a study found, beside what was published: what is printed, tables and a picture."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import asdict
from pathlib import Path
from typing import Any

import pandas as pd
from rich import box
from rich.console import Console
from rich.table import Table

from haptic_lab.files import write_csv, write_table
from haptic_lab.people.psychometric import LEAST_LEVELS
from haptic_lab.people.studies import discrimination, identification, pictures
from haptic_lab.people.studies.presets import DISCRIMINATION, Published, Study
from haptic_lab.style import OBSERVER_NAMES

FILES = ("study.csv", "published.csv", "study.png")
OF_DISCRIMINATION = ("counts.csv",)
UNREAD = "as cited in the issue"


def tell(study: Study, console: Console) -> None:
    """Print what is done, what was published, and what does not fit.

    Args:
        study: the experiment.
        console: to print on.
    """
    console.print(f"{study.title}. {study.about}", highlight=False)
    for condition in study.conditions:
        if condition.models:
            console.print(f"{condition.name}: {condition.models}", highlight=False)
    for figure in study.published:
        console.print(f"Published: {said(figure, study)} [{source_of(figure)}]", highlight=False)
    for difference in study.differs:
        console.print(f"Does not fit: {difference}", highlight=False)


def said(figure: Published, study: Study) -> str:
    """Put a published mean in words.

    Args:
        figure: of the study.
        study: the experiment.

    Returns:
        The figure with its unit, and what it is of.
    """
    value = f"{figure.value:g}{study.unit and ' '}{study.unit}"
    if study.task != DISCRIMINATION:
        value = f"{100 * figure.value:g} %"
    told = [figure.what, figure.condition, f"{figure.seconds:g} s" if figure.seconds else ""]
    return f"{value}, {', '.join(each for each in told if each)}"


def source_of(figure: Published) -> str:
    """Say where a published mean is from, and where it was read.

    Args:
        figure: of a study.

    Returns:
        In words.
    """
    return f"{figure.source}; {'read in the ' + figure.checked if figure.checked else UNREAD}"


def save(study: Study, rows: pd.DataFrame, out: Path, console: Console) -> list[str]:
    """Write and print what was found.

    Args:
        study: the experiment.
        rows: of the tables of trials, with `condition`.
        out: folder for the results.
        console: to print on.

    Returns:
        Names of the files.

    Raises:
        ValueError: where stimuli were no candidates of the sweep, or nothing of it was explored.
        ImportError: where psignifit is missing.
    """
    written = list(FILES)
    if study.task == DISCRIMINATION:
        counts = discrimination.counted(rows, study)
        if counts.empty:
            raise ValueError("of no stimulus and its standard there are trials yet")
        lines = discrimination.thresholds(counts, study)
        write_csv(out / "counts.csv", counts)
        console.print(_thresholds(lines, study))
        _print_reached(lines, study, console)
        written += OF_DISCRIMINATION
        figure = pictures.thresholds(lines, study)
    else:
        lines = identification.accuracy(rows, study)
        if lines.empty:
            raise ValueError("nothing was explored for as long as the study asks")
        console.print(_accuracy(lines, study))
        figure = pictures.accuracy(lines, study)
    write_table(out, "study", lines, figure)
    write_csv(out / "published.csv", pd.DataFrame([asdict(each) for each in study.published]))
    return written


def _thresholds(lines: pd.DataFrame, study: Study) -> Table:
    share = 0.5 * (1.0 + study.guess)
    title = f"Threshold of {study.parameter} against {study.standard:g}{study.unit and ' '}{study.unit}"
    shown = Table(title=f"{title}: {100 * share:g} % right, 95 % interval", box=box.SIMPLE)
    several = lines["seconds"].nunique() > 1
    for name in ("condition", "observer", *(["seconds"] if several else []), "σ (°)", "threshold", "trials"):
        shown.add_column(name, justify="left" if name in ("condition", "observer") else "right")
    for line in lines.itertuples():
        seconds = [f"{line.seconds:g}"] if several else []
        shown.add_row(
            str(line.condition),
            OBSERVER_NAMES.get(str(line.observer), str(line.observer)),
            *seconds,
            f"{line.sigma_deg:g}",
            _threshold(line, study),
            str(line.trials),
        )
    return shown


def _threshold(line: Any, study: Study) -> str:
    at, low, high = (float(getattr(line, name)) for name in discrimination.ENDS)
    if math.isnan(at):
        few = f"fewer than {LEAST_LEVELS} stimuli"
        return f"none: {'all right' if line.right == 1.0 else 'all wrong' if line.right == 0.0 else few}"
    distance = abs(at - study.standard)  # of which two digits are told
    digits = max(0, 1 - math.floor(math.log10(distance))) if distance else 3
    told = f"{at:.{digits}f} [{low:.{digits}f}, {high:.{digits}f}]"
    return told if line.within else f"{told}, beyond the stimuli"


def _print_reached(lines: pd.DataFrame, study: Study, console: Console) -> None:
    measured = sorted(set(lines["sigma_deg"]))
    for figure in study.published:
        if not figure.drawn or len(measured) < 2:
            continue
        for found in discrimination.reached(lines, figure, study.standard):
            name = OBSERVER_NAMES.get(found["observer"], found["observer"])
            at = found["sigma_deg"]
            if math.isnan(at):
                told = (
                    f"at no σ from {measured[0]:g} to {measured[-1]:g}°{', and is better' if found['better'] else ''}"
                )
            else:
                low = f"below {measured[0]:g}" if math.isnan(found["low"]) else f"{found['low']:.2g}"
                high = f"above {measured[-1]:g}" if math.isnan(found["high"]) else f"{found['high']:.2g}"
                told = f"at σ = {at:.2g}° [{low}, {high}]"
            console.print(f"{name}: has people's {figure.value:g} ({figure.what}) {told}", highlight=False)


def _accuracy(lines: pd.DataFrame, study: Study) -> Table:
    shown = Table(title=f"{study.title}: named right, 95 % interval", box=box.SIMPLE)
    for name in ("condition", "observer", "σ (°)", "after (s)", "right", "trials"):
        shown.add_column(name, justify="left" if name in ("condition", "observer") else "right")
    for line in lines.itertuples():
        shown.add_row(
            str(line.condition),
            OBSERVER_NAMES.get(str(line.observer), str(line.observer)),
            f"{line.sigma_deg:g}",
            f"{line.after:g}",
            f"{100 * line.mean:.0f} % [{100 * line.low:.0f}, {100 * line.high:.0f}]",
            str(line.trials),
        )
    return shown


def listed(studies: Sequence[Study]) -> Table:
    """Say what studies there are.

    Args:
        studies: to be listed.

    Returns:
        A table.
    """
    shown = Table(box=box.SIMPLE)
    for name in ("name", "task", "what", "published"):
        shown.add_column(name)
    for study in studies:
        figures = "; ".join(said(each, study) for each in study.published if each.drawn)
        shown.add_row(study.name, study.task, study.about, figures)
    return shown
