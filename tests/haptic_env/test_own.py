"""Shapes of a class of one's own, by "module:Class": a name alone runs no code."""

from __future__ import annotations

import sys
from collections.abc import Iterator
from pathlib import Path

import gymnasium as gym
import numpy as np
import pytest

from haptic_env import recordings, shapes
from haptic_lab.commands import explore
from haptic_lab.sweeps import options
from haptic_lab.worlds import typed_shape

MODULE = """
import pathlib
import numpy as np
from haptic_env.shapes.base import Shape

pathlib.Path(__file__).with_name("ran").touch()

class Egg(Shape):
    def __init__(self, blunt=1.0):
        if blunt > 9:
            raise RuntimeError("too blunt")
        self.blunt = blunt

    def signed_distance(self, points, size):
        return np.linalg.norm(points, axis=-1) - size[0] / 2

    def geoms(self, root, size):
        return [{"type": "ellipsoid", "size": size / 2}]

class Half(Shape):
    pass

class Flat(Egg):
    default_size = (0.05, 0.05, 0.0)

class Other:
    pass
"""


@pytest.fixture
def here(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[Path]:
    """A folder with a module that tells when it is run."""
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr(sys, "path", [*sys.path])
    (tmp_path / "own_shapes.py").write_text(MODULE)
    yield tmp_path
    sys.modules.pop("own_shapes", None)


def test_a_name_that_is_typed_is_imported_and_goes_anywhere(here: Path) -> None:
    name = typed_shape("own_shapes:Egg( .5, size=.06)")
    assert name == "own_shapes:Egg(0.5, size=0.06)"
    assert (here / "ran").exists()
    assert shapes.find(name).blunt == 0.5  # type: ignore[attr-defined]
    assert shapes.make(name).size == (0.06, 0.06, 0.06)
    with gym.make("HapticSLAM/TwoFinger-v0", shape=["cube", name], reveal_truth=True) as env:
        assert {env.reset(seed=seed)[1]["truth"]["shape"] for seed in range(6)} == {"cube", name}


def _read_as_shape(here: Path) -> None:
    shapes.make("own_shapes:Egg", size=(0.05, 0.05, 0.05))


def _explored(here: Path) -> None:
    gym.make("HapticSLAM/TwoFinger-v0", shape="own_shapes:Egg")


def _in_a_set(here: Path) -> None:
    (here / "set.toml").write_text('[objects]\negg = "own_shapes:Egg"')
    shapes.check("shape", "set.toml:egg")


def _in_a_sweep(here: Path) -> None:
    (here / "sweep.toml").write_text('shapes = ["own_shapes:Egg"]')
    options.check(None, ["--config", "sweep.toml"])


def _typed_of_a_set(here: Path) -> None:
    (here / "set.toml").write_text('[objects]\negg = "own_shapes:Egg"')
    options.check(None, ["--objects", "set.toml"])


def _in_an_exploration(here: Path) -> None:
    (here / "set.toml").write_text('[objects]\negg = "own_shapes:Egg"')
    explore.parse(["--objects", "set.toml"])


def _in_a_recording(here: Path) -> None:
    recording = recordings.Recording(
        "made", np.arange(3) / 50, ("a",), np.zeros((3, 1)), settings={"shape": "own_shapes:Egg"}
    )
    recordings.write(here / "recording.npz", recording)
    explore.parse(["--recording", "recording.npz", "--hand", "two_finger"])


FROM_FILES = (_read_as_shape, _explored, _in_a_set, _in_a_sweep, _typed_of_a_set, _in_an_exploration, _in_a_recording)


@pytest.mark.parametrize("way", FROM_FILES)
def test_no_name_in_a_file_runs_code(here: Path, way: object, capsys: pytest.CaptureFixture) -> None:
    with pytest.raises((ValueError, SystemExit)) as refused:
        way(here)  # type: ignore[operator]
    told = capsys.readouterr().err if refused.type is SystemExit else str(refused.value)
    assert "a name alone runs no code" in told
    assert told.strip().count("\n") == 0
    assert not (here / "ran").exists()
    assert "own_shapes" not in sys.modules


def test_names_in_files_are_imported_where_that_is_said(here: Path) -> None:
    (here / "set.toml").write_text('[objects]\negg = "own_shapes:Egg(2)"')
    plan = options.check(None, ["--objects", "set.toml", "--trust"])
    assert plan.settings.shapes == ("set.toml:egg",)
    assert shapes.find("set.toml:egg").blunt == 2  # type: ignore[attr-defined]


@pytest.mark.parametrize(
    ("name", "why"),
    [
        ("own_shapes:Eg", "no class of the kind Shape there; choose from own_shapes:Egg, own_shapes:Half"),
        ("own_shapes:Other", "no class of the kind Shape"),
        ("own_shapes:np", "no class of the kind Shape"),
        ("own_shapes:np.ndarray", "no class of the kind Shape"),
        ("own_shapes:Half", "abstract"),
        ("own_shapes:Flat", "object size must"),
        ("own_shapes:Egg(10)", "RuntimeError: too blunt"),
        ("own_shapes:Egg(1, 2)", r"too many.*say own_shapes:Egg\(blunt=1\)"),
        ("own_shapes:Egg(open('a'))", "unknown shape"),
    ],
)
def test_classes_that_are_no_shapes_are_refused_in_a_line(here: Path, name: str, why: str) -> None:
    shapes.allow(["own_shapes:Egg"])
    with pytest.raises(ValueError, match=why):
        shapes.find(name)


@pytest.mark.parametrize(
    ("content", "why"),
    [("1 +", "SyntaxError"), ("raise KeyError('x')", "KeyError"), ("raise SystemExit(3)", "SystemExit")],
)
def test_a_module_that_fails_is_refused_in_a_line(here: Path, content: str, why: str) -> None:
    (here / "own_shapes.py").write_text(content)
    with pytest.raises(ValueError, match=rf"own_shapes:Egg.*cannot be imported: {why}"):
        shapes.allow(["own_shapes:Egg"])


@pytest.mark.parametrize("no_text", [object, b"", 3, None])
def test_what_is_no_name_is_refused(no_text: object) -> None:
    with pytest.raises(ValueError, match="name of a shape must be"):
        shapes.allow([no_text])  # type: ignore[list-item]
