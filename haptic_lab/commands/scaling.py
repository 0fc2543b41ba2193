"""How the time of an observer's step grows: with particles, patches and candidates, and with the size of the grid.

Every point is the median over the steps with contact of one exploration, on one thread, of each step's least over the
rounds. Prints a table; --out takes a picture and the table as CSV.
"""

from __future__ import annotations

import argparse
import sys
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
from matplotlib.figure import Figure
from rich.console import Console
from rich.table import Table

from haptic_env import validate
from haptic_env.grid import Grid
from haptic_lab.benchmarks import timings
from haptic_lab.benchmarks.recording import record
from haptic_lab.files import write_table
from haptic_lab.folder_lock import claimed
from haptic_lab.progress import tracked
from haptic_lab.style import styled
from haptic_lab.terminal import Parser, as_path
from observer import HapticSLAM

EXAMPLE = "example: haptic-slam scaling --rounds 5 --out out/scaling"
ENV = "HapticSLAM/TwoFinger-v0"
NOISE = 0.1  # of the time itself: so much is the machine's
VOXEL = 0.004  # metres; a larger grid reaches further
AXES = {
    "particles": "particles N",
    "candidates": "candidates K",
    "patches": "patches P",
    "voxels": "voxels of 4 mm along an edge",
}
ONE = {"particles": "particle", "candidates": "candidate", "patches": "patch", "voxels": "million voxels"}
USUAL = {"particles": 200, "candidates": 8, "voxels": 32}  # of patches: the fewest


@dataclass(frozen=True)
class ScalingPoint:
    """One observer.

    Attributes:
        axis: the attribute that is varied of it.
        value: of that.
        particles: N.
        candidates: K of scan matching.
        around: patches about a finger.
        voxels: along the longest edge of the map.
    """

    axis: str
    value: int
    particles: int = 200
    candidates: int = 8
    around: int = 4
    voxels: int = 32


def settings(quick: bool) -> list[ScalingPoint]:
    """List all observers that are measured.

    Args:
        quick: few and small ones.

    Returns:
        One for each point of the curves.
    """
    few = 10 if quick else 200
    return [
        *(ScalingPoint("particles", n, particles=n) for n in ((5, 10) if quick else (50, 100, 200, 500, 1000, 2000))),
        *(ScalingPoint("candidates", k, few, candidates=k) for k in ((2, 8) if quick else (2, 4, 8, 16, 32))),
        *(ScalingPoint("patches", a, few, around=a) for a in ((4, 8) if quick else (4, 8, 16, 32))),
        *(ScalingPoint("voxels", v, few, voxels=v) for v in ((32, 48) if quick else (32, 48, 64, 96, 128))),
    ]


def measure(chosen: list[ScalingPoint], steps: int, rounds: int, console: Console) -> pd.DataFrame:
    """Time observers.

    Args:
        chosen: the observers.
        steps: of the exploration.
        rounds: repetitions, interleaved.
        console: says how far it is.

    Returns:
        A row for each of `chosen`: `axis`, `value`, and the median `ms` of its steps.
    """
    recordings = {
        around: record(ENV, "cube", 3.0, 0, steps, patches_around=around)
        for around in sorted({each.around for each in chosen})
    }
    least: dict[ScalingPoint, Any] = {}
    for turn in tracked(range(rounds * len(chosen)), "Measuring", rounds * len(chosen), console):
        each = chosen[turn % len(chosen)]
        recording = recordings[each.around]
        hand = recording.hand
        grid = Grid.around(hand.grasp_centre, np.full(3, each.voxels * VOXEL), VOXEL)
        slam = HapticSLAM(hand, 3.0, each.particles, candidates=each.candidates, grid=grid)
        took = timings.observe(slam, recording, threads=1)
        least[each] = np.minimum(least.get(each, np.inf), took)
        late = recording.lagged(slam.lag)
    rows = []
    for each, took in least.items():
        value = len(recordings[each.around].hand.patches) if each.axis == "patches" else each.value
        rows.append({"axis": each.axis, "value": value, "ms": 1e3 * float(np.median(took[late]))})
    return pd.DataFrame(rows)


def draw(rows: pd.DataFrame) -> Figure:
    """Draw the times, with the line of least squares, or their mean where they do not grow, and what is usual.

    Args:
        rows: what `measure` returns.

    Returns:
        A panel for each axis.
    """
    figure = Figure(figsize=(7.0, 5.2), layout="constrained")
    panels = figure.subplots(2, 2).ravel()
    for panel, (axis, label) in zip(panels, AXES.items(), strict=True):
        mine = rows[rows["axis"] == axis]
        of = mine["value"] ** 3 / 1e6 if axis == "voxels" else mine["value"]
        slope, start = np.polyfit(of, mine["ms"], 1)
        ends = np.array([0, of.max()])
        if slope * np.ptp(of) > NOISE * start:
            panel.plot(ends, start + slope * ends, color="#999999", linewidth=1)
            told = f"{float(f'{1e3 * slope:.2g}'):g} µs more for each {ONE[axis]}"
        else:  # times that fall where more is done are those of a machine that has other work
            panel.axhline(mine["ms"].mean(), color="#999999", linewidth=1, linestyle="--")
            told = f"no longer with more {axis}"
        panel.plot(of, mine["ms"], "o", color="#0072B2", markersize=5)
        usual = mine["value"] == USUAL.get(axis, mine["value"].min())
        panel.plot(of[usual], mine["ms"][usual], "o", color="#D55E00", markersize=8, label="as usual")
        panel.set_title(told, fontsize=10, fontweight="normal")
        named = "voxels of the map, millions" if axis == "voxels" else label
        panel.set(xlabel=named, ylim=(0, 1.15 * mine["ms"].max()), xlim=(0, 1.08 * of.max()))
    panels[0].legend(loc="upper left", frameon=False)
    figure.supylabel("a step with contact (ms)", fontsize=11)
    return figure


@styled
def main(arguments: list[str] | None = None) -> int:
    """Run the command.

    Args:
        arguments: of the command line; None: those of this process.

    Returns:
        Its exit code.
    """
    parser = Parser(description=__doc__, epilog=EXAMPLE, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--rounds", type=int, default=5, help="repetitions of everything, interleaved (default 5)")
    parser.add_argument("--quick", action="store_true", help="few particles and steps: to see that it runs")
    parser.add_argument(
        "--out", type=as_path, metavar="FOLDER", default="out/scaling", help="where to write (default out/scaling)"
    )
    given = parser.parse_args(arguments)
    try:
        rounds = validate.integer("--rounds", given.rounds, 1, 1000)
    except ValueError as error:
        parser.error(str(error))
    console = Console(width=None if sys.stdout.isatty() else 100)
    chosen, out = settings(given.quick), Path(given.out)
    with claimed(out, ("scaling.csv", "scaling.png")):
        measure(chosen[:1], 40, 1, console)  # compiles what is not in the cache
        rows = measure(chosen, 40 if given.quick else 120, rounds, console)
        table = Table("what grows", "to", "ms a step with contact")
        for row in rows.itertuples():
            table.add_row(AXES[row.axis], str(row.value), f"{row.ms:.2f}")
        console.print(table)
        console.print(f"Written to {out}: {', '.join(write_table(out, 'scaling', rows, draw(rows)))}", highlight=False)
    return 0
