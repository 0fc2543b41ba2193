"""People beside observers: from a table of trials to tables, pictures and what is to be said of them."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from typing import NamedTuple

import numpy as np
import pandas as pd
from matplotlib.figure import Figure

from haptic_env import validate
from haptic_lab.people import curves, observer_pictures, pictures, sensitivity_tables, summaries
from haptic_lab.people.agreement import FLOOR
from haptic_lab.people.matching import Match, cells_of, match, unknown_to
from haptic_lab.people.observed import Cell, Observed, in_two_intervals
from haptic_lab.people.pictures import MOST_OBSERVERS, MOST_PANELS
from haptic_lab.people.scoring import Design
from haptic_lab.people.summaries import PEOPLE, Group, over_all_times

TOLD = 4  # cells that a message names


class Analysis(NamedTuple):
    """All that is said of a table.

    Attributes:
        facts: of the table and what was asked, in words.
        notes: what a reader must know of the numbers.
        tables: by their names.
        figures: by the names of their tables, or of their own.
        captions: of the figures: what to see in them.
    """

    facts: Mapping[str, str]
    notes: Sequence[str]
    tables: Mapping[str, pd.DataFrame]
    figures: Mapping[str, Figure]
    captions: Mapping[str, str]


CAPTIONS = {
    "confusion": "Rows: what was explored. Columns: what was answered. On the diagonal answers are right.",
    "accuracy": "Black: all people. The nearer an observer's line, the more alike is how often both are right.",
    "sensitivity": "d′: how well objects are told apart. Efficiency: 100 % is as well as the observer does.",
    "psychometric": "How answers go over from one to the other. The steeper, the finer are differences told.",
    "agreement": "The further to the right, the better an observer says what people answered, trial by trial.",
    "times": "Each dot is a trial. ρ: whether people answer later where the observer is sure later.",
}


def analyse(
    table: pd.DataFrame,
    design: Design,
    observers: Sequence[Observed] = (),
    *,
    floor: float = FLOOR,
    level: str | None = None,
) -> Analysis:
    """Say all that there is to say of people, and of observers beside them.

    Args:
        table: (M,) trials, as `read_trials` gives them.
        design: what was asked.
        observers: to hold people against; none: people alone are told of.
        floor: how often an answer is any at all, of log likelihoods.
        level: column with the level of the stimulus; None: the one parameter that varies among the objects.

    Returns:
        Tables, pictures and notes.

    Raises:
        ValueError: for a floor out of range, a column that is none of levels, and observers that explored nothing of
            what people did.
    """
    validate.number("floor", floor, 0.0, 1.0)
    if level is not None and design.kind == "identification":
        raise ValueError(f"a column of levels ({level!r}) is for answers of yes and no; the design is identification")
    matches, notes = _matched(table, design, observers)
    groups = summaries.groups_of(table, design, matches)
    found = sensitivity_tables.sensitivities(groups, design)
    tables = {"accuracy": summaries.accuracy(groups), "confusion": summaries.confusion(groups, design)}
    if found:
        tables["sensitivity"] = sensitivity_tables.detection(found)
    if found and matches:
        tables["efficiency"] = sensitivity_tables.efficiencies(found)
    if matches:
        tables["agreement"] = summaries.agreement(table, design, matches, floor)
    notes += [*_of_design(design), *_of_perfect_people(tables), *_of_perfect(tables, matches)]
    matches = _best_first(matches, tables)
    labels = [each.label for each in matches[:MOST_OBSERVERS]]
    if len(matches) > len(labels):
        notes.append(f"Pictures show {len(labels)} of {len(matches)} observers, those that say people's answers best.")
    conditions, subjects = (table[name].nunique() if name in table else 1 for name in ("condition", "subject"))
    if conditions > MOST_PANELS or subjects > observer_pictures.MOST_ROWS:
        notes.append(
            f"Pictures show the first of {conditions} conditions and {subjects} subjects; tables have them all."
        )
    figures = _figures(table, design, tables, matches[:MOST_OBSERVERS], labels)
    if design.kind != "identification":
        notes += _psychometric(table, design, groups, level, labels, tables, figures)
    if not tables["accuracy"].size:
        del tables["accuracy"]
    order = [name for name in CAPTIONS if name in figures]
    return Analysis(
        _facts(table, design, matches),
        notes,
        tables,
        {name: figures[name] for name in order},
        {name: CAPTIONS[name] for name in order},
    )


def _matched(table: pd.DataFrame, design: Design, observers: Sequence[Observed]) -> tuple[list[Match], list[str]]:
    if observers and design.kind == "2afc":
        if not design.standard:
            return [], ["Observers are left out: nobody knows what the other of two intervals had (--standard)."]
        observers = [in_two_intervals(each, design.standard) for each in observers]
    if observers and not design.scored:
        return [], ["Observers are left out: nobody knows of which objects they should say “no” (--absent)."]
    taken = {PEOPLE, *table["subject"]}
    matches: list[Match] = []
    strangers: dict[tuple[str, ...], list[str]] = {}  # observers, by the names that they did not know
    gaps: dict[tuple[Cell, ...], list[str]] = {}  # and by what they did not explore
    for each in observers:
        label = each.label
        while label in taken:  # as two folders of one sweep would have it
            label += "′"
        taken.add(label)
        unknown = unknown_to(each, design)
        if unknown and set(unknown) & set(table["object"]):
            strangers.setdefault(tuple(unknown), []).append(label)
            continue
        mine = match(table, design, each._replace(label=label))
        if mine.missing:
            gaps.setdefault(mine.missing, []).append(label)
        if len(mine.answers):
            matches.append(mine)
    notes = [
        f"Left out, as they did not know of {validate.listed(unknown)}, an easier task: {_several(labels)}."
        for unknown, labels in strangers.items()
    ]
    notes += [_of_missing(table, missing, labels) for missing, labels in gaps.items()]
    if observers and not matches:
        raise ValueError(
            f"no observer explored what people did: {notes[0]} Explore it with haptic-slam evaluate, with the objects, "
            "seconds and candidates of the table"
        )
    return matches, notes


def _several(labels: Sequence[str]) -> str:
    """Observers by name, or of many the first and how many there are."""
    return validate.listed(labels) if len(labels) <= 2 else f"{labels[0]} and {len(labels) - 1} more observers"


def _of_missing(table: pd.DataFrame, missing: Sequence[Cell], labels: Sequence[str]) -> str:
    gone = set(missing)
    trials = sum(each in gone for each in cells_of(table))
    told = [
        f"{cell.object} for {cell.seconds:g} s{f' ({cell.condition})' if cell.condition else ''}"
        for cell in missing[:TOLD]
    ]
    more = f" and {len(gone) - TOLD} more" if len(gone) > TOLD else ""
    what = f"{_several(labels)} did not explore {', '.join(told)}{more}"
    return f"{what}: {trials} of {len(table)} trials are left out."


def _of_design(design: Design) -> list[str]:
    if not design.scored:
        return [
            "Nobody knows which answers are right: say of which objects “no” is (--absent). Without, there is no "
            "accuracy and no d′."
        ]
    return []


def _of_perfect_people(tables: Mapping[str, pd.DataFrame]) -> list[str]:
    if "sensitivity" not in tables:
        return []
    lines = over_all_times(tables["sensitivity"])
    subjects = lines[lines["kind"] == "subject"]
    perfect = list(dict.fromkeys(subjects["who"][subjects["perfect"]]))
    if not perfect or perfect == list(dict.fromkeys(subjects["who"])):
        return []
    return [
        f"No mistake was made by {validate.listed(perfect)}: the mean d′ over subjects, and people's efficiency, count "
        "each at what so many trials can show, and may be too low."
    ]


def _of_perfect(tables: Mapping[str, pd.DataFrame], matches: Sequence[Match]) -> list[str]:
    if not matches or "sensitivity" not in tables:
        return []
    lines = tables["sensitivity"]
    perfect = over_all_times(lines[(lines["kind"] == "observer") & lines["perfect"]])
    if perfect.empty:
        return []
    told = []
    for who, mine in perfect.groupby("who", sort=False):
        trials = [
            f"{validate.counted(line.trials, 'trial')}{'' if math.isnan(line.seconds) else f' of {line.seconds:g} s'}"
            for line in mine.itertuples()
        ]
        told.append(f"{who} in {validate.listed(dict.fromkeys(trials))}")
    return [
        f"No mistake was made by {'; '.join(told)}: d′ is above what so many can show, and people's efficiency "
        "is only known to be below a bound. Let observers explore with more noise (haptic-slam evaluate --sigmas) or "
        "for less time (--seconds)."
    ]


def _best_first(matches: Sequence[Match], tables: Mapping[str, pd.DataFrame]) -> list[Match]:
    if "agreement" not in tables:
        return list(matches)
    lines = tables["agreement"]
    nats = lines[lines["who"] == PEOPLE].groupby("observer")["nats"].first()
    return sorted(matches, key=lambda each: -float(nats.get(each.label, -np.inf)))


def _figures(
    table: pd.DataFrame,
    design: Design,
    tables: Mapping[str, pd.DataFrame],
    shown: Sequence[Match],
    labels: Sequence[str],
) -> dict[str, Figure]:
    figures = {"confusion": pictures.confusions(tables["confusion"], labels, design.answers)}
    if len(tables["accuracy"]):
        figures["accuracy"] = pictures.accuracies(tables["accuracy"], labels, 1.0 / design.alternatives)
    if "sensitivity" in tables:
        none = pd.DataFrame(columns=["who", "observer", "condition", "seconds", "efficiency", "low", "high"])
        figures["sensitivity"] = observer_pictures.sensitivities(
            tables["sensitivity"], tables.get("efficiency", none), labels
        )
    if shown:
        figures["agreement"] = observer_pictures.agreements(tables["agreement"], labels, len(design.answers))
        if tables["agreement"]["time_rho"].notna().any():
            figures["times"] = observer_pictures.decisions(table, shown, tables["agreement"])
    return figures


def _psychometric(
    table: pd.DataFrame,
    design: Design,
    groups: Sequence[Group],
    level: str | None,
    labels: Sequence[str],
    tables: dict[str, pd.DataFrame],
    figures: dict[str, Figure],
) -> list[str]:
    """Add the table and picture of psychometric functions, where there are any; says why not."""
    try:
        what, levels = curves.levels_of(table, level, design.standard)
    except ValueError as error:
        if level is not None:
            raise
        return [f"No psychometric function: {error}; or say which column is the level (--level)."]
    several = sum(group.kind == "subject" for group in groups) > 1
    counted = curves.shares([each for each in groups if several or each.kind != "subject"], levels)
    try:
        lines, found, refused = curves.fits(counted, design)
    except ImportError as error:
        return [f"No psychometric function: {error}"]
    tables["psychometric"], tables["levels"] = lines, counted
    guess = 0.5 if design.kind == "2afc" else 0.0
    figures["psychometric"] = pictures.psychometrics(counted, found, labels, what, guess)
    return [f"No psychometric function of {each}" for each in refused]


def _facts(table: pd.DataFrame, design: Design, matches: Sequence[Match]) -> dict[str, str]:
    seconds = table["seconds"]
    asked = {
        "identification": f"which of {len(design.answers)} it is",
        "yes-no": "yes or no",
        "2afc": "which of two intervals",
    }[design.kind]
    per = table.groupby("subject").size()
    return {
        "subjects": str(len(per)),
        "trials": f"{len(table)}, {per.min()} to {per.max()} a subject",
        "asked": f"{asked}: {validate.listed(design.answers)}",
        "chance": f"{1 / design.alternatives:.0%}",
        "objects": str(table["object"].nunique()),
        "time explored": f"{seconds.min():g} to {seconds.max():g} s",
        "observers": validate.listed([each.label for each in matches]) or "none",
    }
