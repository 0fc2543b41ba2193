"""d′, criteria and efficiencies of people and observers, a table each."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np
import pandas as pd

from haptic_lab.people.detection import Sensitivity, efficiency, forced_choice, group_draws, yes_no
from haptic_lab.people.scoring import YES, Design
from haptic_lab.people.summaries import PEOPLE, WHERE, Group, parts, worth

Found = Mapping[tuple[str, str, str, float], Sensitivity]  # by kind, who, condition and seconds


def sensitivities(groups: Sequence[Group], design: Design) -> Found:
    """Estimate d′ of each subject and observer.

    Args:
        groups: whose answers.
        design: what was asked.

    Returns:
        By `kind`, `who`, condition and time, of those in which it can be said.
    """
    found: dict[tuple[str, str, str, float], Sensitivity] = {}
    for who, kind, answers in groups:
        if kind == PEOPLE:
            continue
        for where, mine in parts(answers[answers["correct"].notna()]):
            if design.kind != "yes-no":
                made = forced_choice(*worth(mine, mine["correct"]), design.alternatives)
            else:
                absent = mine["object"].isin(design.absent)
                if absent.all() or not absent.any():
                    continue
                counts = [worth(part, part["response"] == YES) for part in (mine[~absent], mine[absent])]
                made = yes_no(*counts[0], *counts[1])
            found[(kind, who, *where)] = made
    return found


def detection(found: Found) -> pd.DataFrame:
    """Put d′ and criteria in a table.

    Args:
        found: of `sensitivities`.

    Returns:
        A line for each `who`, condition and time; of all people the means over subjects, with intervals over
        these; of one subject alone those over trials.
    """
    lines: list[tuple] = []
    for where, people in _by_place(found).items():
        if len(people) == 1:
            lines.append((PEOPLE, PEOPLE, *where, *_of(people[0])))
            continue
        of_d, of_c = (
            (float(values.mean()), *_ends(group_draws(values, within)))
            for values, within in (
                (np.array([one.d_prime for one in people]), np.array([one.d_prime_draws.std() for one in people])),
                (np.array([one.criterion for one in people]), np.array([one.criterion_draws.std() for one in people])),
            )
        )
        trials, perfect = sum(one.trials for one in people), all(one.perfect for one in people)
        lines.append((PEOPLE, PEOPLE, *where, *of_d, *of_c, trials, perfect))
    for (kind, who, *place), one in found.items():
        lines.append((who, kind, *place, *_of(one)))
    names = [
        "d_prime",
        "d_prime_low",
        "d_prime_high",
        "criterion",
        "criterion_low",
        "criterion_high",
        "trials",
        "perfect",
    ]
    return pd.DataFrame(lines, columns=["who", "kind", *WHERE, *names])


def efficiencies(found: Found) -> pd.DataFrame:
    """Hold people against observers.

    Args:
        found: of `sensitivities`.

    Returns:
        A line for all people and each subject, observer, condition and time: `efficiency` with its interval; where
        there is none, `high` is what it is below of.
    """
    lines: list[tuple] = []
    places = _by_place(found)
    for (kind, label, *place), observer in found.items():
        if kind != "observer" or tuple(place) not in places:
            continue
        people = places[tuple(place)]
        lines.append((PEOPLE, label, *place, *efficiency(people if len(people) > 1 else people[0], observer)))
        for (of, who, *there), person in found.items():
            if of == "subject" and there == place:
                lines.append((who, label, *place, *efficiency(person, observer)))
    return pd.DataFrame(lines, columns=["who", "observer", *WHERE, "efficiency", "low", "high"])


def _by_place(found: Found) -> dict[tuple, list[Sensitivity]]:
    """The subjects of each condition and time; `parts` has one NaN, which is the same as itself."""
    places: dict[tuple, list[Sensitivity]] = {}
    for (kind, _, *place), one in found.items():
        if kind == "subject":
            places.setdefault(tuple(place), []).append(one)
    return places


def _of(one: Sensitivity) -> tuple[float | int | bool, ...]:
    """Of one subject or observer, with the intervals over its trials."""
    return (
        one.d_prime, *one.d_prime_interval, one.criterion, *one.criterion_interval, one.trials, one.perfect,
    )  # fmt: skip


def _ends(draws: np.ndarray) -> tuple[float, float]:
    low, high = np.quantile(draws, (0.025, 0.975))
    return float(low), float(high)
