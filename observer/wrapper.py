"""Run an observer beside an environment."""

from __future__ import annotations

from typing import Any

import gymnasium as gym
import numpy as np
from numpy.typing import NDArray

from observer.fastslam import HapticSLAM


class ObserverWrapper(gym.Wrapper, gym.utils.RecordConstructorArgs):
    """Puts `info["belief"]` beside every observation; at the end of an episode the lag is flushed first."""

    def __init__(self, env: gym.Env[Any, Any], observer: HapticSLAM) -> None:
        gym.Wrapper.__init__(self, env)
        hand = env.unwrapped.hand  # type: ignore[attr-defined]
        if hand.joint_names != observer.hand.joint_names or len(hand.patches) != len(observer.hand.patches):
            raise ValueError(
                f"the observer knows hand {observer.hand.name!r} with {len(observer.hand.patches)} patches, the "
                f"environment has {hand.name!r} with {len(hand.patches)}; make the observer from env.unwrapped.hand"
            )
        gym.utils.RecordConstructorArgs.__init__(self, observer=observer, _disable_deepcopy=True)
        self.observer = observer

    def reset(self, *, seed: int | None = None, options: dict[str, Any] | None = None) -> tuple[Any, dict[str, Any]]:
        observation, info = self.env.reset(seed=seed, options=options)
        # Its own stream, so that the observer's chance is fixed by the seed and apart from the environment's.
        seeds = np.random.SeedSequence(seed).generate_state(1) if seed is not None else [None]
        belief = self.observer.reset(seed=None if seeds[0] is None else int(seeds[0]))
        return observation, {**info, "belief": belief}

    def step(self, action: NDArray[np.float32]) -> tuple[Any, Any, bool, bool, dict[str, Any]]:
        observation, reward, terminated, truncated, info = self.env.step(action)
        felt = observation["joint_angles"], observation["contacts"]
        belief = self.observer.step(action, *felt, info.get("root"))  # of a hand that moves as a whole
        if terminated or truncated:
            belief = [belief, *self.observer.flush()][-1]
        return observation, reward, terminated, truncated, {**info, "belief": belief}
