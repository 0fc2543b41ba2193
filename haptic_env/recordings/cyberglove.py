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

from haptic_env import readable, reading, validate
from haptic_env.arrays import Array
from haptic_env.recordings import checks
from haptic_env.recordings.recording import Recording

BEFORE = 7  # columns before those of the sensors: the date in six, and the switch
MOST_GAIN = 1000.0
LARGEST = 1e6  # of what a sensor says, in any unit
UNITS = {"radians": 1.0, "degrees": math.pi / 180}
PACKAGED = files("haptic_env.recordings") / "calibrations"


@dataclass(frozen=True)
class Calibration:
    """What the S sensors of a glove say of J joints: angle = `offset` + `gain` · sensors.

    Attributes:
        source: where it comes from, for messages.
        sensors: (S,) names of the columns of a file, in their order.
        unit: rad, of what the file says.
        joint_names: (J,).
        offset: (J,) rad.
        gain: (J, S).
    """

    source: str
    sensors: tuple[str, ...]
    unit: float
    joint_names: tuple[str, ...]
    offset: Array
    gain: Array

    __repr__ = readable.line

    def joint_angles(self, sensors: Array) -> Array:
        """Compute joint angles.

        Args:
            sensors: (T, S) in the unit of the file.

        Returns:
            (T, J) rad.

        Raises:
            ValueError: for other sensors, or what is not finite or beyond ± `LARGEST`.
        """
        values = validate.numbers("sensors", sensors, 2, bound=LARGEST)
        if values.shape[1] != len(self.sensors):
            raise ValueError(f"sensors must be of shape (T, {len(self.sensors)}), got {values.shape}")
        return np.asarray(self.offset + self.unit * values @ self.gain.T)


def calibration_for(hand: str) -> Calibration:
    """Read the calibration that comes for a hand.

    Args:
        hand: its name.

    Returns:
        The calibration.

    Raises:
        ValueError: where none comes for it.
    """
    names = sorted(each.name.removesuffix(".toml") for each in PACKAGED.iterdir() if each.name.endswith(".toml"))
    name = validate.choice("hand with a glove's calibration", hand, names)
    return _calibration(f"{name}.toml", tomllib.loads((PACKAGED / f"{name}.toml").read_text("utf-8")))


def read_calibration(path: Path | str) -> Calibration:
    """Read a calibration from a TOML file laid out as those in haptic_env/recordings/calibrations.

    Args:
        path: of the file.

    Returns:
        The calibration.

    Raises:
        ValueError: for a key or sensor that is unknown, or a value that is no number.
        OSError: without the file.
    """
    place = validate.path("path", path)
    try:
        content = reading.toml(place)
    except ValueError as error:
        raise ValueError(f"{place}: {error}") from error
    return _calibration(str(place), content)


def _calibration(source: str, content: Mapping[str, Any]) -> Calibration:
    try:
        validate.keywords("calibration", content, ("sensors", "unit", "joints", "patches"))
        if not isinstance(content.get("patches", {}), dict):  # of whom the angles tell nothing
            raise ValueError(f"patches must be a table, got {validate.shown(content['patches'])}")
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
            degrees = validate.number(
                f"offset_deg of {joint}", line.get("offset_deg", 0.0), -360.0, 360.0, unit="degrees"
            )
            offset[row] = np.deg2rad(degrees)
            gains = line.get("gains", {})
            if not isinstance(gains, dict):
                raise ValueError(f"gains of {joint} must be a table with a number for each sensor, got {gains!r}")
            for sensor, value in gains.items():
                column = sensors.index(validate.choice(f"sensor of {joint}", sensor, sensors))
                gain[row, column] = validate.number(f"gain of {sensor} for {joint}", value, -MOST_GAIN, MOST_GAIN)
    except ValueError as error:
        raise ValueError(f"{source}: {error}") from error
    return Calibration(source, tuple(sensors), unit, tuple(joints), offset, gain)


def read(path: Path, *, part: str | None, calibration: Calibration | None, largest_gap: float) -> Recording:
    """Read a glove's recording.

    Args:
        path: of the file.
        part: None; such a file holds one recording.
        calibration: what the sensors mean; needed.
        largest_gap: s, between two frames.

    Returns:
        The recording.

    Raises:
        ValueError: for what is wrong; it names the line.
        OSError: where it cannot be read.
    """
    if calibration is None:
        raise ValueError(f"{path}: a glove's recording needs a calibration, which says what its sensors mean")
    if part is not None:
        raise ValueError(f"{path}: it holds one recording, no part {part!r}")
    try:
        lines = reading.text(path).splitlines()
    except ValueError as error:
        raise ValueError(f"{path}: {error}") from error
    numbers, rows = [], []
    for number, row in enumerate(lines, start=1):
        if row.strip():
            numbers.append(number)
            rows.append(_row(f"{path}, line {number}", row.split(), calibration.sensors))
    if len(rows) < 2:
        raise ValueError(f"{path}: a recording needs two frames, got {len(rows)} lines")
    time = np.array([stamp for stamp, _ in rows])
    time -= time[0]

    def line(frame: int) -> str:
        return f"line {numbers[frame]}"

    checks.times(str(path), time, largest_gap, line)
    angles = calibration.joint_angles(np.array([values for _, values in rows]))
    checks.angles(str(path), "joint_angles", angles, calibration.joint_names, line)
    checks.leaps(str(path), angles, calibration.joint_names, line)
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
        if not all(cell.is_integer() for cell in date):
            raise ValueError("all but the seconds must be whole")
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
        if abs(value) > LARGEST:
            raise ValueError(f"{where}: {sensor} is {cell!r}, beyond {LARGEST:g}")
        values.append(value)
    return time, values
