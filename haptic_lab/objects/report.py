"""A line for each object: what it is, what the physics touches of it, or why it cannot be explored."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass

import numpy as np
import pandas as pd
from matplotlib.figure import Figure
from rich.table import Table
from rich.text import Text

from haptic_env import notice, shapes
from haptic_env.shapes.felt_surface import fit
from haptic_env.shapes.mesh import Mesh
from haptic_lab.style import OUTLINE, as_drawn, titles_of

MM = 1000.0
COMPARING = "Comparing objects with what physics can touch of them"
COLUMNS = (
    "object", "size_x_mm", "size_y_mm", "size_z_mm", "watertight", "pieces", "off_median_mm", "off_max_mm",
    "sticks_out_mm", "falls_short_mm", "volume_ml", "volume_difference", "astray", "refused",
)  # fmt: skip
WORST = "#D55E00"


@dataclass(frozen=True)
class ObjectReport:
    """How an object and its physics differ.

    Attributes:
        name: of the object.
        size_mm: (3,) full extents.
        watertight: whether it is a mesh that was found to be; None for a solid by name, which needs no file.
        pieces: convex ones that physics has.
        off_median_mm: how far the physics' surface is from the object's, the median.
        off_max_mm: the most.
        sticks_out_mm: the most outside of the object.
        falls_short_mm: the most inside of it.
        volume_ml: of the object.
        volume_difference: of the physics' volume from that, a fraction of it.
        astray: volume that only one of both has, a fraction of the object's.
        refused: why it cannot be explored; "" where it can.
    """

    name: str
    size_mm: tuple[float, float, float] = (np.nan, np.nan, np.nan)
    watertight: bool | None = None
    pieces: int = 0
    off_median_mm: float = np.nan
    off_max_mm: float = np.nan
    sticks_out_mm: float = np.nan
    falls_short_mm: float = np.nan
    volume_ml: float = np.nan
    volume_difference: float = np.nan
    astray: float = np.nan
    refused: str = ""


def report(names: Iterable[str], scale: float = 1.0) -> list[ObjectReport]:
    """Compare objects with what the physics can touch of them.

    Args:
        names: as `haptic_env.shapes.find` takes them.
        scale: metres that the unit of a mesh file is long.

    Returns:
        A report of each; what cannot be explored has the reason in it.
    """
    several, made = list(names), []
    for number, name in enumerate(several):
        notice.tell(COMPARING, number, len(several))
        try:
            made.append(_compared(name, scale))
        except (ValueError, ImportError) as error:  # the latter: packages for meshes that are not installed
            made.append(ObjectReport(name, refused=str(error)))
    notice.tell(COMPARING, len(several), len(several))
    return made


def _compared(name: str, scale: float) -> ObjectReport:
    shape, size = shapes.find(name), shapes.default_size(name, scale)
    found = fit(shape, size)
    x, y, z = (MM * size).tolist()
    off = MM * found.off
    return ObjectReport(
        name,
        (x, y, z),
        True if isinstance(shape, Mesh) else None,  # another would have been refused
        found.pieces,
        float(np.median(np.abs(off))),
        float(np.abs(off).max()),
        max(0.0, float(off.max())),
        max(0.0, float(-off.min())),
        1e6 * found.size,
        found.volume - 1.0,
        found.astray,
    )


def frame_of(reports: Iterable[ObjectReport]) -> pd.DataFrame:
    """Lay out reports for a file.

    Args:
        reports: of objects.

    Returns:
        A line for each, with `COLUMNS`.
    """
    rows = [
        (
            *(each.name, *each.size_mm, "" if each.watertight is None else each.watertight, each.pieces or ""),
            *(each.off_median_mm, each.off_max_mm, each.sticks_out_mm, each.falls_short_mm),
            *(each.volume_ml, each.volume_difference, each.astray, each.refused),
        )
        for each in reports
    ]
    return pd.DataFrame(rows, columns=COLUMNS)


def table(reports: list[ObjectReport]) -> Table:
    """Lay out reports for a person.

    Args:
        reports: of objects.

    Returns:
        The table.
    """
    result = Table(title="Objects, and how far the physics' surface is from theirs", title_justify="left")
    result.add_column("object")
    for head in ("size (mm)", "watertight", "pieces", "off, median (mm)", "at most", "volume"):
        result.add_column(head, justify="right")
    titles = titles_of([each.name for each in reports])
    for each in reports:
        if each.refused:
            result.add_row(Text(titles[each.name], style="red"), Text("refused", style="red"), *[""] * 5)
            continue
        result.add_row(
            titles[each.name],
            " × ".join(f"{extent:.0f}" for extent in each.size_mm),
            "yes" if each.watertight else "by name",
            str(each.pieces),
            f"{each.off_median_mm:.2f}",
            f"{each.off_max_mm:.2f}",
            f"{each.volume_difference:+.1%}",
        )
    return result


def picture(reports: list[ObjectReport]) -> Figure:
    """Draw how far the physics is off, object by object.

    Args:
        reports: of objects.

    Returns:
        The picture; what is refused is not in it.
    """
    shown = [each for each in reports if not each.refused]
    titles = titles_of([each.name for each in shown])
    figure = Figure(figsize=(8, max(2.0, 1.2 + 0.22 * len(shown))), layout="constrained")
    axes = figure.subplots()
    place = np.arange(len(shown))
    axes.barh(place, [each.sticks_out_mm for each in shown], color=WORST, height=0.7, label="sticks out at most")
    axes.barh(place, [-each.falls_short_mm for each in shown], color="#0072B2", height=0.7, label="falls short at most")
    middle = [each.off_median_mm for each in shown]
    axes.plot(middle, place, "|", color=OUTLINE, markersize=9, label="off either way, median")
    axes.axvline(0.0, color=OUTLINE, linewidth=1)
    axes.set(
        yticks=place,
        yticklabels=[as_drawn(titles[each.name]) for each in shown],
        xlabel="the physics' surface from the object's (mm)",
        title="What the physics touches against what the object is",
    )
    axes.set_xlim(min(-0.1, axes.get_xlim()[0]), max(0.1, axes.get_xlim()[1]))  # mm: less than that is nothing
    axes.invert_yaxis()
    figure.legend(loc="outside lower center", ncols=3)
    return figure


def refusals(reports: Iterable[ObjectReport]) -> list[str]:
    """List what cannot be explored, and why.

    Args:
        reports: of objects.

    Returns:
        A line for each.
    """
    told = [each for each in reports if each.refused]
    return [each.refused if each.name in each.refused else f"{each.name}: {each.refused}" for each in told]
