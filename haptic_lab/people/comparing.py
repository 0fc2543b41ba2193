"""Which observer explains a subject best: each answer's log probability to a model that was told all other trials.

Leave-one-out is exact here: of a posterior over θ, p(answer | all others) = 1 / E[1 / p(answer | θ)].
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np
import pandas as pd

from haptic_env import readable, validate
from haptic_lab.analysis.statistics import interval, share_interval
from haptic_lab.people.fitting import DRAWS, Fit, Prepared, fit
from haptic_lab.people.models import Model
from haptic_lab.people.simulated import drawn, halves, simulate


@dataclass(frozen=True, eq=False)
class Comparison:
    """Models beside each other.

    Attributes:
        fits: of the same trials, by the model's name.
    """

    fits: Mapping[str, Fit]

    __repr__ = readable.line

    @property
    def best(self) -> str:
        """The name of the model with the highest cross-validated log likelihood."""
        return max(self.fits, key=lambda name: float(self.fits[name].cross_validated.sum()))

    def table(self) -> pd.DataFrame:
        """Put down how well each model explains the subject.

        Returns:
            A row for each model, the best first: `nats`, log likelihood of a trial that it was not told of; the
            `difference` from the best with its 95 % interval (Student's t, over trials); `log_evidence` of all trials;
            `parameters` that were found.
        """
        best = self.fits[self.best].cross_validated
        rows = []
        for name, each in self.fits.items():
            difference, low, high, _ = interval(each.cross_validated - best)
            rows.append(
                {
                    "model": name,
                    "nats": float(each.cross_validated.mean()),
                    "difference": difference,
                    "difference_low": low,
                    "difference_high": high,
                    "log_evidence": each.log_evidence,
                    "parameters": len(each.model.parameters),
                    "trials": each.trials,
                }
            )
        return pd.DataFrame(rows).sort_values("difference", ascending=False, ignore_index=True, kind="stable")


def compare(models: Sequence[Model], table: pd.DataFrame, *, draws: int = DRAWS, seed: int = 0) -> Comparison:
    """Fit several models to one subject.

    Args:
        models: of different names.
        table: (n,) trials, as `read_trials` has them.
        draws: as of `fit`.
        seed: as of `fit`.

    Returns:
        The comparison.

    Raises:
        ValueError: for trials that the courses of a model do not have, and for models of one name.
    """
    check_models(models)
    return Comparison({model.name: fit(model, table, draws=draws, seed=seed) for model in models})


def check_models(models: Sequence[Model]) -> None:
    """Check models that are to be compared.

    Args:
        models: of different names.

    Raises:
        ValueError: where names are the same, or what may be answered differs.
    """
    if len(models) < 2:
        raise ValueError(f"models must be 2 at least to be compared, got {len(models)}")
    names = [model.name for model in models]
    if len(set(names)) < len(names):
        raise ValueError(f"models must have names of their own, got {', '.join(names)}")
    if len({model.timed for model in models}) > 1:
        timed, asked = (validate.listed(each.name for each in models if each.timed is told) for told in (True, False))
        raise ValueError(f"models tell when a subject answers ({timed}) or wait until it is asked ({asked}): not both")
    for model in models[1:]:
        if set(model.courses.names) != set(models[0].courses.names):
            told = f"{', '.join(models[0].courses.names)} of {names[0]}, {', '.join(model.courses.names)}"
            raise ValueError(f"models must have the same names to answer, got {told} of {model.name}")


def recoveries(
    models: Sequence[Model],
    trials: int,
    seconds: Sequence[float],
    subjects: int,
    *,
    draws: int = 0,
    seed: int = 0,
) -> Iterator[tuple[str, str]]:
    """Simulate subjects of each model, and see which model explains each of them best.

    Who is simulated explores as one part of the repeats did; models are fitted by the other. A subject's parameters are
    drawn from the model's ranges.

    Args:
        models: of different names.
        trials: of each subject.
        seconds: s, after which it is asked.
        subjects: of each model.
        draws: as of `fit`.
        seed: of chance.

    Yields:
        The model that a subject is of, and that which explains it best.

    Raises:
        ValueError: for what models, trials and times cannot be.
    """
    check_models(models)
    validate.integer("subjects", subjects, 1, 100_000)
    rng = np.random.default_rng(seed)
    for _ in range(subjects):
        answering, prepared = parted(models, seconds, rng, draws)
        for model in answering:
            table = simulate(model.courses, drawn(model, rng), trials, seconds, rng)
            yield model.name, Comparison({each.model.name: each.fit(table) for each in prepared}).best


def parted(
    models: Sequence[Model], seconds: Sequence[float], rng: np.random.Generator, draws: int = 0
) -> tuple[list[Model], list[Prepared]]:
    """Part the repeats of models: subjects are simulated by the ones, and fitted by the others.

    Args:
        models: of different names.
        seconds: s, at which subjects are asked.
        rng: that draws which; courses with as many repeats are parted alike.
        draws: as of `fit`.

    Returns:
        Models of the first parts, and those of the others, prepared for any answers.
    """
    seed = int(rng.integers(2**31))
    parts = {id(each.courses): halves(each.courses, np.random.default_rng(seed)) for each in models}
    first, second = ([replace(model, courses=parts[id(model.courses)][half]) for model in models] for half in (0, 1))
    return first, [Prepared(model, seconds, draws=draws, seed=seed) for model in second]


def recovery_table(found: Sequence[tuple[str, str]], names: Sequence[str]) -> pd.DataFrame:
    """Count what `recoveries` found.

    Args:
        found: pairs of the true model, and the best.
        names: of the models.

    Returns:
        A row for each pair: `true`, `best`, `subjects`, `share` of the true model's, with its 95 % interval (Wilson).
    """
    rows = []
    for true in names:
        of_true = [best for name, best in found if name == true]
        for best in names:
            count, whole = of_true.count(best), len(of_true)
            low, high = share_interval(count, whole)
            share = count / whole if whole else math.nan
            rows.append({"true": true, "best": best, "subjects": count, "share": share, "low": low, "high": high})
    return pd.DataFrame(rows)
