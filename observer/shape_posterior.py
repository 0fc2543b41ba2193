"""What the object is, from the whole stream of beliefs: the shape likelihood with the pose integrated out.

Shapes: H hypotheses, C labels, S pose samples, G fingers, P patches, M points of the skin. Lengths in metres.

A hypothesis is a solid: a shape of one size at one pose. If it were there, a patch that feels contact would lie on
its surface and no patch would lie inside it. The pose is only known as a Gaussian process, so each hypothesis has a
particle filter of its own over the pose, with the solid as its known map; its evidence is the hypothesis's
likelihood. Fingers hang from one base and err independently, so each finger is weighted and resampled apart. Fed
with the belief of a good pose filter this is the ideal discriminator: it knows the candidates beforehand and infers
the pose and which one it is.
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
from observer import resampling
from observer.belief import Belief
from observer.gaussian import square_root
from observer.kinematics import body_frames, tree_of

Array = NDArray[np.float64]
FIELD_RESOLUTION = 0.002
FIELD_EXTENT = 0.2
FRESH_SHARE = 8  # one sample in so many is drawn afresh at every step
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
        samples: int = 64,
        tolerance: float = 0.001,
        surprise: float = 0.001,
        temper: float = 1.0,
    ) -> None:
        """`candidates`: the solids that each label may be, equally probable; None: the four shapes at their default
        size at the grasp centre. `samples` S of the pose for each hypothesis; `tolerance` m: SD of the gap between a
        patch that feels contact and the surface; `surprise`: probability of what the model cannot explain; `temper`:
        exponent of the likelihood of one step.
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
        self._fingers = [np.flatnonzero(hand.joint_group == group) for group in range(hand.joint_group.max() + 1)]
        self.reset()

    def reset(self, seed: int | None = None) -> Array:
        """Start a trial: all labels equally probable; returns that (C,)."""
        count = len(self._label_of)
        self._rng = np.random.default_rng(seed)
        self.log_likelihood = np.zeros(count)
        self._poses = np.tile(self.hand.rest_pose, (count, self.samples, 1))
        self._log_weights = np.full((count, self.samples, len(self._fingers)), -np.log(self.samples))
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
        if belief.transition is None or belief.lagged_contacts is None:
            return self.posterior
        mean, follow, before, rest = belief.transition
        normals = self._rng.standard_normal(self._poses.shape)
        self._poses = mean + (self._poses - before) @ follow.T + normals @ square_root(rest).T
        # Some start anew, so that no hypothesis is stuck where its samples once were.
        fresh = slice(None, max(1, self.samples // FRESH_SHARE))
        self._poses[:, fresh] = mean + normals[:, fresh] @ square_root(belief.lagged_covariance).T
        self._log_weights += self.temper * _contact_log_likelihood(
            self._tree,
            self._skin,
            self._hypotheses,
            self._poses,
            belief.lagged_contacts,
            self.tolerance,
            self.surprise,
            len(self._fingers),
        )
        evidence = logsumexp(self._log_weights, axis=1, keepdims=True)
        self._log_weights -= evidence
        self.log_likelihood += evidence.sum(axis=(1, 2))
        self._resample()
        return self.posterior

    def _resample(self) -> None:
        """Resample the samples of each hypothesis and finger whose effective number is below half of them."""
        weights = np.exp(self._log_weights)
        poor = 1.0 / np.square(weights).sum(axis=1) < 0.5 * self.samples
        for hypothesis, finger in zip(*np.nonzero(poor), strict=True):
            counts = resampling.systematic_counts(weights[hypothesis, :, finger], self._rng.random())
            joints = self._fingers[finger]
            kept = np.repeat(self._poses[hypothesis][:, joints], counts, axis=0)
            self._poses[hypothesis][:, joints] = kept
            self._log_weights[hypothesis, :, finger] = -np.log(self.samples)


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
    """Signed distance (m) of hypothesis `h` at a world point; beyond `FAR` outside its field."""
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


@numba.njit(cache=True, inline="always")
def _gap(hypotheses, h, at, turn, point):
    """Signed distance (m) of hypothesis `h` at a `point` of a body at `at`, `turn`; beyond `FAR` outside its field."""
    x = at[0] + turn[0, 0] * point[0] + turn[0, 1] * point[1] + turn[0, 2] * point[2]
    y = at[1] + turn[1, 0] * point[0] + turn[1, 1] * point[1] + turn[1, 2] * point[2]
    z = at[2] + turn[2, 0] * point[0] + turn[2, 1] * point[1] + turn[2, 2] * point[2]
    return _distance(hypotheses, h, x, y, z)


@numba.njit(cache=True, parallel=True, error_model="numpy")
def _contact_log_likelihood(tree, skin, hypotheses, poses, contacts, tolerance, surprise, fingers):
    """log p(z_g | q, h) (H, S, G) of the contacts of each finger g at each of the `poses` (H, S, J)."""
    count, samples = poses.shape[0], poses.shape[1]
    result = np.zeros((count, samples, fingers))
    for job in numba.prange(count * samples):
        h, s = job // samples, job % samples
        position = np.empty((len(tree.parent), 3))
        rotation = np.empty((len(tree.parent), 3, 3))
        body_frames(tree, poses[h, s], position, rotation)
        for patch in range(len(skin.body)):
            at, turn = position[skin.body[patch]], rotation[skin.body[patch]]
            gap = _gap(hypotheses, h, at, turn, skin.middle[patch]) - skin.radius[patch]
            if gap < 6.0 * tolerance:
                gap = FAR
                for m in range(skin.begin[patch], skin.begin[patch + 1]):
                    gap = min(gap, _gap(hypotheses, h, at, turn, skin.points[m]))
            ratio = gap / tolerance
            # Silent patches: a normal's distribution function, nearly.
            fit = np.exp(-0.5 * ratio * ratio) if contacts[patch] else 1.0 / (1.0 + np.exp(-1.7 * ratio))
            result[h, s, skin.group[patch]] += np.log(surprise + (1.0 - surprise) * fit)
    return result
