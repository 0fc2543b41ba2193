"""A belief as numbers for a network.

Shapes: J joints, P patches, C labels, F fingertips. Every entry of the vector is listed in `ENTRIES`.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from typing import Any

import gymnasium as gym
import numpy as np
from numpy.typing import ArrayLike, NDArray

from haptic_env import readable, validate
from haptic_env.hand import Hand
from observer import edge
from observer.belief import Belief
from observer.kinematics import link_frames, tree_of
from observer.wrappers.stepped_apart import SteppedApart

ENTRIES = {
    "pose": "(J,) posterior mean of the joint angles now; the joint's limits are -1 and 1",
    "spread": "(J,) their posterior SD, in units of 0.1 rad",
    "motion": "(J,) how far the mean has moved since the lagged pose, rad",
    "contacts": "(P,) what each patch feels now, 0 or 1",
    "names": "(C,) posterior probability of each label",
    "occupancy": "(F * 27,) occupancy about the tip of each finger, on a lattice of 3 x 3 x 3 points 1 cm apart in the "
    "link's frame: probability * 2 - 1, 0 where nothing is known",
    "time": "(1,) share of the episode that is left",
    "rhythm": "(6,) sine and cosine of clocks of 0.5 Hz, 1 Hz and 0.17 Hz: a network without memory keeps no rhythm",
    "covered": "(125,) occupied voxels in each of 5 x 5 x 5 parts of the map, in units of one side of such a part",
}
OF_NAMES = ("names",)  # which need an observer that names the object
OF_MAPS = ("occupancy", "covered")  # which need an observer that has one
USUAL = tuple(name for name in ENTRIES if name != "covered")  # where nothing else is said
PARTS = 5  # of the map along each axis
SPREAD_UNIT = 0.1  # rad
BOUND = 2.0  # of what has no bound of its own; what is beyond is clipped
SPACING = 0.01  # m
CLOCKS_HZ = (0.5, 1.0, 0.17)  # the last fits into no other, so that a rhythm drifts


class BeliefSpace(gym.spaces.Box):
    """Box (D,) of a belief as numbers, which knows what they are, and so does whatever is saved with it.

    Attributes:
        entries: of `ENTRIES`, one after the other.
    """

    def __init__(self, low: NDArray[np.float32], high: NDArray[np.float32], entries: Sequence[str]) -> None:
        """Keep the entries.

        Args:
            low: (D,) least numbers.
            high: (D,) largest numbers.
            entries: of `ENTRIES`.
        """
        super().__init__(low, high, dtype=np.float32)
        self.entries = tuple(entries)


class BeliefFeatures:
    """What is believed as a vector: entries of `ENTRIES`, one after the other.

    Attributes:
        entries: which.
        space: Box (D,) of the vector.
    """

    __repr__ = readable.line

    def __init__(
        self, hand: Hand, labels: Sequence[str], seconds: float, control_hz: float, entries: Sequence[str] | None = None
    ) -> None:
        """Lay the vector out.

        Args:
            hand: that explores.
            labels: (C,) names; none, where none of the entries tells of them.
            seconds: of an episode.
            control_hz: steps a second.
            entries: some of `ENTRIES`; None: `USUAL`, all but "covered".

        Raises:
            ValueError: for an unknown entry or none, and for what is out of range.
        """
        edge.world(hand=hand)
        several = (list, tuple)
        validate.instance("labels", labels, several, "a list of names")
        if entries is not None:
            known = f"a list of some of {', '.join(ENTRIES)}, or None for all but covered"
            validate.instance("entries", entries, several, known)
        self.entries = tuple(USUAL if entries is None else entries)
        for entry in self.entries:
            validate.choice("entry", entry, ENTRIES)
        if not self.entries:
            raise ValueError(f"entries must name at least one of {', '.join(ENTRIES)}")
        if labels or tell_names(self.entries):
            validate.names("labels", labels)
        self._seconds = validate.number("seconds", seconds, 1e-6, 1e12, unit="s")
        self._step_seconds = 1.0 / validate.number("control_hz", control_hz, 1e-6, 1e6, unit="Hz")
        self._patches, self._labels = len(hand.patches), len(labels)
        self._middle = hand.joint_limits.mean(axis=1)
        self._reach = 0.5 * np.ptp(hand.joint_limits, axis=1)
        self._tree = tree_of(hand)
        self._tips = np.array([index for index, link in enumerate(hand.links) if link.tip], dtype=np.int64)
        steps = np.stack(np.meshgrid(*[[-1, 0, 1]] * 3, indexing="ij"), axis=-1).reshape(-1, 3)
        ends = np.array([[0.0, 0.0, hand.links[tip].length] for tip in self._tips])
        self._lattice = ends[:, None] + SPACING * steps
        joints, patches, cells = hand.joints, len(hand.patches), len(self._tips) * len(steps)
        bounds = {
            "pose": (joints, -BOUND, BOUND),
            "spread": (joints, 0.0, BOUND),
            "motion": (joints, -BOUND, BOUND),
            "contacts": (patches, 0.0, 1.0),
            "names": (len(labels), 0.0, 1.0),
            "occupancy": (cells, -1.0, 1.0),
            "time": (1, 0.0, 1.0),
            "rhythm": (2 * len(CLOCKS_HZ), -1.0, 1.0),
            "covered": (PARTS**3, 0.0, BOUND),
        }
        low, high = (
            np.concatenate([np.full(bounds[entry][0], bounds[entry][side], np.float32) for entry in self.entries])
            for side in (1, 2)
        )
        self.space = BeliefSpace(low, high, self.entries)

    def vector(
        self, belief: Belief, contacts: ArrayLike, posterior: ArrayLike | None, step: int
    ) -> NDArray[np.float32]:
        """Turn a belief into numbers.

        Args:
            belief: after that step.
            contacts: (P,) felt now.
            posterior: (C,) of the labels; None where there are none.
            step: how many there were.

        Returns:
            (D,), within `space`.

        Raises:
            ValueError: for what is none of these.
        """
        felt = validate.binary("contacts", contacts, (self._patches,))
        if posterior is None:  # which no entry may need
            posterior = np.zeros(0 if tell_names(self.entries) else self._labels)
        if isinstance(posterior, np.ndarray) and posterior.shape != (self._labels,):
            raise ValueError(
                f"posterior must be of shape ({self._labels},), one for each of the labels, got shape {posterior.shape}"
            )
        names = validate.array("posterior", posterior, (self._labels,), bound=1.0)
        seconds = validate.integer("step", step, 0, 10**12) * self._step_seconds
        turns = [2 * np.pi * hz * seconds for hz in CLOCKS_HZ]
        rhythm = [wave(turn) for turn in turns for wave in (np.sin, np.cos)]
        parts: dict[str, Any] = {
            "pose": (belief.joint_angles - self._middle) / self._reach,
            "spread": belief.joint_std / SPREAD_UNIT,
            "motion": belief.joint_angles - belief.lagged_joint_angles,
            "contacts": felt,
            "names": names,
            "time": [1.0 - seconds / self._seconds],
            "rhythm": rhythm,
        }
        if "occupancy" in self.entries:  # which takes longer than all the others
            parts["occupancy"] = self._occupancy(belief)
        if "covered" in self.entries:
            parts["covered"] = _covered(belief)
        told = np.concatenate([np.asarray(parts[entry], dtype=np.float32) for entry in self.entries])
        return np.clip(told, self.space.low, self.space.high)

    def _occupancy(self, belief: Belief) -> NDArray[np.float64]:
        position, rotation = link_frames(self._tree, belief.joint_angles)
        tips = self._tips
        points = position[tips, None] + np.einsum("fij,fkj->fki", rotation[tips], self._lattice)
        grid = belief.grid
        cell, inside = grid.index(points.reshape(-1, 3))
        result = np.zeros(len(cell))
        result[inside] = 2.0 * belief.occupancy[tuple(cell[inside].T)] - 1.0
        return result


class BeliefObservation(SteppedApart, gym.utils.RecordConstructorArgs):
    """What the observer believes in place of what was felt: a flat Box, its numbers as in `ENTRIES`.

    `env` is an `ObserverWrapper`, with a `ShapePosterior` for the entry "names", or has one inside.
    """

    def __init__(self, env: gym.Env[Any, Any], entries: Sequence[str] | None = None) -> None:
        """Lay the vector out.

        Args:
            env: with an `ObserverWrapper`.
            entries: some of `ENTRIES`; None: `USUAL`, all but "covered".

        Raises:
            ValueError: for an unknown entry, or where nothing observes `env`.
        """
        gym.utils.RecordConstructorArgs.__init__(self, entries=entries)
        gym.Wrapper.__init__(self, env)
        self.features = features_of(env, entries)
        self.observation_space = self.features.space

    def reset(self, *, seed: int | None = None, options: dict[str, Any] | None = None) -> tuple[Any, dict[str, Any]]:
        """Start an episode.

        Args:
            seed: as the environment's.
            options: as the environment's.

        Returns:
            The vector (D,), and the info of the environment.
        """
        observation, info = self.env.reset(seed=seed, options=options)
        self._steps = 0
        return self._told(observation, info), info

    def advance(self, action: NDArray[np.float32]) -> tuple[Any, bool, bool]:
        reward, terminated, truncated = self.advance_inside(action)
        self._steps += 1
        return reward, terminated, truncated

    def told(self) -> tuple[Any, dict[str, Any]]:
        observation, info = self.told_inside()
        return self._told(observation, info), info

    def _told(self, observation: Any, info: dict[str, Any]) -> NDArray[np.float32]:
        return self.features.vector(info["belief"], observation["contacts"], info.get("posterior"), self._steps)


def _covered(belief: Belief) -> NDArray[np.float64]:
    """(PARTS**3,): how many voxels of each part of the map are occupied, over those of a side of a part."""
    shape = np.array(belief.occupancy.shape)
    part = np.argwhere(belief.occupancy > 0.5) * PARTS // shape
    count = np.bincount(np.ravel_multi_index(tuple(part.T), (PARTS,) * 3), minlength=PARTS**3)
    return np.asarray(count / (shape.mean() / PARTS) ** 2)


def tell_names(entries: Iterable[str]) -> bool:
    """Say whether some entries tell of names, so that an observer has to name the object.

    Args:
        entries: some of `ENTRIES`.

    Returns:
        Whether one does.
    """
    return not {*OF_NAMES}.isdisjoint(entries)


def labels_of(env: gym.Env[Any, Any]) -> tuple[str, ...]:
    """Tell the labels of `info["posterior"]`.

    Args:
        env: with an `ObserverWrapper`.

    Returns:
        (C,) names.

    Raises:
        ValueError: where nothing names the object.
    """
    shape = _namer(env)
    if shape is None:
        raise ValueError(
            f"nothing names the object in {env}; wrap it: ObserverWrapper(env, HapticSLAM(hand), ShapePosterior(hand))"
        )
    return tuple(shape.labels)


def features_of(env: gym.Env[Any, Any], entries: Sequence[str] | None = None) -> BeliefFeatures:
    """Lay out what is believed about an environment.

    Args:
        env: with an `ObserverWrapper`.
        entries: some of `ENTRIES`; None: `USUAL`, all but "covered".

    Returns:
        The features.

    Raises:
        ValueError: where an entry tells of names, and nothing names the object.
    """
    base: Any = env.unwrapped
    nameless = entries is not None and not tell_names(entries) and _namer(env) is None
    labels = () if nameless else labels_of(env)
    return BeliefFeatures(base.hand, labels, base.episode_seconds, base.control_hz, entries)


def _namer(env: gym.Env[Any, Any]) -> Any:
    return env.get_wrapper_attr("shape") if env.has_wrapper_attr("shape") else None
