"""The registries of figures: add one as a file here and a line below.

Figures of trials are drawn from the rows of one sweep, those of noises from one in which more than sigma varies; scenes
from explorations of single shapes and sigmas (degrees).
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import NamedTuple

import pandas as pd

from haptic_env.hand import Hand
from haptic_lab.figures import (
    confusion,
    figure2,
    figure4,
    figure5,
    figure6,
    film,
    offsets,
    pose_error,
    reliability,
    time_course,
)
from haptic_lab.figures.paper_figure import Find, PaperFigure, Wanted, save


class SceneFigure(NamedTuple):
    """A figure of single explorations.

    Attributes:
        wanted: which explorations, given the shapes there are.
        draw: from these, each read when it is asked for.
    """

    wanted: Callable[[Sequence[str]], Wanted]
    draw: Callable[[Wanted, Find, Hand], PaperFigure]


FROM_EXPLORATIONS: dict[str, SceneFigure] = {
    "figure2": SceneFigure(figure2.wanted, figure2.draw),
    "figure4": SceneFigure(figure4.wanted, figure4.draw),
    "figure5": SceneFigure(figure5.wanted, figure5.draw),
    "film": SceneFigure(film.wanted, film.draw),
}
FROM_TRIALS: dict[str, Callable[[pd.DataFrame], PaperFigure]] = {
    "figure6": figure6.draw,
    "confusion": confusion.draw,
    "time_course": time_course.draw,
    "pose_error": pose_error.draw,
    "reliability": reliability.draw,
}
FROM_NOISES: dict[str, Callable[[pd.DataFrame], PaperFigure]] = {"offsets": offsets.draw}
FIGURES = tuple(sorted({**FROM_EXPLORATIONS, **FROM_TRIALS, **FROM_NOISES}))

__all__ = ["FIGURES", "FROM_EXPLORATIONS", "FROM_NOISES", "FROM_TRIALS", "PaperFigure", "SceneFigure", "save"]
