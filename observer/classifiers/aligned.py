"""Nearest neighbour in an object-centred frame: maps are compared where they overlap most, over SE(3).

Shapes: M exemplars, R rotations, (X, Y, Z) voxels. Rotations turn about the middle of the grid; translations are
whole voxels.

With a = p - 0.5, so that the unknown is 0 and fills what comes in from beyond the grid, the squared distance of two
maps is |a|² + |b|² - 2 a·b. Moving one of them changes only their overlap a·b, whose values at all translations are
one cross-correlation, by FFT.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.fft import irfftn, next_fast_len, rfftn
from scipy.ndimage import affine_transform
from scipy.optimize import minimize
from scipy.spatial.transform import Rotation
from scipy.special import softmax

from haptic_env import validate
from haptic_env.arrays import Array
from observer.classifiers.base import WINDOW, MapClassifier

Real = NDArray[np.floating[Any]]
YAW_STEP_DEG = 15.0
ALL_COUNT = 300  # random rotations, besides those of the cube: neighbours are some 30° apart
REFINEMENTS = {"none": 0, "yaw": 12, "all": 40}  # evaluations at full resolution


class AlignedNearestNeighbour(MapClassifier):
    """Compares maps however one is turned and moved: all rotations are tried at half of the resolution, and the best is
    refined at the full one.
    """

    def __init__(self, rotations: str = "yaw", reach: float = 0.25, bandwidth: float = 2.4) -> None:
        """Check the arguments.

        Args:
            rotations: "none", "yaw" (about z, an object that stands), or "all".
            reach: the largest translation along each axis, as a share of the grid.
            bandwidth: how sure the probabilities are, in voxels that differ altogether.

        Raises:
            ValueError: for a value out of range.
        """
        self.rotations = validate.choice("rotations", rotations, REFINEMENTS)
        self.reach = validate.number("reach", reach, 0.0, 1.0)
        self.bandwidth = validate.number("bandwidth", bandwidth, *WINDOW, unit="voxels")

    def square_distances(self, map: Array) -> Array:
        """Compare a map with each exemplar, however that is moved.

        Args:
            map: (X, Y, Z) probabilities.

        Returns:
            (M,) the least squared distances.
        """
        probe = map - 0.5
        full, half = _Overlap(probe, self.reach), _Overlap(_halved(probe), self.reach)
        square = np.square(probe).sum()
        return np.array(
            [
                max(0.0, square + np.square(exemplar).sum() - 2 * self._best(full, half, exemplar, turned))
                for exemplar, turned in zip(self._exemplars, self._turned, strict=True)
            ]
        )

    def _fit(self, maps: Array, index: NDArray[np.int64]) -> None:
        self._exemplars, self._index = maps - 0.5, index
        self._set = _rotations(self.rotations)
        small = [_halved(each) for each in self._exemplars]
        self._turned = [[_turn(each, rotation) for rotation in self._set] for each in small]

    def _predict_proba(self, map: Array) -> Array:
        square = self.square_distances(map)
        nearest = [square[self._index == c].min() for c in range(len(self.classes_))]
        return softmax(-0.5 * np.array(nearest) / self.bandwidth**2)

    def _best(self, full: _Overlap, half: _Overlap, exemplar: Array, turned: list[Real]) -> float:
        """The largest overlap with `exemplar`, `turned` as in the set of rotations at half resolution."""
        start = self._set[int(np.argmax([half.largest(each) for each in turned]))]
        best = full.largest(_turn(exemplar, start))
        budget = REFINEMENTS[self.rotations]
        if budget == 0:
            return best
        axes = np.eye(3)[2:] if self.rotations == "yaw" else np.eye(3)
        size = np.deg2rad(YAW_STEP_DEG) / 2

        def lack(turn: Array) -> float:
            return -full.largest(_turn(exemplar, Rotation.from_rotvec(turn @ axes) * start))

        simplex = np.vstack([np.zeros(len(axes)), size * np.eye(len(axes))])
        found = minimize(
            lack,
            simplex[0],
            method="Nelder-Mead",
            options={"initial_simplex": simplex, "maxfev": budget, "xatol": 0.01, "fatol": 1e-3 * abs(best) + 1e-9},
        )
        return max(best, -float(found.fun))


class _Overlap:
    """Overlap of one map with others at all translations up to `reach`."""

    def __init__(self, map: Real, reach: float) -> None:
        self._reach = tuple(int(reach * n) for n in map.shape)
        # As long as map and reach together: what wraps round then falls beyond the reach.
        self._shape = tuple(next_fast_len(n + r, real=True) for n, r in zip(map.shape, self._reach, strict=True))
        self._transform = rfftn(map, self._shape)

    def largest(self, other: Real) -> float:
        """The largest sum of products with `other` (X, Y, Z), moved."""
        values = irfftn(self._transform * rfftn(other, self._shape).conj(), self._shape)
        return float(values[np.ix_(*(np.arange(-r, r + 1) for r in self._reach))].max())


def _rotations(name: str) -> Rotation:
    """The set of rotations, the identity first."""
    if name == "none":
        return Rotation.identity(1)
    if name == "yaw":
        return Rotation.from_euler("z", np.arange(0, 360, YAW_STEP_DEG)[:, None], degrees=True)
    cube = Rotation.create_group("O")
    return Rotation.concatenate([cube, Rotation.random(ALL_COUNT, rng=np.random.default_rng(0))])


def _turn(map: Real, rotation: Rotation) -> Real:
    """`map` (X, Y, Z), 0 beyond its grid, turned about the middle of the grid."""
    back = rotation.inv().as_matrix()
    middle = 0.5 * (np.array(map.shape) - 1)
    return affine_transform(map, back, middle - back @ middle, order=1)


def _halved(map: Real) -> Real:
    """(⌈X/2⌉, ⌈Y/2⌉, ⌈Z/2⌉): means over two voxels along each axis, the last of an odd number beside nothing."""
    even = np.pad(map, [(0, n % 2) for n in map.shape])
    x, y, z = (n // 2 for n in even.shape)
    return even.reshape(x, 2, y, 2, z, 2).mean(axis=(1, 3, 5)).astype(np.float32)  # the search needs no more
