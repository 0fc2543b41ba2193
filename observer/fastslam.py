"""Haptic SLAM: FastSLAM 2.0 for touch (paper, section 3).

Shapes: N particles, J joints, P patches, K candidates, L links, (X, Y, Z) voxels. Angles in radians.

What is linear and Gaussian is the same for all particles and is done once, exactly, by one of `MOTIONS`. A particle
is one hypothesis of the path of the pose about that Gaussian, drawn at the lag, and the map that follows from it.
"""

from __future__ import annotations

from collections.abc import Callable
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
from haptic_env.sensors import Faults
from observer import compiling, edge
from observer import threads as side_by_side
from observer.belief import Belief
from observer.contacts.contact_filter import believed_contacts
from observer.maps.capsules import MapInput
from observer.maps.contact_model import ContactModel
from observer.maps.matching import MATCHING, Cloud, match, sweep
from observer.maps.occupancy import Maps, OccupancySnapshot
from observer.novelty import MapNovelty
from observer.pose.angle_noise import believed
from observer.pose.contact_dynamics import ContactDynamics
from observer.pose.motions import MOTIONS
from observer.pose.tracking import TracksPose
from observer.sensing import Sensing
from observer.shape.pose_correction import PoseCorrection
from observer.shape.posterior import ShapePosterior
from observer.state import NOTHING, Diagnostics, FilterState, Proposal, Waiting, belief_of

RESOLUTION = 0.004  # metres
LAG_SECONDS = 0.2
ENOUGH = 16_000  # particles times candidates, from which on two threads are faster than one
PARTS = ("pose", "predict", "settle", "gather", "match", "weigh", "map", "resample", "belief")  # of a step
AS_WRITTEN: dict[str, Any] = {
    "motion": "delta_pose",
    "matching": "sample",
    "lag": 0,
    "contact_model": ContactModel(prior=0.5, touch=1.0, sustained=1.0, free=1.0, caution=0.0, temper=1.0, repeats=0.0),
}


class HapticSLAM(TracksPose):
    """The observer: from efference copies, noisy joint angles and contacts to pose and shape."""

    def __init__(
        self,
        hand: Hand,
        sigma_deg: float | None = 3.0,
        particles: int = 200,
        *,
        bias_deg: float = 0.0,
        drift_deg: float = 0.0,
        drift_seconds: float = 10.0,
        proportional: float = 0.0,
        start_std_deg: float = 0.0,
        contact_miss: float = 0.0,
        contact_false_alarm: float = 0.0,
        contact_confusion: float = 0.0,
        patches_stuck: Faults = 0.0,
        patches_dead: Faults = 0.0,
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
        """`sigma_deg` (None: found out), `bias_deg`, `drift_deg`, `drift_seconds`, `proportional` and `motor_noise`:
        the environment's keywords, as the observer believes them; `start_std_deg`: SD of each joint about the rest pose
        at the reset (`observer.pose.angle_noise`). `contact_miss` to `patches_dead`: those of contacts; which patches
        are stuck or dead is found out, where their probability is told (`observer.contacts`). `motion`: what it knows
        of how torques move the hand, its physics ("forward_model"), a line ("delta_pose"), nothing but that it moves
        smoothly ("kinematic", for recordings without torques), or that it is where it is felt ("raw_angles");
        `candidates` K of scan matching; `lag` in steps (None: 200 ms); `grid` (None: 4 mm voxels).

        `matching`: a particle takes the "mean" of its candidates by likelihood, which keeps the maps sharp with few
        particles, or one "sample" of them, which is exact Bayes as N grows (tests/observer/test_exact_bayes.py).

        `in_hindsight`: the last belief of a trial, from `flush`, has the map of `observer.maps.hindsight` (only with
        matching by the "mean", of which it is the continuation).

        `solids`: what the object may be, where that is known; the lagged angles of a belief are then also what contacts
        with those solids make of them (`observer.shape.pose_correction`). Maps are the same with and without; but where
        it can be one alone, contacts with it tell the offsets of felt angles.

        `threads`: how many match particles to their maps side by side; None: what is fastest for their number, one
        where they are few. The bits are the same.

        The attribute `on_part`, where it is set, is called with the name of each part of a step when it is done, in
        order: "pose" of every step, and of those that enter the maps the rest of `PARTS`.

        Raises `ValueError` for a value out of range.
        """
        edge.world(hand=hand)
        motor = validate.number("motor_noise", motor_noise, 0.0, 1.0)
        rate = validate.number("control_hz", control_hz, 1.0, 500.0, unit="Hz")
        self.hand, self.control_hz = hand, rate
        sigma, noise = believed(
            hand.joints, rate, sigma_deg, bias_deg, drift_deg, drift_seconds, proportional, start_std_deg
        )
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
        validate.choice("motion", motion, MOTIONS)
        kinds = matching == "sample", motion == "kinematic"
        edge.of_particles(hand, self.grid, self.n_particles, self.n_candidates, self.lag, *kinds)
        self.pose = MOTIONS[motion](
            hand,
            sigma=sigma,
            motor_noise=motor,
            control_hz=rate,
            lag=self.lag + 1,  # the proposal needs the step before the lagged one as well
            dynamics=dynamics,
            noise=noise,
        )
        self.in_hindsight = validate.boolean("in_hindsight", in_hindsight) and matching == "mean"
        self._reports = believed_contacts(
            hand, rate, self.lag, contact_miss, contact_false_alarm, contact_confusion, patches_stuck, patches_dead
        )
        self._known = None if solids is None else PoseCorrection(solids, rate, hand)
        self._sensing = Sensing(hand, self.grid, self.contact_model, self.in_hindsight)
        self._state: FilterState | None = None  # of the trial that is running
        self.on_part: Callable[[str], object] | None = None
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
        rng = np.random.default_rng(validate.seed(seed))
        self._begin(joint_angles)
        self._state = FilterState.begin(
            rng,
            Maps(self.n_particles, self.grid, self._sensing.evidence.probability, dense=self.matching == "sample"),
            MapNovelty(self.hand, self.contact_model.repeats, self.grid.resolution),
            self.hand,
            self.pose,
        )
        if self._known is not None:
            self._known.reset(seed)
        return self._belief(self._state, ago=0)

    def step(self, torque: ArrayLike, joint_angles: ArrayLike, contacts: ArrayLike, root: Pose | None = None) -> Belief:
        """One turn: `torque` (J,) commanded, fractions; `joint_angles` (J,) rad felt; `contacts` (P,) felt.

        `root`: where the frame in which the hand is drawn lies in the grid's, for a hand that moves as a whole about
        the object; None: where the grid is.

        Raises `ValueError` before the first `reset`, after `flush`, and for what is not finite, not binary, or beyond
        what can be: torques of ± 1, angles of ± 4π rad.
        """
        state = self._running()
        u, q, z = edge.told(self.hand, torque, joint_angles, contacts)
        at = edge.root(root)
        touched = self._touched(z)
        self.pose.step(u, q, touched)
        if self._known is not None:
            self._known.teach(self.pose, (touched, at))
        self._done("pose")
        state.waiting.append(Waiting(z, at))
        if len(state.waiting) <= self.lag:
            return self._belief(state, ago=len(state.waiting))
        return self._assimilate(state, ago=self.lag)

    def flush(self) -> list[Belief]:
        """End the trial: let the steps that still wait for the lag enter the maps; a belief for each, the last one
        about now (`in_hindsight` there is one without a lag, too). After it only `reset` is possible."""
        state = self._running()
        beliefs = [self._assimilate(state, ago) for ago in reversed(range(len(state.waiting)))]
        self._state = None
        if not self.in_hindsight or not state.moments:
            return beliefs
        last = beliefs.pop() if beliefs else self._belief(state, ago=0)
        return [
            *beliefs,
            replace(last, snapshot=OccupancySnapshot(partial(self._sensing.in_retrospect, state.moments))),
        ]

    @property
    def particle_maps(self) -> NDArray[np.int8]:
        """(N, T) log-odds of the particles' own cells in units of `contact_model.QUANTUM`, as they are kept: not to
        be changed. Raises `ValueError` outside a trial."""
        return self._running().maps.own

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
