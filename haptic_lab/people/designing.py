"""How many trials a subject must do so that two observers can be told apart."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field

import numpy as np
import pandas as pd

from haptic_env import readable, validate
from haptic_lab.analysis.statistics import share_interval
from haptic_lab.people.comparing import Comparison, check_models, parted
from haptic_lab.people.models import Model
from haptic_lab.people.simulated import drawn, simulate

ROUNDS = 100  # subjects of each observer


@dataclass
class Design:
    """Simulated subjects of two observers, each with a table of many trials, of which fewer may be looked at.

    Attributes:
        models: the two.
        most: trials of each table.
        found: of each round and true model: at which numbers of trials the true model explained the subject best.
    """

    models: Sequence[Model]
    most: int
    found: list[tuple[str, dict[int, bool]]] = field(default_factory=list)

    __repr__ = readable.line

    @property
    def numbers(self) -> list[int]:
        """Of trials that are tried: a fifth more each, at most."""
        return numbers(self.most)

    def table(self) -> pd.DataFrame:
        """Put down how often the true observer is found.

        Returns:
            A row for each number of `trials`: `power`, the share of subjects of whom the true observer is found, of the
            model with the lower one, with its 95 % interval (Wilson), and `subjects` of that model.
        """
        rows = []
        for trials in self.numbers:
            of_model = {
                model.name: [told[trials] for name, told in self.found if name == model.name] for model in self.models
            }
            name = min(of_model, key=lambda each: float(np.mean(of_model[each])))
            right, whole = sum(of_model[name]), len(of_model[name])
            low, high = share_interval(right, whole)
            rows.append({"trials": trials, "power": right / whole, "low": low, "high": high, "subjects": whole})
        return pd.DataFrame(rows)

    def needed(self, power: float) -> tuple[float, float, float]:
        """Say how many trials a subject must do.

        Args:
            power: the share of subjects of whom the true observer shall be found.

        Returns:
            Trials, and the two ends of the 95 % interval: where the interval of the power ends above it, and where it
            begins above it; inf: more than were tried. Between the numbers that were tried it is interpolated.

        Raises:
            ValueError: for a power that cannot be.
        """
        validate.number("power", power, 0.5, 0.999)
        table = self.table()
        found = [
            _crossing(table["trials"].to_numpy(), table[name].to_numpy(), power) for name in ("power", "high", "low")
        ]
        return found[0], found[1], found[2]


def numbers(most: int) -> list[int]:
    """List numbers of trials to be tried.

    Args:
        most: the largest.

    Returns:
        Numbers from 10 on, a quarter more each.
    """
    found = [most]
    while found[-1] > 12:
        found.append(max(round(found[-1] / 1.25), 10))
    return found[::-1]


def design(
    models: Sequence[Model], most: int, seconds: Sequence[float], *, rounds: int = ROUNDS, seed: int = 0
) -> Iterator[Design]:
    """Simulate subjects of two observers, and see with how many of their trials they are told apart.

    A subject's parameters are drawn from its model's ranges; it explores as one part of the repeats did, and both
    models are fitted by the other.

    Args:
        models: two.
        most: trials of a subject.
        seconds: s, after which it is asked.
        rounds: subjects of each observer.
        seed: of chance.

    Yields:
        What is known after each round.

    Raises:
        ValueError: for what models, trials and times cannot be.
    """
    check_models(models)
    if len(models) != 2:
        raise ValueError(f"two models are told apart, got {len(models)}")
    validate.integer("trials", most, 20, 100_000)
    validate.integer("rounds", rounds, 2, 100_000)
    rng = np.random.default_rng(seed)
    result = Design(models, most)
    for _ in range(rounds):
        answering, prepared = parted(models, seconds, rng)
        for model in answering:
            table = simulate(model.courses, drawn(model, rng), most, seconds, rng)
            told = {}
            for trials in numbers(most):
                part = table.iloc[:trials]
                told[trials] = Comparison({each.model.name: each.fit(part) for each in prepared}).best == model.name
            result.found.append((model.name, told))
        yield result


def _crossing(trials: np.ndarray, shares: np.ndarray, power: float) -> float:
    """The number of trials from which on the shares stay above the power."""
    below = np.flatnonzero(shares < power)
    if not below.size:
        return float(trials[0])
    last = int(below[-1])
    if last + 1 == len(trials):
        return float("inf")
    part = (power - shares[last]) / (shares[last + 1] - shares[last])
    return float(np.exp(np.log(trials[last]) + part * np.log(trials[last + 1] / trials[last])))
