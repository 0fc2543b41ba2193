"""What the particle filter carries from step to step: all that a trial has come to, settings and diagnostics apart.

Shapes: N particles, J joints, P patches. Angles in radians.
"""

from __future__ import annotations

from collections import deque
from dataclasses import dataclass, field
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from haptic_env.arrays import Array
from haptic_env.grid import Grid
from haptic_env.pose import Pose
from observer import resampling
from observer.belief import Belief, Transition
from observer.gaussian import shifted
from observer.maps.hindsight import Moment
from observer.maps.occupancy import Maps
from observer.novelty import MapNovelty
from observer.pose.source import PoseSource


class Waiting(NamedTuple):
    """A step that waits for the lag: the `contacts` (P,) felt, and where the `root` of the hand was."""

    contacts: NDArray[np.bool_]
    root: Pose | None


class Diagnostics(NamedTuple):
    """What one turn did, for whoever looks at it; no later step needs it. `transition`: the proposal; `moved_share` of
    the particles, which scan matching moved; whether it `resampled`."""

    transition: Transition | None = None
    resampled: bool = False
    moved_share: float = 0.0


NOTHING = Diagnostics()


@dataclass
class FilterState:
    """N particles, each with its pose, its map and its weight; changed in place by every step.

    `poses` (N, J) at the lagged step, drawn about the Gaussian `drawn`, its mean (J,) and factor (J, J). `contacts`
    (P,) of the step that entered the maps last; `waiting` are those that have not. `moments`: what the map in hindsight
    is made of.
    """

    rng: np.random.Generator
    maps: Maps
    novelty: MapNovelty
    poses: Array
    drawn: tuple[Array, Array]
    contacts: NDArray[np.bool_]
    log_evidence: float = 0.0
    waiting: deque[Waiting] = field(default_factory=deque)
    moments: list[Moment] = field(default_factory=list)

    def __post_init__(self) -> None:
        self.weigh_alike()

    @classmethod
    def begin(cls, rng: np.random.Generator, maps: Maps, novelty: MapNovelty, pose: Array, patches: int) -> FilterState:
        """All particles of `maps` at one `pose` (J,) rad (step 1)."""
        poses = np.tile(pose, (len(maps.own), 1)).astype(np.float64).reshape(len(maps.own), len(pose))
        return cls(rng, maps, novelty, poses, (pose, np.zeros((len(pose), len(pose)))), np.zeros(patches, dtype=bool))

    def weigh(self, log_likelihood: Array) -> None:
        """w ∝ w · p(z | q, m) (N,) (step 5); raises `FloatingPointError` for what is not finite."""
        self.log_weights += log_likelihood
        total, self.weights, self.n_eff = resampling.normalise(self.log_weights)
        if not np.isfinite(total):
            raise FloatingPointError(f"the particles' weights are not finite: log Σw = {total}")
        self.log_evidence += total

    def resample(self) -> bool:
        """Systematic resampling where Neff < N/2 (step 6); whether it was."""
        if self.n_eff >= 0.5 * len(self.weights):
            return False
        source, target = resampling.in_place(resampling.systematic_counts(self.weights, self.rng.random()))
        self.maps.copy(source, target)
        self.poses[target] = self.poses[source]
        self.weigh_alike()
        return True

    def weigh_alike(self) -> None:
        """Give all particles the same weight."""
        count = len(self.poses)
        self.n_eff = float(count)
        self.weights = np.full(count, 1.0 / count)
        self.log_weights: Array = np.log(self.weights)


def belief_of(
    pose: PoseSource, state: FilterState, grid: Grid, ago: int, step: Waiting | None, told: Diagnostics
) -> Belief:
    """What `pose` and `state` make one believe; `step`: the one `ago` steps back, if it has entered the maps."""
    lagged = pose.lagged(ago)
    mean, covariance, weights = pose.mean, pose.covariance, state.weights
    # What the maps say of the lagged pose moves the present one as far as the two are correlated.
    shift = np.zeros(lagged.stop - lagged.start) if step is None else weights @ state.poses - mean[lagged]
    angles, std, lagged_angles, lagged_std, lagged_covariance = shifted(mean, covariance, lagged.start, shift)
    offset = pose.offset
    return Belief(
        joint_angles=angles,
        joint_std=std,
        joint_offset=offset.mean,
        joint_offset_std=offset.std,
        lagged_joint_angles=lagged_angles,
        lagged_joint_std=lagged_std,
        lagged_covariance=lagged_covariance,
        lagged_contacts=None if step is None else step.contacts,
        lagged_root=None if step is None else step.root,
        lag_steps=ago,
        grid=grid,
        weights=weights,
        particles=state.poses.copy(),
        n_eff=state.n_eff,
        log_evidence=state.log_evidence + pose.log_evidence,
        snapshot=state.maps.snapshot(weights),
        **told._asdict(),
    )
