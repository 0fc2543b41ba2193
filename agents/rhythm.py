"""A rhythm of fingers with reflexes: they close, open and go from side to side, and what each feels changes how.

Few numbers, its gains, say all of it, so that they can be searched (`haptic_lab.learning.search`). Each finger keeps
three phases, and of what it feels traces that fade; what it does is a sum of three strokes of `FingerKinematics`. A
wrist keeps phases of its own, which no touch quickens.

Shapes: F fingers, J joints, P patches, K gains.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, NamedTuple

import gymnasium as gym
import numpy as np
from numpy.typing import NDArray

from agents import kept_arrays, spaces_json
from agents.finger_kinematics import FingerKinematics
from agents.instead import Instead, instead
from agents.kept_arrays import KeptArrays
from agents.layers import Array
from agents.training import checked_training
from haptic_env import readable, validate
from haptic_env.hand import Hand
from haptic_env.patches import SIDES

KIND = "haptic-slam rhythm"
FASTEST = 6.0  # times its usual rate, of a phase that touch quickens
FELT = ("touch", "side", "along", "back")  # of a finger: whether it touches, left or right, root or tip, its back
SHARED = ("always", "beat", "turn", "drift", "touch")  # what a joint that moves several fingers, as a wrist's, follows
TRACES = (("touch", "fast"), ("touch", "slow"), ("side", "fast"), ("side", "slow"), ("along", "fast"), ("back", "fast"))


class Gain(NamedTuple):
    """One number of a rhythm.

    Attributes:
        usual: where it begins: without reflexes, as the policy `sweep`.
        unit: in which it is searched.
        low: the least that it may be.
        high: the most.
    """

    usual: float
    unit: float
    low: float = -10.0
    high: float = 10.0


GAINS = {
    # Strokes, as fractions of the torque limits.
    "flexion": Gain(0.5, 1.0),  # close: always
    "opening": Gain(0.5, 1.0),  # with the beat
    "close_touch": Gain(0.0, 1.0),  # by a trace of touch, fast
    "close_slow": Gain(0.0, 1.0),  # and slow
    "close_along": Gain(0.0, 1.0),  # where the tip touches, and less where the root does
    "close_back": Gain(0.0, 1.0),  # where its back touches
    "close_others": Gain(0.0, 1.0),  # where other fingers touch
    "curled": Gain(0.0, 1.0),  # curl: always, and so on
    "curl_beat": Gain(0.0, 1.0),
    "curl_drift": Gain(-0.5, 1.0),
    "curl_touch": Gain(0.0, 1.0),
    "curl_slow": Gain(0.0, 1.0),
    "curl_along": Gain(0.0, 1.0),
    "curl_back": Gain(0.0, 1.0),
    "curl_others": Gain(0.0, 1.0),
    "sideways": Gain(1.0, 1.0),  # across: with the turn
    "across_drift": Gain(0.0, 1.0),
    "across_side": Gain(0.0, 1.0),  # away from the side that touches, or towards it
    "across_slow": Gain(0.0, 1.0),
    # Phases, Hz, and how much touch quickens them (1: twice as fast).
    "beat": Gain(1.0, 1.0, 0.05, 5.0),
    "turn": Gain(0.5, 0.5, 0.02, 5.0),
    "drift": Gain(0.17, 0.2, 0.01, 5.0),
    "beat_touch": Gain(0.0, 2.0),
    "beat_slow": Gain(0.0, 2.0),
    "turn_touch": Gain(0.0, 2.0),
    "turn_slow": Gain(0.0, 2.0),
    "drift_touch": Gain(0.0, 2.0),
    "drift_slow": Gain(0.0, 2.0),
    # By how much the next finger is ahead, rad.
    "beat_ahead": Gain(0.0, 2.0),
    "turn_ahead": Gain(0.0, 2.0),
    # s.
    "withdraw": Gain(0.6, 0.15, 0.0, 10.0),  # for so long a finger that closes may touch, and then opens
    "fast": Gain(0.2, 0.2, 0.02, 10.0),  # time constants of traces
    "slow": Gain(1.5, 1.0, 0.1, 60.0),
}
Memory = tuple[NDArray[Any] | None, ...]


def gains_of(told: Mapping[str, Any], what: str = "gain") -> dict[str, float]:
    """Check gains.

    Args:
        told: some of `GAINS`, by name.
        what: they are, for messages.

    Returns:
        All of them, those that are not told as usual.

    Raises:
        ValueError: for an unknown one, or out of range.
    """
    for name in told:
        validate.choice(what, name, GAINS)
    return {
        name: validate.number(f"{what} {name}", told.get(name, each.usual), each.low, each.high)
        for name, each in GAINS.items()
    }


@dataclass(frozen=True)
class Rhythm:
    """A rhythm with reflexes, for one hand.

    Attributes:
        observation_space: (P,) what is felt, the entry "contacts" of a belief.
        action_space: (J,).
        gains: of `GAINS`, by name.
        strokes: (3, F, J): close, across and curl.
        felt: (4, F, P): what of `FELT` each patch is to each finger.
        seconds: from one decision to the next.
        told: how it was learnt, as `agents.network.Network` has it.
        instead: what `agents.make` shows it in place of what is felt; None: what is felt.
        shared: (5, J): by how much each joint follows what `SHARED` lists, for those that move several fingers; None:
            they are left alone.
    """

    observation_space: gym.spaces.Box
    action_space: gym.spaces.Box
    gains: Mapping[str, float]
    strokes: NDArray[np.float64]
    felt: NDArray[np.float64]
    seconds: float
    told: Mapping[str, Any] = field(default_factory=dict)
    instead: Instead | None = None
    shared: NDArray[np.float64] | None = None

    __repr__ = readable.line

    @property
    def remembers(self) -> tuple[tuple[int, ...], ...]:
        """Shapes of its memory: the phases, a wrist's last, the traces, and how long each finger has touched, s."""
        fingers = self.felt.shape[1]
        return (3, fingers + (self.shared is not None)), (len(TRACES), fingers), (fingers,)

    def predict(
        self, observation: Any, memory: Memory, began: bool, deterministic: bool, rng: np.random.Generator
    ) -> tuple[Array, Memory]:
        """Compute an action.

        Args:
            observation: (P,) what is felt.
            memory: what the last call returned.
            began: whether it is the first of an episode.
            deterministic: of no effect, and so is `rng`: nothing is left to chance.
            rng: not used.

        Returns:
            Action (J,), and what to hand to the next call as `memory`.
        """
        g, dt = self.gains, self.seconds
        felt = np.clip(self.felt @ np.asarray(observation, np.float64), -1.0, 1.0)
        phases, traces, lasted = self._start() if began else memory
        assert phases is not None
        assert traces is not None
        assert lasted is not None
        now = felt[[FELT.index(what) for what, _ in TRACES]]
        kept = np.exp(-dt / np.array([g[pace] for _, pace in TRACES]))[:, None]
        traces = kept * traces + (1.0 - kept) * now
        lasted = np.where(felt[0] > 0.0, lasted + dt, 0.0)
        if not began:
            phases = phases + 2.0 * np.pi * dt * self._rates(traces)
        phases, fingers = phases.copy(), len(lasted)
        beat = phases[0, :fingers]
        phases[0, :fingers] = np.where((np.cos(beat) > 0.0) & (lasted > g["withdraw"]), np.pi - beat, beat)
        torque = np.einsum("sf,sfj->j", self._strokes(phases[:, :fingers], traces), self.strokes)
        if self.shared is not None:
            beat, turn, drift = phases[:, -1]
            torque += np.array([1.0, np.sin(beat), np.cos(turn), np.sin(drift), traces[0].mean()]) @ self.shared
        low, high = self.action_space.low, self.action_space.high
        return np.clip(torque.astype(np.float32), low, high), (phases, traces, lasted)

    def _start(self) -> tuple[NDArray[np.float64], ...]:
        shapes = self.remembers
        finger, phases = np.arange(shapes[2][0]), np.zeros(shapes[0])
        phases[0, : len(finger)] = self.gains["beat_ahead"] * finger
        phases[1, : len(finger)] = np.pi * (finger + 1) + self.gains["turn_ahead"] * finger  # neighbours take turns
        return phases, np.zeros(shapes[1]), np.zeros(shapes[2])

    def _rates(self, traces: NDArray[np.float64]) -> NDArray[np.float64]:
        """(3, F) Hz; with a wrist (3, F + 1)."""
        g, (fast, slow) = self.gains, np.pad(traces[:2], ((0, 0), (0, int(self.shared is not None))))
        quicker = [1.0 + g[f"{phase}_touch"] * fast + g[f"{phase}_slow"] * slow for phase in ("beat", "turn", "drift")]
        return np.array([[g["beat"]], [g["turn"]], [g["drift"]]]) * np.clip(quicker, 0.0, FASTEST)

    def _strokes(self, phases: NDArray[np.float64], traces: NDArray[np.float64]) -> NDArray[np.float64]:
        """(3, F): how much of each stroke each finger makes."""
        g, (fast, slow, side, side_slow, along, back) = self.gains, traces
        beat, drift = np.sin(phases[0]), np.sin(phases[2])
        others = (fast.sum() - fast) / max(1, len(fast) - 1)

        def felt(stroke: str) -> NDArray[np.float64]:
            about = {"touch": fast, "slow": slow, "along": along, "back": back, "others": others}
            return sum((g[f"{stroke}_{what}"] * each for what, each in about.items()), np.zeros(len(fast)))

        close = g["flexion"] + g["opening"] * beat + felt("close")
        curl = g["curled"] + g["curl_beat"] * beat + g["curl_drift"] * drift + felt("curl")
        across = g["sideways"] * np.cos(phases[1]) + g["across_drift"] * drift
        return np.stack([close, across + g["across_side"] * side + g["across_slow"] * side_slow, curl])

    def write(self, path: Path) -> None:
        """Write it to a file, as `restore` reads it: numbers and a description, nothing that runs.

        Args:
            path: of the file.
        """
        description = {"gains": dict(self.gains), "seconds": self.seconds}
        shared = {} if self.shared is None else {"shared": self.shared}
        kept_arrays.write(path, KIND, self, description, {"strokes": self.strokes, "felt": self.felt, **shared})


def rhythm_for(
    hand: Hand,
    space: gym.spaces.Box,
    gains: Mapping[str, float],
    seconds: float,
    told: Mapping[str, Any],
    shared: NDArray[np.float64] | None = None,
) -> Rhythm:
    """Make a rhythm for a hand.

    Args:
        hand: whose fingers move.
        space: (P,) of what is felt.
        gains: all of `GAINS`.
        seconds: from one decision to the next.
        told: how it was learnt.
        shared: as the attribute.

    Returns:
        The rhythm.
    """
    kinematics = FingerKinematics(hand)
    close, across, curl = kinematics.strokes(hand.rest_pose, hand.grasp_centre)
    alone = kinematics.alone * np.stack([close, across, curl])
    most = np.maximum(np.abs(alone).max(axis=2, keepdims=True), 1e-9)
    patches = hand.patches
    of_finger = kinematics.links[:, patches.link].astype(np.float64)  # (F, P)
    _, left, dorsal, right = ([float(name.endswith(side)) for name in patches.names] for side in SIDES)
    order = np.cumsum(kinematics.links, axis=1) * kinematics.links
    along = (2.0 * order - 1.0 - order.max(axis=1, keepdims=True)) / np.maximum(order.max(axis=1, keepdims=True) - 1, 1)
    felt = [of_finger, of_finger * (np.array(left) - right), of_finger * along[:, patches.link], of_finger * dorsal]
    action = gym.spaces.Box(-1.0, 1.0, (hand.joints,), np.float32)
    strokes = np.clip(alone / most, -1.0, 1.0)
    return Rhythm(space, action, dict(gains), strokes, np.stack(felt), seconds, told, shared=shared)


def restore(told: dict[str, Any], arrays: KeptArrays) -> Rhythm:
    """Make the rhythm that a file holds.

    Args:
        told: the description of the file.
        arrays: of the file.

    Returns:
        The rhythm.

    Raises:
        ValueError: for what is none.
    """
    felt, acts = (_row(told, name) for name in ("observation", "action"))
    (patches,), (joints,) = felt.shape, acts.shape
    if not isinstance(told["gains"], dict):
        raise ValueError(f"gains must be a table, got {told['gains']!r}")
    matrix = arrays.take("felt", len(FELT), None, patches, dtype=np.float64)
    strokes = arrays.take("strokes", 3, matrix.shape[1], joints, dtype=np.float64)
    shown = None if "instead" not in told else instead(told["instead"], patches, arrays.take)
    shared = arrays.take("shared", len(SHARED), joints, dtype=np.float64) if "shared" in arrays.left else None
    seconds = validate.number("seconds", told["seconds"], 0.0, 100.0, above=0.0, unit="s")
    trained = checked_training(told["told"])
    return Rhythm(felt, acts, gains_of(told["gains"]), strokes, matrix, seconds, trained, shown, shared)


def _row(told: Mapping[str, Any], name: str) -> gym.spaces.Box:
    space = spaces_json.restore(told[name], name)
    if not isinstance(space, gym.spaces.Box) or len(space.shape) != 1:
        raise ValueError(f"the {name} must be a row of numbers, got {space}")
    return space
