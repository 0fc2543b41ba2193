"""What each idea of the observer is worth: variants of it over the same trials, one idea changed at a time."""

from __future__ import annotations

import math
from pathlib import Path
from textwrap import fill

import numpy as np
import pandas as pd
from matplotlib.figure import Figure
from rich import box
from rich.console import Console
from rich.table import Table
from rich.text import Text

from haptic_env import validate
from haptic_lab.analysis.statistics import interval, side
from haptic_lab.files import write_table
from haptic_lab.style import BETTER, OUTLINE, WORSE
from observer.variants import FULL

# Column of the table of trials: what it is called, and whether more of it is better (None: neither).
COLUMNS: dict[str, tuple[str, bool | None]] = {
    "pose_error_lagged": ("pose error, lagged (σ)", False),
    "pose_error_online": ("pose error, online (σ)", False),
    "coverage_90_lagged": ("90 % interval holds", None),
    "surface_f_score_1": ("F-score, last map", True),
    "growing_f_score_1": ("F-score, growing map", True),
    "skin_brier": ("Brier, last map", False),
    "growing_brier": ("Brier, growing map", False),
    "correct_2s": ("named right after 2 s", True),
}


def compare(rows: pd.DataFrame) -> pd.DataFrame:
    """Compare the observers of a table with the full one, or those of several changes, "paper+no_lag", with what is
    without the last change, if it is there.

    Args:
        rows: of the table of trials.

    Returns:
        A line for each noise, observer and measure of `COLUMNS`: `mean`, half of its 95 % interval (`half`), number of
        `trials`, and mean and 95 % interval (`low`, `high`) of the `difference` to the `reference`, trial by trial.
    """
    relative = {
        f"pose_error_{when}": rows[f"pose_error_{when}_deg"] / rows["sigma_deg"] for when in ("lagged", "online")
    }
    trials = rows.assign(**relative).set_index(["sigma_deg", "shape", "seed"])
    lines = []
    for sigma, of_sigma in trials.groupby("sigma_deg"):
        each = dict(iter(of_sigma.groupby("observer", sort=False)))
        for observer, mine in each.items():
            without = str(observer).rpartition("+")[0]
            reference = without if without in each else FULL
            for measure in COLUMNS:
                mean, low, high, count = interval(mine[measure].dropna().to_numpy())
                gaps = interval((mine[measure] - each[reference][measure]).dropna().to_numpy())
                lines.append((sigma, observer, reference, measure, mean, 0.5 * (high - low), count, *gaps[:3]))
    names = ["sigma_deg", "observer", "reference", "measure", "mean", "half", "trials", "difference", "low", "high"]
    return pd.DataFrame(lines, columns=names)


def save(rows: pd.DataFrame, folder: Path) -> list[str]:
    """Write ablation.csv and ablation.png.

    Args:
        rows: of the table of trials.
        folder: to write to.

    Returns:
        The names of the files.
    """
    lines = compare(rows)
    return write_table(folder, "ablation", lines, draw(lines))


def print_table(path: Path, console: Console) -> None:
    """Print ablation.csv: of the full observer the means, of each variant the differences to its reference, each with
    its 95 % interval and coloured where it is surely better or worse.

    Args:
        path: of the file that `save` has written.
        console: to print to.
    """
    lines = pd.read_csv(path)
    for sigma, of_sigma in lines.groupby("sigma_deg"):
        title = (
            f"σ = {sigma:g}°, {of_sigma['trials'].max()} explorations: mean of {FULL} ± 95 %; of the others the "
            "difference to it, or to what stands before the last +, in the same explorations ± 95 %"
        )
        result = Table(title=title, title_justify="left", title_style="bold", box=box.SIMPLE_HEAD)
        result.add_column("variant", no_wrap=True)
        for heading, _ in COLUMNS.values():
            result.add_column(heading, justify="right")
        for observer, mine in of_sigma.groupby("observer", sort=False):
            cells = mine.set_index("measure")
            told = [_told(cells.loc[measure], more) for measure, (_, more) in COLUMNS.items()]
            result.add_row(str(observer), *told, style="bold" if observer == FULL else None)
        console.print(result)


def draw(lines: pd.DataFrame) -> Figure:
    """Draw how far each variant is from its reference, measure by measure, at the largest noise.

    Args:
        lines: what `compare` returns.

    Returns:
        A panel for each measure, a row for each variant.
    """
    sigma = lines["sigma_deg"].max()
    mine = lines[(lines["sigma_deg"] == sigma) & (lines["observer"] != FULL)]
    variants = list(dict.fromkeys(mine["observer"]))
    figure = Figure(figsize=(15, 1.8 + 0.32 * len(variants)), layout="constrained")
    panels = np.atleast_1d(figure.subplots(1, len(COLUMNS), sharey=True))
    for axes, (measure, (heading, more)) in zip(panels, COLUMNS.items(), strict=True):
        cells = mine[mine["measure"] == measure].set_index("observer").loc[variants]
        for place, (_, cell) in enumerate(cells.iterrows()):
            colour = _colour(cell["low"], cell["high"], more)
            axes.plot([cell["low"], cell["high"]], [place, place], color=colour, linewidth=2)
            axes.plot(cell["difference"], place, "o", color=colour, markersize=6)
        axes.axvline(0, color=OUTLINE, linewidth=1)
        axes.set_title(fill(heading, 14))
        axes.tick_params(axis="y", length=0)
        axes.grid(axis="y", color="#EEEEEE")
        axes.margins(x=0.1)
    panels[0].set(yticks=range(len(variants)), yticklabels=[each.replace("_", " ") for each in variants])
    panels[0].invert_yaxis()
    count = int(mine["trials"].max())
    figure.suptitle(
        f"One idea changed: difference to the full observer (or to what stands before the last +), σ = {sigma:g}°, "
        f"{validate.counted(count, 'exploration')}, 95 % intervals (red: worse, blue: better)",
        fontsize=11,
        fontweight="bold",
    )
    return figure


def _colour(low: float, high: float, more: bool | None) -> str:
    """Grey where the interval holds 0 or nothing is better than anything."""
    where = side(low, high)
    if more is None or not where:
        return "#777777"
    return BETTER if (where > 0) == more else WORSE


def _told(cell: pd.Series, more: bool | None) -> Text:
    if cell["observer"] == FULL:
        mean, half, sign, colour = cell["mean"], cell["half"], "", ""
    else:
        mean, half, sign = cell["difference"], 0.5 * (cell["high"] - cell["low"]), "+"
        colour = _colour(cell["low"], cell["high"], more)
    if math.isnan(mean):
        return Text("–")
    return Text(f"{mean:{sign}.4f}" + ("" if math.isnan(half) else f" ±{half:.4f}"), colour)
