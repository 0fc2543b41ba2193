"""People beside the observers: what these believed through time, and what is left of it.

M cells, S sigmas, R repeats, T times, C names.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from hypothesis import strategies as st

from haptic_lab.people import comparing, fitting
from haptic_lab.people.courses import Courses
from haptic_lab.people.decisions import Decision
from haptic_lab.people.models import MODELS, PARAMETERS, Model
from haptic_lab.people.simulated import simulate, subject_of
from observer.shape.fading import faded
from tests.properties import samples
from tests.properties.entry import Entry
from tests.properties.files import archives, file, out
from tests.properties.parameters import Parameter, array, integer, number
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


def _courses() -> Courses:
    rng = np.random.default_rng(0)
    believed = rng.normal(size=SHAPE)
    believed -= np.logaddexp.reduce(believed, axis=-1, keepdims=True)
    held = {name: list(each) for name, each in HELD.items()}
    return Courses(**{**held, "conditions": ["", ""], "log_posterior": believed})


def _decided(cell: Any, sigma: Any, seconds: Any, **call: Any) -> Any:
    return Decision(**call).answers(_courses(), cell, sigma, seconds)


def _answered(trials: Any, seconds: Any, seed: int = 0, **values: Any) -> Any:
    return simulate(_courses(), subject_of(values), trials, seconds, np.random.default_rng(seed))


def _modelled(kind: Any, name: Any, low: Any, high: Any) -> Any:
    model = Model.named(kind, _courses(), {name: (low, high)})
    return [grid.values for grid in model.grids.values() if not grid.fixed]


def _fitted(draws: Any = 0, seed: Any = 0) -> Any:
    table = _answered(12, [0.1, 0.3], sigma_deg=2.0)
    return fitting.fit(Model.named("lapse", _courses()), table, draws=draws, seed=seed).interval("lapse")


def _compared(draws: Any = 0, seed: Any = 0) -> Any:
    models = [Model.named(name, _courses()) for name in ("ideal", "lapse")]
    table = _answered(12, [0.1, 0.3], sigma_deg=2.0)
    return comparing.compare(models, table, draws=draws, seed=seed).table()["nats"].to_numpy()


LIMITS = {
    "memory_seconds": number(0.1, 100.0),
    "decision_noise": number(0.0, 10.0),
    "lapse": number(0.0, 1.0),
}
TIMES = Parameter(st.sampled_from([[0.1], [0.0, 0.3]]), array((2,)).odd)
ENTRIES: dict[str, Entry] = {
    "haptic_lab.people.decisions.Decision": Entry(
        _decided,
        {
            "cell": integer(0, M - 1).always,
            "sigma": number(1.0, 3.0).always,
            "seconds": number(0.01, 0.3).always,
            **LIMITS,
            "stop_at": number(0.3, 1.0),
        },
        Allowed(words=("seconds", "sigma", "price")),
    ),
    "haptic_lab.people.simulated.subject_of": Entry(
        lambda **values: list(subject_of(values).truth.values())[:1],
        {"sigma_deg": number(1.0, 3.0).always, **LIMITS},
    ),
    "haptic_lab.people.simulated.simulate": Entry(
        lambda **call: len(_answered(**call)),
        {"trials": integer(1, 20).always, "seconds": TIMES.always, "sigma_deg": number(1.0, 3.0).always},
        Allowed(words=("seconds", "sigma")),
    ),
    "haptic_lab.people.models.Model": Entry(
        _modelled,
        {
            "kind": Parameter(st.sampled_from(list(MODELS)), st.sampled_from(["idle", "", 3, None])).always,
            "name": Parameter(st.sampled_from(PARAMETERS), st.sampled_from(["sigma", "", 3, None])).always,
            "low": number(1.0, 1.0).always,
            "high": number(1.0, 1.0).always,
        },
        Allowed(words=("range", "model", "parameter", "memory_seconds")),
    ),
    "haptic_lab.people.fitting.fit": Entry(_fitted, {"draws": integer(0, 8), "seed": integer(0, 100)}),
    "haptic_lab.people.comparing.compare": Entry(_compared, {"draws": integer(0, 8), "seed": integer(0, 100)}),
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
