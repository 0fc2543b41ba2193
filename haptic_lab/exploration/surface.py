"""The surface of what an exploration touched: as a file, as a table of how well it fits, and as a picture."""

from __future__ import annotations

import math
import os
from pathlib import Path
from typing import Any

from rich.console import Console
from rich.table import Table

from haptic_env import validate
from haptic_env.shapes import triangles
from haptic_env.shapes.mesh import is_path
from haptic_lab.exploration.surface_picture import picture
from haptic_lab.files import atomic, check_output
from haptic_lab.records import BeliefTrace, Exploration
from observer import metrics
from observer.surface import Surface, files
from observer.surface.metrics import MeshScore, mesh_score

PICTURE = "surface.png"
ROWS = {  # of the table: what a figure is called, and how it is written
    "chamfer_felt_mm": ("Chamfer distance, of the part that was felt", "{:.1f} mm"),
    "band_felt": ("90 % band holds what was felt", "{:.0%} of it"),
    "std_felt_mm": ("mean SD, of the part that was felt", "{:.1f} mm"),
    "chamfer_mm": ("Chamfer distance, of the whole", "{:.1f} mm"),
    "band": ("90 % band holds the whole", "{:.0%} of it"),
    "std_mm": ("mean SD, of the whole", "{:.1f} mm"),
    "f_score": ("F-score at 5 mm", "{:.2f}"),
    "iou": ("IoU (filled)", "{:.2f}"),
    "normal_consistency": ("normal consistency", "{:.2f}"),
}


def resolve(given: dict[str, Any], recorded: bool) -> None:
    """Tell a mesh that is explored from one that is written.

    Args:
        given: the flags; `mesh` becomes `shape` or `save_mesh`.
        recorded: whether a recording is repeated, of which a mesh alone is the object that was held.

    Raises:
        ValueError: where it can be neither.
    """
    path = given.pop("mesh")
    if path is None:
        return
    there = is_path(path) and os.path.exists(path) and not files.is_ours(Path(path))
    if given["shape"] is None and (recorded or there):
        given["shape"] = path
    elif given["save_mesh"] is None:
        given["save_mesh"] = path
    else:
        raise ValueError(
            f"--mesh {validate.shown(path)} is one mesh too many: --shape says what is explored, --save-mesh where the "
            "surface is written"
        )


def check(path: str, out: str) -> None:
    """Check that a surface can be written.

    Args:
        path: of the file for it.
        out: folder of the exploration, which may be made yet.

    Raises:
        ValueError: where it cannot.
    """
    files.format_of("--save-mesh", Path(path))
    try:
        triangles.check()
    except ImportError as error:
        raise ValueError(f"--save-mesh: {error}") from error
    check_output("--save-mesh", Path(path), Path(out))


def write(path: Path, out: Path, exploration: Exploration, trace: BeliefTrace) -> dict[str, float]:
    """Draw the surface, and write it and its picture.

    Args:
        path: of the surface.
        out: folder for the picture.
        exploration: what happened.
        trace: what the observer believed.

    Returns:
        How well it fits; nothing where nothing was touched, so that nothing was written.
    """
    surface = trace.belief.surface()
    if surface.empty:
        return {}
    surface.save(path)
    touched = metrics.touched_places(
        exploration.hand, exploration.true_angles, exploration.contacts, exploration.solid, roots=exploration.roots
    )
    score = mesh_score(surface, exploration.solid, touched)
    figure = picture(surface, exploration.solid, touched, told(surface, score, exploration))
    with atomic(out / PICTURE) as place:
        figure.savefig(place)
    return score._asdict()


def told(surface: Surface, score: MeshScore, exploration: Exploration) -> str:
    """Say in a title what a picture shows.

    Args:
        surface: that is drawn.
        score: how well it fits.
        exploration: what happened.

    Returns:
        The title.
    """
    felt = "drawn from false touches"
    if math.isfinite(score.chamfer_felt_mm):
        felt = f"{score.chamfer_felt_mm:.1f} mm off where felt, SD {score.std_felt_mm:.1f} mm"
    guessed = 1000.0 * float(surface.std.max())
    return (
        f"{exploration.seconds[-1]:g} s of blind touch: the surface is {felt};\n"
        f"the rest is a guess, SD up to {guessed:.0f} mm"
    )


def tell(console: Console, score: dict[str, float], path: str, out: Path) -> None:
    """Say what came of it.

    Args:
        console: to say it on.
        score: what `write` returns.
        path: of the surface.
        out: folder of the picture.
    """
    if not score:
        console.print(f"Nothing was touched: the surface is empty, and {path} is not written.", highlight=False)
        return
    console.print(table(score))
    console.print(f"Surface, and its picture: {path}, {out / PICTURE}", highlight=False)


def table(score: dict[str, float]) -> Table:
    """Lay out how well a surface fits.

    Args:
        score: what `write` returns.

    Returns:
        The table as a person reads it.
    """
    result = Table(show_header=False, title="The surface, against the true object", title_justify="left")
    result.add_column(style="dim")
    result.add_column()
    for name, (title, form) in ROWS.items():
        result.add_row(title, form.format(score[name]) if math.isfinite(score[name]) else "it touched nothing")
    return result
