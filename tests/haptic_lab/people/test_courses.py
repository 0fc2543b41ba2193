"""Courses are kept whole, and what is not a course is refused."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from haptic_lab.people.courses import Courses

RNG = np.random.default_rng(3)
LOG = np.log(RNG.dirichlet(np.ones(3), (2, 2, 4, 5)))
LOG[1, :, 3] = np.nan
TOLD: dict[str, Any] = {
    "names": ("cube", "sphere", "ellipsoid(1.1)"),
    "objects": ("cube", "cube"),
    "conditions": ("", "würfel, kalt"),
    "sigmas": [1.0, 3.0],
    "seconds": [0.0, 0.1, 0.2, 0.3, 0.4],
    "log_posterior": LOG,
}


def test_a_file_gives_back_what_was_saved(tmp_path: Path) -> None:
    made = Courses(**TOLD)
    made.save(tmp_path / "courses")  # whatever its ending
    assert [each.name for each in tmp_path.iterdir()] == ["courses"]
    found = Courses.load(tmp_path / "courses")
    assert (found.names, found.objects, found.conditions) == (made.names, made.objects, made.conditions)
    for name in ("sigmas", "seconds", "log_posterior"):
        assert getattr(found, name).tobytes() == getattr(made, name).tobytes()
    assert found.repeats == 4


def test_cells_are_found_by_object_and_condition() -> None:
    made = Courses(**TOLD)
    assert [made.cell(*each) for each in made.cells] == [0, 1]
    with pytest.raises(ValueError, match="no course of 'sphere' under ''; there are cube; cube under würfel, kalt"):
        made.cell("sphere")


WRONG: dict[str, tuple[dict[str, Any], str]] = {
    "a name twice": ({"names": ("a", "b", "a")}, "each name must be there once, got 'a' again"),
    "a cell twice": ({"conditions": ("", "")}, "each cell must be there once"),
    "no name": ({"names": ()}, "names must be one name or more"),
    "a condition less": ({"conditions": ("",)}, "2 objects, 1 conditions"),
    "sigmas that fall": ({"sigmas": [3.0, 1.0]}, "sigmas must be ascending"),
    "a sigma of 0": ({"sigmas": [0.0, 1.0]}, "sigmas must be ascending numbers above 0"),
    "the same time twice": ({"seconds": [0.0, 0.1, 0.1, 0.2, 0.3]}, "seconds must be ascending"),
    "a time before": ({"seconds": [-0.1, 0.1, 0.2, 0.3, 0.4]}, "seconds must be ascending numbers of at least 0"),
    "other names": ({"names": ("a", "b")}, r"of shape \(2, 2, repeats, 5, 2\)"),
    "no repeat": ({"log_posterior": LOG[:, :, :0]}, "one repeat at least"),
    "no logs": ({"log_posterior": np.exp(LOG)}, "add to 1 over names"),
    "one NaN": ({"log_posterior": np.where(np.arange(3) == 1, np.nan, LOG)}, r"at index \(0, 0, 0, 0\)"),
    "texts": ({"log_posterior": "x"}, "log_posterior must be numbers"),
}


@pytest.mark.parametrize("what", WRONG)
def test_what_does_not_fit_together_is_refused(what: str) -> None:
    changed, told = WRONG[what]
    with pytest.raises(ValueError, match=told):
        Courses(**{**TOLD, **changed})


def _without(path: Path) -> None:
    with np.load(path) as content:
        kept = {name: content[name] for name in content.files if name != "sigmas"}
    np.savez(path, **kept)


def _later(path: Path) -> None:
    with np.load(path) as content:
        kept = dict(content)
    np.savez(path, **{**kept, "format": np.array(99)})


def _other_kind(path: Path) -> None:
    with np.load(path) as content:
        kept = dict(content)
    np.savez(path, **{**kept, "names": np.arange(3)})


DAMAGED: dict[str, tuple[Callable[[Path], Any], str]] = {
    "cut short": (lambda path: path.write_bytes(path.read_bytes()[:-40]), "not a whole .npz file"),
    "without sigmas": (_without, "no sigmas in it"),
    "a later format": (_later, "courses of format 99, 1 is read here"),
    "names that are numbers": (_other_kind, "names must be texts"),
}


@pytest.mark.parametrize("how", DAMAGED)
def test_a_damaged_file_is_told_by_its_name(tmp_path: Path, how: str) -> None:
    damage, told = DAMAGED[how]
    place = tmp_path / "courses.npz"
    Courses(**TOLD).save(place)
    damage(place)
    with pytest.raises(ValueError, match=told) as error:
        Courses.load(place)
    assert str(place) in str(error.value)
