"""What the observer believes at one step.

Shapes: J joints, N particles, P patches, (X, Y, Z) voxels. Angles in radians.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from haptic_env.arrays import Array
from haptic_env.grid import Grid
from haptic_env.pose import Pose
from observer.gaussian import conditional
from observer.maps.occupancy import OccupancySnapshot
from observer.surface.mesh import Surface, surface_of


class Transition(NamedTuple):
    """How the lagged pose follows from the pose one step before it, given all that was felt, the maps apart.

    q_k = mean + follow · (q_{k-1} - before) + N(0, rest).

    Attributes:
        mean: (J,) rad.
        follow: (J, J).
        before: (J,) rad, the mean of q_{k-1}.
        rest: (J, J) rad².
    """

    mean: Array
    follow: Array
    before: Array
    rest: Array

    @classmethod
    def between(cls, mean: Array, covariance: Array, before: slice, now: slice) -> Transition:
        """Read it off a Gaussian over both poses.

        Args:
            mean: (S,).
            covariance: (S, S).
            before: where it has q_{k-1}.
            now: where it has q_k.

        Returns:
            The transition from the one to the other.
        """
        return cls(*conditional(mean, covariance, before.start, now.start, now.stop - now.start))

    def then(self, following: Transition) -> Transition:
        """Make one of two steps.

        Args:
            following: the step after this one.

        Returns:
            The transition from before this one to the end of the following.
        """
        mean, follow, before, rest = following
        return Transition(
            mean + follow @ (self.mean - before),
            follow @ self.follow,
            self.before,
            rest + follow @ self.rest @ follow.T,
        )


@dataclass(frozen=True, eq=False)
class Belief:
    """Posterior over pose and shape. Its arrays never change once it is handed out.

    With `matching="sample"` particles and weights are a posterior of the lagged pose; with "mean" each particle is the
    mean of one hypothesis, so that their cloud is narrower than `lagged_joint_std` says.

    Attributes:
        joint_angles: (J,) rad, posterior mean now.
        joint_std: (J,) rad, posterior SD now.
        joint_offset: (J,) rad, posterior mean of the offset: felt angle = angle + offset + white noise.
        joint_offset_std: (J,) rad, its posterior SD.
        patch_reliability: (P,) probability that each patch works, 1 where nothing else is believed.
        lagged_joint_angles: (J,) rad, the smoothed pose `lag_steps` steps ago, whose contacts entered the maps now.
        lagged_joint_std: (J,) rad, its SD.
        lagged_covariance: (J, J) rad², of that pose before the maps, or known solids, had a say.
        lagged_contacts: (P,) which patches were touched there, as far as is known; None while the lag fills up.
        transition: how that pose follows from the one before; None likewise.
        unfit: probability that the object is none of the solids that the observer was told (`solids` with `none`); None
            where it was told none, or does not doubt.
        lagged_unmeasured: (P,) patches whose contact was not measured there; None where all were.
        lagged_root: where the hand's own frame then lay in the grid's; None where it does not move.
        lag_steps: how long ago that pose was.
        grid: of the occupancy.
        weights: (N,) of the particles.
        particles: (N, J) rad, hypotheses of the lagged pose.
        n_eff: effective sample size, 1 / Σw².
        log_evidence: log probability of all that was felt so far, contacts with the exponent `temper`.
        resampled: whether this step resampled.
        moved_share: of the particles, those that scan matching moved.
        snapshot: the occupancy, computed when it is asked for.
    """

    joint_angles: Array
    joint_std: Array
    joint_offset: Array
    joint_offset_std: Array
    patch_reliability: Array
    lagged_joint_angles: Array
    lagged_joint_std: Array
    lagged_covariance: Array
    lagged_contacts: NDArray[np.bool_] | None
    transition: Transition | None
    lagged_root: Pose | None
    lag_steps: int
    grid: Grid
    weights: Array
    particles: Array
    n_eff: float
    log_evidence: float
    resampled: bool
    moved_share: float
    snapshot: OccupancySnapshot
    lagged_unmeasured: NDArray[np.bool_] | None = None
    unfit: float | None = None

    def __repr__(self) -> str:
        pose = f"{len(self.joint_angles)} joints ± {np.rad2deg(self.joint_std.mean()):.2f}°, lag {self.lag_steps} steps"
        map_of = f"{' × '.join(map(str, self.grid.shape))} voxels of {1e3 * self.grid.resolution:g} mm"
        return f"<Belief: {pose}, Neff {self.n_eff:.3g} of {len(self.weights)}, {map_of}>"

    @property
    def occupancy(self) -> Array:
        """(X, Y, Z) posterior probability that each voxel is occupied; 0.5 where the hand never came near.
        Read-only."""
        return self.snapshot.value()

    def surface(self) -> Surface:
        """Draw the surface of what was touched so far.

        Returns:
            `vertices` (V, 3) m, `faces` (F, 3) and `std` (V,) m of a closed mesh (`observer.surface`), in the frame of
            `grid`; without any where nothing was touched.

        Raises:
            ValueError: where no map was made.
            ImportError: where the extra `meshes` is missing.
        """
        if self.snapshot.touches is None:
            raise ValueError("a belief without a map has no surface: HapticSLAM makes maps, PoseOnly does not")
        return surface_of(self.snapshot.touches, self.occupancy, self.grid)

    def __eq__(self, other: object) -> bool:
        """Whether everything that is believed is the same, bit for bit."""
        if not isinstance(other, Belief):
            return NotImplemented
        mine, theirs = ({**vars(each), "snapshot": each.occupancy} for each in (self, other))
        return all(_same(mine[name], theirs[name]) for name in mine)

    __hash__ = None  # type: ignore[assignment]

    def copy(self) -> Belief:
        """Take a copy.

        Returns:
            The same belief with arrays of its own, its occupancy computed.
        """
        self.occupancy  # noqa: B018 - computes it
        arrays = {name: value.copy() for name, value in vars(self).items() if isinstance(value, np.ndarray)}
        return replace(self, **arrays)  # type: ignore[arg-type]


def _same(a: object, b: object) -> bool:
    if isinstance(a, tuple) and isinstance(b, tuple):
        return len(a) == len(b) and all(_same(x, y) for x, y in zip(a, b, strict=True))
    return np.array_equal(a, b) if isinstance(a, np.ndarray) and isinstance(b, np.ndarray) else bool(a == b)
