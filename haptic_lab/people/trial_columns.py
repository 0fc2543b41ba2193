"""Which column of a table of trials is what, in which unit, and what its words mean: by flags, or a TOML file."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from haptic_env import readable, reading, validate

REQUIRED = ("subject", "object", "response", "seconds")
DEADLINE = "deadline"  # when an answer was asked for, of a subject that may give it before
OPTIONAL = ("condition", "confidence", "response_time", DEADLINE, "recording", "trial")
CONSTANT = ("seconds", DEADLINE)  # which may be the same in every trial
COLUMNS = (*REQUIRED, *OPTIONAL)
ALSO = {"subject": "participant_id", "object": "trial_type", "seconds": "duration"}  # as BIDS calls them
UNITS: dict[str, dict[str, float]] = {  # of each column that has one, how many make one of ours
    "seconds": {"s": 1.0, "ms": 1e3, "min": 1 / 60},
    "response_time": {"s": 1.0, "ms": 1e3, "min": 1 / 60},
    DEADLINE: {"s": 1.0, "ms": 1e3, "min": 1 / 60},
    "confidence": {"share": 1.0, "percent": 1e2},
}
CONTENT = ("columns", "units", "names")


@dataclass(frozen=True)
class TrialColumns:
    """What the columns of a table of trials mean.

    Attributes:
        columns: of ours, what the table calls it; of `seconds` and `deadline` also a number, where all trials have one.
        units: of ours that have one, by their names in `UNITS`.
        names: what the table calls objects and responses, and what they are: shapes, "none", "yes" or "no".
    """

    columns: Mapping[str, str | float] = field(default_factory=dict)
    units: Mapping[str, str] = field(default_factory=dict)
    names: Mapping[str, str] = field(default_factory=dict)

    __repr__ = readable.line

    def __post_init__(self) -> None:
        """Check what was given.

        Raises:
            ValueError: for a column or unit that is unknown, and what is no name.
        """
        for what in CONTENT:
            validate.instance(what, getattr(self, what), Mapping, "names and what they mean")
        for name, column in self.columns.items():
            validate.choice("column", name, COLUMNS)
            if name in CONSTANT and not isinstance(column, str):
                validate.seconds(f"column {name}, if it is a number,", column)
            elif not isinstance(column, str) or not column.strip():
                raise ValueError(f"column {name} must be a name of a column, got {validate.shown(column)}")
        for name, unit in self.units.items():
            validate.choice(f"unit of {name}", unit, UNITS[validate.choice("column with a unit", name, UNITS)])
        for name, meant in self.names.items():
            if not isinstance(name, str) or not isinstance(meant, str) or not meant.strip():
                raise ValueError(f"name {validate.shown(name)} must mean a shape, got {validate.shown(meant)}")


def read_trial_columns(path: Path | str) -> TrialColumns:
    """Read what columns mean from a TOML file (docs/people.md has the layout).

    Args:
        path: of the file.

    Returns:
        What they mean.

    Raises:
        ValueError: for a key that is unknown, or a value out of its range.
        OSError: where it cannot be read.
    """
    place = validate.path("path", path)
    try:
        content = reading.toml(place)
        validate.keywords("map", content, CONTENT)
        for name, table in content.items():
            if not isinstance(table, dict):
                raise ValueError(f"{name} must be a table, got {validate.shown(table)}")
        return TrialColumns(**content)
    except ValueError as error:
        raise ValueError(f"{place}: {error}") from error


def typed(
    file: str | None = None,
    columns: Sequence[str] = (),
    units: Sequence[str] = (),
    names: Sequence[str] = (),
) -> TrialColumns:
    """Put together what flags say, over what a file does.

    Args:
        file: a TOML file, as `read_trial_columns` takes it.
        columns: each "OURS=THEIRS"; "seconds=5" is a number, and so is "deadline=6".
        units: each "OURS=UNIT".
        names: each "THEIRS=SHAPE".

    Returns:
        What columns mean.

    Raises:
        ValueError: for a flag that is none of these, and for what `read_trial_columns` refuses.
        OSError: where the file cannot be read.
    """
    told = TrialColumns() if file is None else read_trial_columns(file)
    mapped: dict[str, str | float] = {
        ours: _as_constant(theirs) if ours in CONSTANT else theirs
        for ours, theirs in _pairs("--column", "seconds=duration", columns).items()
    }
    return TrialColumns(
        {**told.columns, **mapped},
        {**told.units, **_pairs("--unit", "seconds=ms", units)},
        {**told.names, **_pairs("--name", "ball=sphere", names)},
    )


def _pairs(flag: str, example: str, given: Sequence[str]) -> dict[str, str]:
    pairs: dict[str, str] = {}
    for text in given:
        left, equals, right = text.partition("=")
        if not equals or not left.strip() or not right.strip():
            raise ValueError(f"{flag} must be like {example}, got {validate.shown(text)}")
        if left.strip() in pairs:
            raise ValueError(f"{flag} {left.strip()} is given twice: {pairs[left.strip()]!r} and {right.strip()!r}")
        pairs[left.strip()] = right.strip()
    return pairs


def _as_constant(text: str) -> Any:
    try:
        value = float(text)
    except ValueError:
        return text
    return value if math.isfinite(value) else text
