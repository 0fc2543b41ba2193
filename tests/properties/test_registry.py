"""Whatever is public has an entry, or is left out for a reason that is told."""

from __future__ import annotations

import importlib
import inspect

import pytest

import agents
import haptic_env
import observer
from haptic_env import hands, recordings, shapes
from observer import classifiers, variants
from tests.properties.registry import ENTRIES, LEFT_OUT, MODULES


def _names_of(module: str) -> list[str]:
    """What `module` is for: what it lists, or else the functions and classes that it defines."""
    content = importlib.import_module(module)
    listed = getattr(content, "__all__", None)
    if listed is not None:
        return [name for name in listed if callable(getattr(content, name))]
    return [
        name
        for name, each in vars(content).items()
        if not name.startswith("_")
        and (inspect.isfunction(each) or inspect.isclass(each) or hasattr(each, "py_func"))
        and each.__module__ == module
    ]


@pytest.mark.parametrize("module", MODULES)
def test_every_public_name_has_an_entry_or_a_reason(module):
    known = {*ENTRIES, *LEFT_OUT}
    missing = [
        name
        for name in _names_of(module)
        if not any(
            each == f"{module}.{name}" or each.startswith((f"{module}.{name}.", f"{module}.{name}[")) for each in known
        )
    ]
    assert not missing, f"give {module} an entry in tests/properties/entries for {', '.join(missing)}"


@pytest.mark.parametrize(
    ("registry", "names"),
    [
        ("haptic_env.ENVIRONMENTS", haptic_env.ENVIRONMENTS),
        ("haptic_env.hands.HANDS", hands.HANDS),
        ("haptic_env.shapes.SHAPES", shapes.SHAPES),
        ("haptic_env.recordings.READERS", recordings.READERS),
        ("observer.OBSERVERS", observer.OBSERVERS),
        ("observer.variants", variants.NAMES),
        ("observer.classifiers.CLASSIFIERS", classifiers.CLASSIFIERS),
        ("agents.POLICIES", agents.POLICIES),
    ],
)
def test_every_name_of_a_registry_has_an_entry(registry, names):
    missing = [name for name in names if not any(each.startswith(f"{registry}[{name}]") for each in ENTRIES)]
    assert not missing


def test_what_is_left_out_is_there_and_has_no_entry():
    for name, reason in LEFT_OUT.items():
        module, _, attribute = name.rpartition(".")
        assert hasattr(importlib.import_module(module), attribute), name
        assert name not in ENTRIES
        assert len(reason) > 10, name
