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
from typing import Any

import gymnasium as gym
import numpy as np
from numpy.typing import NDArray

from agents import kept_arrays, spaces_json
from agents.finger_kinematics import FingerKinematics
from agents.gains import gains_of
from agents.instead import Instead, instead
from agents.kept_arrays import KeptArrays
from agents.layers import Array
from agents.touched_places import PLACES, TouchedPlaces
from agents.training import checked_training
from haptic_env import readable, validate
from haptic_env.hand import Hand
from haptic_env.patches import SIDES

KIND = "haptic-slam rhythm"
FASTEST = 6.0  # times its usual rate, of a phase that touch quickens
FELT = ("touch", "side", "along", "back")  # of a finger: whether it touches, left or right, root or tip, its back
SHARED = ("always", "beat", "turn", "drift", "touch")  # what a joint that moves several fingers, as a wrist's, follows
TRACES = (("touch", "fast"), ("touch", "slow"), ("side", "fast"), ("side", "slow"), ("along", "fast"), ("back", "fast"))
Memory = tuple[NDArray[Any] | None, ...]


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
        """Shapes of its memory: the phases, a wrist's last, the traces, how long each finger has touched, s, and where
        it has (`TouchedPlaces`), if it remembers that."""
        fingers = self.felt.shape[1]
        places = ((3, fingers), (fingers, PLACES, PLACES, PLACES)) if self.gains["enough"] > 0.0 else ()
        return (3, fingers + (self.shared is not None)), (len(TRACES), fingers), (fingers,), *places

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
        phases, traces, lasted, *places = self._start() if began else memory
        assert phases is not None
        assert traces is not None
        assert lasted is not None
        now = felt[[FELT.index(what) for what, _ in TRACES]]
        kept = np.exp(-dt / np.array([g[pace] for _, pace in TRACES]))[:, None]
        traces = kept * traces + (1.0 - kept) * now
        lasted = np.where(felt[0] > 0.0, lasted + dt, 0.0)
        known, away = np.zeros(len(lasted)), np.zeros((3, len(lasted)))
        if places:
            recalled = TouchedPlaces(*places)
            known, away = recalled.known(g["width"], g["enough"])
            recalled = recalled.touching(dt * (felt[0] > 0.0))
        if not began:
            phases = phases + 2.0 * np.pi * dt * self._rates(traces, known)
        phases, fingers = phases.copy(), len(lasted)
        beat = phases[0, :fingers]
        phases[0, :fingers] = np.where((np.cos(beat) > 0.0) & (lasted > g["withdraw"]), np.pi - beat, beat)
        made = self._strokes(phases[:, :fingers], traces)
        if places:
            made += self._elsewhere(known, away)
            places = list(recalled.moved(made, 1.0 - np.exp(-dt / g["lag"])))
        torque = np.einsum("sf,sfj->j", made, self.strokes)
        if self.shared is not None:
            beat, turn, drift = phases[:, -1]
            torque += np.array([1.0, np.sin(beat), np.cos(turn), np.sin(drift), traces[0].mean()]) @ self.shared
        low, high = self.action_space.low, self.action_space.high
        return np.clip(torque.astype(np.float32), low, high), (phases, traces, lasted, *places)

    def _start(self) -> tuple[NDArray[np.float64], ...]:
        shapes = self.remembers
        finger, phases = np.arange(shapes[2][0]), np.zeros(shapes[0])
        phases[0, : len(finger)] = self.gains["beat_ahead"] * finger
        phases[1, : len(finger)] = np.pi * (finger + 1) + self.gains["turn_ahead"] * finger  # neighbours take turns
        return phases, *(np.zeros(shape) for shape in shapes[1:])

    def _rates(self, traces: NDArray[np.float64], known: NDArray[np.float64]) -> NDArray[np.float64]:
        """(3, F) Hz; with a wrist (3, F + 1)."""
        g, about = self.gains, np.vstack([traces[:2], known])
        fast, slow, known = np.pad(about, ((0, 0), (0, int(self.shared is not None))))
        quicker = [
            1.0 + g[f"{phase}_touch"] * fast + g[f"{phase}_slow"] * slow + g[f"{phase}_known"] * known
            for phase in ("beat", "turn", "drift")
        ]
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

    def _elsewhere(self, known: NDArray[np.float64], away: NDArray[np.float64]) -> NDArray[np.float64]:
        """(3, F): how much more of each stroke, for what each finger knows of where it is."""
        g = self.gains
        about = np.stack([g["close_known"] * known, np.zeros(len(known)), g["curl_known"] * known])
        return about + np.array([[g["close_away"]], [g["across_away"]], [g["curl_away"]]]) * away

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
