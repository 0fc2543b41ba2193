"""People beside the observers: what these believed through time, and what is left of it.

M cells, S sigmas, R repeats, T times, C names.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from hypothesis import strategies as st

from haptic_lab.people.courses import Courses
from observer.shape.fading import faded
from tests.properties import samples
from tests.properties.entry import Entry
from tests.properties.files import archives, file, out
from tests.properties.parameters import Parameter, array, number
from tests.properties.rule import Allowed
from tests.properties.strategies import odd_arrays

M, S, R, T, C = SHAPE = 2, 2, 3, 4, 2
HELD: dict[str, Any] = {
    "names": np.array(["cube", "sphere"]),
    "objects": np.array(["cube", "sphere"]),
    "conditions": np.array(["", "cold"]),
    "sigmas": np.array([1.0, 3.0]),
    "seconds": np.array([0.0, 0.1, 0.2, 0.3]),
    "log_posterior": np.full(SHAPE, -np.log(C)),
}
FILE: dict[str, Any] = {"format": np.array(1), **HELD}


def _texts(name: str) -> Parameter:
    odd = [None, "ab", [], [1, 2], ["a", "a"], ["a"], ["ü", "\ud800"], [["a"], ["b"]], 3]
    return Parameter(st.just(list(HELD[name])), st.sampled_from(odd))


def _saved(**changes: Any) -> Any:
    """What is kept is read again, bit for bit."""
    made = Courses(**{**{name: list(each) for name, each in HELD.items()}, **changes})
    made.save(out("courses.npz"))
    again = Courses.load(out("courses.npz"))
    assert again.cells == made.cells
    assert again.log_posterior.tobytes() == made.log_posterior.tobytes()
    assert [again.cell(*each) for each in again.cells] == list(range(len(again.cells)))
    return again.sigmas, again.seconds


def _read(path: Any) -> Any:
    found = Courses.load(path)
    return found.sigmas, found.seconds, found.cells


ENTRIES: dict[str, Entry] = {
    "observer.shape.fading.faded": Entry(
        lambda log_posterior, **call: np.exp(faded(log_posterior, **call)),
        {
            "log_posterior": array((R, T, C), -3.0, 0.0).always,
            "seconds": Parameter(st.just(HELD["seconds"]), array((T,)).odd).always,
            "memory_seconds": number(0.01, 100.0).always,
            "prior": array((C,), -3.0, 0.0),
        },
        Allowed(nan=True, words=("log_posterior", "seconds", "prior")),
    ),
    "haptic_lab.people.courses.Courses": Entry(
        _saved,
        {
            **{name: _texts(name) for name in ("names", "objects", "conditions")},
            "sigmas": Parameter(st.just([1.0, 3.0]), array((S,)).odd),
            "seconds": Parameter(st.just([0.0, 0.1, 0.2, 0.3]), array((T,)).odd),
            "log_posterior": Parameter(st.just(HELD["log_posterior"]), odd_arrays(SHAPE)),
        },
        Allowed(words=("each name", "each cell", "object", "log_posterior")),
        weight=0.5,
    ),
    "haptic_lab.people.courses.Courses.load": Entry(
        _read,
        {"path": file(".npz", samples.npz(FILE), also=archives(FILE)).always},
        Allowed(files=True, words=("input",)),
        weight=0.5,
    ),
}
