"""Haptic SLAM: FastSLAM 2.0 for touch (paper, section 3).

Shapes: N particles, J joints, P patches, K candidates, L links, (X, Y, Z) voxels. Angles in radians.

What is linear and Gaussian is the same for all particles and is done once, exactly, by one of `MOTIONS`. A particle
is one hypothesis of the path of the pose about that Gaussian, drawn at the lag, and the map that follows from it.
"""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Any, Self

import numpy as np
from numpy.typing import ArrayLike, NDArray

from haptic_env import validate
from haptic_env.arrays import Array
from haptic_env.hand import Hand
from haptic_env.moved import renamed
from haptic_env.pose import Pose
from observer import compiling, edge, saved_state
from observer import threads as side_by_side
from observer.belief import Belief
from observer.configuration import Configured
from observer.maps.capsules import MapInput
from observer.maps.contact_model import ContactModel
from observer.maps.forgetting import Forgetting
from observer.maps.matching import MATCHING, Cloud, match, sweep
from observer.maps.occupancy import Maps, OccupancySnapshot
from observer.novelty import MapNovelty
from observer.shape.posterior import ShapePosterior
from observer.state import NOTHING, Diagnostics, FilterState, Proposal, Waiting, belief_of
from observer.surface.mesh import Surface, surface_of
from observer.surface.touches import TouchLog, TouchRecorder

__getattr__ = renamed(__name__, {name: f"observer.configuration.{name}" for name in ("LAG_SECONDS", "RESOLUTION")})

ENOUGH = 16_000  # particles times candidates, from which on two threads are faster than one
PARTS = ("pose", "predict", "settle", "gather", "match", "weigh", "map", "resample", "belief")  # of a step
AS_WRITTEN: dict[str, Any] = {
    "motion": "delta_pose",
    "matching": "sample",
    "lag": 0,
    "contact_model": ContactModel(prior=0.5, touch=1.0, sustained=1.0, free=1.0, caution=0.0, temper=1.0, repeats=0.0),
}


class HapticSLAM(Configured):
    """The observer: from efference copies, noisy joint angles and contacts to pose and shape."""

    @classmethod
    def paper(cls, hand: Hand, sigma_deg: float = 3.0, particles: int = 200, **keywords: Any) -> Self:
        """Make the observer as the paper describes it (section 3), to compare with.

        Delta-pose motion, no lag, K candidates of which one is kept, w ∝ p(z | q, m), every step's contacts written in
        full with the pose held fixed, resampling where Neff < N/2. The paper is silent on: the motion model
        (`DeltaPose`: learnt by babbling); p(z | q, m) and the inverse model of the map (`ContactModel`, without what it
        makes of the pose's spread and of repetition); how far the perturbations reach (as far as the proposal). It
        keeps the best candidate; one drawn by likelihood stands in, for which the weight, their mean likelihood, is
        unbiased. Its estimate is the best particle's; a `Belief` gives the mean.

        Args:
            hand: with J joints and P patches.
            sigma_deg: degrees, SD of white noise of the felt angles.
            particles: N.
            **keywords: of the constructor, to change single parts.

        Returns:
            The observer.
        """
        return cls(hand, sigma_deg, particles, **{**AS_WRITTEN, **keywords})

    def reset(self, seed: int | None = None, joint_angles: ArrayLike | None = None) -> Belief:
        """Start a trial: all particles at the rest pose with an empty map (step 1).

        Args:
            seed: of all that is left to chance; None: another one each time.
            joint_angles: (J,) rad felt at the reset, for a motion that does not know where the hand begins
                ("kinematic"), and for offsets; None: they are not told.

        Returns:
            The belief before the first step.

        Raises:
            ValueError: for a seed that is none, and for angles as `step` does.
        """
        compiling.ensure(self.needs, self.hand)
        rng = np.random.default_rng(validate.seed(seed))
        self._begin(joint_angles)
        self._state = FilterState.begin(
            rng,
            Maps(self.n_particles, self.grid, self._sensing.evidence.probability, dense=self.matching == "sample"),
            self._sensing.hindsight(),
            MapNovelty(self.hand, self.contact_model.repeats, self.grid.resolution),
            TouchRecorder(self.hand, self.control_hz),
            self.hand,
            self.pose,
        )
        self._state.forgetting = Forgetting(self.memory_seconds, self.control_hz)
        if self._known is not None:
            self._known.reset(seed)
        return self._belief(self._state, ago=0)

    def step(
        self, torque: ArrayLike | None, joint_angles: ArrayLike, contacts: ArrayLike, root: Pose | None = None
    ) -> Belief:
        """Take one turn.

        Args:
            torque: (J,) that was commanded, fractions of the limits; None, where the motion asks for none ("kinematic",
                "raw_angles"): it is not known.
            joint_angles: (J,) rad that were felt after it; NaN where a joint was not measured.
            contacts: (P,) that were felt; NaN where a patch was not measured.
            root: where the frame in which the hand is drawn lies in the grid's, for a hand that moves as a whole about
                the object; None: where the grid is.

        Returns:
            The belief, whose lagged pose has entered the maps once as many steps have passed.

        Raises:
            ValueError: before the first `reset`, after `flush`, and for what is not finite, not binary, or beyond what
                can be: torques of ± 1, angles of ± 4π rad.
        """
        state = self._running()
        u, q, z, unmeasured = edge.told(self.hand, torque, joint_angles, contacts, self.pose.needs_torque)
        at = edge.root(root)
        touched = self._touched(z, unmeasured)
        self.pose.step(u, q, touched)
        if self._known is not None:
            self._known.teach(self.pose, Waiting(touched, at, unmeasured))
        self._done("pose")
        state.waiting.append(Waiting(z, at, unmeasured))
        if len(state.waiting) <= self.lag:
            return self._belief(state, ago=len(state.waiting))
        return self._assimilate(state, ago=self.lag)

    def flush(self) -> list[Belief]:
        """End the trial: let the steps that still wait for the lag enter the maps. After it only `reset` is possible.

        Returns:
            A belief for each, the last one about now; where there is a map in hindsight there is one without a lag,
            too.

        Raises:
            ValueError: outside a trial.
        """
        state = self._running()
        beliefs = [self._assimilate(state, ago) for ago in reversed(range(len(state.waiting)))]
        self._state = None
        if not self.in_hindsight or state.hindsight.empty:
            return beliefs
        last = beliefs.pop() if beliefs else self._belief(state, ago=0)
        return [*beliefs, replace(last, snapshot=OccupancySnapshot(state.hindsight.occupancy, state.touches.log()))]

    def map_now(self) -> Array:
        """Draw the map of the trial so far, the steps that still wait for the lag included, and end nothing.

        Returns:
            (X, Y, Z) probability that each voxel is occupied, 0.5 where nothing is known: the bits that `flush` would
            give now. Where no map in hindsight is kept (`in_hindsight=False`, or matching by "sample"), the map as it
            has grown, without those steps.

        Raises:
            ValueError: outside a trial.
        """
        return self._now()[1]

    def surface_now(self) -> Surface:
        """Draw the surface of the trial so far (`Belief.surface`), of the touches and the map that `map_now` has.

        Returns:
            The surface that the last belief of `flush` would have now.

        Raises:
            ValueError: outside a trial.
            ImportError: where the extra `meshes` is missing.
        """
        return surface_of(*self._now(), self.grid)

    def save(self, path: Path | str) -> None:
        """Save the observer as it is now, in mid-trial too: arrays and JSON in an `.npz`, whole or not at all.

        Args:
            path: of the file.

        Raises:
            ValueError: where it cannot be written, and for one that was told `solids` with `rotation_jitter`.
        """
        saved_state.write(path, self)

    @classmethod
    def load(cls, path: Path | str, hand: Hand | None = None, *, solids: ShapePosterior | None = None) -> Self:
        """Take up an observer that was saved; it goes on to the same bits.

        Nothing in the file is run.

        Args:
            path: of the file.
            hand: that it was saved of; None: the one of `haptic_env.hands` of that name, as it is made without
                keywords.
            solids: that it was told, as they were given to it then; None: none.

        Returns:
            The observer.

        Raises:
            ValueError: for a file that is none, is cut short, of another hand, other solids or another format.
            OSError: where it cannot be read.
        """
        made: Self = saved_state.read(path, hand, cls, solids)
        return made

    @property
    def particle_maps(self) -> NDArray[np.int8]:
        """(N, T) log-odds of the particles' own cells in units of `contact_model.QUANTUM`, as they are kept.

        Not to be changed. Outside a trial there are none: `ValueError`.
        """
        return self._running().maps.own

    def _now(self) -> tuple[TouchLog, Array]:
        """What `flush` would leave of touches and of the map (X, Y, Z) now, apart from the trial."""
        state = self._running()
        if not self.in_hindsight:
            return state.touches.log(), state.maps.snapshot(state.weights).value().copy()
        ahead, waiting = state.branch(), state.waiting.copy()
        last = len(waiting) - 1
        self._look_back(waiting, last)
        for index, step in enumerate(waiting):
            lagged = self.pose.lagged(last - index)
            self._sensing.stand(ahead, step, self.pose.mean[lagged], self.pose.covariance[lagged, lagged].copy())
        return ahead.touches.log(), ahead.hindsight.occupancy()

    def _assimilate(self, state: FilterState, ago: int) -> Belief:
        """Predict, match, weigh, map and resample (steps 3 to 6) for the oldest step that waits, `ago` steps back."""
        self._look_back(state.waiting, ago)
        step = state.waiting.popleft()
        proposal = state.predict(self.pose, ago)
        self._done("predict")
        felt, cloud = self._stand(state, step, proposal, ago)
        log_likelihood, moved = self._match(state, felt, cloud)
        state.weigh(log_likelihood)
        self._done("weigh")
        sweep(felt, cloud.stance, state.maps, carve=self.matching == "mean")
        self._done("map")
        resampled = state.resample()
        if resampled or (self.n_particles > 1 and log_likelihood.any()):
            state.maps.weights_changed()
        self._done("resample")
        moved_share = np.count_nonzero(moved) / self.n_particles
        belief = self._belief(state, ago, step, Diagnostics(proposal.transition, resampled, moved_share))
        if self._known is not None:
            belief = self._known.correct(belief, self.pose, [step, *state.waiting])
        self._done("belief")
        return belief

    def _stand(self, state: FilterState, step: Waiting, proposal: Proposal, ago: int) -> tuple[MapInput, Cloud]:
        """What the step has to say to the maps, and where the proposals lie."""
        state.maps.before_change()
        self._done("settle")
        lagged = self.pose.lagged(ago)
        mean, covariance = proposal.transition.mean, self.pose.covariance[lagged, lagged].copy()
        felt, stance = self._sensing.stand(state, step, mean, covariance)
        if (fade := state.forgetting.now) is not None:
            state.maps.fade(fade)
        return felt, Cloud(stance, proposal.centres, proposal.rest, proposal.spread)

    def _match(self, state: FilterState, felt: MapInput, cloud: Cloud) -> tuple[Array, NDArray[np.bool_]]:
        """Match each particle's pose to its own map, and write the touches into that at the matched pose (4 and 5)."""
        search = MATCHING[self.matching](felt, cloud, self.n_candidates, state.maps, state.rng)
        self._done("gather")
        number = side_by_side.chosen(self.threads, self.n_particles * self.n_candidates, ENOUGH)
        found = match(search, cloud, state.poses, number)
        self._done("match")
        return found

    def _done(self, part: str) -> None:
        if self.on_part is not None:
            self.on_part(part)

    def _belief(self, state: FilterState, ago: int, step: Waiting | None = None, told: Diagnostics = NOTHING) -> Belief:
        return belief_of(self.pose, self.patch_reliability, state, self.grid, ago, step, told)

    def _running(self) -> FilterState:
        if self._state is None:
            raise ValueError("the observer is not in a trial: call reset() before step() or flush()")
        return self._state
