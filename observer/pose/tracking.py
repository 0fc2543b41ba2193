"""What any observer has of a pose and of contacts."""

from __future__ import annotations

from collections import deque
from typing import TYPE_CHECKING, Any, Self

import gymnasium as gym
import numpy as np
from numpy.typing import ArrayLike, NDArray

from haptic_env import hand_env, sensors, validate
from haptic_env.arrays import Array
from haptic_env.hand import Hand
from observer import compiling, edge
from observer.contacts.contact_filter import ContactFilter
from observer.pose.kalman import PoseFilter
from observer.pose.smooth_motion import KinematicPose
from observer.pose.source import PoseSource

if TYPE_CHECKING:
    from observer.state import Waiting


class TracksPose:
    """An observer whose pose is tracked by a source of its own, and who may doubt what patches report.

    Attributes:
        hand: whose pose it is, with P patches.
        pose: the source, of J joints.
        lag: steps.
    """

    hand: Hand
    pose: PoseSource
    lag: int
    _reports: ContactFilter | None  # None: contacts are what is reported

    def __repr__(self) -> str:
        return f"<{type(self).__name__} of {self.hand.name}: {', '.join(self._in_words())}>"

    def _in_words(self) -> list[str]:
        """What `repr` says of it besides its name and its hand's."""
        low, high = np.min(self.sigma_deg), np.max(self.sigma_deg)
        return [f"σ = {low:.3g}°" if low == high else f"σ = {low:.3g}° to {high:.3g}°", f"lag {self.lag} steps"]

    @classmethod
    def for_env(cls, env: gym.Env[Any, Any], **keywords: Any) -> Self:
        """Make an observer that believes of its senses and muscles what is so in an environment.

        Args:
            env: with a hand, moved at a rate, and a noise, which all are believed.
            **keywords: of the observer, to change single parts.

        Returns:
            The observer.

        Raises:
            ValueError: for an environment without a hand, or whose noise is not known, such as a played recording.
        """
        base = hand_env(env)
        noise = getattr(base, "noise", None)
        validate.instance("noise of env", noise, dict, "known, as that of HapticSLAM/TwoFinger-v0")
        return cls(**{"hand": base.hand, "control_hz": base.control_hz, **(noise or {}), **keywords})

    @property
    def sigma_deg(self) -> Any:
        """Degrees: SD of white noise of the felt angles as the observer believes it, (J,) where joints differ.

        It may be set, in mid-trial too, and holds from the next step on; what is out of range raises `ValueError`.
        """
        sigma = np.rad2deg(self.pose.sigma)
        return sigma if np.ndim(sigma) else float(sigma)

    @sigma_deg.setter
    def sigma_deg(self, sigma_deg: sensors.Spread) -> None:
        self.pose.sigma = sensors.White(sigma_deg, self.hand.joints).sigma

    @property
    def set_aside(self) -> NDArray[np.int64]:
        """(J,) how many felt angles of the trial no hand can have (`observer.pose.gating`).

        They were set aside, or taken without whole turns.
        """
        return self.pose.set_aside

    @property
    def patch_reliability(self) -> Array:
        """(P,) probability that each patch works; 1 where nothing else is believed."""
        return np.ones(len(self.hand.patches)) if self._reports is None else self._reports.reliability

    def anticipate(self) -> None:
        """Do of the next step what needs nothing that is measured at it, while there is time; else `step` does it.

        Only `motion="kinematic"` has such a part. What is believed is the same, bit for bit, and so is what is saved.
        """
        if isinstance(self.pose, KinematicPose):
            self.pose.expect()

    def _begin(self, joint_angles: ArrayLike | None) -> None:
        """Start a trial, with `joint_angles` (J,) rad felt at the reset."""
        self.pose.reset(None if joint_angles is None else edge.angles(self.hand, joint_angles))
        if self._reports is not None:
            compiling.ensure(("observer.warming:contacts",), self.hand)
            self._reports.reset()

    def _touched(self, contacts: NDArray[np.bool_], unmeasured: NDArray[np.bool_] | None) -> NDArray[np.bool_]:
        """(P,) which patches are touched now, where they report `contacts` (P,), but for those `unmeasured` (P,)."""
        touched, doubted = contacts, np.zeros(len(contacts), dtype=bool)
        if self._reports is not None:
            touched = self._reports.step(contacts, unmeasured)
            doubted = self._reports.doubted
        if unmeasured is not None:
            touched, doubted = touched & ~unmeasured, doubted | unmeasured
        if isinstance(self.pose, PoseFilter):  # what else tracks a pose knows of no forces
            self.pose.doubted = doubted
        return touched

    def _look_back(self, waiting: deque[Waiting], ago: int) -> None:
        """Put which patches were touched in place of what they reported, at the steps that wait, of which the first is
        `ago` steps back."""
        if self._reports is not None:
            doubted = self._reports.doubted
            for k in range(len(waiting)):
                waiting[k] = waiting[k].touching(self._reports.touched(ago - k), doubted)
