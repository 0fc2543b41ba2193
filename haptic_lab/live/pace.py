"""Whether an observer keeps up with the steps that it is told."""

from __future__ import annotations

import time

import numpy as np

from observer import HapticSLAM, ShapePosterior

BEHIND = 1.0  # s, of the belief behind what has come
RECENT = 50  # steps over which the time that one takes is averaged
SPARE = 0.75  # share of the time between steps that one may take of a hand at rest: touches take more


class Pace:
    """The time that steps take, and whether that is too much: said once.

    Attributes:
        seconds: s, that a step takes by the clock, lately; 0 before the first.
        most: s, how far behind beliefs were at most.
    """

    def __init__(self, control_hz: float) -> None:
        """Begin before the first step.

        Args:
            control_hz: Hz, at which steps come.
        """
        self.seconds, self.most = 0.0, 0.0
        self._rate, self._said = control_hz, False

    def step(self, seconds: float) -> None:
        """Take in a step.

        Args:
            seconds: that it took by the clock.
        """
        self.seconds += (seconds - self.seconds) / (RECENT if self.seconds else 1)

    def told(self, behind: float) -> str | None:
        """Tell that it is too slow, where it is.

        Args:
            behind: s, of the newest belief behind what has come.

        Returns:
            A line, once: not while a burst is caught up with.
        """
        self.most = max(self.most, behind)
        if self._said or behind <= BEHIND or self.seconds * self._rate < 1.0:
            return None
        self._said = True
        return f"the observer is {behind:.1f} s behind, and nothing is lost, but beliefs grow older: {self._advice()}"

    def rehearse(self, slam: HapticSLAM, namer: ShapePosterior) -> str | None:
        """Take some steps before there are any, of a hand at rest.

        Args:
            slam: the observer, whose next trial does not know of it.
            namer: names the object, likewise.

        Returns:
            A line where it will be too slow; None: it will keep up.
        """
        hand, taken = slam.hand, []
        slam.reset(seed=0, joint_angles=hand.rest_pose)
        namer.reset(seed=0)
        torque = np.zeros(hand.joints)
        for _ in range(slam.lag + 20):
            begun = time.perf_counter()
            namer.update(slam.step(torque, hand.rest_pose, np.zeros(len(hand.patches))))
            taken.append(time.perf_counter() - begun)
        self.seconds = float(np.mean(taken[slam.lag :]))
        if self.seconds * self._rate < SPARE:
            return None
        self._said = True
        return f"the observer will not keep up on this machine as it is: {self._advice()}"

    def _advice(self) -> str:
        fits = min(max(1, int(SPARE / self.seconds)), int(self._rate))
        return (
            f"a step takes {1e3 * self.seconds:.1f} ms and comes every {1e3 / self._rate:.3g} ms; --control-hz {fits} "
            "fits, or fewer --particles"
        )
