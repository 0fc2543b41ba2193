"""What is said of people and observers, a table each: accuracy, confusions, and how well they agree.

`who` is a subject, `PEOPLE` all of them, or an observer. `seconds` is empty for all times together.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping, Sequence
from typing import NamedTuple

import numpy as np
import pandas as pd

from haptic_lab.analysis.statistics import interval, share_interval
from haptic_lab.people import agreement as agreeing
from haptic_lab.people.matching import Match
from haptic_lab.people.scoring import Design

PEOPLE = "people"
MOST_TIMES = 8  # that are told apart; of more, ranges of as many trials each
RANGES = 5
WHERE = ("condition", "seconds")


class Group(NamedTuple):
    """Whose answers these are.

    Attributes:
        who: what they are called.
        kind: "subject", "people" or "observer".
        answers: a row for each trial: `object`, `condition`, `seconds` (as `binned`), `response`, `correct`, `weight`,
            and `exploration`, which those of one object have alike that are of one.
    """

    who: str
    kind: str
    answers: pd.DataFrame


def binned(table: pd.DataFrame) -> Mapping[float, float]:
    """Put times that are many together.

    Args:
        table: of trials.

    Returns:
        For each of its seconds those that it is counted under: itself, or the median of its range.
    """
    times = table["seconds"].to_numpy(dtype=np.float64)
    different = np.unique(times)
    if len(different) <= MOST_TIMES:
        return {float(each): float(each) for each in different}
    ranges = pd.qcut(times, RANGES, labels=False, duplicates="drop")
    return {
        float(time): round(float(np.median(times[ranges == which])), 3)
        for time, which in zip(times, ranges, strict=True)
    }


def groups_of(table: pd.DataFrame, design: Design, matches: Sequence[Match]) -> list[Group]:
    """Put all answers in one form.

    Args:
        table: of people's trials.
        design: what was asked.
        matches: of observers.

    Returns:
        All people first, then each subject where there are several, then the observers.
    """
    times = binned(table)
    people = _in_form(table.assign(weight=1.0, exploration=np.arange(len(table))), design, times)
    subjects = table["subject"]
    found = [Group(PEOPLE, "people", people)]
    found += [Group(str(name), "subject", people[subjects == name]) for name in dict.fromkeys(subjects)]
    found += [
        Group(each.label, "observer", _in_form(each.answers, design, times)) for each in matches if len(each.answers)
    ]
    return found


def _in_form(answers: pd.DataFrame, design: Design, times: Mapping[float, float]) -> pd.DataFrame:
    condition = answers.get("condition", "")
    form = answers[["object", "response", "weight", "exploration"]].assign(
        condition=condition, seconds=answers["seconds"].map(times)
    )
    right = design.right(answers["object"])
    return form.assign(correct=(answers["response"] == right).where(right != "").astype(np.float64))


def parts(answers: pd.DataFrame) -> Iterator[tuple[tuple[str, float], pd.DataFrame]]:
    """Split answers.

    Args:
        answers: of a group.

    Yields:
        Condition and seconds with their rows, each time of a condition and then, where there are several, all.
    """
    for condition, mine in answers.groupby("condition", sort=False):
        times = sorted(set(mine["seconds"]))
        for time in times:
            yield (str(condition), time), mine[mine["seconds"] == time]
        if len(times) > 1:
            yield (str(condition), math.nan), mine


def over_all_times(table: pd.DataFrame) -> pd.DataFrame:
    """Take the lines of a table that tell of all times together.

    Args:
        table: with `condition` and `seconds`.

    Returns:
        Those, and of a condition with one time alone the lines of that.
    """
    several = table["condition"].isin(table["condition"][table["seconds"].isna()])
    return table[table["seconds"].isna() | ~several]


def accuracy(groups: Sequence[Group]) -> pd.DataFrame:
    """Count right answers, with Wilson's intervals.

    Args:
        groups: whose answers.

    Returns:
        A line for each `who`, condition and time: `share`, `low`, `high`, `trials`.
    """
    lines = []
    for who, kind, answers in groups:
        for where, mine in parts(answers[answers["correct"].notna()]):
            share = float(np.average(mine["correct"], weights=mine["weight"]))
            count, trials = worth(mine, mine["correct"])
            lines.append((who, kind, *where, share, *share_interval(count, trials), trials))
    return pd.DataFrame(lines, columns=["who", "kind", *WHERE, "share", "low", "high", "trials"])


def confusion(groups: Sequence[Group], design: Design) -> pd.DataFrame:
    """Count what objects are taken for.

    Args:
        groups: whose answers; subjects are left to their own tables.
        design: what was asked.

    Returns:
        A line for all people and each observer, object and response: the `share` of `trials` of this object.
    """
    lines = []
    for who, kind, answers in groups:
        if kind == "subject":
            continue
        for name, mine in answers.groupby("object", sort=False):
            weights = mine.groupby("response")["weight"].sum() / mine["weight"].sum()
            lines += [(who, kind, name, each, float(weights.get(each, 0.0)), len(mine)) for each in design.answers]
    return pd.DataFrame(lines, columns=["who", "kind", "object", "response", "share", "trials"])


def agreement(table: pd.DataFrame, design: Design, matches: Sequence[Match], floor: float) -> pd.DataFrame:
    """Say how well observers say what people answered, trial by trial.

    Args:
        table: of people's trials.
        design: what was asked.
        matches: of observers.
        floor: of the likelihoods.

    Returns:
        A line for all people and each subject and observer: nats a trial with their interval (over trials of a subject,
        over subjects of all), those of chance, κ, shared bits and those that chance makes, and Spearman's correlation
        of times.
    """
    lines = []
    timed = "response_time" in table and table["response_time"].notna().any()
    for each in matches:
        for who, rows in [(PEOPLE, np.ones(len(table), dtype=bool)), *_subjects(table)]:
            mine = rows & each.known
            if not mine.any():
                continue
            responses = table["response"][mine].to_list()
            nats = agreeing.log_likelihoods(responses, each.probabilities[mine], design.answers, floor)
            of = table["subject"][mine].to_numpy()
            per_subject = np.array([nats[of == name].mean() for name in dict.fromkeys(of)])
            several = who == PEOPLE and len(per_subject) > 1
            mean, low, high, _ = interval(per_subject if several else nats)
            kappa = agreeing.kappa(responses, each.answered[mine], design.answers)
            bits = agreeing.shared_bits(responses, each.answered[mine], design.answers)
            chance = (len(design.answers) - 1) ** 2 / (2.0 * len(responses) * math.log(2.0))
            rho = (
                agreeing.time_correlation(each.decided[mine], table["response_time"][mine])
                if timed
                else [math.nan] * 3 + [0]
            )
            lines.append(
                (
                    who,
                    each.label,
                    len(responses),
                    mean,
                    low,
                    high,
                    float(nats.sum()),
                    -math.log(len(design.answers)),
                    kappa,
                    bits,
                    chance,
                    *rho,
                )
            )
    names = ["nats", "nats_low", "nats_high", "log_likelihood", "nats_of_chance", "kappa", "bits", "bits_of_chance"]
    return pd.DataFrame(
        lines, columns=["who", "observer", "trials", *names, "time_rho", "time_rho_low", "time_rho_high", "timed"]
    )


def worth(answers: pd.DataFrame, which: pd.Series) -> tuple[int, int]:
    """Count answers of a kind, in as many trials as tell as much if each is an exploration of its own.

    An observer's answers at several times of one exploration are alike, so that they tell less than as many trials: by
    the ratio of the variance of their mean to that of independent ones (the design effect, Kish 1965).

    Args:
        answers: of a group.
        which: 1 or 0 of each, whether it is of the kind.

    Returns:
        Those of the kind, as their weights have it, and of how many trials.
    """
    weights, there = answers["weight"].to_numpy(), which.to_numpy(dtype=np.float64)
    share, whole = float(np.average(there, weights=weights)), len(answers)
    explored = answers.groupby(["object", "exploration"], sort=False).ngroup().to_numpy()
    different = len(np.unique(explored))
    if different < whole:
        cells = answers.groupby(["object", "seconds"], sort=False).ngroup().to_numpy()
        usual = np.bincount(cells, there) / np.bincount(cells)
        apart = weights * (there - usual[cells])
        alone = float((apart**2).sum())
        effect = float((np.bincount(explored, apart) ** 2).sum()) / alone if alone > 0.0 else math.inf
        whole = round(whole / min(max(effect, 1.0), whole / different))
    return round(share * whole), whole


def _subjects(table: pd.DataFrame) -> list[tuple[str, np.ndarray]]:
    return [(str(name), (table["subject"] == name).to_numpy()) for name in dict.fromkeys(table["subject"])]
