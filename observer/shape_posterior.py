"""What the object is, from the whole stream of beliefs: the shape likelihood with the pose integrated out.

Shapes: H hypotheses, C labels, S pose samples, P patches, M points of the skin. Lengths in metres.

A hypothesis is a solid: a shape of one size at one pose. If it were there, a patch that feels contact would lie on
its surface and no patch would lie inside it. The pose is only known as a Gaussian, so the likelihood of one step's
contacts is averaged over samples of the pose, finger by finger (fingers err independently).
"""

from __future__ import annotations

import itertools
from collections.abc import Mapping, Sequence
from typing import NamedTuple

import numba
import numpy as np
from numpy.typing import NDArray
from scipy.special import logsumexp, softmax

from haptic_env import shapes, validate
from haptic_env.grid import Grid
from haptic_env.hand import Hand
from haptic_env.shapes.base import Solid, rotation_matrix
from observer.belief import Belief
from observer.kinematics import body_frames, tree_of

Array = NDArray[np.float64]
FIELD_RESOLUTION = 0.002
FIELD_EXTENT = 0.2
FAR = 0.02  # no patch feels anything from here on


class Skin(NamedTuple):
    """`points` (M, 3) m in their link's frame, those of patch p from `begin[p]` to `begin[p + 1]`; for each patch
    (P,): `body` it is fixed to, `group` (finger), `middle` (P, 3) m and `radius` of a ball that holds its points."""

    points: Array
    begin: NDArray[np.int64]
    body: NDArray[np.int64]
    group: NDArray[np.int64]
    middle: Array
    radius: Array


class Hypotheses(NamedTuple):
    """Signed distance `field` (F, X, Y, Z) m of each distinct shape in its own frame; for each hypothesis (H,):
    which field, its `scale`, and its pose, `rotation` (H, 3, 3) and `position` (H, 3) m."""

    field: NDArray[np.float32]
    drawn_in: NDArray[np.int64]
    scale: Array
    rotation: Array
    position: Array


class ShapePosterior:
    """Posterior over labels, updated by every belief of a trial, those of the flush included."""

    def __init__(
        self,
        hand: Hand,
        candidates: Mapping[str, Sequence[Solid]] | None = None,
        *,
        samples: int = 32,
        tolerance: float = 0.001,
        surprise: float = 0.001,
        temper: float = 0.05,
    ) -> None:
        """`candidates`: the solids that each label may be, equally probable; None: the four shapes at their default
        size at the grasp centre. `samples` S of the pose a step; `tolerance` m: SD of the gap between a patch that
        feels contact and the surface; `surprise`: probability of what the model cannot explain; `temper`: weight of
        a step, below 1 because the errors of successive steps repeat.
        """
        if candidates is None:
            candidates = {name: [shapes.make(name, position=hand.grasp_centre)] for name in shapes.SHAPES}
        if not candidates or not all(len(solids) for solids in candidates.values()):
            raise ValueError(f"candidates must give each label at least one solid, got {dict(candidates)!r}")
        self.hand = hand
        self.labels = tuple(candidates)
        self.samples = validate.integer("samples", samples, 1)
        self.tolerance = validate.number("tolerance", tolerance, above=0.0, unit="m")
        self.surprise = validate.number("surprise", surprise, 0.0, 1.0, above=0.0)
        self.temper = validate.number("temper", temper, 0.0, 1.0, above=0.0)
        self._label_of = np.repeat(np.arange(len(self.labels)), [len(solids) for solids in candidates.values()])
        self._hypotheses = _hypotheses([solid for solids in candidates.values() for solid in solids])
        self._tree = tree_of(hand)
        self._skin = _skin(hand)
        self.reset()

    def reset(self, seed: int | None = None) -> Array:
        """Start a trial: all labels equally probable; returns that (C,)."""
        self._rng = np.random.default_rng(seed)
        self.log_likelihood = np.zeros(len(self._label_of))
        return self.posterior

    @property
    def posterior(self) -> Array:
        """(C,) probability of each of `labels`, uniform before anything was felt."""
        per_label = [
            logsumexp(self.log_likelihood[self._label_of == c]) - np.log((self._label_of == c).sum())
            for c in range(len(self.labels))
        ]
        return softmax(np.array(per_label))

    def update(self, belief: Belief) -> Array:
        """Take in what `belief` felt at its lagged pose; returns the posterior (C,)."""
        if belief.lagged_contacts is not None:
            half = np.linalg.cholesky(belief.lagged_covariance + 1e-12 * np.eye(self.hand.joints))
            normals = self._rng.standard_normal((self.samples, self.hand.joints))
            poses = belief.lagged_joint_angles + normals @ half.T
            per_sample = _contact_log_likelihood(
                self._tree,
                self._skin,
                self._hypotheses,
                poses,
                belief.lagged_contacts,
                self.tolerance,
                self.surprise,
                int(self._skin.group.max()) + 1,
            )
            marginal = logsumexp(per_sample, axis=0) - np.log(self.samples)
            self.log_likelihood += self.temper * marginal.sum(axis=0)
        return self.posterior


def _skin(hand: Hand) -> Skin:
    points = hand.patches.surface(FAR / 5)
    order = np.argsort(points.patch, kind="stable")
    begin = np.searchsorted(points.patch[order], np.arange(len(hand.patches) + 1)).astype(np.int64)
    placed = points.points[order]
    middle = np.stack([placed[a:b].mean(axis=0) for a, b in itertools.pairwise(begin)])
    owner = np.repeat(np.arange(len(middle)), np.diff(begin))
    radius = np.zeros(len(middle))
    np.maximum.at(radius, owner, np.linalg.norm(placed - middle[owner], axis=1))
    body = hand.link_bodies[hand.patches.link].astype(np.int64)
    return Skin(placed, begin, body, hand.link_group[hand.patches.link].astype(np.int64), middle, radius)


def _hypotheses(solids: Sequence[Solid]) -> Hypotheses:
    """Solids that differ in scale and pose alone share one distance field, drawn at the first one's size."""
    grid = Grid.around(np.zeros(3), np.full(3, FIELD_EXTENT), FIELD_RESOLUTION)
    fields: dict[tuple, int] = {}
    drawn: list[Array] = []
    reference: list[float] = []
    index, scale = [], []
    for solid in solids:
        proportions = tuple(np.round(np.array(solid.size) / solid.size[0], 6))
        key = (solid.name, proportions)
        if key not in fields:
            fields[key] = len(drawn)
            drawn.append(solid.shape.signed_distance(grid.centres(), np.array(solid.size)))
            reference.append(solid.size[0])
        index.append(fields[key])
        scale.append(solid.size[0] / reference[fields[key]])
    return Hypotheses(
        np.stack(drawn).astype(np.float32),
        np.array(index),
        np.array(scale),
        np.stack([rotation_matrix(solid.quaternion) for solid in solids]),
        np.array([solid.position for solid in solids]),
    )


@numba.njit(cache=True, inline="always")
def _distance(hypotheses, h, x, y, z):
    """Signed distance (m) of hypothesis `h` at a world point, or `FAR` outside its field."""
    at, turn, scale = hypotheses.position[h], hypotheses.rotation[h], hypotheses.scale[h]
    x, y, z = x - at[0], y - at[1], z - at[2]
    half = 0.5 * FIELD_EXTENT
    u = (turn[0, 0] * x + turn[1, 0] * y + turn[2, 0] * z) / scale + half
    v = (turn[0, 1] * x + turn[1, 1] * y + turn[2, 1] * z) / scale + half
    w = (turn[0, 2] * x + turn[1, 2] * y + turn[2, 2] * z) / scale + half
    if min(u, v, w) < 0.0 or max(u, v, w) >= FIELD_EXTENT:
        return 2.0 * FAR
    i, j, k = int(u / FIELD_RESOLUTION), int(v / FIELD_RESOLUTION), int(w / FIELD_RESOLUTION)
    return scale * hypotheses.field[hypotheses.drawn_in[h], i, j, k]


@numba.njit(cache=True, parallel=True, error_model="numpy")
def _contact_log_likelihood(tree, skin, hypotheses, poses, contacts, tolerance, surprise, groups):
    """log p(z_g | q, h) (S, groups, H) of the contacts of each finger g at each of the `poses` (S, J)."""
    count = len(hypotheses.scale)
    result = np.zeros((len(poses), groups, count))
    for s in numba.prange(len(poses)):
        position = np.empty((len(tree.parent), 3))
        rotation = np.empty((len(tree.parent), 3, 3))
        world = np.empty(3)
        body_frames(tree, poses[s], position, rotation)
        for patch in range(len(skin.body)):
            at, turn = position[skin.body[patch]], rotation[skin.body[patch]]
            for i in range(3):
                world[i] = at[i] + np.dot(turn[i], skin.middle[patch])
            for h in range(count):
                gap = _distance(hypotheses, h, world[0], world[1], world[2]) - skin.radius[patch]
                if gap < 6.0 * tolerance:
                    gap = FAR
                    for m in range(skin.begin[patch], skin.begin[patch + 1]):
                        p = skin.points[m]
                        x = at[0] + turn[0, 0] * p[0] + turn[0, 1] * p[1] + turn[0, 2] * p[2]
                        y = at[1] + turn[1, 0] * p[0] + turn[1, 1] * p[1] + turn[1, 2] * p[2]
                        z = at[2] + turn[2, 0] * p[0] + turn[2, 1] * p[1] + turn[2, 2] * p[2]
                        gap = min(gap, _distance(hypotheses, h, x, y, z))
                ratio = gap / tolerance
                # Silent patches: a normal's distribution function, nearly.
                fit = np.exp(-0.5 * ratio * ratio) if contacts[patch] else 1.0 / (1.0 + np.exp(-1.7 * ratio))
                result[s, skin.group[patch], h] += np.log(surprise + (1.0 - surprise) * fit)
    return result
