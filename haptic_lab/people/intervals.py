"""Choices of two intervals: in one the comparison is felt, in the other the standard; "yes" names the right one.

An observer that knows both beforehand holds in each interval the log of the ratio of their posterior probabilities for
evidence; the difference of the two intervals tells which is which. No answer is right more often.

Shapes: as in `Courses`: M cells, S sigmas, R repeats, T times, C names; n explorations.
"""

from __future__ import annotations

import numpy as np
import pandas as pd
from scipy.special import log_expit

from haptic_env import validate
from haptic_env.arrays import Array
from haptic_lab.people import evidence
from haptic_lab.people.courses import Courses
from haptic_lab.people.scoring import NO, YES
from haptic_lab.people.sweep_courses import condition_of

LABEL = "{0} {1}"  # of a cell: the comparison, and under which condition


def difference(comparison: Array, standard: Array) -> Array:
    """Put two intervals together, of different repeats.

    Args:
        comparison: (…, R, n) nats for the comparison against the standard, where the comparison was felt.
        standard: (…, R, n) likewise where the standard was; of repeats as many, of the same seeds.

    Returns:
        (…, R, n) nats for the right interval.
    """
    return np.asarray(comparison - np.roll(standard, 1, axis=-2))


def two_intervals(courses: Courses, standard: str) -> Courses:
    """Make courses of choices of two intervals from those of names.

    Args:
        courses: of an observer that had the standard and all comparisons for candidates.
        standard: what one of the two intervals had, an object of the courses.

    Returns:
        Courses of "yes", the right interval, and "no", with a condition for each comparison. Each repeat of the
        comparison is felt beside another repeat of the standard. "no" as an object is the mirror of "yes".

    Raises:
        ValueError: for a standard that is not there, courses without a comparison, or a single repeat.
    """
    validate.choice("standard", standard, {*courses.objects} & {*courses.names})
    if courses.repeats < 2:
        raise ValueError(f"courses must have 2 repeats at least to be felt in two intervals, got {courses.repeats}")
    there = np.maximum(courses.log_posterior, evidence.LEAST)  # NaN stays
    found: dict[tuple[str, str], Array] = {}
    for cell, (name, condition) in enumerate(courses.cells):
        if name == standard or name not in courses.names or (standard, condition) not in courses.cells:
            continue
        pair = courses.names.index(name), courses.names.index(standard)
        ours, theirs = (
            there[each][..., pair[0]] - there[each][..., pair[1]] for each in (cell, courses.cell(standard, condition))
        )
        told = difference(ours, theirs)  # (S, R, T)
        of_yes = np.stack([log_expit(told), log_expit(-told)], axis=-1)
        label = LABEL.format(name, condition).strip()
        found |= {(YES, label): of_yes, (NO, label): of_yes[..., ::-1]}
    if not found:
        raise ValueError(
            f"courses must be of the standard {standard} and something to be told from it, both candidates"
        )
    return Courses(
        names=(YES, NO),
        objects=tuple(name for name, _ in found),
        conditions=tuple(condition for _, condition in found),
        sigmas=courses.sigmas,
        seconds=courses.seconds,
        log_posterior=np.stack([*found.values()]),
    )


def in_two_intervals(table: pd.DataFrame, standard: str) -> pd.DataFrame:
    """Put trials of two intervals so that `two_intervals` has courses of them.

    Args:
        table: (M,) trials, of which `object` is the comparison.
        standard: what the other interval had.

    Returns:
        The trials, of which "yes" is right, with the comparison for their condition.

    Raises:
        ValueError: for answers that are neither "yes" nor "no", and where the standard is compared with itself.
    """
    strange = sorted({*table["response"]} - {YES, NO})
    if strange:
        raise ValueError(
            f"responses of two intervals must be {YES}, the right one, or {NO}, got {validate.listed(strange)}"
        )
    if (table["object"] == standard).any():
        raise ValueError(f"objects of two intervals are comparisons, got the standard, {standard}, in some trials")
    nothing = [""] * len(table)
    told = zip(table["object"], table.get("condition", nothing), table.get("recording", nothing), strict=True)
    labels = [LABEL.format(name, condition_of(under, path)).strip() for name, under, path in told]
    return table.drop(columns="recording", errors="ignore").assign(object=YES, condition=labels)
