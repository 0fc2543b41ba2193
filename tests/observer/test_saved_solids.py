"""An observer that was told what the object may be is saved and goes on to the same bits, with the same solids only."""

from __future__ import annotations

import json
from collections import deque
from typing import Any

import numpy as np
import pytest

from haptic_env import shapes
from haptic_env.grid import Grid
from haptic_env.shapes.base import Solid
from observer import HapticSLAM, ShapePosterior
from observer.saved_state import CHANGED
from observer.surface import Surface
from observer.surface.felt_shape import FeltShape

SOLIDS: dict[str, dict[str, Any]] = {
    "exactly": {"candidates": ["cube", "sphere"]},
    "one": {"candidates": ["cube"]},
    "or none": {"candidates": ["cube", "sphere"], "none": 0.2},
    "of unknown size or none": {"candidates": ["cube", "cone"], "none": 0.2, "variants": 5, "size_jitter": 0.1},
    "of unknown size": {
        "variants": 5,
        "size_jitter": 0.1,
        "candidates": ["cube", "cone"],
        "yaw_jitter": 20.0,
        "position_jitter": 0.005,
    },
    "forgotten": {"candidates": ["cube", "sphere"], "memory_seconds": 1.0, "stride": 1},
    "at many poses": {"samples": 3, "candidates": ["cube", "cylinder"]},
}


@pytest.fixture(scope="module")
def trial(explore):
    """Two fingers about a cube, which they touch."""
    return explore("cube", 50, seed=3)


def turns(trial, first: int, last: int) -> list:
    return list(zip(trial.torque, trial.felt, trial.contacts, strict=True))[first:last]


def made(trial, solids: dict[str, Any], steps: int, **keywords: Any) -> HapticSLAM:
    observer = HapticSLAM(trial.hand, particles=2, solids=ShapePosterior(trial.hand, **solids), **keywords)
    observer.reset(seed=5)
    for turn in turns(trial, 0, steps):
        observer.step(*turn)
    return observer


@pytest.mark.parametrize("steps", [5, 35])
@pytest.mark.parametrize("which", SOLIDS)
def test_it_goes_on_as_the_original(tmp_path, trial, bits, which, steps):
    told = {"bias_deg": 2.0} if which == "one" else {}
    one, other = (made(trial, SOLIDS[which], steps, **told) for _ in range(2))
    other.save(tmp_path / "state.npz")
    solids = ShapePosterior(trial.hand, **SOLIDS[which])
    twin = HapticSLAM.load(tmp_path / "state.npz", solids=solids)
    assert _same("known", other._known, twin._known) > 100
    for turn in turns(trial, steps, 50):
        expected = bits(one.step(*turn))
        assert bits(other.step(*turn)) == expected
        assert bits(twin.step(*turn)) == expected
    assert [bits(belief) for belief in one.flush()] == [bits(belief) for belief in twin.flush()]
    assert bits(one.reset(seed=1)) == bits(twin.reset(seed=1))
    np.testing.assert_array_equal(solids.posterior, ShapePosterior(trial.hand, **SOLIDS[which]).posterior)


def _same(name: str, one: Any, other: Any) -> int:
    """Compare all that a trial changes; how many numbers were compared."""
    if isinstance(one, np.ndarray):
        np.testing.assert_array_equal(one, other, err_msg=name)
        return one.size
    if type(one) in CHANGED:
        return sum(_same(f"{name}.{key}", each, vars(other)[key]) for key, each in vars(one).items())
    if isinstance(one, list | tuple | deque):
        assert len(one) == len(other), name
        if isinstance(one, deque):
            assert one.maxlen == other.maxlen
        return sum(_same(f"{name}.{k}", *each) for k, each in enumerate(zip(one, other, strict=True)))
    if isinstance(one, bool | int | float | str | np.generic | None):
        assert one == other, name
    return 1


def test_one_that_never_began_is_kept(tmp_path, trial, bits):
    observer = HapticSLAM(trial.hand, particles=2, solids=ShapePosterior(trial.hand))
    observer.save(tmp_path / "state.npz")
    twin = HapticSLAM.load(tmp_path / "state.npz", trial.hand, solids=ShapePosterior(trial.hand))
    for each in (observer, twin):
        each.reset(seed=0)
    assert [bits(observer.step(*turn)) for turn in turns(trial, 0, 15)] == [
        bits(twin.step(*turn)) for turn in turns(trial, 0, 15)
    ]


OTHERS: dict[str, tuple[dict[str, Any] | None, str]] = {
    "none": (None, "give the ShapePosterior of cube, sphere that it was told, solids="),
    "others": ({"candidates": ["cube", "cylinder"]}, "labels was"),
    "more of them": ({}, "labels was"),
    "another model": ({"candidates": ["cube", "sphere"], "tolerance": 0.002}, "tolerance was 0.001"),
    "unknown sizes": ({"candidates": ["cube", "sphere"], "size_jitter": 0.1}, "temper was"),
    "other places": (
        {"candidates": {n: [shapes.make(n, position=(0, 0, 0.1))] for n in ("cube", "sphere")}},
        "position",
    ),
}


@pytest.mark.parametrize("which", OTHERS)
def test_other_solids_are_told(tmp_path, trial, which):
    given, told = OTHERS[which]
    made(trial, {"candidates": ["cube", "sphere"]}, 3).save(tmp_path / "state.npz")
    solids = None if given is None else ShapePosterior(trial.hand, **given)
    with pytest.raises(ValueError, match=r"state\.npz: saved with ") as error:
        HapticSLAM.load(tmp_path / "state.npz", solids=solids)
    assert told in str(error.value)
    assert "\n" not in str(error.value)


def test_what_was_felt_less_surely_is_another_solid(tmp_path, trial):
    """Its distances are the same."""
    trimesh = pytest.importorskip("trimesh")
    pytest.importorskip("igl")
    box = trimesh.creation.box((0.03, 0.03, 0.03)).subdivide()

    def felt(std: float) -> ShapePosterior:
        surface = Surface(np.array(box.vertices), np.array(box.faces), np.full(len(box.vertices), std))
        solid = Solid("mine", FeltShape(surface), (0.03, 0.03, 0.03), (0.0, 0.0, 0.1))
        return ShapePosterior(trial.hand, {"mine": [solid], "cube": [shapes.make("cube")]})

    HapticSLAM(trial.hand, particles=2, solids=felt(0.001)).save(tmp_path / "state.npz")
    HapticSLAM.load(tmp_path / "state.npz", trial.hand, solids=felt(0.001))
    with pytest.raises(ValueError, match="their spread differ"):
        HapticSLAM.load(tmp_path / "state.npz", trial.hand, solids=felt(0.002))


def test_solids_that_it_was_not_told_are_told(tmp_path, trial):
    HapticSLAM(trial.hand, particles=1).save(tmp_path / "state.npz")
    with pytest.raises(ValueError, match=r"saved without solids"):
        HapticSLAM.load(tmp_path / "state.npz", solids=ShapePosterior(trial.hand))
    with pytest.raises(ValueError, match=r"rotation_jitter cannot be saved"):
        made(trial, {"rotation_jitter": 180.0, "variants": 10}, 0).save(tmp_path / "other.npz")
    assert [each.name for each in tmp_path.iterdir()] == ["state.npz"]


def test_a_state_that_does_not_fit_is_told(tmp_path, trial):
    """Whatever is changed: kernels look nothing up outside their tables."""
    told = {"candidates": ["cube", "sphere"], "variants": 5, "size_jitter": 0.1, "memory_seconds": 2.0}
    grid = Grid.around((0.0, 0.0, 0.1), (0.1, 0.1, 0.1), 0.02)
    made(trial, told, 20, grid=grid).save(tmp_path / "state.npz")
    with np.load(tmp_path / "state.npz") as content:
        saved = dict(content)
    solids = ShapePosterior(trial.hand, **told)
    arrays = {name: each for name, each in saved.items() if name.startswith(("known.", "solids."))}
    assert len(arrays) > 25
    for number, (name, each) in enumerate(arrays.items()):
        wrong = np.concatenate([each, each]) if number % 2 and each.size else each.astype(complex)
        if number % 3 == 0 and each.dtype.kind == "f" and each.size and not name.endswith("_likelihood"):
            wrong = np.full_like(each, np.nan)
        if name.endswith("_units"):
            wrong = np.full_like(each, 1e9)
        if name.endswith("_counts"):
            wrong = np.array([[0.7, 250.0], [-2.0, 7.5]])
        np.savez(tmp_path / "changed.npz", **{**saved, name: wrong})
        with pytest.raises(ValueError, match=r"changed\.npz: "):
            HapticSLAM.load(tmp_path / "changed.npz", solids=solids)
    for changed in (None, {}, {"changed": {}}, 3):
        observer = json.loads(str(saved["observer"])) | {"known": changed}
        np.savez(tmp_path / "changed.npz", **{**saved, "observer": np.array(json.dumps(observer))})
        with pytest.raises(ValueError, match=r"changed\.npz: "):
            HapticSLAM.load(tmp_path / "changed.npz", solids=solids)
