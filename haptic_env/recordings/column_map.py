"""What the columns of a file of measured touch mean: a TOML file that says which column is which joint, and which taxel
is which patch.

Shapes: J joints, P patches.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, NamedTuple

from haptic_env import readable, reading, registration, validate
from haptic_env.recordings.cyberglove import UNITS as ANGLES
from haptic_env.recordings.streams import UNITS as TIMES

CONTENT = ("hand", "control_hz", "time", "joints", "touch")
CLOCK = ("column", "unit", "rate")
JOINTS = ("columns", "unit", "stream", "order", "time")
TOUCH = ("taxels", "threshold", "stream", "order", "time")
LINE = ("column", "unit", "sign", "zero")


class Clock(NamedTuple):
    """When samples were taken.

    Attributes:
        column: that has the time stamps; None: the one that is called so.
        unit: s, of these; None: what the file says, or 1.
        rate: Hz of steady samples, in place of stamps.
    """

    column: str | None = None
    unit: float | None = None
    rate: float | None = None


class JointColumn(NamedTuple):
    """How a column tells the angle of a joint: `sign` · (column - `zero`) · `unit`.

    Attributes:
        column: its name; None: the joint stays at `zero`.
        unit: rad, of what it says.
        sign: 1 or -1.
        zero: what it says where the angle is zero, in its unit.
    """

    column: str | None
    unit: float = 1.0
    sign: float = 1.0
    zero: float = 0.0


@dataclass(frozen=True)
class ColumnMap:
    """What columns mean.

    Attributes:
        source: where it comes from, for messages.
        joints: by the name of the joint.
        taxels: the patch of each column of touch, by the column.
        threshold: above which a pressure is a contact; None: columns are 0 or 1.
        hand: name of the hand; None: told elsewhere.
        control_hz: Hz, of the observer's steps; None: as the joints come.
        joints_clock: of the joints.
        touch_clock: of the touch.
        joints_stream: whose columns are the joints in the order of `joints_order`, in place of names.
        joints_order: names of joints, "" for a column that is none.
        touch_stream: whose columns are the patches in the order of `touch_order`, in place of names.
        touch_order: names of patches, "" for a taxel that is left out.
    """

    source: str
    joints: Mapping[str, JointColumn] = field(default_factory=dict)
    taxels: Mapping[str, str] = field(default_factory=dict)
    threshold: float | None = None
    hand: str | None = None
    control_hz: float | None = None
    joints_clock: Clock = field(default_factory=Clock)
    touch_clock: Clock = field(default_factory=Clock)
    joints_stream: str | None = None
    joints_order: tuple[str, ...] = ()
    touch_stream: str | None = None
    touch_order: tuple[str, ...] = ()

    __repr__ = readable.line

    @property
    def whose(self) -> str | None:
        """The hand by its name, or by the path of its file where it is one's own, which lies beside the map."""
        return str(Path(self.source).parent / str(self.hand)) if registration.is_file(self.hand) else self.hand


def read_columns(path: Path | str) -> ColumnMap:
    """Read what columns mean from a TOML file (docs/recordings.md has the layout).

    Args:
        path: of the file.

    Returns:
        The map.

    Raises:
        ValueError: for a key that is unknown, or a value out of its range.
        OSError: where it cannot be read.
    """
    place = validate.path("path", path)
    try:
        return _map(str(place), reading.toml(place))
    except ValueError as error:
        raise ValueError(f"{place}: {error}") from error


def _map(source: str, content: Mapping[str, Any]) -> ColumnMap:
    validate.keywords("map", content, CONTENT)
    joints, touch = _table(content, "joints", JOINTS), _table(content, "touch", TOUCH)
    usual = _clock("time", _table(content, "time", CLOCK))
    unit = _unit("unit of joints", joints.get("unit", "radians"))
    lines = {name: _line(name, line, unit) for name, line in _table(joints, "columns").items()}
    taxels = _table(touch, "taxels")
    for taxel, patch in taxels.items():
        if not isinstance(patch, str) or not patch:
            raise ValueError(f"taxel {taxel!r} has no place: name its patch, got {patch!r}")
    threshold, rate = touch.get("threshold"), content.get("control_hz")
    if threshold is not None:
        threshold = validate.number("threshold", threshold, -math.inf)
    if rate is not None:
        rate = validate.number("control_hz", rate, 1.0, 500.0, unit="Hz")
    return ColumnMap(
        source,
        lines,
        dict(taxels),
        threshold,
        _text(content, "hand"),
        rate,
        _clock("time of joints", _table(joints, "time", CLOCK), usual),
        _clock("time of touch", _table(touch, "time", CLOCK), usual),
        _text(joints, "stream"),
        _order(joints),
        _text(touch, "stream"),
        _order(touch),
    )


def _table(content: Mapping[str, Any], name: str, valid: tuple[str, ...] = ()) -> Mapping[str, Any]:
    table = content.get(name, {})
    if not isinstance(table, dict):
        raise ValueError(f"{name} must be a table, got {validate.shown(table)}")
    if valid:
        validate.keywords(name, table, valid)
    return table


def _text(content: Mapping[str, Any], name: str) -> str | None:
    value = content.get(name)
    if value is not None and (not isinstance(value, str) or not value):
        raise ValueError(f"{name} must be a text, got {validate.shown(value)}")
    return value


def _order(content: Mapping[str, Any]) -> tuple[str, ...]:
    order = content.get("order", [])
    if not isinstance(order, list) or not all(isinstance(each, str) for each in order):
        raise ValueError(f"order must be a list of names, got {validate.shown(order)}")
    if bool(order) != ("stream" in content):
        raise ValueError("stream and order go together: which stream, and what its columns are, one after the other")
    return tuple(order)


def _clock(what: str, content: Mapping[str, Any], usual: Clock | None = None) -> Clock:
    if not content and usual is not None:
        return usual
    unit, rate = content.get("unit"), content.get("rate")
    return Clock(
        _text(content, "column"),
        None if unit is None else TIMES[validate.choice(f"unit of {what}", unit, TIMES)],
        None if rate is None else validate.number(f"rate of {what}", rate, 0.0, 1e5, above=0.0, unit="Hz"),
    )


def _unit(what: str, value: Any) -> float:
    return ANGLES[validate.choice(what, value, ANGLES)]


def _line(joint: str, line: Any, unit: float) -> JointColumn:
    if isinstance(line, str):
        return JointColumn(line, unit)
    if not isinstance(line, dict):
        value = validate.number(f"angle of {joint}, if it is no column,", line, -math.inf)
        return JointColumn(None, unit, 1.0, value)
    validate.keywords(f"joint {joint}", line, LINE)
    if not (column := _text(line, "column")):
        raise ValueError(f"joint {joint} needs a column, got {validate.shown(line)}")
    sign = line.get("sign", 1)
    if sign not in (1, -1):
        raise ValueError(f"sign of {joint} must be 1 or -1, got {validate.shown(sign)}")
    own = _unit(f"unit of {joint}", line["unit"]) if "unit" in line else unit
    return JointColumn(column, own, float(sign), validate.number(f"zero of {joint}", line.get("zero", 0.0), -math.inf))
