"""CyberGlove recordings as text, in the layout of GraspDB14, and what their sensors mean for the joints of a hand.

One row a frame: year, month, day, hour, minute, second, the switch, then one angle for each sensor. What a sensor
means differs from glove to glove and person to person, so that it stands in a TOML file, the `Calibration`.
"""

from __future__ import annotations

import math
import tomllib
from collections.abc import Mapping
from dataclasses import dataclass
from datetime import UTC, datetime
from importlib.resources import files
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from haptic_env import validate
from haptic_env.recordings.recording import Recording, check_times

Array = NDArray[np.float64]
BEFORE = 7  # columns before those of the sensors: the date in six, and the switch
UNITS = {"radians": 1.0, "degrees": math.pi / 180}
PACKAGED = files("haptic_env.recordings") / "calibrations"


@dataclass(frozen=True)
class Calibration:
    """Joint angle = `offset` (J,) rad + `gain` (J, S) · sensors (S,) rad.

    `sensors` (S,): names of the columns, in their order; `unit` (rad) of what the file says; `joint_names` (J,).
    """

    source: str
    sensors: tuple[str, ...]
    unit: float
    joint_names: tuple[str, ...]
    offset: Array
    gain: Array

    def joint_angles(self, sensors: Array) -> Array:
        """(T, J) rad for `sensors` (T, S) in the unit of the file."""
        return np.asarray(self.offset + self.unit * sensors @ self.gain.T)


def calibration_for(hand: str) -> Calibration:
    """The calibration that comes for the hand of this name; raises `ValueError` where none does."""
    names = sorted(each.name.removesuffix(".toml") for each in PACKAGED.iterdir() if each.name.endswith(".toml"))
    name = validate.choice("hand with a glove's calibration", hand, names)
    return _calibration(f"{name}.toml", tomllib.loads((PACKAGED / f"{name}.toml").read_text()))


def read_calibration(path: Path | str) -> Calibration:
    """The calibration in a TOML file laid out as those in haptic_env/recordings/calibrations.

    Raises `ValueError` for a key or sensor that is unknown, or a value that is no number; `OSError` without the file.
    """
    try:
        content = tomllib.loads(Path(path).read_bytes().decode())
    except ValueError as error:
        raise ValueError(f"{path}: {error}") from error
    return _calibration(str(path), content)


def _calibration(source: str, content: Mapping[str, Any]) -> Calibration:
    try:
        validate.keywords("calibration", content, ("sensors", "unit", "joints"))
        sensors = content.get("sensors")
        if not isinstance(sensors, list) or not sensors or not all(isinstance(each, str) for each in sensors):
            raise ValueError(f"sensors must be a list of names in the order of the columns, got {sensors!r}")
        unit = UNITS[validate.choice("unit", content.get("unit"), UNITS)]
        joints = content.get("joints")
        if not isinstance(joints, dict) or not joints:
            raise ValueError(f"joints must be a table with a line for each joint, got {joints!r}")
        offset, gain = np.zeros(len(joints)), np.zeros((len(joints), len(sensors)))
        for row, (joint, line) in enumerate(joints.items()):
            if not isinstance(line, dict):
                raise ValueError(f"joint {joint} must be a table of offset_deg and gains, got {line!r}")
            validate.keywords(f"joint {joint}", line, ("offset_deg", "gains"))
            offset[row] = np.deg2rad(validate.number(f"offset_deg of {joint}", line.get("offset_deg", 0.0)))
            for sensor, value in dict(line.get("gains", {})).items():
                column = sensors.index(validate.choice(f"sensor of {joint}", sensor, sensors))
                gain[row, column] = validate.number(f"gain of {sensor} for {joint}", value)
    except ValueError as error:
        raise ValueError(f"{source}: {error}") from error
    return Calibration(source, tuple(sensors), unit, tuple(joints), offset, gain)


def read(path: Path, *, part: str | None, calibration: Calibration | None, largest_gap: float) -> Recording:
    """The glove's recording in `path`; raises `ValueError` that names the line for what is wrong."""
    if calibration is None:
        raise ValueError(f"{path}: a glove's recording needs a calibration, which says what its sensors mean")
    if part is not None:
        raise ValueError(f"{path}: it holds one recording, no part {part!r}")
    try:
        lines = path.read_text().splitlines()
    except UnicodeDecodeError as error:
        raise ValueError(f"{path}: not a text file ({error})") from error
    numbers = [number for number, line in enumerate(lines, start=1) if line.strip()]
    if len(numbers) < 2:
        raise ValueError(f"{path}: a recording needs two frames, got {len(numbers)} lines")
    rows = [_row(f"{path}, line {number}", lines[number - 1].split(), calibration.sensors) for number in numbers]
    time = np.array([stamp for stamp, _ in rows])
    time -= time[0]
    check_times(str(path), time, largest_gap, lambda frame: f"line {numbers[frame]}")
    angles = calibration.joint_angles(np.array([values for _, values in rows]))
    return Recording(str(path), time, calibration.joint_names, angles)


def _row(where: str, cells: list[str], sensors: tuple[str, ...]) -> tuple[float, list[float]]:
    """Time in s and the sensors' values of one line."""
    count = BEFORE + len(sensors)
    if len(cells) != count:
        raise ValueError(
            f"{where}: {len(cells)} columns instead of {count} (6 of date and time, the switch, {len(sensors)} sensors)"
        )
    try:
        *date, second = (float(cell) for cell in cells[: BEFORE - 1])
        validate.number("second", second, 0.0, 61.0)
        time = datetime(*map(int, date), tzinfo=UTC).timestamp() + second  # type: ignore[arg-type, misc]
    except (ValueError, OverflowError) as error:
        raise ValueError(f"{where}: {' '.join(cells[: BEFORE - 1])!r} is no date and time ({error})") from error
    values = []
    for sensor, cell in zip(sensors, cells[BEFORE:], strict=True):
        try:
            value = float(cell)
        except ValueError as error:
            raise ValueError(f"{where}: {sensor} is {cell!r}, no number") from error
        if not math.isfinite(value):
            raise ValueError(f"{where}: {sensor} is {cell!r}, not finite")
        values.append(value)
    return time, values
