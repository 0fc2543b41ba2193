"""Models of subjects: an ideal observer with limits, each limit a parameter that is found or held fixed."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, field

import numpy as np

from haptic_env import readable, validate
from haptic_env.arrays import Array
from haptic_lab.people.courses import Courses
from observer.shape import fading

AT_LONGEST = 3.0  # times the longest course: a memory beyond that cannot be told from none that fades
USUAL: dict[str, float] = {  # the ideal's, who waits until it is asked
    "memory_seconds": math.inf,
    "decision_noise": 0.0,
    "stop_at": math.inf,
    "price": 0.0,
    "lapse": 0.0,
}
UNITS = {
    "sigma_deg": "degrees",
    "memory_seconds": "s",
    "decision_noise": "nats",
    "stop_at": "",
    "price": "per s",
    "lapse": "",
}
STEPS = {"sigma_deg": 40, "memory_seconds": 22, "decision_noise": 14, "stop_at": 30, "price": 20, "lapse": 25}
RANGES = {
    "memory_seconds": (0.3, math.nan),
    "decision_noise": (0.2, 20.0),
    "stop_at": (math.nan, 1.0),  # from a guess
    "price": (0.003, 1.0),
    "lapse": (0.0, 0.3),
}
RULES = ("stop_at", "price")  # of when it answers: with one of them models tell of times
LOGARITHMIC = ("sigma_deg", "memory_seconds", "decision_noise", "price")  # equally probable beforehand in proportion
PARAMETERS = tuple(UNITS)
MODELS: dict[str, tuple[str, ...]] = {
    "ideal": ("sigma_deg",),
    "memory": ("sigma_deg", "memory_seconds"),
    "noise": ("sigma_deg", "decision_noise"),
    "lapse": ("sigma_deg", "lapse"),
    "limits": ("sigma_deg", "memory_seconds", "lapse"),
    "all": ("sigma_deg", "memory_seconds", "decision_noise", "lapse"),
    "stop_at": ("sigma_deg", "stop_at", "lapse"),
}
ASKED = tuple(name for name, free in MODELS.items() if set(free).isdisjoint(RULES))  # which can be compared


@dataclass(frozen=True)
class Grid:
    """Values of a parameter, all equally probable before anything is known.

    Attributes:
        low: the least.
        high: the largest; as `low`: the parameter is fixed.
        steps: how many.
        logarithmic: whether they are spaced in proportion.
    """

    low: float
    high: float
    steps: int
    logarithmic: bool

    __repr__ = readable.line

    @property
    def fixed(self) -> bool:
        """Whether there is one value alone."""
        return self.low == self.high

    @property
    def edges(self) -> Array:
        """(steps + 1,) on the scale on which the steps are alike."""
        return np.linspace(self._scaled(self.low), self._scaled(self.high), self.steps + 1)

    @property
    def values(self) -> Array:
        """(steps,) in the middle of each step."""
        if self.fixed:
            return np.array([self.low])
        middle = 0.5 * (self.edges[1:] + self.edges[:-1])
        return np.exp(middle) if self.logarithmic else middle

    def quantiles(self, weights: Array, shares: tuple[float, ...]) -> Array:
        """Find where the probability is split.

        Args:
            weights: (steps,) probability of each step.
            shares: of probability, below.

        Returns:
            A value for each share.
        """
        if self.fixed:
            return np.full(len(shares), self.low)
        below = np.concatenate(([0.0], np.cumsum(weights))) / weights.sum()
        found = np.interp(shares, below, self.edges)
        return np.exp(found) if self.logarithmic else found

    def drawn(self, rng: np.random.Generator) -> float:
        """Draw a value.

        Args:
            rng: that draws.

        Returns:
            One within the range, all alike on the scale of the steps.
        """
        if self.fixed:
            return self.low
        value = rng.uniform(self._scaled(self.low), self._scaled(self.high))
        return math.exp(value) if self.logarithmic else value

    def _scaled(self, value: float) -> float:
        return math.log(value) if self.logarithmic else value


@dataclass(frozen=True)
class Model:
    """An observer that may explain a subject.

    Attributes:
        name: by which it is told of.
        courses: of the ideal observer that it is made from.
        free: parameters that are found.
        ranges: (low, high) of parameters, within which they are found, or the one value at which they are held.

    Raises:
        ValueError: for a parameter that there is not, or a range out of what can be.
    """

    name: str
    courses: Courses = field(repr=False)
    free: tuple[str, ...]
    ranges: Mapping[str, tuple[float, float]] = field(default_factory=dict)

    __repr__ = readable.line

    def __post_init__(self) -> None:
        for each in (*self.free, *self.ranges):
            validate.choice("parameter", each, PARAMETERS)
        if len(self._rules) > 1:
            raise ValueError("either stop_at or price says when a subject answers, and not both")

    @classmethod
    def named(cls, kind: str, courses: Courses, ranges: Mapping[str, tuple[float, float]] | None = None) -> Model:
        """Make one of `MODELS`.

        Args:
            kind: its name.
            courses: of the ideal observer that it is made from.
            ranges: of some of its parameters, in place of the usual; of others the value at which they are held.

        Returns:
            The model.

        Raises:
            ValueError: for a name that is none, and ranges out of what can be.
        """
        return cls(kind, courses, MODELS[validate.choice("model", kind, MODELS)], dict(ranges or {}))

    @property
    def grids(self) -> dict[str, Grid]:
        """Of each of `PARAMETERS`, in order."""
        return {name: self._grid(name) for name in PARAMETERS}

    @property
    def parameters(self) -> tuple[str, ...]:
        """Those that are found."""
        return tuple(name for name, grid in self.grids.items() if not grid.fixed)

    @property
    def timed(self) -> bool:
        """Whether it tells when a subject answers, which is then explained as well."""
        return bool(self._rules)

    @property
    def _rules(self) -> list[str]:
        """Of stopping, those that it has."""
        return [name for name, grid in self.grids.items() if name in RULES and grid.values[0] != USUAL[name]]

    def _grid(self, name: str) -> Grid:
        low, high = _ends(name, self.ranges.get(name, self._usual(name)), self.courses)
        return Grid(low, high, 1 if low == high else STEPS[name], low != high and name in LOGARITHMIC)

    def _usual(self, name: str) -> tuple[float, float]:
        if name == "sigma_deg":
            return float(self.courses.sigmas[0]), float(self.courses.sigmas[-1])
        if name not in self.free:
            return USUAL[name], USUAL[name]
        low, high = RANGES[name]
        if name == "stop_at":
            return 1.0 / len(self.courses.names), high
        return low, AT_LONGEST * float(self.courses.seconds[-1]) if math.isnan(high) else high


def _ends(name: str, given: tuple[float, float], courses: Courses) -> tuple[float, float]:
    """The range of a parameter, checked."""
    told = f"range of {name}"
    low, high = (_end(told, name, each, courses) for each in given)
    if low > high:
        raise ValueError(f"{told} must have its least value first, got {low:g} to {high:g}")
    if low != high and high == math.inf:
        raise ValueError(f"{told} must end at a finite number, got {low:g} to {high:g}")
    if low != high and low == 0.0 and name in LOGARITHMIC:
        raise ValueError(f"{told} must begin above 0, got {low:g} to {high:g}")
    return low, high


def _end(told: str, name: str, value: float, courses: Courses) -> float:
    if name == "sigma_deg":
        first, last = float(courses.sigmas[0]), float(courses.sigmas[-1])
        return validate.number(f"{told}, where there are courses,", value, first, last, unit="degrees")
    if name == "memory_seconds":
        return fading.check(value)
    if name == "stop_at":
        return value if value == math.inf else validate.number(told, value, high=1.0, above=0.0)
    return validate.number(told, value, 0.0, 1.0 if name == "lapse" else 1e3 if name == "price" else 1e6)
