"""What `HapticSLAM` is told, checked, and the parts that it is made of.

Shapes: N particles, J joints, P patches, K candidates.
"""

from __future__ import annotations

import copy
from collections.abc import Callable

import numpy as np

from haptic_env import validate
from haptic_env.grid import Grid
from haptic_env.hand import Hand
from haptic_env.sensors import Faults, Spread
from observer import compiling, edge, memory
from observer import threads as side_by_side
from observer.contacts.contact_filter import believed_contacts
from observer.maps.contact_model import ContactModel
from observer.maps.matching import MATCHING
from observer.pose.angle_noise import believed
from observer.pose.contact_dynamics import ContactDynamics
from observer.pose.motions import MOTIONS
from observer.pose.tracking import TracksPose
from observer.sensing import Sensing
from observer.shape import fading
from observer.shape.pose_correction import PoseCorrection, reach
from observer.shape.posterior import ShapePosterior
from observer.state import FilterState

RESOLUTION = 0.004  # metres
LAG_SECONDS = 0.2


class Configured(TracksPose):
    """A particle filter that is put together, and in no trial yet.

    Attributes:
        hand: with J joints and P patches.
        control_hz: Hz, steps a second.
        n_particles: N.
        n_candidates: K.
        matching: the kind of scan matching.
        threads: how many are asked for.
        lag: steps.
        grid: of the maps.
        contact_model: what contacts say of voxels.
        memory_seconds: s, time constant with which maps fade.
        pose: the Gaussian that is the same for all particles.
        in_hindsight: whether the last belief has the map in hindsight.
        needs: what is to be compiled for it (`observer.compiling`).
        on_part: where it is set, called with the name of each part of a step when it is done, in order: "pose" of every
            step, and of those that enter the maps the rest of `observer.fastslam.PARTS`.
    """

    def __init__(
        self,
        hand: Hand,
        sigma_deg: Spread | None = 3.0,
        particles: int = 200,
        *,
        bias_deg: Spread = 0.0,
        drift_deg: Spread = 0.0,
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
        memory_seconds: float = np.inf,
    ) -> None:
        """Check the arguments, and put the filter together.

        Args:
            hand: with J joints and P patches.
            sigma_deg: degrees, SD of white noise of the felt angles, of all joints or (J,), as `bias_deg` and
                `drift_deg`; None: it is found out. This and what else is told of noise are the environment's keywords,
                as the observer believes them.
            particles: N.
            bias_deg: degrees, SD of the constant error of each joint and trial (`observer.pose.angle_noise`).
            drift_deg: degrees, SD of the slow error of each joint.
            drift_seconds: s, time constant of the drift.
            proportional: SD of white noise as a fraction of the angle.
            start_std_deg: degrees, SD of each joint's angle about the rest pose at the reset.
            contact_miss: probability that a touched patch stays silent, at each step (`observer.contacts`).
            contact_false_alarm: probability that an untouched patch reports a contact, at each step.
            contact_confusion: probability that a touch is felt at a neighbouring patch instead, at each step.
            patches_stuck: the patches that always report a contact, by index or name, or the probability of each: then
                which they are is found out.
            patches_dead: the patches that never do, likewise.
            motion: what is known of how torques move the hand: its physics ("forward_model"), a line ("delta_pose"),
                nothing but that it moves smoothly ("kinematic", for recordings without torques), or that it is where it
                is felt ("raw_angles").
            candidates: K of scan matching.
            matching: a particle takes the "mean" of its candidates by likelihood, which keeps the maps sharp with few
                particles, or one "sample" of them, which is exact Bayes as N grows
                (tests/observer/test_exact_bayes.py).
            lag: steps; None: 200 ms.
            motor_noise: SD of a torque as a fraction of it.
            control_hz: Hz, steps a second.
            grid: of the maps; None: 4 mm voxels over the hand's workspace.
            contact_model: what contacts say of voxels; None: the defaults.
            in_hindsight: the last belief of a trial, from `flush`, has the map of `observer.maps.hindsight` (only with
                matching by the "mean", of which it is the continuation).
            dynamics: what contact does to the motion; None: forces last where offsets are believed, and are
                stronger where a wrist moves.
            solids: what the object may be, where that is known: the lagged angles of a belief are then also what
                contacts with those solids make of them (`observer.shape.pose_correction`). Maps are the same with and
                without; but where it can be one alone, contacts with it tell the offsets of felt angles.
            threads: how many match particles to their maps side by side; None: what is fastest for their number. The
                bits are the same.
            memory_seconds: s, time constant with which maps fade (`observer.maps.forgetting`), that in hindsight too;
                inf: not at all. The pose, and the log of touches that surfaces are drawn of, do not.

        Raises:
            ValueError: for a value out of range.
        """
        told = {name: value for name, value in locals().items() if name not in ("self", "hand")}  # to be saved
        edge.world(hand=hand)
        motor = validate.number("motor_noise", motor_noise, 0.0, 1.0)
        rate = validate.number("control_hz", control_hz, 1.0, 500.0, unit="Hz")
        self.hand, self.control_hz = hand, rate
        sigma, noise = believed(
            hand.joints, rate, sigma_deg, bias_deg, drift_deg, drift_seconds, proportional, start_std_deg
        )
        self.n_particles = validate.integer("particles", particles, 1, edge.COUNT)
        self.memory_seconds = fading.check(memory_seconds)
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
        memory.of_particles(hand, self.grid, self.n_particles, self.n_candidates, self.lag, *kinds)
        self.pose = MOTIONS[motion](
            hand,
            sigma=sigma,
            motor_noise=motor,
            control_hz=rate,
            lag=self.lag + 1,  # the proposal needs the step before the lagged one as well
            dynamics=dynamics,
            noise=noise,
            **({"apart": 1 if solids is None else reach(rate)} if motion == "kinematic" else {}),
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
            "contacts": self._reports is not None,
        }
        self._told = {name: value if name == "solids" else copy.deepcopy(value) for name, value in told.items()}
        self.needs = (*compiling.USUAL, *(f"observer.warming:{name}" for name, needed in also.items() if needed))

    def _in_words(self) -> list[str]:
        voxels = f"{' × '.join(map(str, self.grid.shape))} voxels of {1e3 * self.grid.resolution:g} mm"
        return [f"{self.n_particles} particles", *super()._in_words(), voxels]
