"""A film of an exploration: the hand gropes, the map grows, and the name becomes sure."""

from __future__ import annotations

from collections.abc import Sequence

import pandas as pd
from matplotlib.figure import Figure

from haptic_env.hand import Hand
from haptic_lab.figures import isometric
from haptic_lab.figures.explorations import FRAMES_PER_SECOND, ShownExploration
from haptic_lab.figures.isometric_view import IsometricView
from haptic_lab.figures.paper_figure import Film, Find, PaperFigure, Wanted
from haptic_lab.style import OBSERVER_COLOURS, as_drawn, colours_of, titles_of
from observer import metrics

SHAPE, SIGMA = "cylinder", 3.0
LONGEST = 12.0  # seconds
POSES = 30
FELT, INFERRED = OBSERVER_COLOURS["floor"], OBSERVER_COLOURS["haptic_slam"]


def wanted(shapes: Sequence[str]) -> Wanted:
    """Choose one exploration.

    Args:
        shapes: that there are.

    Returns:
        One shape and sigma.
    """
    return [(SHAPE if SHAPE in shapes else shapes[-1], SIGMA)]


def draw(wanted: Wanted, find: Find, hand: Hand) -> PaperFigure:
    """Draw the scene on the left, the posterior and the pose error up to now on the right.

    Args:
        wanted: what `wanted` returns.
        find: reads an exploration.
        hand: that explored.

    Returns:
        A figure with a film; the picture is the last frame.
    """
    showing = find(*wanted[0])
    data = course(showing)
    last = showing.frame_at(LONGEST)
    duration = float(showing.seconds[showing.step[last] - 1])
    figure = Figure(figsize=(7.2, 3.6), layout="constrained")
    grid = figure.add_gridspec(2, 2, width_ratios=(1.35, 1))
    scene, names, error = (figure.add_subplot(each) for each in (grid[:, 0], grid[0, 1], grid[1, 1]))
    view = IsometricView.around(showing.grid)
    curves, labels = [], showing.labels.tolist()
    colours, titles = colours_of(labels), titles_of(labels)
    for label in labels:
        width = 2.2 if label == str(showing.shape) else 1.2
        (line,) = names.plot([], [], color=colours[label], linewidth=width, label=as_drawn(titles[label]))
        curves.append((line, f"p_{label}"))
    for label, column, colour in (("felt", "felt_error_deg", FELT), ("inferred", "inferred_error_deg", INFERRED)):
        (line,) = error.plot([], [], color=colour, linewidth=1.0, label=label)
        curves.append((line, column))
    names.set(xlim=(0, duration), ylim=(0, 1.02), ylabel="posterior", title="What the object is")
    error.set(xlim=(0, duration), xlabel="time (s)", ylabel="error (°)", title="Where the hand is")
    shown = data[data["seconds"] <= duration]
    error.set_ylim(0, 1.3 * shown["felt_error_deg"].max())
    names.legend(loc="center right", fontsize=7)
    error.legend(loc="upper right", fontsize=7, ncols=2)

    def show(frame: int) -> None:
        step = showing.step[frame] - 1
        scene.clear()
        occupancy = showing.occupancy[frame].astype(float)
        title = f"{showing.seconds[step]:4.1f} s of blind touch, σ = {showing.sigma_deg:g}°"
        isometric.draw_scene(scene, occupancy, showing.grid, showing.solid, view, title)
        isometric.draw_hand(scene, hand, showing.poses(frame, POSES), showing.grid, view, showing.solid, opacity=0.6)
        until = data.iloc[: step + 1]
        for line, column in curves:
            line.set_data(until["seconds"], until[column])

    show(last)
    return PaperFigure(figure, shown, Film(show, last + 1, 1.0 / FRAMES_PER_SECOND, list(colours.values())))


def course(showing: ShownExploration) -> pd.DataFrame:
    """List how an exploration went.

    Args:
        showing: the exploration.

    Returns:
        A line for each step: the errors of the felt and of the inferred angles (RMS over joints, degrees), and the
        posterior.
    """
    columns = {
        "seconds": showing.seconds,
        "felt_error_deg": metrics.pose_error_deg(showing.felt_angles, showing.true_angles),
        "inferred_error_deg": metrics.pose_error_deg(showing.lagged_angles, showing.true_angles),
    }
    posterior = {f"p_{label}": p for label, p in zip(showing.labels, showing.posterior.T, strict=True)}
    return pd.DataFrame({**columns, **posterior})
