"""The offsets of felt angles that an exploration has found: as a table, as a panel, and as a file to calibrate by.

Shapes: T steps, J joints. Offsets are what felt angles are too large by, at the end of the exploration.
"""

from __future__ import annotations

import json
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from rich.table import Table

from haptic_env import validate
from haptic_lab.exploration.patches import DEAD, STUCK, Found
from haptic_lab.files import atomic, check_output, write_text
from haptic_lab.records import BeliefTrace, Exploration
from haptic_lab.style import OUTLINE, as_drawn

INTERVAL = 1.645  # SDs on each side: 90 %
LEAST = 1e-4  # degrees: the last digit of a file
HEAD = """# Offsets of felt joint angles, found by touch: `haptic-slam explore --save-offsets`, {source}.
# In the form of a glove's calibration, whose sensors are the felt angles themselves:
#     joint angle = offset_deg + felt angle.
# To mend the calibration that the felt angles came from, add each offset_deg to its own.
"""
PATCHES = """# Patches that do not work, as --believed-patches-stuck and --believed-patches-dead take them, and the
# probability that each works."""


def believed(told: Mapping[str, Any]) -> bool:
    """Say whether an observer believes that felt angles have offsets.

    Args:
        told: keywords of the observer.

    Returns:
        Whether there is anything to find that could be told.
    """
    return any(np.max(told.get(name, 0.0)) >= LEAST for name in ("bias_deg", "drift_deg"))


def check(path: str, out: str, told: Mapping[str, Any]) -> None:
    """Check that offsets will be found, and can be kept.

    Args:
        path: of the file for them.
        out: folder of the exploration, which may be made yet.
        told: keywords of the observer.

    Raises:
        ValueError: where the observer believes in none, or there can be no such file.
    """
    if Path(path).suffix.lower() != ".toml":
        raise ValueError(f"--save-offsets must be the path of a .toml file, got {validate.shown(path)}")
    if not believed(told):
        raise ValueError(
            "--save-offsets needs an observer that believes in offsets: --bias-deg, --believed-bias-deg or --believed"
        )
    check_output("--save-offsets", Path(path), Path(out))


def found(exploration: Exploration, trace: BeliefTrace) -> dict[str, dict[str, float | None]]:
    """Say what was found.

    Args:
        exploration: what happened.
        trace: what the observer believed.

    Returns:
        For each joint `degrees`, `std_degrees` and `true_degrees` (None where nobody knows); nothing where the observer
        believed that there are no offsets.
    """
    if not trace.joint_offset_std.any():
        return {}
    mean, std = np.rad2deg(trace.joint_offset[-1]), np.rad2deg(trace.joint_offset_std[-1])
    true = exploration.joint_offset
    truth = [None] * len(mean) if true is None else np.rad2deg(true[-1]).tolist()
    names = exploration.hand.joint_names
    return {
        name: {"degrees": float(each), "std_degrees": float(spread), "true_degrees": so}
        for name, each, spread, so in zip(names, mean, std, truth, strict=True)
    }


def table(offsets: Mapping[str, Mapping[str, float | None]]) -> Table:
    """Lay out the offsets as a person reads them.

    Args:
        offsets: what `found` returns.

    Returns:
        A row for each joint.
    """
    known = all(each["true_degrees"] is not None for each in offsets.values())
    some = any(each["degrees"] for each in offsets.values())
    title = "Offsets of felt angles, found by touch" if some else "Offsets of felt angles: nothing tells of them here"
    result = Table(title=title, title_justify="left")
    for name in ("joint", "offset", "± SD", *(["in truth"] if known else [])):
        result.add_column(name, justify="left" if name == "joint" else "right")
    for joint, each in offsets.items():
        shown = [f"{each[name]:+.2f}°" for name in ("degrees", "true_degrees") if each[name] is not None]
        result.add_row(joint, shown[0], f"{each['std_degrees']:.2f}°", *shown[1:])
    return result


def draw(axes: Axes, offsets: Mapping[str, Mapping[str, float | None]]) -> None:
    """Draw the offset of each joint with its 90 % interval, and the true one where it is known.

    Args:
        axes: to draw into.
        offsets: what `found` returns.
    """
    rows, few = np.arange(len(offsets)), len(offsets) <= 12
    mean, std, true = (
        np.array([each[name] for each in offsets.values()], dtype=np.float64)  # NaN for what nobody knows
        for name in ("degrees", "std_degrees", "true_degrees")
    )
    axes.axvline(0.0, color="#777777", linewidth=0.8, linestyle=":")
    if np.isfinite(true).all():
        axes.plot(true, rows, "|", color="#D55E00", markersize=13 if few else 7, markeredgewidth=2.5, label="true")
    found: Any = {"xerr": INTERVAL * std, "fmt": "o", "color": OUTLINE, "markersize": 3.5, "capsize": 2}
    axes.errorbar(mean, rows, label="found, 90 %", **found)
    axes.set(
        title="Offsets of the felt angles",
        xlabel="felt too large by (degrees)",
        yticks=rows,
        yticklabels=[as_drawn(name) for name in offsets],
        ylim=(len(offsets) - 0.4, -0.6),
    )
    axes.tick_params(axis="y", labelsize=8 if few else 5, length=0)
    axes.legend(loc="best", fontsize=8, frameon=True, framealpha=0.9, edgecolor="none")


def save(path: Path, offsets: Mapping[str, Mapping[str, float | None]], source: str, patches: Found) -> None:
    """Write what was found as a calibration that `haptic_env.recordings.read_calibration` takes.

    Args:
        path: of the .toml file.
        offsets: what `found` returns.
        source: says what was explored, in a line.
        patches: that were found to lie; nothing where nobody looked for them.
    """
    lines = [HEAD.format(source=source), f"sensors = {json.dumps(list(offsets))}", 'unit = "radians"', "", "[joints]"]
    for joint, each in offsets.items():
        name, degrees = json.dumps(joint), -float(each["degrees"] or 0.0)
        line = f"{name} = {{ offset_deg = {degrees:.4f}, gains = {{ {name} = 1.0 }} }}"
        lines.append(f"{line}  # ± {each['std_degrees']:.2f} degrees (SD)")
    if patches:
        lines += ["", PATCHES, "[patches]"]
        for fault in (STUCK, DEAD):
            lines.append(f"{fault} = {json.dumps([name for name in patches if patches[name]['believed'] == fault])}")
        lines += ["", "[patches.reliability]"]
        lines += [f"{json.dumps(name)} = {each['reliability']:.6f}" for name, each in patches.items()]
    with atomic(path) as place:
        write_text(place, "\n".join(lines) + "\n")
