"""What an argument may be, and what it may not be but is: one line for each argument of an entry point."""

from __future__ import annotations

from collections.abc import Callable, Collection, Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
from hypothesis import strategies as st

from tests.properties.strategies import SEEDS, Shape, Strategy, odd_arrays, odd_names, odd_numbers, odd_paths

FEW = 3  # arguments of a call that are odd, at most


@dataclass(frozen=True)
class Parameter:
    """`valid` values of an argument, and `odd` ones; `needed`: whether a call without it is none."""

    valid: Strategy
    odd: Strategy
    needed: bool = False

    @property
    def always(self) -> Parameter:
        """The same, in every call."""
        return Parameter(self.valid, self.odd, needed=True)


def number(low: float, high: float) -> Parameter:
    """A number, of which those in [`low`, `high`] are cheap and good for anything."""
    return Parameter(st.floats(low, high), odd_numbers)


def spread(high: float, joints: int) -> Parameter:
    """An SD in [0, `high`] of all joints, or of each."""
    each = array((joints,), 0.0, high)
    return Parameter(number(0.0, high).valid | each.valid, odd_numbers | each.odd)


def integer(low: int, high: int) -> Parameter:
    """An integer likewise."""
    return Parameter(st.integers(low, high), odd_numbers)


def switch() -> Parameter:
    """True or False."""
    return Parameter(st.booleans(), odd_numbers)


def name(valid: Collection[str]) -> Parameter:
    """One of a registry's names."""
    return Parameter(st.sampled_from(sorted(valid)), odd_names)


def path(valid: Strategy) -> Parameter:
    """A file, `valid` ones being there."""
    return Parameter(valid, odd_paths)


def array(shape: Shape, low: float = -1.0, high: float = 1.0, type_: str = "float64") -> Parameter:
    """An array of `shape` with entries in [`low`, `high`]."""

    def build(seed: int) -> np.ndarray:
        return np.random.default_rng(seed).uniform(low, high, shape).astype(type_)

    return Parameter(st.builds(build, SEEDS), odd_arrays(shape))


def binary(shape: Shape) -> Parameter:
    """An array of zeros and ones."""

    def build(seed: int) -> np.ndarray:
        rng = np.random.default_rng(seed)
        return (rng.random(shape) < rng.random()).astype(("bool", "int8", "float64")[seed % 3])

    return Parameter(st.builds(build, SEEDS), odd_arrays(shape))


def one_of(*values: Any) -> Parameter:
    """One of a few `values`, made by calling those that can be called."""
    made = st.sampled_from(values).map(lambda each: each() if callable(each) and not isinstance(each, type) else each)
    return Parameter(made, st.one_of(odd_numbers, odd_names))


def one_of_these(*values: Any) -> Parameter:
    """One of a few `values`, and nothing else."""
    return Parameter(st.sampled_from(values), st.sampled_from(values))


def seed() -> Parameter:
    """Where chance begins."""
    return Parameter(st.one_of(st.none(), SEEDS), odd_numbers)


def several(of: Parameter, least: int = 1, most: int = 3) -> Parameter:
    """A list of what `of` is."""
    valid = st.lists(of.valid, min_size=least, max_size=most)
    return Parameter(valid, st.one_of(st.lists(of.odd, max_size=most), of.odd, odd_numbers))


def given(parameters: Mapping[str, Parameter]) -> Strategy:
    """Calls by keyword: up to `FEW` arguments odd, the others valid or left out."""

    @st.composite
    def draw_call(draw: Callable[[Strategy], Any]) -> dict[str, Any]:
        names = list(parameters)
        count = min(len(names), draw(st.sampled_from([0, 1, 1, 1, 1, 1, 2, FEW])))
        odd = set(draw(st.permutations(names))[:count]) if 0 < count < len(names) else set(names[: count or 0])
        call = {}
        for key, parameter in parameters.items():
            if key in odd:
                call[key] = draw(parameter.odd)
            elif parameter.needed or draw(st.integers(0, 3)) == 0:
                call[key] = draw(parameter.valid)
        return call

    return draw_call()
