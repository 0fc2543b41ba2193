"""A picture of an exploration in a task: the scene, and beside it what is believed.

Shapes: H × W pixels, C labels.
"""

from __future__ import annotations

from typing import Any

import gymnasium as gym
import numpy as np
from matplotlib.axes import Axes
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure
from numpy.typing import NDArray

from haptic_env import hand_of
from haptic_lab.panels import SIDES, draw_map
from haptic_lab.style import as_drawn, colours_of, styled, titles_of

DPI = 100
SHARE = 0.75  # of the scene's width, that of what is believed
MOST = 8  # names whose probabilities are shown, the most probable


class Picture:
    """Draws the frames of an environment, always of one size."""

    def __init__(self, env: gym.Env[Any, Any], scene: tuple[int, ...]) -> None:
        """Lay it out.

        Args:
            env: with an `ObserverWrapper`, and the truth in what its innermost environment knows.
            scene: (H, W, 3) of its pictures.
        """
        self._env, self._hand = env, hand_of(env)
        shape = env.get_wrapper_attr("shape")
        self._labels = () if shape is None else tuple(shape.labels)
        self._colours, self._titles = colours_of(self._labels), titles_of(self._labels)
        height, width = scene[0], int(SHARE * scene[1])
        self._figure = Figure(figsize=(width / DPI, height / DPI), dpi=DPI, layout="constrained")
        self._canvas = FigureCanvasAgg(self._figure)

    @styled
    def draw(self, scene: NDArray[np.uint8], posterior: NDArray[np.float64] | None) -> NDArray[np.uint8]:
        """Draw a frame.

        Args:
            scene: (H, W, 3).
            posterior: (C,) of the labels; None: nobody names.

        Returns:
            (H, W', 3): the scene, the map from two sides with the hand where it is believed to be, and the names.
        """
        belief = self._env.get_wrapper_attr("belief")
        base: Any = self._env.unwrapped
        self._figure.clear()
        grid = self._figure.add_gridspec(2, 2)
        places = [grid[0, 0], grid[0, 1]] if posterior is not None else [grid[0, 0], grid[0, 1], grid[1, :]]
        sides = [self._figure.add_subplot(each) for each in places]
        if posterior is not None:
            self._draw_names(self._figure.add_subplot(grid[1, :]), base.solid.name, posterior)
        self._figure.draw_without_rendering()  # the hand's lines need the size of the panels
        for axes, side in zip(sides, SIDES, strict=False):
            draw_map(axes, belief.occupancy, belief.grid, base.solid, side, self._hand, belief.joint_angles)
            axes.set(xlabel="", ylabel="")
        self._canvas.draw()
        believed = np.asarray(self._canvas.buffer_rgba())[..., :3]
        return np.concatenate([scene, believed], axis=1)

    def _draw_names(self, axes: Axes, truth: str, posterior: NDArray[np.float64]) -> None:
        """The most probable names, and the truth."""
        first = [int(index) for index in np.argsort(-posterior)[:MOST]]
        if len(self._labels) <= MOST:
            first = list(range(len(self._labels)))
        shown = [self._labels[index] for index in first]
        titles = [as_drawn(self._titles[each]) + (" (true)" if each == truth else "") for each in shown]
        axes.barh(range(len(shown)), posterior[first], color=[self._colours[each] for each in shown], alpha=0.7)
        for row, title in enumerate(titles):  # inside, so that all frames are laid out alike
            axes.text(0.01, row, title, fontsize=8, verticalalignment="center")
        axes.set(title="What the object is", xlabel="posterior", xlim=(0, 1), yticks=[])
        axes.invert_yaxis()
