"""What the benchmark measures from outside: a whole trial, a policy's decisions, a new process. In seconds."""

from __future__ import annotations

import json
import os
import subprocess
import sys
import time
from typing import Any

import numpy as np
from numpy.typing import NDArray

import agents
from haptic_env import hand_of, registration
from haptic_lab.sweeps.worker import GUIDE_VARIANTS
from haptic_lab.trial import Trial, guided, make_observers
from observer import ShapePosterior

UNKNOWN: dict[str, Any] = {"size_jitter": 0.2, "yaw_jitter": 45.0, "position_jitter": 0.005}  # of what is explored
ASKED = 7  # times for the map of a trial that is about to end
clock = time.perf_counter


def whole_trial(env_id: str, shape: str, sigma_deg: float, seconds: float, particles: int, seed: int) -> dict[str, Any]:
    """Time a trial, environment, policy, observer and the naming of the object, and what is asked at its end.

    Args:
        env_id: registered, such as "HapticSLAM/TwoFinger-v0".
        shape: that is explored.
        sigma_deg: noise of the felt angles, degrees.
        seconds: how long is explored.
        particles: of the observer.
        seed: of the trial.

    Returns:
        Seconds that it took (`trial`), and those of each of `ASKED` maps in between (`map_now`).
    """
    env = registration.make(env_id, shape=shape, sigma_deg=sigma_deg, episode_seconds=seconds, reveal_truth=True)
    hand = hand_of(env)
    observers: dict[str, Any] = make_observers(("haptic_slam",), hand, sigma_deg, particles)
    trial = Trial(env, "random_torque", observers, ShapePosterior(hand), seed)
    start = clock()
    trial.run()
    took, maps = clock() - start, []
    for _ in range(ASKED):
        start = clock()
        observers["haptic_slam"].map_now()
        maps.append(clock() - start)
    start = clock()
    trial.finish()
    took += clock() - start
    env.close()
    return {"trial": took, "map_now": np.array(maps)}


def decisions(
    env_id: str, shape: str, sigma_deg: float, seconds: float, seed: int, threads: int | None
) -> NDArray[np.float64]:
    """Time every decision of `information_gain` in an exploration, guided as in a sweep.

    Args:
        env_id: registered, such as "HapticSLAM/TwoFinger-v0".
        shape: that is explored, of a size and a place that are not known (`UNKNOWN`).
        sigma_deg: noise of the felt angles, degrees.
        seconds: how long is explored.
        seed: of environment and policy.
        threads: of the policy; None: as many as are fastest.

    Returns:
        Seconds of each decision, in their order.
    """
    env = registration.make(env_id, shape=shape, sigma_deg=sigma_deg, episode_seconds=seconds, **UNKNOWN)
    hand = hand_of(env)
    env = guided(env, "information_gain", sigma_deg, ShapePosterior(hand, variants=GUIDE_VARIANTS, **UNKNOWN))
    policy, state, over, took = agents.make("information_gain", env, seed=seed, threads=threads), None, False, []
    observation, _ = env.reset(seed=seed)
    while not over:
        decides = state is None or state[1] == 0
        start = clock()
        torque, state = agents.act(policy, observation, state)
        if decides:
            took.append(clock() - start)
        observation, _, _, over, _ = env.step(torque)
    env.close()
    return np.array(took)


CHILD = """
import json, pathlib, sys, time
start = time.perf_counter()
import numpy as np
from haptic_env import registration
from haptic_env.grid import Grid
from observer import HapticSLAM
imported = time.perf_counter()
def peak():
    status = pathlib.Path("/proc/self/status")  # of this process alone; the other one may be its parent's
    if status.exists():
        return next(1024 * int(line.split()[1]) for line in status.open(encoding="utf-8") if line.startswith("VmHWM"))
    import resource
    return 1024 * resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
env_id, shape, particles, voxels, steps = sys.argv[1], sys.argv[2], *map(int, sys.argv[3:])
env = registration.make(env_id, shape=shape)
hand = env.unwrapped.hand
grid = Grid.around(hand.grasp_centre, hand.workspace, float(hand.workspace.max()) / voxels)
slam = HapticSLAM(hand, 3.0, particles, grid=grid)
env.reset(seed=0)
before = peak()
slam.reset(seed=0)
ready = time.perf_counter()
rng = np.random.default_rng(0)
for step in range(steps):
    torque = np.tanh(rng.standard_normal(hand.joints)).astype(np.float32)
    seen, *_ = env.step(torque)
    slam.step(torque, seen["joint_angles"], seen["contacts"])
    if step == 0:
        first = time.perf_counter()
    if step == slam.lag:
        mapped = time.perf_counter()
print(json.dumps({"import": imported - start, "make": ready - imported, "first step": first - ready,
                  "first step into the maps": mapped - first, "before": before, "after": peak()}))
"""


def fresh_process(env_id: str, shape: str, particles: int, voxels: int, steps: int) -> dict[str, float]:
    """Time what a new process takes until it works.

    Args:
        env_id: registered, such as "HapticSLAM/TwoFinger-v0".
        shape: that is explored.
        particles: of the observer.
        voxels: along the longest edge of its map.
        steps: of the exploration, more than the observer's lag.

    Returns:
        Seconds to "import", to "make" environment and observer, to the "first step" and to the "first step into the
        maps", and bytes of memory "before" the trial and "after" it, at their peaks.
    """
    command = [sys.executable, "-c", CHILD, env_id, shape, str(particles), str(voxels), str(steps)]
    path = os.pathsep.join(filter(None, sys.path))
    environment = {**os.environ, "PYTHONPATH": path}
    ran = subprocess.run(command, check=True, capture_output=True, encoding="utf-8", env=environment)
    return dict(json.loads(ran.stdout))
