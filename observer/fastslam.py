"""Haptic SLAM: FastSLAM 2.0 for touch (paper, section 3).

Shapes: N particles, J joints, P patches, K candidates, L links, (X, Y, Z) voxels. Angles in radians.

What is linear and Gaussian is the same for all particles and is done once, exactly, by one of `MOTIONS`. A particle
is one hypothesis of the path of the pose about that Gaussian, drawn at the lag, and the map that follows from it.
"""

from __future__ import annotations

from collections import deque
from dataclasses import replace
from functools import partial
from typing import Any, Self

import numpy as np
from numpy.typing import ArrayLike, NDArray

from haptic_env import validate
from haptic_env.arrays import Array
from haptic_env.grid import Grid
from haptic_env.hand import Hand
from haptic_env.pose import Pose
from observer import compiling, edge, resampling
from observer import threads as side_by_side
from observer.belief import Belief, Transition
from observer.gaussian import carried_on, shifted
from observer.kinematics import placed, tree_of
from observer.maps import capsules, hindsight, mean_frames
from observer.maps.contact_model import ContactModel
from observer.maps.matching import MATCHING, Cloud, Felt
from observer.maps.novelty import MapNovelty
from observer.maps.occupancy import FIRST_SLOTS, Maps, OccupancySnapshot
from observer.pose.kalman import ContactDynamics
from observer.pose.motions import MOTIONS
from observer.shape.pose_correction import KnownSolids
from observer.shape.posterior import ShapePosterior

RESOLUTION = 0.004  # metres
LAG_SECONDS = 0.2
ENOUGH = 16_000  # particles times candidates, from which on two threads are faster than one
AS_WRITTEN: dict[str, Any] = {
    "motion": "delta_pose",
    "matching": "sample",
    "lag": 0,
    "contact_model": ContactModel(prior=0.5, touch=1.0, sustained=1.0, free=1.0, caution=0.0, temper=1.0, repeats=0.0),
}


class HapticSLAM:
    """The observer: from efference copies, noisy joint angles and contacts to pose and shape."""

    def __init__(
        self,
        hand: Hand,
        sigma_deg: float = 3.0,
        particles: int = 200,
        *,
        motion: str = "forward_model",
        candidates: int = 8,
        matching: str = "mean",
        lag: int | None = None,
        motor_noise: float = 0.1,
        control_hz: float = 50.0,
        grid: Grid | None = None,
        contact_model: ContactModel | None = None,
        in_hindsight: bool = True,
        dynamics: ContactDynamics | None = None,
        solids: ShapePosterior | None = None,
        threads: int | None = None,
    ) -> None:
        """`sigma_deg` and `motor_noise` as the observer believes them; `motion`: what it knows of how torques move
        the hand, its physics ("forward_model"), a line ("delta_pose"), nothing but that it moves smoothly ("kinematic",
        for recordings without torques), or that it is where it is felt ("raw_angles"); `candidates` K of scan matching;
        `lag` in steps (None: 200 ms); `grid` (None: 4 mm voxels over the hand's workspace).

        `matching`: a particle takes the "mean" of its candidates by likelihood, which keeps the maps sharp with few
        particles, or one "sample" of them, which is exact Bayes as N grows (tests/observer/test_exact_bayes.py).

        `in_hindsight`: the last belief of a trial, from `flush`, has the map of `observer.maps.hindsight` (only with
        matching by the "mean", of which it is the continuation).

        `solids`: what the object may be, where that is known; the lagged angles of a belief are then also what contacts
        with those solids make of them (`observer.shape.pose_correction`). Maps are the same with and without.

        `threads`: how many match particles to their maps side by side; None: what is fastest for their number, one
        where they are few. The bits are the same.

        Raises `ValueError` for a value out of range.
        """
        edge.world(hand=hand)
        sigma = edge.sigma(sigma_deg)
        motor = validate.number("motor_noise", motor_noise, 0.0, 1.0)
        rate = validate.number("control_hz", control_hz, 1.0, 500.0, unit="Hz")
        self.hand, self.control_hz = hand, rate
        self.n_particles = validate.integer("particles", particles, 1, edge.COUNT)
        self.n_candidates = validate.integer("candidates", candidates, 1, edge.COUNT)
        self.matching = validate.choice("matching", matching, MATCHING)
        self.threads = side_by_side.check(threads)
        self.lag = round(LAG_SECONDS * rate) if lag is None else validate.integer("lag", lag, 0, edge.COUNT)
        self.grid = Grid.around(hand.grasp_centre, hand.workspace, RESOLUTION) if grid is None else grid
        validate.instance("grid", self.grid, Grid, "a haptic_env.grid.Grid")
        self.contact_model = ContactModel() if contact_model is None else contact_model
        validate.instance("contact_model", self.contact_model, ContactModel, "a ContactModel")
        if dynamics is not None:
            validate.instance("dynamics", dynamics, ContactDynamics, "a ContactDynamics")
        self._check_memory(validate.choice("motion", motion, MOTIONS))
        self.pose = MOTIONS[motion](
            hand,
            sigma=sigma,
            motor_noise=motor,
            control_hz=rate,
            lag=self.lag + 1,  # the proposal needs the step before the lagged one as well
            dynamics=ContactDynamics() if dynamics is None else dynamics,
        )
        self.in_hindsight = validate.boolean("in_hindsight", in_hindsight) and matching == "mean"
        if solids is not None:
            validate.instance("solids", solids, ShapePosterior, "a ShapePosterior of what the object may be")
            if solids.hand.joint_names != hand.joint_names or len(solids.hand.patches) != len(hand.patches):
                raise ValueError(f"solids must be told of hand {hand.name!r}, got those of {solids.hand.name!r}")
        self._known = None if solids is None else KnownSolids(solids, rate)
        self._fixed = tree_of(hand)
        self._body = capsules.body_of(hand.patches, self.grid.resolution)
        group = hand.link_group
        self._watches = group[hand.patches.link][:, None] == group  # (P, L): links whose patches a touch calls up
        self._lattice = capsules.lattice_of(self.grid)
        self._evidence = self.contact_model.evidence(self.grid.resolution)
        self._novelty = MapNovelty(hand, self.contact_model.repeats, self.grid.resolution)
        self._pending: deque[tuple[NDArray[np.bool_], Pose | None]] | None = None
        also = {
            "sampled_matching": matching == "sample",
            "smooth_motion": motion == "kinematic",
            "known_solids": solids is not None,
        }
        self._needs = (*compiling.USUAL, *(f"observer.warming:{name}" for name, needed in also.items() if needed))

    @classmethod
    def paper(cls, hand: Hand, sigma_deg: float = 3.0, particles: int = 200, **keywords: Any) -> Self:
        """The observer as the paper describes it (section 3), to compare with; `keywords` change single parts.

        Delta-pose motion, no lag, K candidates of which one is kept, w ∝ p(z | q, m), every step's contacts written
        in full with the pose held fixed, resampling where Neff < N/2. The paper is silent on: the motion model
        (`DeltaPose`: learnt by babbling); p(z | q, m) and the inverse model of the map (`ContactModel`, without what
        it makes of the pose's spread and of repetition); how far the perturbations reach (as far as the proposal).
        It keeps the best candidate; one drawn by likelihood stands in, for which the weight, their mean likelihood,
        is unbiased. Its estimate is the best particle's; a `Belief` gives the mean.
        """
        return cls(hand, sigma_deg, particles, **{**AS_WRITTEN, **keywords})

    def reset(self, seed: int | None = None, joint_angles: ArrayLike | None = None) -> Belief:
        """All particles at the rest pose with an empty map (step 1); the belief before the first step.

        `joint_angles` (J,) rad: those felt at the reset, for a `motion` that does not know where the hand begins
        ("kinematic"); it need not be told. Raises `ValueError` as `step` does, and for a `seed` that is none.
        """
        compiling.ensure(self._needs, self.hand)
        count, joints = self.n_particles, self.hand.joints
        self._rng = np.random.default_rng(validate.seed(seed))
        self.pose.reset(None if joint_angles is None else edge.angles(self.hand, joint_angles))
        self._maps = Maps(count, self.grid, self._evidence.probability, dense=self.matching == "sample")
        self._poses = np.tile(self.hand.rest_pose, (count, 1)).astype(np.float64).reshape(count, joints)
        self._drawn = self.hand.rest_pose, np.zeros((joints, joints))  # mean and factor of the Gaussian about them
        self._weigh_alike()
        self._log_evidence = 0.0
        self._felt = np.zeros(len(self.hand.patches), dtype=bool)
        self._novelty.reset()
        self._pending = deque()  # felt, but waiting for the lag
        self._moments: list[hindsight.Moment] = []
        if self._known is not None:
            self._known.reset(seed)
        return self._belief(ago=0)

    def step(self, torque: ArrayLike, joint_angles: ArrayLike, contacts: ArrayLike, root: Pose | None = None) -> Belief:
        """One turn: `torque` (J,) commanded, fractions; `joint_angles` (J,) rad felt; `contacts` (P,) felt.

        `root`: where the frame in which the hand is drawn lies in the grid's, for a hand that moves as a whole about
        the object; None: where the grid is.

        Raises `ValueError` before the first `reset`, after `flush`, and for what is not finite, not binary, or beyond
        what can be: torques of ± 1, angles of ± 4π rad.
        """
        pending = self._running()
        u, q, z = edge.told(self.hand, torque, joint_angles, contacts)
        at = edge.root(root)
        self.pose.step(u, q, z)
        pending.append((z, at))
        if len(pending) <= self.lag:
            return self._belief(ago=len(pending))
        return self._assimilate(ago=self.lag)

    def flush(self) -> list[Belief]:
        """End the trial: let the steps that still wait for the lag enter the maps; a belief for each, the last one
        about now (`in_hindsight` there is one without a lag, too). After it only `reset` is possible."""
        pending = self._running()
        beliefs = [self._assimilate(ago=len(pending) - 1) for _ in range(len(pending))]
        self._pending = None
        if not self.in_hindsight or not self._moments:
            return beliefs
        last = beliefs.pop() if beliefs else self._belief(ago=0)
        link_body = self._fixed.link_body
        seen = partial(hindsight.occupancy, self._moments, link_body, self.grid, self._body, self.contact_model)
        return [*beliefs, replace(last, snapshot=OccupancySnapshot(seen))]

    @property
    def sigma_deg(self) -> float:
        """Degrees: SD of the noise of felt angles as the observer believes it. May be set, in mid-trial too: it holds
        from the next step on. Raises `ValueError` for a value out of range."""
        return float(np.rad2deg(self.pose.sigma))

    @sigma_deg.setter
    def sigma_deg(self, sigma_deg: float) -> None:
        self.pose.sigma = edge.sigma(sigma_deg)

    @property
    def set_aside(self) -> NDArray[np.int64]:
        """(J,) how many felt angles of the trial no hand can have, so that they were set aside, or taken without whole
        turns (`observer.pose.gating`)."""
        return self.pose.set_aside

    def _assimilate(self, ago: int) -> Belief:
        """Predict, match, weigh, map and resample (steps 3 to 6) for the oldest step that waits, `ago` steps back."""
        contacts, root = self._running().popleft()
        self._tree = placed(self._fixed, root)
        proposal, centres = self._propose(ago)
        log_likelihood, moved = self._match_and_map(proposal, centres, contacts, ago)
        self._weigh(log_likelihood)
        resampled = self._resample()
        if resampled or (self.n_particles > 1 and log_likelihood.any()):
            self._maps.weights_changed()
        moved_share = np.count_nonzero(moved) / self.n_particles
        belief = self._belief(ago, contacts, proposal, resampled, moved_share, root)
        if self._known is None:
            return belief
        return self._known.correct(belief, self.pose, [(contacts, root), *self._running()])

    def _propose(self, ago: int) -> tuple[Transition, Array]:
        """p(q_k | q_{k-1}, u, q̃): the same linear Gaussian for all particles, and how far from its mean the centre of
        each one's lies (N, J).

        What was felt since has told more of q_{k-1} too, the same for all: it moves the particles with the Gaussian
        that they were drawn about, so that no weight is needed for it. Raises `FloatingPointError` for poses that are
        not finite, which no kernel is to have.
        """
        now, before = self.pose.lagged(ago), self.pose.lagged(ago + 1)
        mean, covariance = self.pose.mean, self.pose.covariance
        proposal = Transition.between(mean, covariance, before, now)
        centres, factor = carried_on(covariance, before.start, now.start, proposal.follow, *self._drawn, self._poses)
        if not all(np.isfinite(each).all() for each in (proposal.mean, proposal.rest, centres, factor)):
            raise FloatingPointError(f"the pose of {ago} steps ago is not finite")
        self._drawn = proposal.mean, factor
        return proposal, centres

    def _match_and_map(
        self, proposal: Transition, centres: Array, contacts: NDArray[np.bool_], ago: int
    ) -> tuple[Array, NDArray[np.bool_]]:
        """Scan matching against each particle's own map, and that map's update at the matched pose (4 and 5)."""
        self._maps.before_change()
        lagged = self.pose.lagged(ago)
        stance, reach = mean_frames.stand(
            self._tree,
            self._body,
            self._evidence,
            self.contact_model.caution,
            proposal.mean,
            self.pose.covariance[lagged, lagged].copy(),
        )
        touch = np.where(self._felt, self.contact_model.sustained, self.contact_model.touch)
        heard = self._novelty.heard(stance, contacts)
        if self.in_hindsight and heard.any():
            moment = hindsight.Moment(stance.position, stance.rotation, reach.place, contacts, touch, heard)
            self._moments.append(moment)
        felt = Felt(
            self._tree,
            self._body,
            self._lattice,
            self._evidence,
            reach.of(heard),
            contacts,
            np.where(heard[self.hand.patches.link], touch, 0.0),
            self._watches[contacts].any(axis=0),
        )
        self._felt = contacts
        cloud = Cloud(stance, centres, proposal.rest, self._drawn[1])
        match = MATCHING[self.matching]
        number = side_by_side.chosen(self.threads, self.n_particles * self.n_candidates, ENOUGH)
        return match(felt, cloud, self.n_candidates, self._maps, self._rng, self._poses, number)

    def _weigh(self, log_likelihood: Array) -> None:
        """w ∝ w · p(z | q, m) (step 5); raises `FloatingPointError` for what is not finite."""
        self._log_weights += log_likelihood
        total, self._weights, self._n_eff = resampling.normalise(self._log_weights)
        if not np.isfinite(total):
            raise FloatingPointError(f"the particles' weights are not finite: log Σw = {total}")
        self._log_evidence += total

    def _resample(self) -> bool:
        """Systematic resampling where Neff < N/2 (step 6); whether it was."""
        if self._n_eff >= 0.5 * self.n_particles:
            return False
        counts = resampling.systematic_counts(self._weights, self._rng.random())
        source, target = resampling.in_place(counts)
        self._maps.copy(source, target)
        self._poses[target] = self._poses[source]
        self._weigh_alike()
        return True

    def _weigh_alike(self) -> None:
        self._n_eff = float(self.n_particles)
        self._weights = np.full(self.n_particles, 1.0 / self.n_particles)
        self._log_weights: Array = np.log(self._weights)

    def _belief(
        self,
        ago: int,
        contacts: NDArray[np.bool_] | None = None,
        transition: Transition | None = None,
        resampled: bool = False,
        moved_share: float = 0.0,
        root: Pose | None = None,
    ) -> Belief:
        lagged = self.pose.lagged(ago)
        mean, covariance, weights = self.pose.mean, self.pose.covariance, self._weights
        # What the maps say of the lagged pose moves the present one as far as the two are correlated.
        shift = np.zeros(self.hand.joints) if contacts is None else weights @ self._poses - mean[lagged]
        angles, std, lagged_angles, lagged_std, lagged_covariance = shifted(mean, covariance, lagged.start, shift)
        return Belief(
            joint_angles=angles,
            joint_std=std,
            lagged_joint_angles=lagged_angles,
            lagged_joint_std=lagged_std,
            lagged_covariance=lagged_covariance,
            lagged_contacts=contacts,
            transition=transition,
            lagged_root=root,
            lag_steps=ago,
            grid=self.grid,
            weights=weights,
            particles=self._poses.copy(),
            n_eff=self._n_eff,
            log_evidence=self._log_evidence + self.pose.log_evidence,
            resampled=resampled,
            moved_share=moved_share,
            snapshot=self._maps.snapshot(weights),
        )

    def _check_memory(self, motion: str) -> None:
        """Raise `ValueError` for more particles, candidates, steps of lag or voxels than fit into the memory."""
        count, voxels = self.n_particles, int(np.prod(self.grid.shape))
        slots = voxels if self.matching == "sample" else FIRST_SLOTS
        edge.memory(
            f"particles={count}, candidates={self.n_candidates}, lag={self.lag} and {voxels} voxels",
            edge.of_maps(self.hand, self.grid, count, self.n_candidates, slots)
            + edge.of_poses(self.hand.joints, self.lag + 1, motion == "kinematic"),
        )

    def _running(self) -> deque[tuple[NDArray[np.bool_], Pose | None]]:
        if self._pending is None:
            raise ValueError("the observer is not in a trial: call reset() before step() or flush()")
        return self._pending
