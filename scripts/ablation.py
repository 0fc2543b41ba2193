"""What each idea of the observer is worth: variants of it over the same trials, one idea changed at a time."""

from __future__ import annotations

import math
from pathlib import Path

import numpy as np
import pandas as pd
from files import write_table
from matplotlib.figure import Figure
from report import interval
from rich import box
from rich.console import Console
from rich.table import Table
from style import BETTER, OUTLINE, WORSE

from observer.variants import ABLATION

FULL = ABLATION[0]
# Column of the table of trials: what it is called, and whether more of it is better (None: neither).
COLUMNS: dict[str, tuple[str, bool | None]] = {
    "pose_error_lagged": ("pose error, lagged (σ)", False),
    "pose_error_online": ("pose error, online (σ)", False),
    "coverage_90_lagged": ("90 % interval holds", None),
    "surface_f_score_2": ("F-score, 2 voxels", True),
    "occupancy_ece": ("ECE of occupancy", False),
    "shape_posterior_correct": ("named right", True),
}


def compare(rows: pd.DataFrame) -> pd.DataFrame:
    """One line for each noise, observer and measure of `COLUMNS`: `mean`, half of its 95 % interval (`half`), number
    of `trials`, and mean and 95 % interval of the `difference` to the full observer, trial by trial."""
    relative = {
        f"pose_error_{when}": rows[f"pose_error_{when}_deg"] / rows["sigma_deg"] for when in ("lagged", "online")
    }
    trials = rows.assign(**relative).set_index(["sigma_deg", "shape", "seed"])
    lines = []
    for sigma, of_sigma in trials.groupby("sigma_deg"):
        full = of_sigma[of_sigma["observer"] == FULL]
        for observer, mine in of_sigma.groupby("observer", sort=False):
            for measure in COLUMNS:
                mean, low, high, count = interval(mine[measure].dropna().to_numpy())
                gaps = (mine[measure] - full[measure]).dropna().to_numpy()
                lines.append((sigma, observer, measure, mean, 0.5 * (high - low), count, *interval(gaps)[:3]))
    names = ["sigma_deg", "observer", "measure", "mean", "half", "trials", "difference", "low", "high"]
    return pd.DataFrame(lines, columns=names)


def save(rows: pd.DataFrame, folder: Path) -> list[str]:
    """Write ablation.csv and ablation.png of a table's `rows` to `folder`; returns their names."""
    lines = compare(rows)
    return write_table(folder, "ablation", lines, draw(lines))


def print_table(path: Path, console: Console) -> None:
    """Print the table at `path`: a row for each variant, best estimate and 95 % interval."""
    lines = pd.read_csv(path)
    for sigma, of_sigma in lines.groupby("sigma_deg"):
        title = f"σ = {sigma:g}°, {of_sigma['trials'].max()} explorations: mean ± 95 %"
        result = Table(title=title, title_justify="left", title_style="bold", box=box.SIMPLE_HEAD)
        result.add_column("variant", no_wrap=True)
        for heading, _ in COLUMNS.values():
            result.add_column(heading, justify="right")
        for observer, mine in of_sigma.groupby("observer", sort=False):
            cells = mine.set_index("measure")
            told = [_cell(*cells.loc[measure, ["mean", "half"]]) for measure in COLUMNS]
            result.add_row(str(observer), *told, style="bold" if observer == FULL else None)
        console.print(result)


def draw(lines: pd.DataFrame) -> Figure:
    """How far each variant is from the full observer, measure by measure; the largest noise."""
    sigma = lines["sigma_deg"].max()
    mine = lines[(lines["sigma_deg"] == sigma) & (lines["observer"] != FULL)]
    variants = list(dict.fromkeys(mine["observer"]))
    figure = Figure(figsize=(13, 1.4 + 0.32 * len(variants)), layout="constrained")
    panels = np.atleast_1d(figure.subplots(1, len(COLUMNS), sharey=True))
    for axes, (measure, (heading, more)) in zip(panels, COLUMNS.items(), strict=True):
        cells = mine[mine["measure"] == measure].set_index("observer").loc[variants]
        for place, (_, cell) in enumerate(cells.iterrows()):
            colour = _colour(cell["low"], cell["high"], more)
            axes.plot([cell["low"], cell["high"]], [place, place], color=colour, linewidth=2)
            axes.plot(cell["difference"], place, "o", color=colour, markersize=6)
        axes.axvline(0, color=OUTLINE, linewidth=1)
        axes.set_title(heading)
        axes.tick_params(axis="y", length=0)
        axes.grid(axis="y", color="#EEEEEE")
        axes.margins(x=0.1)
    panels[0].set(yticks=range(len(variants)), yticklabels=[each.replace("_", " ") for each in variants])
    panels[0].invert_yaxis()
    count = int(mine["trials"].max())
    figure.suptitle(
        f"One idea changed: difference to the full observer, σ = {sigma:g}°, {count} explorations, 95 % intervals "
        "(red: worse, blue: better)",
        fontsize=11,
        fontweight="bold",
    )
    return figure


def _colour(low: float, high: float, more: bool | None) -> str:
    """Grey where the interval holds 0 or nothing is better than anything."""
    if more is None or math.isnan(low) or low <= 0 <= high:
        return "#777777"
    return BETTER if (low > 0) == more else WORSE


def _cell(mean: float, half: float) -> str:
    if math.isnan(mean):
        return "–"
    return f"{mean:.3f}" if math.isnan(half) else f"{mean:.3f} ±{half:.3f}"
