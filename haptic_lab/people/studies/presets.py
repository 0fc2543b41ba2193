"""What an experiment with people was: its stimuli, its task, and what was published; read from a TOML file."""

from __future__ import annotations

import argparse
import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, fields
from pathlib import Path
from typing import Any

from haptic_env import readable, reading, shapes, validate
from haptic_lab import toml_presets
from haptic_lab.worlds import as_shape

FOLDER = Path(__file__).parent / "presets"
DISCRIMINATION, IDENTIFICATION = "discrimination", "identification"
TASKS = (DISCRIMINATION, IDENTIFICATION)
NOT_A_STUDYS = (
    *("ablation", "calibration", "classifiers", "cluster", "courses", "exemplars", "jobs", "out", "quick"),
    *("recordings", "trial_table"),
)
MOST_INTERVALS = 8
MOST = 64  # stimuli, conditions, published figures
Stimulus = tuple[float, str]


@dataclass(frozen=True)
class Published:
    """A mean that was published.

    Attributes:
        value: of the study's parameter at the threshold, or the share of objects named right.
        what: people did.
        source: as it is cited.
        checked: where the figure was read ("abstract"); "": it is as the study's own source cites it.
        condition: of the study, to which it belongs; "": all.
        seconds: that people had; None: not said, or as long as they liked.
        drawn: whether it is a figure to compare with, which pictures show.

    Raises:
        ValueError: for a value out of its range.
    """

    value: float
    what: str
    source: str
    checked: str = ""
    condition: str = ""
    seconds: float | None = None
    drawn: bool = True

    def __post_init__(self) -> None:
        validate.number("value of published", self.value, 0.0, 1e6)
        _texts(self, "what", "source", "checked", "condition")
        if self.seconds is not None:
            validate.number("seconds of published", self.seconds, 0.0, 3600.0, above=0.0, unit="s")
        validate.boolean("drawn of published", self.drawn)


@dataclass(frozen=True)
class HandCondition:
    """What a hand may do in one condition of an experiment.

    Attributes:
        name: of the condition.
        models: says what stands for what people did.
        moves: joints that are driven, as patterns (`mcp2_*`); others are left to their springs.
        feels: patches that feel, as patterns; others are dead, and the observers know it.
        sweep: what differs from the study's, by the keys of a sweep.

    Raises:
        ValueError: for a value out of its range.
    """

    name: str
    models: str = ""
    moves: tuple[str, ...] = ("*",)
    feels: tuple[str, ...] = ("*",)
    sweep: Mapping[str, Any] = field(default_factory=dict)

    def __post_init__(self) -> None:
        _texts(self, "name", "models")
        for name in ("moves", "feels"):
            several = getattr(self, name)
            if not several or not all(isinstance(each, str) and each for each in several):
                raise ValueError(f"{name} of condition {self.name!r} must be a list of patterns, got {several!r}")


@dataclass(frozen=True)
class Study:
    """An experiment.

    Attributes:
        name: of the preset, or of its file.
        title: for a picture.
        task: a name of `TASKS`.
        about: what people were asked.
        sweep: what is explored, and how, by the keys of a sweep.
        parameter: what differs between stimuli, of a discrimination.
        unit: of the parameter.
        standard: value with which the others are compared.
        intervals: stimuli that are felt before an answer; 1: one, which is the standard in half the trials.
        stimuli: each value with the shape that has it.
        after: seconds after which the name is asked for, of an identification; none: at the end.
        conditions: of the hand; none: as it is.
        published: what people did.
        differs: what is not as it was with people.

    Raises:
        ValueError: for a value out of its range.
    """

    name: str
    title: str
    task: str
    about: str
    sweep: Mapping[str, Any]
    parameter: str = ""
    unit: str = ""
    standard: float = math.nan
    intervals: int = 2
    stimuli: tuple[Stimulus, ...] = ()
    after: tuple[float, ...] = ()
    conditions: tuple[HandCondition, ...] = field(default_factory=lambda: (HandCondition(""),))
    published: tuple[Published, ...] = ()
    differs: tuple[str, ...] = ()

    __repr__ = readable.line

    def __post_init__(self) -> None:
        _texts(self, "name", "title", "task", "about", "parameter", "unit")
        validate.choice("task", self.task, TASKS)
        validate.integer("intervals", self.intervals, 1, MOST_INTERVALS)
        if not all(isinstance(each, str) for each in self.differs):
            raise ValueError(f"differs must be a list of texts, got {validate.shown(self.differs)}")
        names = [each.name for each in self.conditions]
        if len({*names}) < len(names) or not names:
            raise ValueError(f"conditions must have names of their own, got {validate.listed(names)}")
        for figure in self.published:
            if figure.condition:
                validate.choice("condition of published", figure.condition, names)
        for seconds in self.after:
            validate.number("after", seconds, 0.0, 3600.0, above=0.0, unit="s")
        if self.task == IDENTIFICATION:
            if self.stimuli:
                raise ValueError("stimuli are of a discrimination: an identification says shapes or objects in [sweep]")
            return
        if "shapes" in self.sweep or "objects" in self.sweep:
            raise ValueError("a discrimination says what is explored in stimuli, not by shapes or objects in [sweep]")
        validate.number("standard", self.standard, -1e6, 1e6)
        values = [value for value, _ in self.stimuli]
        if len({*values}) < len(values) or len(values) < 2:
            raise ValueError(f"stimuli must have two values or more, each once, got {values}")
        if self.standard not in values:
            raise ValueError(f"standard must be one of the values of stimuli, got {self.standard!r}")
        above = [value > self.standard for value in values if value != self.standard]
        if len({*above}) > 1:
            raise ValueError(f"stimuli must all be above the standard of {self.standard:g}, or all below it")

    @property
    def comparisons(self) -> tuple[Stimulus, ...]:
        """The stimuli but for the standard, the nearest to it first."""
        others = [each for each in self.stimuli if each[0] != self.standard]
        return tuple(sorted(others, key=lambda each: abs(each[0] - self.standard)))

    @property
    def standard_shape(self) -> str:
        """The shape that has the value of the standard."""
        return next(shape for value, shape in self.stimuli if value == self.standard)

    @property
    def guess(self) -> float:
        """How often a guess is right."""
        return 1.0 / max(self.intervals, 2)


def names() -> list[str]:
    """List the studies that ship.

    Returns:
        Their names.
    """
    return toml_presets.names(FOLDER)


def read(name: str) -> Study:
    """Read a study.

    Args:
        name: of one that ships, or the path of a TOML file.

    Returns:
        The study.

    Raises:
        ValueError: for another name, and for a file that describes none.
    """
    path = toml_presets.path_of("study", name, FOLDER)
    try:
        return _study(path.stem, reading.toml(path))
    except OSError as error:
        raise ValueError(f"the study {name!r} cannot be read: {error}") from error
    except ValueError as error:
        raise ValueError(f"{name}: {error}") from error


def _study(name: str, told: Mapping[str, Any]) -> Study:
    values = _keys("key", told, {each.name for each in fields(Study)} - {"name"} | {"condition"})
    conditions, published = (values.pop(each, []) for each in ("condition", "published"))
    if "conditions" in values:
        raise ValueError("a condition is a table [[condition]] of its own")
    values["stimuli"] = tuple(_stimulus(each) for each in _several("stimuli", values.get("stimuli", [])))
    values["after"] = tuple(_several("after", values.get("after", [])))
    values["differs"] = tuple(_several("differs", values.get("differs", [])))
    values["sweep"] = _sweep("sweep", values.get("sweep", {}))
    for needed in ("title", "task", "about"):
        if needed not in values:
            raise ValueError(f"{needed} is missing")
    if conditions:
        values["conditions"] = tuple(_condition(each) for each in _several("condition", conditions))
    known = {each.name for each in fields(Published)}
    several = [_keys("key of published", each, known) for each in _several("published", published)]
    for figure in several:
        for needed in ("value", "what", "source"):
            if needed not in figure:
                raise ValueError(f"{needed} of published is missing")
    return Study(name=name, published=tuple(Published(**each) for each in several), **values)


def _condition(told: Any) -> HandCondition:
    values = _keys("key of condition", told, {each.name for each in fields(HandCondition)})
    values |= {name: tuple(_several(name, values[name])) for name in ("moves", "feels") if name in values}
    if "name" not in values:
        raise ValueError("name of condition is missing")
    return HandCondition(**{**values, "sweep": _sweep("sweep of condition", values.get("sweep", {}))})


def _stimulus(told: Any) -> Stimulus:
    if not isinstance(told, list) or len(told) != 2 or not isinstance(told[1], str):
        raise ValueError(f"stimuli must be pairs of a value and the name of a shape, got {validate.shown(told)}")
    try:
        shape = shapes.check("shape of stimuli", as_shape(told[1]))
        return validate.number("value of stimuli", told[0], -1e6, 1e6), shape
    except argparse.ArgumentTypeError as error:
        raise ValueError(f"stimuli: {error}") from error


def _keys(what: str, told: Any, known: set[str]) -> dict[str, Any]:
    """The table `told`, whose keys are among those that are known."""
    for name in _table(what, told):
        validate.choice(what, name, sorted(known))
    return dict(told)


def _sweep(what: str, told: Any) -> Mapping[str, Any]:
    for name in _table(what, told):
        if name in NOT_A_STUDYS:
            raise ValueError(f"{name} is no key of {what} that a study may have")
    return told


def _table(what: str, told: Any) -> Mapping[str, Any]:
    if not isinstance(told, dict):
        raise ValueError(f"{what} must be a table, got {validate.shown(told)}")
    return told


def _several(what: str, told: Any) -> Sequence[Any]:
    if not isinstance(told, list) or len(told) > MOST:
        raise ValueError(f"{what} must be a list of {MOST} at most, got {validate.shown(told)}")
    return told


def _texts(told: object, *names: str) -> None:
    for name in names:
        validate.instance(name, getattr(told, name), str, "a text")
