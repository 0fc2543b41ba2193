"""What a user gets hold of says in one readable line what it is."""

from __future__ import annotations

import importlib
import inspect
import re
from collections.abc import Callable
from pathlib import Path
from typing import Any

import gymnasium as gym
import numpy as np
import pytest
import trimesh

import agents
import observer
from agents.few_joints import FewJoints
from agents.repeat_torques import RepeatTorques
from haptic_env import hands, readable, recordings, sensors, shapes
from haptic_lab.learning import presets
from haptic_lab.people import options
from haptic_lab.people.courses import Courses
from haptic_lab.people.models import Model
from haptic_lab.people.studies import presets as studies
from observer import HapticSLAM, ObserverWrapper, ShapePosterior
from observer.brackets import OBSERVERS
from observer.classifiers import CLASSIFIERS

ROOT = Path(__file__).resolve().parents[2]
REFERENCE = sorted(
    {name for page in ROOT.glob("docs/reference/*.md") for name in re.findall(r"(?m)^::: (\S+)", page.read_text())}
)
HAND = hands.make("two_finger")


def wrapped() -> Any:
    env = gym.make("HapticSLAM/TwoFinger-v0", shape="cube")
    return ObserverWrapper(env, HapticSLAM(HAND, 3.0, 5), ShapePosterior(HAND, variants=2))


def belief() -> Any:
    env = wrapped()
    env.reset(seed=0)
    return env.step(np.zeros(HAND.joints))[-1]["belief"]


def mesh(folder: Path) -> str:
    trimesh.creation.box((0.05, 0.06, 0.05)).export(folder / "box.stl")
    return str(folder / "box.stl")


def named_courses() -> Courses:
    return Courses.load(options.SHIPPED["courses"])


MADE: dict[str, Callable[[Path], Any]] = {
    "hand": lambda _: HAND,
    "patches": lambda _: HAND.patches,
    "layout": lambda _: HAND.patches.layout,
    "skin": lambda _: HAND.patches.surface(0.01),
    "solid": lambda _: shapes.make("torus(0.4)", np.array([0.06, 0.06, 0.024])),
    "mesh": lambda folder: shapes.find(mesh(folder)),
    "solid of a mesh": lambda folder: shapes.usual(mesh(folder), HAND),
    "environment": lambda _: wrapped().unwrapped,
    "wrapper": lambda _: wrapped(),
    "belief": lambda _: belief(),
    "surface": lambda _: belief().surface(),
    "posterior": lambda _: ShapePosterior(HAND, variants=2),
    "posterior of many": lambda _: ShapePosterior(HAND, list(shapes.read_set("twenty")), variants=2),
    "library": lambda folder: observer.Library(folder),
    "task": lambda _: gym.make("HapticSLAM/Name-v0").unwrapped,
    "few joints": lambda _: FewJoints(agents.make("sweep", wrapped()), [0, 1]),
    "torques": lambda _: RepeatTorques(wrapped(), np.zeros((5, 8))),
    "noise of contacts": lambda _: wrapped().unwrapped.contact_detection,
    "noise of angles": lambda _: sensors.Proprioception([sensors.White(3.0), sensors.Bias(1.0)]),
    "calibration": lambda _: recordings.calibration_for("adroit"),
    "recording": lambda _: recordings.Recording("a.npz", np.arange(3.0), HAND.joint_names, np.zeros((3, 8))),
    "model of contacts": lambda _: observer.ContactModel(prior=0.1),
    "courses": lambda _: named_courses(),
    "model": lambda _: Model.named("limits", named_courses(), {}),
    **{f"shape {name}": lambda _, name=name: shapes.find(name) for name in (*shapes.SHAPES, *shapes.FAMILIES)},
    **{
        f"policy {name}": lambda _, name=name: agents.make(name, wrapped()) for name in agents.POLICIES if name != "sb3"
    },
    **{f"classifier {name}": lambda _, made=made: made() for name, made in CLASSIFIERS.items()},
    **{f"observer {name}": lambda _, made=made: made(HAND, 3.0) for name, made in OBSERVERS.items()},
    **{f"preset {name}": lambda _, name=name: presets.read(name) for name in presets.names()},
    **{f"world {name}": lambda _, name=name: presets.read(name).world for name in presets.names()},
    **{f"study {name}": lambda _, name=name: studies.read(name) for name in studies.names()},
}


@pytest.mark.parametrize("what", MADE)
def test_it_is_one_readable_line(what: str, tmp_path: Path) -> None:
    made = MADE[what](tmp_path)
    told = repr(made)
    assert told.lstrip("<").startswith(type(made).__name__)
    assert "\n" not in told
    assert " at 0x" not in told
    assert len(told) <= 200


@pytest.mark.parametrize("name", REFERENCE)
def test_no_public_class_is_left_without(name: str) -> None:
    home, _, last = name.rpartition(".")
    try:
        found = importlib.import_module(name)
    except ImportError:
        found = getattr(importlib.import_module(home), last)
    inside = vars(found).values() if inspect.ismodule(found) else [found]
    classes = [each for each in inside if inspect.isclass(each) and each.__module__.startswith(name.split(".")[0])]
    for each in classes:
        is_protocol = getattr(each, "_is_protocol", False)
        assert is_protocol or each.__repr__ is not object.__repr__, each


def test_what_is_as_usual_is_not_told() -> None:
    assert repr(CLASSIFIERS["nearest_neighbour"]()) == "NearestNeighbour()"
    assert repr(CLASSIFIERS["touched_nearest_neighbour"]()) == "NearestNeighbour(metric='touched')"
    assert repr(observer.ContactDynamics()) == "ContactDynamics()"
    assert repr(presets.TrainingWorld(seconds=3.0)) == "TrainingWorld(seconds=3)"


def test_arrays_are_told_by_their_shape_and_things_by_their_name() -> None:
    assert readable.VALUES.repr(np.zeros((3, 4))) == "<3 × 4 array>"
    assert readable.VALUES.repr(np.array([1.0, 2.5])) == "[1, 2.5]"
    assert readable.VALUES.repr(HAND) == "two_finger"
    assert readable.VALUES.repr(gym.make("HapticSLAM/TwoFinger-v0")) == "HapticSLAM/TwoFinger-v0"
    assert readable.VALUES.repr(object()) == "<object>"
