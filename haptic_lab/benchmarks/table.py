"""A row of the benchmark's table (`BenchRow`: a median over steps and rounds, with its unit), and the table."""

from __future__ import annotations

import math
import os
import platform
from dataclasses import dataclass, replace
from typing import Any

import numba
import numpy as np
from rich.table import Table


@dataclass(frozen=True)
class BenchRow:
    """One row.

    Attributes:
        name: of what was measured.
        unit: of the numbers.
        median: over all steps.
        touching: median over the steps with contact.
        least: median of each step's least over the rounds.
        note: what it compares with.
    """

    name: str
    unit: str
    median: float
    touching: float = math.nan
    least: float = math.nan
    note: str = ""


def beyond(whole: Any, bare: Any, touching: Any) -> BenchRow:
    """Make the row of what steps take beyond a part of them that was measured from the same state.

    A least difference would be one whose bare part was disturbed; so the least is taken of each by itself.

    Args:
        whole: (rounds, T) s.
        bare: (rounds, T) s, the part.
        touching: (T,) whether there was contact.

    Returns:
        The row, in µs.
    """
    low, high = 1e6 * np.percentile(whole - bare, [25, 75])
    row = of_steps("env.step beyond its mj_step calls", whole - bare, touching)
    least = 1e6 * float(np.median(whole.min(axis=0) - bare.min(axis=0)))
    note = f"half of {whole.size} pairs between {number(low)} and {number(high)} µs"
    return replace(row, least=least, note=note)


def of_steps(name: str, seconds: Any, touching: Any, skip: int = 0, unit: str = "µs", note: str = "") -> BenchRow:
    """Make the row of what was measured at every step.

    Args:
        name: of the row.
        seconds: (rounds, T).
        touching: (T,) whether there was contact.
        skip: so many first steps do not count.
        unit: "µs" or "ms", to which seconds are converted.
        note: of the row.

    Returns:
        The row.
    """
    scale = {"µs": 1e6, "ms": 1e3}[unit]
    middle = np.median(seconds, axis=0)[skip:]
    felt = middle[touching[skip:]]
    least = np.min(seconds, axis=0)[skip:]
    median, contact, low = (scale * float(np.median(each)) if each.size else math.nan for each in (middle, felt, least))
    return BenchRow(name, unit, median, contact, low, note)


def spread(values: Any) -> tuple[float, float, float]:
    """Summarise what was measured once a round.

    Args:
        values: one number a round.

    Returns:
        Median, NaN (of steps with contact), and least.
    """
    return float(np.median(values)), math.nan, float(np.min(values))


def number(value: float) -> str:
    """Round for the table.

    Args:
        value: in the unit of its row.

    Returns:
        At least three significant digits, as text.
    """
    return f"{value:.3g}" if abs(value) < 1000 else f"{value:.0f}"


def table(figures: list[BenchRow], rounds: int) -> Table:
    """Lay out what was measured.

    Args:
        figures: the rows.
        rounds: of which they are medians, for the title.

    Returns:
        The table as a person reads it.
    """
    result = Table(title=f"Medians of {rounds} interleaved rounds", title_justify="left")
    result.add_column("")
    for head in ("all steps", "touching", "least"):
        result.add_column(head, justify="right", no_wrap=True)
    result.add_column("", style="dim")
    for row in figures:
        numbers = ("" if math.isnan(x) else f"{number(x)} {row.unit}" for x in (row.median, row.touching, row.least))
        result.add_row(row.name, *numbers, row.note)
    return result


def machine() -> dict[str, Any]:
    """Describe what the figures were measured on.

    Returns:
        What JSON can say: processor, cores, system, versions.
    """
    return {
        "processor": platform.processor() or platform.machine(),
        "cores": os.cpu_count(),
        "system": platform.system(),
        "python": platform.python_version(),
        "numba": numba.__version__,
        "numpy": np.__version__,
    }
