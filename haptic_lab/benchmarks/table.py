"""The rows of the benchmark's table, and the table."""

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
    """One row: the `median` over all steps, over those with contact (`touching`), and of each step's `least` over the
    rounds; `note` says what it compares with."""

    name: str
    unit: str
    median: float
    touching: float = math.nan
    least: float = math.nan
    note: str = ""


def beyond(whole: Any, bare: Any, touching: Any) -> BenchRow:
    """What steps take (rounds, T) s `whole`, beyond what `bare` takes from the same state next to it: of all pairs. A
    least difference would be one whose bare part was disturbed; so least is taken of each part by itself."""
    low, high = 1e6 * np.percentile(whole - bare, [25, 75])
    row = of_steps("env.step beyond its mj_step calls", whole - bare, touching)
    least = 1e6 * float(np.median(whole.min(axis=0) - bare.min(axis=0)))
    note = f"half of {whole.size} pairs between {number(low)} and {number(high)} µs"
    return replace(row, least=least, note=note)


def of_steps(name: str, seconds: Any, touching: Any, skip: int = 0, unit: str = "µs", note: str = "") -> BenchRow:
    """A row from the `seconds` (rounds, T) of every step but the first `skip`; `touching` (T,)."""
    scale = {"µs": 1e6, "ms": 1e3}[unit]
    middle = np.median(seconds, axis=0)[skip:]
    felt = middle[touching[skip:]]
    least = np.min(seconds, axis=0)[skip:]
    median, contact, low = (scale * float(np.median(each)) if each.size else math.nan for each in (middle, felt, least))
    return BenchRow(name, unit, median, contact, low, note)


def spread(values: Any) -> tuple[float, float, float]:
    """Median, nothing and least of one number a round."""
    return float(np.median(values)), math.nan, float(np.min(values))


def number(value: float) -> str:
    return f"{value:.3g}" if abs(value) < 1000 else f"{value:.0f}"


def table(figures: list[BenchRow], rounds: int) -> Table:
    """The figures as a person reads them."""
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
    """What the figures were measured on."""
    return {
        "processor": platform.processor() or platform.machine(),
        "cores": os.cpu_count(),
        "system": platform.system(),
        "python": platform.python_version(),
        "numba": numba.__version__,
        "numpy": np.__version__,
    }
