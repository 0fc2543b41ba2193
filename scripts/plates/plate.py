"""What every figure gives: a picture for print, its data, and a film where it moves."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any, NamedTuple

import pandas as pd
from files import atomic
from matplotlib.animation import FuncAnimation, PillowWriter
from matplotlib.figure import Figure
from showing import Showing

Wanted = Sequence[tuple[str, float]]  # explorations, by shape and sigma in degrees
Find = Callable[[str, float], Showing]
WIDTH = 7.2  # inches: a page of two columns
PRINT: Any = {
    "savefig.dpi": 200,
    "pdf.fonttype": 42,
    "font.size": 8,
    "axes.titlesize": 8.5,
    "figure.dpi": 100,
}
SCREEN_DPI = 100


class Plate(NamedTuple):
    """`figure` and the `data` that it shows; `film`, where there is one, with its frames a second."""

    figure: Figure
    data: pd.DataFrame
    film: FuncAnimation | None = None
    frames_per_second: float = 10.0


def save(plate: Plate, name: str, folder: Path) -> list[str]:
    """Write `name`.png, .pdf, .csv and, where it moves, .gif to `folder`; returns what was written."""
    names = [f"{name}.{kind}" for kind in ("png", "pdf", "csv")]
    if plate.film is not None:
        names.append(f"{name}.gif")
        with atomic(folder / names[-1]) as place:
            plate.film.save(place, PillowWriter(fps=round(plate.frames_per_second)), dpi=SCREEN_DPI)
    with atomic(folder / names[0]) as place:
        plate.figure.savefig(place)
    with atomic(folder / names[1]) as place:
        plate.figure.savefig(place, metadata={"CreationDate": None})
    with atomic(folder / names[2]) as place:
        plate.data.to_csv(place, index=False)
    return names
