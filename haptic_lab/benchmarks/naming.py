"""How long it takes to name one of many objects that lie any way."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

import agents
from haptic_env import hand_of, registration, shapes
from haptic_lab.benchmarks.end_to_end import clock
from observer import ObserverWrapper, ShapePosterior
from observer.pose_only import PoseOnly

UNKNOWN: dict[str, Any] = {
    "size_jitter": 0.2,
    "position_jitter": 0.005,
    "rotation_jitter": 180.0,
}  # of what is explored
CANDIDATES = (
    *shapes.SHAPES,
    *(f"ellipsoid(1, {y}, {z})" for y, z in ((1, 0.6), (1, 1.6), (1, 2.2), (1.5, 2))),
    *(f"cuboid(1, {y}, {z})" for y, z in ((1, 0.5), (1, 2), (1.5, 2), (2, 3))),
    *(f"cone({height})" for height in (0.7, 1, 1.5)),
    *(f"frustum({top}, {height})" for top, height in ((0.5, 1), (0.7, 1.5))),
    *(f"torus({tube})" for tube in (0.3, 0.4, 0.48)),
    *(f"prism({sides}, {height})" for sides, height in ((3, 1), (3, 2), (4, 0.5), (5, 1), (6, 1), (8, 0.6))),
    *(f"L({bar}, {height})" for bar, height in ((0.4, 0.6), (0.3, 0.6), (0.5, 1), (0.25, 0.4))),
    *(f"capsule({length})" for length in (1.5, 2, 3)),
    *(f"superquadric({up}, {around})" for up, around in ((0.5, 0.5), (0.3, 1), (1, 0.3), (1.5, 0.5), (1.5, 1.5))),
    *(f"noise({seed})" for seed in range(1, 10)),
    *(f"noise({seed}, 0.25)" for seed in range(10, 13)),
)


def naming_steps(env_id: str, sigma_deg: float, seconds: float, seed: int, candidates: int) -> NDArray[np.float64]:
    """Time every step of the namer in an exploration by random torques of a torus, of which nothing else is known.

    Args:
        env_id: registered, such as "HapticSLAM/TwoFinger-v0".
        sigma_deg: noise of the felt angles, degrees.
        seconds: how long is explored.
        seed: of environment, policy and namer.
        candidates: how many of `CANDIDATES` it may be.

    Returns:
        Seconds of each step, in their order.
    """
    env = registration.make(env_id, shape="torus(0.4)", sigma_deg=sigma_deg, episode_seconds=seconds, **UNKNOWN)
    hand = hand_of(env)
    namer = ShapePosterior(hand, CANDIDATES[:candidates], **UNKNOWN)
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
