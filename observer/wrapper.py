"""Run an observer beside an environment."""

from __future__ import annotations

from typing import Any

import gymnasium as gym
import numpy as np
from numpy.typing import NDArray

from observer.belief import Belief
from observer.fastslam import HapticSLAM
from observer.pose_only import PoseOnly
from observer.shape_posterior import ShapePosterior


class ObserverWrapper(gym.Wrapper, gym.utils.RecordConstructorArgs):
    """Puts `info["belief"]` beside every observation, and with `shape` `info["posterior"]` (C,) of `shape.labels`; at
    the end of an episode the lag is flushed first.

    `belief` and `shape` are attributes too, which `env.get_wrapper_attr` finds through further wrappers: policies read
    them there (`agents.policy.Guided`).
    """

    belief: Belief | None

    def __init__(
        self, env: gym.Env[Any, Any], observer: HapticSLAM | PoseOnly, shape: ShapePosterior | None = None
    ) -> None:
        gym.Wrapper.__init__(self, env)
        hand = env.unwrapped.hand  # type: ignore[attr-defined]
        if hand.joint_names != observer.hand.joint_names or len(hand.patches) != len(observer.hand.patches):
            raise ValueError(
                f"the observer knows hand {observer.hand.name!r} with {len(observer.hand.patches)} patches, the "
                f"environment has {hand.name!r} with {len(hand.patches)}; make the observer from env.unwrapped.hand"
            )
        gym.utils.RecordConstructorArgs.__init__(self, observer=observer, shape=shape, _disable_deepcopy=True)
        self.observer, self.shape = observer, shape
        self.belief = None
        self._chance = np.random.SeedSequence()

    def reset(self, *, seed: int | None = None, options: dict[str, Any] | None = None) -> tuple[Any, dict[str, Any]]:
        observation, info = self.env.reset(seed=seed, options=options)
        # Streams of their own, so that the observer's chance is fixed by the seed and apart from the environment's;
        # without a seed the next one follows from the last, as the environment's does.
        self._chance = self._chance.spawn(1)[0] if seed is None else np.random.SeedSequence(seed)
        mine, shapes = map(int, self._chance.generate_state(2))
        if self.shape is not None:
            self.shape.reset(seed=shapes)
        return observation, {**info, **self._told(self.observer.reset(seed=mine))}

    def step(self, action: NDArray[np.float32]) -> tuple[Any, Any, bool, bool, dict[str, Any]]:
        observation, reward, terminated, truncated, info = self.env.step(action)
        felt = observation["joint_angles"], observation["contacts"]
        self.belief = None  # the last one's map would be computed just before it changes
        told = self._told(self.observer.step(action, *felt, info.get("root")))  # of a hand that moves as a whole
        if terminated or truncated:
            for belief in self.observer.flush():
                told = self._told(belief)
        return observation, reward, terminated, truncated, {**info, **told}

    def _told(self, belief: Belief) -> dict[str, Any]:
        self.belief = belief
        return {"belief": belief} if self.shape is None else {"belief": belief, "posterior": self.shape.update(belief)}
