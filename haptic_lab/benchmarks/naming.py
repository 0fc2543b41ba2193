"""How long it takes to name one of many objects that lie any way."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

import agents
from haptic_env import hand_of, registration
from haptic_lab.benchmarks.end_to_end import clock
from observer import ObserverWrapper, ShapePosterior
from observer.pose_only import PoseOnly

UNKNOWN: dict[str, Any] = {
    "size_jitter": 0.2,
    "position_jitter": 0.005,
    "rotation_jitter": 180.0,
}  # of what is explored


def naming_steps(
    env_id: str, sigma_deg: float, seconds: float, seed: int, candidates: Sequence[str]
) -> NDArray[np.float64]:
    """Time every step of the namer in an exploration by random torques of a torus, of which nothing else is known.

    Args:
        env_id: registered, such as "HapticSLAM/TwoFinger-v0".
        sigma_deg: noise of the felt angles, degrees.
        seconds: how long is explored.
        seed: of environment, policy and namer.
        candidates: names of what it may be.

    Returns:
        Seconds of each step, in their order.
    """
    env = registration.make(env_id, shape="torus(0.4)", sigma_deg=sigma_deg, episode_seconds=seconds, **UNKNOWN)
    hand = hand_of(env)
    namer = ShapePosterior(hand, candidates, **UNKNOWN)
    namer.reset(seed=seed)
    env = ObserverWrapper(env, PoseOnly(hand, sigma_deg))
    policy, state, over, took = agents.make("random_torque", env, seed=seed), None, False, []
    observation, info = env.reset(seed=seed)
    while not over:
        torque, state = agents.act(policy, observation, state)
        observation, _, _, over, info = env.step(torque)
        start = clock()
        namer.update(info["belief"])
        took.append(clock() - start)
    env.close()
    return np.array(took)
