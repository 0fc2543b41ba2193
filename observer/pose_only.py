"""The pose filter alone: an observer for whoever needs no map, and needs it fast.

Shapes: J joints, P patches.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike

from haptic_env import validate
from haptic_env.arrays import Array
from haptic_env.grid import Grid
from haptic_env.hand import Hand
from haptic_env.pose import Pose
from haptic_env.sensors import Faults, Spread
from observer import compiling, edge, memory
from observer.belief import Belief, Transition
from observer.configuration import LAG_SECONDS, RESOLUTION
from observer.contacts.contact_filter import believed_contacts
from observer.maps.occupancy import OccupancySnapshot
from observer.pose.angle_noise import believed
from observer.pose.contact_dynamics import ContactDynamics
from observer.pose.kalman import PoseFilter
from observer.pose.seen import LaggedPose, Seen, seen_of
from observer.pose.tracking import TracksPose
from observer.state import Waiting


class PoseOnly(TracksPose):
    """`HapticSLAM` without a map: its Gaussian over the pose is the same, the occupancy stays 0.5 everywhere.

    Naming the object needs no more (`ShapePosterior`), so that a policy which looks at no map is trained with it. With
    a `stride` it says something new only at every so many steps, and a `transition` reaches from one to the next.

    Attributes:
        hand: with J joints and P patches.
        control_hz: Hz, steps a second.
        stride: steps from one pose that is told of to the next.
        lag: steps, a multiple of the stride.
        pose: the Gaussian over the pose.
        grid: of the occupancy.
    """

    def __init__(
        self,
        hand: Hand,
        sigma_deg: Spread | None = 3.0,
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
        stride: int = 1,
        dynamics: ContactDynamics | None = None,
        motor_noise: float = 0.1,
        control_hz: float = 50.0,
    ) -> None:
        """Check the arguments, which are as those of `HapticSLAM` are.

        Args:
            hand: with J joints and P patches.
            sigma_deg: degrees, SD of white noise of the felt angles, of all joints or (J,), as `bias_deg` and
                `drift_deg`; None: it is found out.
            bias_deg: degrees, SD of the constant error of each joint and trial.
            drift_deg: degrees, SD of the slow error of each joint.
            drift_seconds: s, time constant of the drift.
            proportional: SD of white noise as a fraction of the angle.
            start_std_deg: degrees, SD of each joint's angle about the rest pose at the reset.
            contact_miss: probability that a touched patch stays silent, at each step.
            contact_false_alarm: probability that an untouched patch reports a contact, at each step.
            contact_confusion: probability that a touch is felt at a neighbouring patch instead, at each step.
            patches_stuck: the patches that always report a contact, by index or name, or the probability of each.
            patches_dead: the patches that never do, likewise.
            stride: steps from one pose that is told of to the next; the lag, 200 ms, is rounded to a multiple.
            dynamics: what contact does to the motion; None: forces last where offsets are believed, and are
                stronger where a wrist moves.
            motor_noise: SD of a torque as a fraction of it.
            control_hz: Hz, steps a second.

        Raises:
            ValueError: for a value out of range.
        """
        edge.world(hand=hand)
        self.hand = hand
        self.stride = validate.integer("stride", stride, 1, edge.COUNT)
        self.control_hz = rate = validate.number("control_hz", control_hz, 1.0, 500.0, unit="Hz")
        self.lag = self.stride * max(1, round(LAG_SECONDS * rate / self.stride))
        memory.check(f"stride={stride}", memory.of_poses(hand.joints, self.lag + self.stride))
        if dynamics is not None:
            validate.instance("dynamics", dynamics, ContactDynamics, "a ContactDynamics")
        sigma, noise = believed(
            hand.joints, rate, sigma_deg, bias_deg, drift_deg, drift_seconds, proportional, start_std_deg
        )
        self.pose = PoseFilter(
            hand,
            sigma=sigma,
            motor_noise=validate.number("motor_noise", motor_noise, 0.0, 1.0),
            control_hz=rate,
            lag=self.lag + self.stride,
            dynamics=dynamics,
            noise=noise,
        )
        self._reports = believed_contacts(
            hand, rate, self.lag, contact_miss, contact_false_alarm, contact_confusion, patches_stuck, patches_dead
        )
        self.grid = Grid.around(hand.grasp_centre, hand.workspace, RESOLUTION)
        self._felt: list[Waiting] | None = None
        self._lagged: LaggedPose | None = None  # what was told of at the last step
        self._belief: Belief | None = None

    def reset(self, seed: int | None = None, joint_angles: ArrayLike | None = None) -> Belief:
        """Start a trial at the rest pose.

        Args:
            seed: checked; nothing here is left to chance.
            joint_angles: (J,) rad felt at the reset, which tell of offsets; None: they are not told.

        Returns:
            The belief before the first step.

        Raises:
            ValueError: for a seed that is none, and for angles as `step` does.
        """
        compiling.ensure(compiling.USUAL, self.hand)
        validate.seed(seed)
        self._begin(joint_angles)
        self._felt = []  # every step so far
        self._told = 0  # steps that were told of
        self._look(0)
        return self.belief

    def step(
        self, torque: ArrayLike | None, joint_angles: ArrayLike, contacts: ArrayLike, root: Pose | None = None
    ) -> Belief:
        """Take one turn.

        Args:
            torque: (J,) that was commanded, fractions of the limits; None, where the motion asks for none ("kinematic",
                "raw_angles"): it is not known.
            joint_angles: (J,) rad that were felt after it; NaN where a joint was not measured.
            contacts: (P,) that were felt; NaN where a patch was not measured.
            root: None: where no map is, another one means nothing.

        Returns:
            The belief, of which what was told before is not told again.

        Raises:
            ValueError: before the first `reset`, after `flush`, and for what is not finite, not binary, or beyond what
                can be: torques of ± 1, angles of ± 4π rad, or a root.
        """
        self.advance(torque, joint_angles, contacts, root)
        return self.belief

    def advance(
        self, torque: ArrayLike | None, joint_angles: ArrayLike, contacts: ArrayLike, root: Pose | None = None
    ) -> LaggedPose | None:
        """Take one turn, and make no belief of it before it is asked for one.

        Args:
            torque: as `step`'s.
            joint_angles: as `step`'s.
            contacts: as `step`'s.
            root: as `step`'s.

        Returns:
            What is told of now; None: nothing is.

        Raises:
            ValueError: as `step` does.
        """
        felt = self._running()
        if root is not None:
            raise ValueError(
                "PoseOnly maps nothing, so a hand that moves as a whole needs HapticSLAM; got "
                f"root={validate.shown(root)}"
            )
        u, q, z, unmeasured = edge.told(self.hand, torque, joint_angles, contacts, self.pose.needs_torque)
        self.pose.step(u, q, self._touched(z, unmeasured))
        felt.append(Waiting(z, None, unmeasured))
        steps = len(felt)
        if steps % self.stride == 0 and steps >= self.lag + self.stride:
            return self._tell(self.lag)
        if steps % self.stride == 0:
            self._look(steps)
        elif self._lagged is not None:
            self._look(self.lag)  # what was told is not told twice
        return None

    @property
    def belief(self) -> Belief:
        """Of the last step at which there was anything new to tell.

        Raises:
            ValueError: before the first `reset`.
        """
        if self._belief is None:
            if not hasattr(self, "_seen"):
                raise ValueError("the observer believes nothing before the first reset(); call it first")
            self._belief = self._made()
        return self._belief

    def flush(self) -> list[Belief]:
        """End the trial. After it only `reset` is possible.

        Returns:
            A belief about each of the steps, a stride apart, that still waited for the lag.

        Raises:
            ValueError: outside a trial.
        """
        waiting = len(self._running()) - self._told
        beliefs = []
        for ago in range(waiting - self.stride, -1, -self.stride):
            self._tell(ago)
            beliefs.append(self.belief)
        self._felt = None
        return beliefs

    def _tell(self, ago: int) -> LaggedPose:
        """Look at the pose of `ago` steps back, which was not told of yet."""
        felt = self._running()
        self._look(ago)
        self._told = len(felt) - ago
        step = felt[-1 - ago]
        if self._reports is not None:
            step = step.touching(self._reports.touched(ago), self._reports.doubted)
        seen = self._seen
        self._lagged = LaggedPose(seen.lagged, seen.lagged_covariance, step.contacts, step.unmeasured)
        return self._lagged

    def _look(self, ago: int) -> None:
        """See what is known of now, and of the pose of `ago` steps back."""
        lagged = self.pose.lagged(min(ago, self.lag))
        self._seen = Seen(*seen_of(self.pose.mean, self.pose.covariance, lagged.start, self.hand.joints))
        self._ago, self._offset, self._log_evidence = ago, self.pose.offset, self.pose.log_evidence
        self._lagged = self._belief = None

    def _made(self) -> Belief:
        """The belief of what was seen; how the lagged pose follows is asked for at the step itself."""
        seen, told, transition = self._seen, self._lagged, None
        if told is not None:
            now, before = self.pose.lagged(self._ago), self.pose.lagged(self._ago + self.stride)
            transition = Transition.between(self.pose.mean, self.pose.covariance, before, now)
        return Belief(
            joint_angles=seen.angles,
            joint_std=seen.std,
            joint_offset=self._offset.mean,
            joint_offset_std=self._offset.std,
            patch_reliability=self.patch_reliability,
            lagged_joint_angles=seen.lagged,
            lagged_joint_std=seen.lagged_std,
            lagged_covariance=seen.lagged_covariance,
            lagged_contacts=None if told is None else told.contacts,
            lagged_unmeasured=None if told is None else told.unmeasured,
            transition=transition,
            lagged_root=None,
            lag_steps=min(self._ago, self.lag),
            grid=self.grid,
            weights=np.ones(1),
            particles=seen.lagged[None].copy(),
            n_eff=1.0,
            log_evidence=self._log_evidence,
            resampled=False,
            moved_share=0.0,
            snapshot=OccupancySnapshot(self._unknown),
        )

    def _unknown(self) -> Array:
        return np.full(self.grid.shape, 0.5)

    def _running(self) -> list[Waiting]:
        if self._felt is None:
            raise ValueError("the observer is not in a trial: call reset() before step() or flush()")
        return self._felt
