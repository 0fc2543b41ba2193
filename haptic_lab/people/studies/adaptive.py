"""The threshold of an observer with few trials: QUEST+ (Watson 2017) chooses what is felt next.

Each trial is another two explorations, of seeds that no other trial has; they are kept like those of a sweep, and the
same choices are made again from there.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np
import pandas as pd

from haptic_env import extras, validate
from haptic_lab.people.studies.discrimination import evidence
from haptic_lab.people.studies.presets import Study
from haptic_lab.people.studies.running import ConditionPlan
from haptic_lab.sweeps.results import Results
from haptic_lab.sweeps.tasks import SweepTask
from haptic_lab.sweeps.workers import on_one_core

SLOPES = (0.5, 0.75, 1.0, 1.5, 2.0, 3.0)  # of a Weibull function
LAPSES = (0.0, 0.02, 0.05)
FINE = 61  # thresholds that are held possible
MARGIN = 2.0  # by which they go beyond the stimuli, at both ends
TRIALS = 60
MOST_TRIALS = 10_000


@dataclass(frozen=True)
class Staircase:
    """What was felt and answered, and the threshold.

    Attributes:
        values: of the comparison in each trial.
        answers: whether each was right.
        threshold: a value of the study's parameter, where half of what can be better than a guess is right.
        low: the end of its 95 % interval that is nearer to the standard.
        high: the other.
    """

    values: tuple[float, ...]
    answers: tuple[bool, ...]
    threshold: float
    low: float
    high: float


def staircase(study: Study, answer: Callable[[float, int], bool], trials: int = TRIALS) -> Staircase:
    """Find a threshold.

    Args:
        study: a discrimination.
        answer: says whether the answer to a comparison of a value is right, in the trial of a number from 0.
        trials: how many.

    Returns:
        What was asked, and the threshold.

    Raises:
        ValueError: for a number of trials out of range.
        ImportError: where questplus is missing.
    """
    validate.integer("trials", trials, 1, MOST_TRIALS)
    questplus = extras.load("questplus", "people", "an adaptive staircase")
    distance = {abs(value - study.standard): value for value, _ in study.comparisons}
    logs = np.log(list(distance))
    quest = questplus.QuestPlus(
        stim_domain={"intensity": np.exp(logs)},
        param_domain={
            "threshold": np.exp(np.linspace(logs.min() - math.log(MARGIN), logs.max() + math.log(MARGIN), FINE)),
            "slope": np.array(SLOPES),
            "lower_asymptote": np.array([study.guess]),
            "lapse_rate": np.array(LAPSES),
        },
        outcome_domain={"response": ["right", "wrong"]},
        func="weibull",
        stim_scale="linear",
    )
    values, answers = [], []
    for number in range(trials):
        felt = float(quest.next_stim["intensity"])
        value = distance[min(distance, key=lambda each: abs(each - felt))]
        was_right = bool(answer(value, number))
        quest.update(stim={"intensity": felt}, outcome={"response": "right" if was_right else "wrong"})
        values.append(value)
        answers.append(was_right)
    at, low, high = _half_way(quest)
    sign = math.copysign(1.0, values[0] - study.standard)
    return Staircase(tuple(values), tuple(answers), *(study.standard + sign * each for each in (at, low, high)))


def _half_way(quest: Any) -> tuple[float, float, float]:
    """Where half of what can be better than a guess is right: median and 95 % interval of the posterior."""
    posterior = quest.posterior.sum(["lower_asymptote", "lapse_rate"]).transpose("threshold", "slope")
    thresholds, slopes = (np.asarray(posterior[each], float) for each in ("threshold", "slope"))
    # Weibull's own threshold is where 1 - 1/e of it is.
    at = (thresholds[:, None] * math.log(2.0) ** (1.0 / slopes)).ravel()
    order = np.argsort(at)
    below = np.cumsum(np.asarray(posterior, float).ravel()[order])
    low, middle, high = (float(at[order][np.searchsorted(below, q * below[-1])]) for q in (0.025, 0.5, 0.975))
    return middle, low, high


def observed(study: Study, plan: ConditionPlan, results: Results, observer: str) -> Callable[[float, int], bool]:
    """Make an observer that answers.

    Args:
        study: a discrimination.
        plan: one condition of it, of one sigma.
        results: what was explored already, and where it is kept.
        observer: its name.

    Returns:
        What `staircase` asks.
    """
    shapes = dict(study.stimuli)
    (condition,) = plan.sweep.conditions
    settings = plan.sweep.settings
    needed = max(study.intervals, 2)

    def evidence_of(shape: str, seed: int, comparison: str) -> float:
        task = SweepTask(settings, condition, shape, seed)
        if task.key not in results.trials:
            with on_one_core():
                results.append(plan.work([task], ())[0])
        rows = pd.DataFrame(results.trials[task.key])
        return float(evidence(rows[rows["observer"] == observer], comparison, study.standard_shape)[0])

    def answer(value: float, number: int) -> bool:
        comparison, first = shapes[value], settings.first_seed + needed * number
        if study.intervals == 1:
            felt = comparison if number % 2 else study.standard_shape
            return (evidence_of(felt, first, comparison) > 0) == (felt == comparison)
        theirs = evidence_of(comparison, first, comparison)
        others = [evidence_of(study.standard_shape, first + i, comparison) for i in range(1, needed)]
        return theirs > max(others)

    return answer
