"""What the particle filter carries from step to step: all that a trial has come to, settings and diagnostics apart.

Shapes: N particles, J joints, P patches. Angles in radians.
"""

from __future__ import annotations

import copy
from collections import deque
from dataclasses import dataclass, field
from typing import NamedTuple, Self

import numpy as np
from numpy.typing import NDArray

from haptic_env.arrays import Array
from haptic_env.grid import Grid
from haptic_env.hand import Hand
from observer import resampling
from observer.belief import Belief, Transition
from observer.gaussian import carried_on, lower_factor, shifted
from observer.maps.forgetting import Forgetting
from observer.maps.hindsight import Hindsight
from observer.maps.occupancy import Maps
from observer.novelty import MapNovelty
from observer.pose.source import PoseSource
from observer.surface.touches import TouchRecorder
from observer.waiting import Waiting as Waiting


class Diagnostics(NamedTuple):
    """What one turn did, for whoever looks at it; no later step needs it.

    Attributes:
        transition: of the proposal.
        resampled: whether it resampled.
        moved_share: of the particles, those that scan matching moved.
    """

    transition: Transition | None = None
    resampled: bool = False
    moved_share: float = 0.0


NOTHING = Diagnostics()


class Proposal(NamedTuple):
    """p(q_k | q_{k-1}, u, q̃) (step 3) of every particle, which may be a hypothesis of constant errors too.

    Attributes:
        transition: that is the same for all.
        centres: (N, J) rad, how far from its mean the centre of each particle's lies.
        rest: (J, J) rad², what is left about that.
        spread: (J, J) rad, a factor of all that is uncertain of q_k, but for an error that maps have in common with it.
    """

    transition: Transition
    centres: Array
    rest: Array
    spread: Array


@dataclass
class FilterState:
    """N particles, each with its pose, its map and its weight; changed in place by every step.

    Attributes:
        rng: all that is left to chance.
        maps: of the particles.
        hindsight: the map in hindsight, where steps are kept for it.
        novelty: what links have said before.
        touches: the links that have touched.
        poses: (N, J) rad at the lagged step.
        errors: (N, E) rad, constant errors of the angles.
        drawn: the Gaussian about which both were drawn, its mean (J + E,) and factor (J + E, J + E).
        contacts: (P,) of the step that entered the maps last.
        log_evidence: log probability of the contacts so far.
        waiting: steps that have not entered the maps.
        forgetting: when maps fade.
        weights: (N,).
        log_weights: (N,).
        n_eff: effective sample size, 1 / Σw².
    """

    rng: np.random.Generator
    maps: Maps
    hindsight: Hindsight
    novelty: MapNovelty
    touches: TouchRecorder
    poses: Array
    errors: Array
    drawn: tuple[Array, Array]
    contacts: NDArray[np.bool_]
    log_evidence: float = 0.0
    waiting: deque[Waiting] = field(default_factory=deque)
    forgetting: Forgetting = field(default_factory=Forgetting)

    def __post_init__(self) -> None:
        self.weigh_alike()

    @classmethod
    def begin(
        cls,
        rng: np.random.Generator,
        maps: Maps,
        hindsight: Hindsight,
        novelty: MapNovelty,
        touches: TouchRecorder,
        hand: Hand,
        pose: PoseSource,
    ) -> FilterState:
        """Put all particles at the rest pose (step 1), or about it, where it is not known exactly.

        Args:
            rng: for all that is left to chance.
            maps: of the N particles.
            hindsight: the map in hindsight, empty.
            novelty: what links have said before.
            touches: the links that have touched, none.
            hand: with J joints and P patches.
            pose: tells how exactly that pose is known, and of constant errors.

        Returns:
            The state before the first step.
        """
        count, noise = len(maps.own), pose.noise
        constant = noise.prior[: pose.constant.stop - pose.constant.start]
        mean = np.concatenate([hand.rest_pose, np.zeros(len(constant))])
        spread = np.sqrt(np.concatenate([np.full(hand.joints, noise.start_variance), constant]))
        points = np.tile(mean, (count, 1)).astype(np.float64)
        if spread.any():
            # Antithetic: each is still drawn from the whole of it, but few are not off by their mean for good.
            drawn = rng.standard_normal(points.shape)
            points += spread * np.sqrt(count / max(count - 1, 1)) * (drawn - drawn.mean(axis=0))
        poses, errors = np.ascontiguousarray(points[:, : hand.joints]), points[:, hand.joints :]
        contacts = np.zeros(len(hand.patches), dtype=bool)
        return cls(rng, maps, hindsight, novelty, touches, poses, errors, (mean, np.diag(spread)), contacts)

    def branch(self) -> Self:
        """Branch off what has been heard for the map in hindsight, and what has touched.

        Returns:
            A state to which `Sensing.stand` can tell more without telling this one; particles and maps are the same.
        """
        other = copy.copy(self)
        other.novelty, other.hindsight = self.novelty.branch(), self.hindsight.branch()
        other.touches, other.forgetting = self.touches.branch(), copy.copy(self.forgetting)
        return other

    def predict(self, pose: PoseSource, ago: int) -> Proposal:
        """Move on to the pose of some steps back (step 3).

        What was felt since has told more of q_{k-1} too, the same for all: it moves the particles with the Gaussian
        that they were drawn about, so that no weight is needed for it. An error that is constant is a part of what a
        particle is a hypothesis of: with q_{k-1} alone the angles felt before would be forgotten.

        Args:
            pose: its Gaussian.
            ago: how many steps.

        Returns:
            Where the particles' next poses may be.

        Raises:
            FloatingPointError: for poses that are not finite, which no kernel is to have.
        """
        now, before, constant = pose.lagged(ago), pose.lagged(ago + 1), pose.constant
        mean, covariance = pose.mean, pose.covariance
        transition = Transition.between(mean, covariance, before, now)
        moved, joints, points = transition, len(transition.mean), self.poses
        if self.errors.size:
            both = np.r_[before, constant, now, constant]
            mean, covariance = mean[both], covariance[np.ix_(both, both)]
            size = len(both) // 2
            before, now = slice(0, size), slice(size, 2 * size)
            moved = Transition.between(mean, covariance, before, now)
            points = np.hstack([self.poses, self.errors])
        centres, factor = carried_on(covariance, before.start, now.start, moved.follow, *self.drawn, points)
        if not all(np.isfinite(each).all() for each in (moved.mean, moved.rest, centres, factor)):
            raise FloatingPointError(f"the pose of {ago} steps ago is not finite")
        self.drawn = moved.mean, factor
        if self.errors.size:
            self.errors = moved.mean[joints:] + centres[:, joints:]
            centres, factor = (np.ascontiguousarray(each[:, :joints]) for each in (centres, factor[:joints]))
        if pose.unfound.any():
            factor = lower_factor(covariance[now, now] - np.diag(pose.unfound))
        return Proposal(transition, centres, np.ascontiguousarray(moved.rest[:joints, :joints]), factor)

    def weigh(self, log_likelihood: Array) -> None:
        """Weigh the particles, w ∝ w · p(z | q, m) (step 5).

        Args:
            log_likelihood: (N,).

        Raises:
            FloatingPointError: for weights that are not finite.
        """
        self.log_weights += log_likelihood
        total, self.weights, self.n_eff = resampling.normalise(self.log_weights)
        if not np.isfinite(total):
            raise FloatingPointError(f"the particles' weights are not finite: log Σw = {total}")
        self.log_evidence += total

    def resample(self) -> bool:
        """Resample systematically where Neff < N/2 (step 6).

        Returns:
            Whether it was done.
        """
        if self.n_eff >= 0.5 * len(self.weights):
            return False
        source, target = resampling.in_place(resampling.systematic_counts(self.weights, self.rng.random()))
        self.maps.copy(source, target)
        self.poses[target] = self.poses[source]
        self.errors[target] = self.errors[source]
        self.weigh_alike()
        return True

    def weigh_alike(self) -> None:
        """Give all particles the same weight."""
        count = len(self.poses)
        self.n_eff = float(count)
        self.weights = np.full(count, 1.0 / count)
        self.log_weights: Array = np.log(self.weights)


def belief_of(
    pose: PoseSource,
    reliability: Array,
    state: FilterState,
    grid: Grid,
    ago: int,
    step: Waiting | None,
    told: Diagnostics,
) -> Belief:
    """Tell what the Gaussian of the pose and the particles make one believe.

    Args:
        pose: the Gaussian.
        reliability: (P,) probability that each patch works.
        state: the particles.
        grid: of their maps.
        ago: how many steps the lagged pose is back.
        step: that one, if it has entered the maps.
        told: what this turn did.

    Returns:
        The belief.
    """
    lagged = pose.lagged(ago)
    mean, covariance, weights = pose.mean, pose.covariance, state.weights
    # What the maps say of the lagged pose moves the present one as far as the two are correlated.
    shift = np.zeros(lagged.stop - lagged.start) if step is None else weights @ state.poses - mean[lagged]
    angles, std, lagged_angles, lagged_std, lagged_covariance = shifted(mean, covariance, lagged.start, shift)
    offset = pose.offset
    told_of = weights @ state.errors - mean[pose.constant] if state.errors.size and step is not None else 0.0
    return Belief(
        joint_angles=angles,
        joint_std=std,
        joint_offset=offset.mean + told_of,
        joint_offset_std=offset.std,
        patch_reliability=reliability,
        lagged_joint_angles=lagged_angles,
        lagged_joint_std=lagged_std,
        lagged_covariance=lagged_covariance,
        lagged_contacts=None if step is None else step.contacts,
        lagged_root=None if step is None else step.root,
        lagged_unmeasured=None if step is None else step.unmeasured,
        lag_steps=ago,
        grid=grid,
        weights=weights,
        particles=state.poses.copy(),
        n_eff=state.n_eff,
        log_evidence=state.log_evidence + pose.log_evidence,
        snapshot=state.maps.snapshot(weights, state.touches.log()),
        **told._asdict(),
    )
