"""What is taken of one step to be drawn, which must cost the observer next to nothing.

Shapes: J joints, P patches, C labels, (X, Y, Z) voxels.
"""

from __future__ import annotations

import time
from typing import Any, NamedTuple, Self

import numpy as np
from numpy.typing import NDArray

from haptic_env.arrays import Array
from haptic_env.grid import Grid
from haptic_env.hand import Hand
from haptic_env.pose import Pose
from observer import Belief
from observer.surface.touches import TouchingLink, TouchLog

FRAMES_PER_SECOND = 25.0  # of the exploration's own time
MAP_SECONDS, SURFACE_SECONDS = 0.4, 1.0  # between two of them
RESTS = (0.03, 0.2, 2.0)  # s of the clock between two frames, maps, surfaces that are watched
SURE, UNKNOWN = 254, 255  # of a voxel in a byte: that it is solid for certain, and that nothing is known


class Setting(NamedTuple):
    """What stays as it is.

    Attributes:
        title: of the page.
        hand: that is drawn.
        grid: of the map.
        labels: (C,) what the object may be.
        particles: of the observer.
        control_hz: steps a second.
        seconds: how long it will take; None: nobody knows.
    """

    title: str
    hand: Hand
    grid: Grid
    labels: tuple[str, ...]
    particles: int
    control_hz: float
    seconds: float | None


class NewTouches(NamedTuple):
    """K links that have touched since the last that were told.

    Attributes:
        begin: how many were told before.
        rate: Hz, of their steps.
        patches: indices, link by link.
        counts: (K,) how many patches each has.
        position: (K, 3) m.
        rotation: (K, 3, 3).
        covariance: (K, 6, 6), as `TouchingLink` has them.
    """

    begin: int
    rate: float
    patches: NDArray[np.int64]
    counts: NDArray[np.int64]
    position: Array
    rotation: Array
    covariance: Array

    @classmethod
    def of(cls, log: TouchLog, begin: int) -> Self:
        """Put together what is new.

        Args:
            log: of the trial.
            begin: how many were told before.

        Returns:
            The links since.
        """
        links, rate = log.since(begin)
        patches, position, rotation, covariance = zip(*links, strict=True) if links else ([], [], [], [])
        return cls(
            begin,
            rate,
            np.concatenate([np.empty(0, dtype=np.int64), *patches]),
            np.array([len(each) for each in patches], dtype=np.int64),
            np.array(position).reshape(-1, 3),
            np.array(rotation).reshape(-1, 3, 3),
            np.array(covariance).reshape(-1, 6, 6),
        )

    def links(self) -> list[TouchingLink]:
        """Take them apart.

        Returns:
            The links.
        """
        patches = np.split(self.patches, np.cumsum(self.counts)[:-1]) if len(self.counts) else []
        return [
            TouchingLink(*each) for each in zip(patches, self.position, self.rotation, self.covariance, strict=True)
        ]


class Moment(NamedTuple):
    """What was believed at a step.

    Attributes:
        step: from 1.
        angles: (J,) rad, the smoothed pose.
        std: (J,) rad, its SD.
        covariance: (J, J) rad², of which only the correlations are used.
        contacts: (P,) which patches were touched there; None: nobody knows yet.
        root: where the hand as a whole then was; None where it does not move.
        posterior: (C,).
        n_eff: effective sample size.
        truth: (J,) rad, the true pose there; None where nobody knows.
        occupancy: (X, Y, Z) probabilities in units of 1 / `SURE`, `UNKNOWN` where the hand never came near; None where
            the map is not drawn anew.
        touches: since the surface was last drawn; None where it is not drawn anew.
    """

    step: int
    angles: Array
    std: Array
    covariance: Array
    contacts: NDArray[np.bool_] | None
    root: Pose | None
    posterior: Array
    n_eff: float
    truth: Array | None
    occupancy: NDArray[np.uint8] | None
    touches: NewTouches | None


class Pace:
    """Which steps are drawn, and of which the map and the surface are."""

    def __init__(self, control_hz: float, every: bool = True) -> None:
        """Choose.

        Args:
            control_hz: steps a second.
            every: whether all those are drawn, however soon they follow each other: for a file, rather than to be
                watched.
        """
        self._rests = np.zeros(3) if every else np.array(RESTS)
        self._free = np.zeros(3)  # s, from when on a frame, a map and a surface are drawn
        self._mapped = self._drawn = 0
        self._log: TouchLog | None = None  # that was told last
        self._frame = max(1, round(control_hz / FRAMES_PER_SECOND))
        self._map, self._surface = (
            self._frame * max(1, round(seconds * control_hz / self._frame))
            for seconds in (MAP_SECONDS, SURFACE_SECONDS)
        )

    def frame(self, step: int) -> bool:
        """Tell whether a step is drawn.

        Args:
            step: from 1.

        Returns:
            Whether it is.
        """
        return step % self._frame == 0 and self._rested(0)

    def _rested(self, kind: int) -> bool:
        now = time.monotonic()
        if now < self._free[kind]:
            return False
        self._free[kind] = now + self._rests[kind]
        return True

    def take(self, step: int, belief: Belief, posterior: Array, truth: Array | None, whole: bool = False) -> Moment:
        """Take what is drawn of a step.

        Args:
            step: from 1.
            belief: of that step.
            posterior: (C,) probabilities of names.
            truth: (J,) rad, the true pose at the lag; None where nobody knows.
            whole: whether map and surface are drawn whatever the step.

        Returns:
            What belongs to it; arrays of the belief, which do not change.
        """
        log = belief.snapshot.touches
        draws_map = whole or (step - self._mapped >= self._map and self._rested(1))
        draws_surface = log is not None and (whole or (step - self._drawn >= self._surface and self._rested(2)))
        self._mapped = step if draws_map else self._mapped
        self._drawn = step if draws_surface else self._drawn
        return Moment(
            step,
            belief.lagged_joint_angles,
            belief.lagged_joint_std,
            belief.lagged_covariance,
            belief.lagged_contacts,
            belief.lagged_root,
            np.asarray(posterior, dtype=float).copy(),
            belief.n_eff,
            None if truth is None or not np.isfinite(truth).all() else truth,
            coded(belief.occupancy) if draws_map or draws_surface else None,
            self._new(log) if log is not None and draws_surface else None,
        )

    def _new(self, log: TouchLog) -> NewTouches:
        begin = 0 if self._log is None or not log.continues(self._log) else len(self._log)
        self._log = log
        return NewTouches.of(log, begin)


def coded(occupancy: Array) -> NDArray[np.uint8]:
    """Write a map in bytes.

    Args:
        occupancy: (X, Y, Z) probabilities.

    Returns:
        (X, Y, Z) the same in units of 1 / `SURE`, and `UNKNOWN`.
    """
    code = (SURE * occupancy + 0.5).astype(np.uint8)
    code[occupancy == 0.5] = UNKNOWN
    return code


def packed(moment: Moment) -> tuple[Any, ...]:
    """Make of a moment what is pickled several times as fast: arrays as bytes.

    Args:
        moment: any.

    Returns:
        What `unpacked` takes.
    """
    return tuple(map(_plain, moment))


def unpacked(told: tuple[Any, ...]) -> Moment:
    """Undo `packed`.

    Args:
        told: what that returns.

    Returns:
        The moment.
    """
    *rest, touches = told
    return Moment._make([*map(_array, rest), None if touches is None else NewTouches(*map(_array, touches))])


def _plain(value: Any) -> Any:
    if isinstance(value, NewTouches):
        return tuple(map(_plain, value))
    return (value.dtype.str, value.shape, value.tobytes()) if isinstance(value, np.ndarray) else value


def _array(value: Any) -> Any:
    if not isinstance(value, tuple) or not isinstance(value[-1], bytes):
        return value
    kind, shape, content = value
    return np.frombuffer(content, dtype=kind).reshape(shape)
