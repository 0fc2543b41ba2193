"""One observer at work in an exploration.

Shapes: T steps, J joints, P patches, C labels.
"""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np
from numpy.typing import ArrayLike, NDArray

from haptic_env.arrays import Array
from haptic_lab.limits import Attention
from haptic_lab.records import BeliefTrace, StepInput
from observer import Belief, HapticSLAM, ShapePosterior
from observer.variants import Observer


@dataclass
class ObserverRun:
    """An observer at work, what it tells about the shape, and a record of both.

    Attributes:
        observer: that is told what was felt.
        shape: names the object from its beliefs; None: nobody does.
        beliefs: of each step: mean (J,) rad, SD (J,) rad, offset (J,) rad, its SD (J,) rad, effective sample size,
            posterior (C,), reliability (P,).
        lagged: by step: mean (J,) rad, SD (J,) rad, touches (P,), once the lag has passed.
        course: log posterior (C,) after the reset and each step; None: it is not kept.
        attention: what it notices of what is felt; None: all.
        maps_every: steps from one map that is kept to the next, 1 at least; None: none is, nor of who has no map.
        maps: each in hindsight, of the first step that is not before its time.
    """

    observer: Observer
    shape: ShapePosterior | None
    course: list[Array] | None = None
    attention: Attention | None = None
    maps_every: float | None = None
    maps: list[Array] = field(default_factory=list)
    beliefs: list[tuple[Array, Array, Array, Array, float, Array, Array]] = field(default_factory=list)
    lagged: dict[int, tuple[Array, Array, NDArray[np.bool_] | None]] = field(default_factory=dict)

    @property
    def posterior(self) -> dict[str, float]:
        """Probability of each label now; empty where the observer is not asked to name the object."""
        if self.shape is None:
            return {}
        return dict(zip(self.shape.labels, map(float, self.shape.posterior), strict=True))

    def reset(self, seed: int, joint_angles: ArrayLike) -> None:
        """Start a trial.

        Args:
            seed: of the observer's chance.
            joint_angles: (J,) rad that are felt first.
        """
        self.belief = self.observer.reset(seed, joint_angles)
        if self.shape is not None:
            self.shape.reset(seed)
            if self.course is not None:
                self.course = [self.shape.log_posterior]

    def step(self, step: int, name: str, turn: StepInput) -> None:
        """Take one turn.

        Args:
            step: its number, from 1.
            name: by which this observer is told something.
            turn: what all are told.
        """
        del self.belief  # its map would be computed just before it changes, though nobody asked for it
        contacts = turn.contacts if self.attention is None else self.attention.attended(step, turn.contacts)
        self.belief = self.observer.step(turn.torque, turn.told[name], contacts, turn.root)
        posterior = self._take_in(step, self.belief)
        now = self.belief
        pose = now.joint_angles, now.joint_std, now.joint_offset, now.joint_offset_std
        self.beliefs.append((*pose, now.n_eff, posterior, now.patch_reliability))
        if self.course is not None and self.shape is not None:
            self.course.append(self.shape.log_posterior)
        due = 0 if self.maps_every is None else int(step / self.maps_every + 1e-9)
        if len(self.maps) < due and isinstance(self.observer, HapticSLAM):
            self.maps.append(self.observer.map_now())

    def trace(self, step: int) -> BeliefTrace:
        """End the trial.

        Args:
            step: number of the last turn.

        Returns:
            What was believed.
        """
        growing = self.belief.occupancy
        for belief in self.observer.flush():
            self.belief = belief
            self._take_in(step, belief)
        angles, std, offset, offset_std, n_eff, posterior, reliability = map(np.array, zip(*self.beliefs, strict=True))
        if self.shape is not None:
            posterior[-1] = self.shape.posterior  # the flush belongs to the last step
        course = np.array([*self.course[:-1], self.shape.log_posterior]) if self.course and self.shape else None
        smoothed = [self.lagged[k] for k in range(1, step + 1)]
        lagged, lagged_std = (np.array([each[part] for each in smoothed]) for part in (0, 1))
        contacts = [each for *_, each in smoothed if each is not None]
        touched = np.array(contacts) if len(contacts) == step else None
        labels = () if self.shape is None else self.shape.labels
        now = angles, std, lagged, lagged_std, offset, offset_std, n_eff, posterior
        maps = tuple(self.maps)
        return BeliefTrace(labels, *now, self.belief, growing, reliability, touched, course, maps)

    def _take_in(self, step: int, belief: Belief) -> Array:
        lagged = belief.lagged_joint_angles, belief.lagged_joint_std, belief.lagged_contacts
        self.lagged[step - belief.lag_steps] = lagged
        return np.empty(0) if self.shape is None else self.shape.update(belief)
