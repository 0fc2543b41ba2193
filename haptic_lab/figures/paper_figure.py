"""A figure for print (`PaperFigure`: picture, data and film), and how it is written as PNG, PDF, CSV and GIF."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
import pandas as pd
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.colors import to_rgb
from matplotlib.figure import Figure
from PIL import Image

from haptic_lab.figures.explorations import ShownExploration
from haptic_lab.files import atomic, write_csv
from haptic_lab.style import OBSERVER_COLOURS, SHAPE_COLOURS

Wanted = Sequence[tuple[str, float]]  # explorations, by shape and sigma in degrees
Find = Callable[[str, float], ShownExploration]
WIDTH = 7.2  # inches: a page of two columns
KINDS = ("png", "pdf", "csv")
PRINT: Any = {
    "savefig.dpi": 200,
    "pdf.fonttype": 42,
    "font.size": 8,
    "axes.titlesize": 8.5,
    "figure.dpi": 100,
}


class Film(NamedTuple):
    """What moves in a figure.

    Attributes:
        show: draws the frame of that number into the figure.
        frames: how many there are.
        seconds: from one to the next.
        colours: of its thin lines, besides those that every picture may have.
    """

    show: Callable[[int], None]
    frames: int
    seconds: float
    colours: Sequence[str] = ()


class PaperFigure(NamedTuple):
    """A figure for print.

    Attributes:
        figure: the picture.
        data: that it shows.
        film: where it moves, of which the picture is the last frame.
    """

    figure: Figure
    data: pd.DataFrame
    film: Film | None = None


def save(drawn: PaperFigure, name: str, folder: Path) -> list[str]:
    """Write NAME.png, .pdf, .csv and, where it moves, .gif.

    Args:
        drawn: the figure.
        name: of the files.
        folder: to write to.

    Returns:
        The names of the files.
    """
    names = [f"{name}.{kind}" for kind in KINDS]
    with atomic(folder / names[0]) as place:
        drawn.figure.savefig(place)
    with atomic(folder / names[1]) as place:
        drawn.figure.savefig(place, metadata={"CreationDate": None})
    write_csv(folder / names[2], drawn.data)
    if drawn.film is not None:
        names.append(f"{name}.gif")
        with atomic(folder / names[-1]) as place:
            _save_film(drawn.figure, drawn.film, place)
    return names


def _save_film(figure: Figure, film: Film, path: Path) -> None:
    canvas, frames = FigureCanvasAgg(figure), []
    for frame in range(film.frames):
        film.show(frame)
        canvas.draw()
        frames.append(Image.fromarray(np.asarray(canvas.buffer_rgba())).convert("RGB"))
    # A GIF has 256 colours; thin lines would lose theirs to the shades of large areas.
    colours = [*SHAPE_COLOURS.values(), *OBSERVER_COLOURS.values()]
    colours += [each for each in film.colours if each not in colours]
    kept = [round(255 * part) for each in colours for part in to_rgb(each)]
    common = frames[-1].quantize(256 - len(colours))
    shades = np.reshape(common.getpalette() or [], (-1, 3))[: 256 - len(colours)]
    shades[(shades > 248).all(axis=1)] = 255  # paper is white
    common.putpalette([*shades.ravel().tolist(), *kept])
    first, *others = (each.quantize(palette=common, dither=Image.Dither.NONE) for each in frames)
    first.save(path, save_all=True, append_images=others, duration=round(1000 * film.seconds), loop=0)
