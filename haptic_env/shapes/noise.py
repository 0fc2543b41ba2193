"""Smooth solids that have no name, one for each seed, such as people are given to feel."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from haptic_env import validate
from haptic_env.shapes.proportions import extents_of
from haptic_env.shapes.star_shaped import StarShaped

WAVES = 12
SLOWEST, FASTEST = 1.5, 4.0  # radians of a wave per radius: from one broad bulge to a few
WILDEST = 0.3


class Noise(StarShaped):
    """A ball whose log radius is a sum of waves in random directions, at random phases."""

    convex = False

    def __init__(self, seed: int = 0, amplitude: float = 0.15) -> None:
        """Choose the solid.

        Args:
            seed: of the waves; the same gives the same solid.
            amplitude: SD of the log radius over the surface, in [0, 0.3]; 0 is a ball.

        Raises:
            ValueError: where one is out of range.
        """
        self.seed = validate.integer("noise's seed", seed, 0)
        self.amplitude = validate.number("noise's amplitude", amplitude, 0.0, WILDEST)
        rng = np.random.default_rng(self.seed)
        wave = rng.standard_normal((3, WAVES))
        self._wave = wave / np.linalg.norm(wave, axis=0) * rng.uniform(SLOWEST, FASTEST, WAVES)
        self._phase = rng.uniform(0.0, 2 * np.pi, WAVES)
        self.default_size = extents_of("noise", *self._box[1])

    def radius(self, directions: NDArray[np.float64]) -> NDArray[np.float64]:
        waves = np.cos(directions @ self._wave + self._phase).sum(axis=1)
        return np.exp(self.amplitude * waves / np.sqrt(WAVES / 2))
