"""Searches for maps are paid by what is touched; what a map shows goes with it, from one policy to the next."""

from __future__ import annotations

import numpy as np
import pytest

import agents
from haptic_env import hand_env
from haptic_lab.learning import presets
from haptic_lab.learning.covering import Touched
from haptic_lab.learning.explored import DomainRandomisation, unobserved
from observer import HapticSLAM, ObserverWrapper, metrics

POLICIES = ("sweep", "enclosure", "random_torque", "reflexes")
WORLDS, FIRST_SEED = 8, 77_200
HOLD = 2


@pytest.mark.statistical
@pytest.mark.timeout(1200)
def test_more_of_a_surface_is_mapped_where_more_of_it_is_touched() -> None:
    """In the same world, by several policies: deviations from the mean of the world."""
    world = presets.read("reflexes").world
    inside = DomainRandomisation(unobserved(world), None, world, held_out=True)
    base = hand_env(inside)
    observer, touched = HapticSLAM(base.hand, particles=1), Touched(base.hand)
    env = ObserverWrapper(inside, observer)
    rows = np.array([[_explored(env, observer, touched, name, i) for name in POLICIES] for i in range(WORLDS)])
    apart = (rows - rows.mean(axis=1, keepdims=True)).reshape(-1, 2)
    correlation = float(np.corrcoef(apart.T)[0, 1])
    print(f"correlation {correlation:.2f} of {len(apart)} explorations of {world.seconds:g} s")
    for name, mean in zip(POLICIES, rows.mean(axis=0), strict=True):
        print(f"{name}: touched {mean[0]:.1%}, mapped {mean[1]:.1%}")
    assert correlation > 0.5


def _explored(
    env: ObserverWrapper, observer: HapticSLAM, touched: Touched, name: str, index: int
) -> tuple[float, float]:
    """Shares of the surface that were touched, and that the map shows."""
    shapes = presets.read("reflexes").world.shapes
    observer.sigma_deg = sigma = (3.0, 5.0)[index % 2]
    told = {"shape": shapes[7 * index % len(shapes)], "sigma_deg": sigma}
    observation, info = env.reset(seed=FIRST_SEED + index, options=told)
    policy, state, steps, over = agents.make(name, env, seed=index), None, 0, False
    solid = env.get_wrapper_attr("solid")
    touched.reset()
    while not over:
        torque, state = policy.predict(observation, state, deterministic=True)
        observation, _, terminated, truncated, info = env.step(torque)
        steps, over = steps + 1, terminated or truncated
        if steps % HOLD == 0:
            touched.take(info["truth"]["joint_angles"], observation["contacts"].astype(bool), solid)
    grid = env.get_wrapper_attr("belief").grid
    mapped = metrics.surface_recall(env.map_now(), grid, metrics.surface_places(solid, grid))
    return touched.share(solid), mapped
