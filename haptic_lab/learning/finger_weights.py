"""Weights that fingers share: what one finger has learnt, its neighbour does too, mirrored.

Shapes: J joints, D numbers of an observation, K weights that are searched.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any, NamedTuple

import gymnasium as gym
import numpy as np
from numpy.typing import ArrayLike, NDArray

from agents.layers import Layer
from agents.network import Network
from agents.sweep import SweepingMotion
from haptic_env.arrays import Array
from haptic_env.hand import Hand
from observer.wrappers.belief_observation import CLOCKS_HZ, BeliefFeatures

OF_JOINTS = ("pose", "spread", "motion")
CONSTANT = "constant"


class Part(NamedTuple):
    """What a number of an observation is to a finger.

    Attributes:
        finger: whose it is; None: of all.
        what: it is, the same for each finger.
        sign: with which it counts there.
    """

    finger: int | None
    what: str
    sign: float


class FingerWeights:
    """A linear policy of so few weights that they can be searched.

    The torque of a joint is that of a sweep, and a weighted sum of what its own finger feels and of what concerns all
    fingers. The same joint of each finger has the same weights. Abductors, and what is felt to the left or right of a
    link, change their sign from one finger to the next; what the patches of a link feel is summed.

    Attributes:
        size: K.
    """

    def __init__(
        self, hand: Hand, features: BeliefFeatures, labels: int, begin: SweepingMotion | Network | None
    ) -> None:
        """Lay the weights out.

        Args:
            hand: that explores.
            features: of the observation, none of a map.
            labels: of the names.
            begin: what weights of 0 do, a sweep or a linear policy; None: no torque at all.

        Raises:
            ValueError: for a sweep without the entry "rhythm", which it follows, and for a policy that is shown
                something else or is not linear.
        """
        if isinstance(begin, SweepingMotion) and "rhythm" not in features.entries:
            raise ValueError(f'[sweep] needs the entry "rhythm" in observation, got {", ".join(features.entries)}')
        joints = _joints(hand)
        columns = [[Part(None, CONSTANT, 1.0)]]
        for entry in features.entries:
            columns += _columns(entry, hand, labels)
        keys: dict[tuple[str, str], int] = {}
        shared: list[tuple[int, int, int]] = []
        signs: list[float] = []
        for row, joint in enumerate(joints):
            for column, parts in enumerate(columns):
                for part in parts:
                    if part.finger in (None, joint.finger):
                        key = keys.setdefault((joint.what, part.what), len(keys))
                        shared.append((row, column, key))
                        signs.append(joint.sign * part.sign)
        self.size = len(keys)
        self._rows, self._columns, self._keys = np.array(shared).T
        self._signs = np.array(signs)
        self._begin = np.zeros((len(joints), len(columns)))
        if isinstance(begin, Network):
            self._begin = _matrix(begin, features, self._begin.shape)
        elif begin is not None:
            clocks = [c for c, parts in enumerate(columns) if parts and parts[0].what.startswith((CONSTANT, "rhythm"))]
            self._begin[:, clocks] = _as_weights(begin, hand)
        self._space = features.space

    def candidate(self, weights: ArrayLike) -> Array:
        """Spread the weights over the joints.

        Args:
            weights: (K,).

        Returns:
            (J, 1 + D), the constant first.
        """
        matrix = self._begin.copy()
        np.add.at(matrix, (self._rows, self._columns), self._signs * np.asarray(weights)[self._keys])
        return matrix

    def network(self, weights: ArrayLike, told: Mapping[str, Any]) -> Network:
        """Make a policy of them.

        Args:
            weights: (K,).
            told: what whoever uses it must know (`agents.network.Network`).

        Returns:
            The policy.
        """
        matrix = self.candidate(weights).astype(np.float32)
        action = gym.spaces.Box(-1.0, 1.0, (len(matrix),), np.float32)
        mean = Layer(np.ascontiguousarray(matrix[:, 1:]), matrix[:, 0].copy())
        return Network(self._space, action, (), mean, squash=False, told=told)


def _matrix(model: Network, features: BeliefFeatures, shape: tuple[int, ...]) -> Array:
    """(J, 1 + D): a linear policy."""
    if model.hidden or model.cells or model.squash or model.normalization is not None:
        raise ValueError("a search begins with a model that is linear, as the presets of a search write, got another")
    if (shown := model.told.get("entries")) != list(features.entries):
        raise ValueError(f"a search begins with a model that is shown {', '.join(features.entries)}, got {shown}")
    matrix = np.column_stack([model.mean.bias, model.mean.weight]).astype(np.float64)
    if matrix.shape != shape:
        raise ValueError(
            f"a search begins with a model of its own hand, with weights of shape {shape}, got {matrix.shape}"
        )
    return matrix


def _side(finger: int) -> float:
    return 1.0 if finger % 2 == 0 else -1.0


def _joints(hand: Hand) -> list[Part]:
    """What each joint is to its finger."""
    order = _order(hand.joint_group)
    odd = ["abduction" in name for name in hand.joint_names]
    rows = zip(hand.joint_group.tolist(), order, odd, strict=True)
    return [Part(finger, f"joint {n}", _side(finger) if turns else 1.0) for finger, n, turns in rows]


def _order(groups: NDArray[np.int64]) -> list[int]:
    """Which of its group each is."""
    return [int(np.sum(groups[:index] == group)) for index, group in enumerate(groups)]


def _columns(entry: str, hand: Hand, labels: int) -> Sequence[list[Part]]:
    if entry in OF_JOINTS:
        signs = [1.0 if entry == "spread" else joint.sign for joint in _joints(hand)]
        return [
            [Part(joint.finger, f"{entry} of {joint.what}", sign)]
            for joint, sign in zip(_joints(hand), signs, strict=True)
        ]
    if entry == "contacts":
        order, group = _order(hand.link_group), hand.link_group.tolist()
        links = hand.patches.link.tolist()
        return [_touch(name, group[link], order[link]) for name, link in zip(hand.patches.names, links, strict=True)]
    width = {"names": labels, "time": 1, "rhythm": 2 * len(CLOCKS_HZ)}[entry]
    return [[Part(None, f"{entry} {index}", 1.0)] for index in range(width)]


def _touch(name: str, finger: int, link: int) -> list[Part]:
    """What a patch is to its finger: that its link is touched, and on which side."""
    parts = [Part(finger, f"touch of link {link}", 1.0)]
    for end, sign in (("left", 1.0), ("right", -1.0)):
        if name.endswith(end):
            parts.append(Part(finger, f"side of link {link}", sign * _side(finger)))
    return parts


def _as_weights(sweep: SweepingMotion, hand: Hand) -> NDArray[np.float64]:
    """(J, 1 + 2 clocks): a sweep as weights of a constant and of the clocks, in which it is linear."""
    seconds = np.linspace(0.0, 12.0, 200)
    turns = [2 * np.pi * hz * seconds for hz in CLOCKS_HZ]
    shown = np.stack([np.ones_like(seconds), *(wave(turn) for turn in turns for wave in (np.sin, np.cos))], axis=1)
    return np.linalg.lstsq(shown, sweep.torques(seconds, hand).astype(np.float64), rcond=None)[0].T
