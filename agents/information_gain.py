"""The torques from which most is expected to be learnt, by looking ahead.

To go where the entropy of a belief falls most is infotaxis (Vergassola, Villermaux & Shraiman 2007, Nature 445,
406-409). Shapes: M candidate torques, K worlds, H hypotheses, J joints, F fingers, D = 2J numbers of state.
"""

from __future__ import annotations

from typing import Any

import gymnasium as gym
import numpy as np
from numpy.typing import NDArray

from agents import lookahead, rollouts
from agents.finger_kinematics import FingerKinematics
from agents.map_lookahead import MapLookahead
from agents.policy import Guided, State
from haptic_env import hand_env, validate
from haptic_env.arrays import Array
from observer import compiling
from observer import threads as side_by_side
from observer.pose.forward_model import ForwardModel
from observer.resampling import systematic_counts

OBJECTIVES = ("class", "map")
HYPOTHESES = 6  # of each label: what is felt is told apart between these
WORLDS = 2  # of each label: of these each is taken for the truth in turn
LOOKS = 3  # within the horizon
UNLIKELY = 0.003  # a label of less is left out
TIE = 0.001  # bits
ENOUGH = 256  # candidates times worlds times hypotheses, from which on two threads are faster than one
SPREAD = 0.0015  # metres: how well the skin's place is known; adds to the gap that the observer tolerates


class InformationGain(Guided):
    """Takes, every `seconds`, that of M candidate torques after which least entropy is expected to be left, and holds
    it.

    Where torques lead is told by the observer's forward model about the believed pose. For the class, hypotheses are
    drawn from the shape posterior; each of a few is taken for the truth in turn, holds the fingers out, and what would
    be felt there is weighed by the observer's own contact likelihood with its own exponent. Expected posterior entropy
    is the mean over those truths. For the map, see `MapLookahead`.

    A candidate is a random mixture of three strokes for each finger, about the grasp centre: closing, going across,
    curling (`FingerKinematics`); the one in force stays a candidate.
    """

    asks_shape = True

    def __init__(
        self,
        env: gym.Env[Any, Any],
        seed: int | None = None,
        *,
        objective: str = "class",
        candidates: int = 12,
        seconds: float = 0.2,
        horizon: float = 0.5,
        threads: int | None = None,
    ) -> None:
        """Check the arguments, and find the strokes of each finger.

        Args:
            env: with an `ObserverWrapper`; with a `ShapePosterior` for the class.
            seed: of candidates and hypotheses.
            objective: whose entropy: "class", what the object is, or "map".
            candidates: M.
            seconds: s, how long torques stay.
            horizon: s, how far it looks ahead.
            threads: how many weigh candidates side by side (None: as many as pay); the bits are the same.

        Raises:
            ValueError: for a value out of range, or as `Guided`.
        """
        super().__init__(env, seed)
        compiling.ensure(("agents.warming:looking_ahead",), self.hand)
        self.threads = side_by_side.check(threads)
        self.objective = validate.choice("objective", objective, OBJECTIVES)
        self.candidates = validate.integer("candidates", candidates, 1)
        self._rate = rate = float(hand_env(env).control_hz)
        self.steps = max(1, round(validate.seconds("seconds", seconds) * rate))
        self.every = max(1, round(validate.seconds("horizon", horizon) * rate / LOOKS))
        self._model = ForwardModel(self.hand, rate)
        self._kinematics = FingerKinematics(self.hand)
        self.remembers = ((self.joints,), (), (self.joints,))
        self._hand = rollouts.hand_of(self.hand)
        self._map = MapLookahead(self.hand)

    def decide(self, observation: Any, state: State, deterministic: bool) -> tuple[NDArray[np.float32], State]:
        """Weigh candidates, where it is time.

        Args:
            observation: of one environment.
            state: the torques in force, how long they stay, and the last pose (J,) rad.
            deterministic: of no effect.

        Returns:
            Action (J,), and the next state.
        """
        pose = self.belief.joint_angles
        if state is None:
            state = np.zeros(self.joints, np.float32), np.array(0), pose
        torque, left, before = state
        if left == 0:
            torque, left = self._decide(torque, pose, before), np.array(self.steps)
        return torque.copy(), (torque, left - 1, pose)

    def _decide(self, held: NDArray[np.float32], pose: Array, before: Array) -> NDArray[np.float32]:
        torques = self._draw(held)
        line = self._line(held, pose, before)
        push = (torques - held) * self.hand.torque_limits
        left = (
            self._class_left(line, push)
            if self.objective == "class"
            else -self._map.gain(self.map_now(), self.belief.grid, line, push, LOOKS, self.every)
        )
        # Where nothing is left to be learnt the hand goes on exploring: it may be sure and wrong.
        return torques[self.rng.choice(np.flatnonzero(left <= left.min() + TIE))]

    def _draw(self, held: NDArray[np.float32]) -> NDArray[np.float32]:
        """(M, J) candidates, the torques in force first."""
        strokes = self._kinematics.strokes(self.hand.rest_pose, self.hand.grasp_centre)
        fingers = self._kinematics.fingers
        drawn = [held]
        for _ in range(self.candidates - 1):
            close = self.rng.uniform(-0.2, 0.8, (fingers, 1))
            across, curl = self.rng.uniform(-1.0, 1.0, (2, fingers, 1))
            drawn.append(
                self._kinematics.together(close * strokes.close + across * strokes.across + 0.5 * curl * strokes.curl)
            )
        return np.array(drawn)

    def _line(self, held: NDArray[np.float32], pose: Array, before: Array) -> rollouts.Line:
        """The forward model about now, at the speed of the last step."""
        state = np.concatenate([pose, (pose - before) * self._rate])
        ahead = self._model.predict(state, held.astype(np.float64))
        low, high = (np.ascontiguousarray(each) for each in self.hand.joint_limits.T)
        return rollouts.Line(state, ahead.state, ahead.transition, ahead.torque_gain, low, high)

    def _class_left(self, line: rollouts.Line, push: Array) -> Array:
        """(M,) bits: the expected entropy of the labels after each of `push` (M, J) N·m."""
        solids, log_probability, of = self.shape.hypotheses
        posterior = np.exp(log_probability)
        chosen: list[int] = []
        worlds: list[int] = []
        for label in np.unique(of):
            mine = np.flatnonzero(of == label)
            total = posterior[mine].sum()
            if total < UNLIKELY:
                continue
            counts = systematic_counts(posterior[mine] / total, self.rng.random())
            drawn = self.rng.permutation(np.repeat(mine, counts))[:HYPOTHESES]
            worlds += range(len(chosen), len(chosen) + min(WORLDS, len(drawn)))
            chosen += drawn.tolist()
        pick = np.array(chosen)
        label = of[pick]
        share = np.bincount(of, posterior)[label]
        log_weights = np.log(share / np.bincount(label)[label])
        some = solids._replace(
            drawn_in=solids.drawn_in[pick],
            scale=solids.scale[pick],
            rotation=solids.rotation[pick],
            position=solids.position[pick],
        )
        shape = self.shape
        tolerance = float(np.hypot(shape.tolerance, SPREAD))
        weight = shape.temper * shape.sustained * self.every / shape.stride
        told = lookahead.LookaheadModel(
            tolerance, shape.surprise, weight, shape.said, shape.alike * tolerance, shape.press
        )
        left = np.empty((len(push), len(worlds)))
        side_by_side.run(
            lookahead.class_entropies,
            len(push),
            side_by_side.chosen(self.threads, left.size * len(pick), ENOUGH),
            self._hand,
            lookahead.Worlds(some, log_weights, label, np.array(worlds)),
            rollouts.Plan(line, push, self.every, LOOKS),
            told,
            left,
        )
        weights = share[worlds] / np.bincount(label[worlds])[label[worlds]]
        return np.asarray(left @ weights / weights.sum())
