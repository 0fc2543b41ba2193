"""How many steps a second a learner gets, of environments with a belief inside: alone, and side by side on threads.

A step is one of control, of 20 ms: physics, senses, pose filter and the posterior over names; a decision, whose
observation is made, comes every fifth.
"""

from __future__ import annotations

import time
from collections.abc import Callable
from functools import partial
from typing import Any

import gymnasium as gym
import numpy as np

import agents
from agents.hold_action import HoldAction
from haptic_env import hand_of, registration
from haptic_lab.benchmarks.end_to_end import UNKNOWN, clock
from haptic_lab.benchmarks.settings import BenchSettings, BenchSize
from haptic_lab.benchmarks.table import BenchRow, number, spread
from haptic_lab.learning.batched import ThreadedVectorEnv
from haptic_lab.learning.explored import explored, unobserved
from haptic_lab.learning.presets import TrainingWorld
from haptic_lab.tasks.registry import SHOWN
from observer import ObserverWrapper, PoseOnly, ShapePosterior

EVALUATION: dict[str, Any] = {"variants": 240, "stride": 3, "temper": 0.07}  # its posterior; a world has training's
NAMES = {
    "alone": "belief steps, one environment",
    "training": "belief steps, one, training's posterior",
    "together": "belief steps, side by side",
    "physics": "steps without belief, side by side",
}


def measurements(asked: BenchSettings, size: BenchSize, threads: int) -> list[Callable[[], dict[str, float]]]:
    """List what one round takes.

    Args:
        asked: of the benchmark.
        size: how much is measured.
        threads: that step environments side by side.

    Returns:
        Functions for `suite.rounds`.
    """
    update = partial(posterior_updates, asked.env, asked.sigma, size.steps, asked.seed)
    return [
        lambda: {"posterior": update()},
        partial(belief_steps, asked.env, size.together, size.decisions, asked.seed, threads),
    ]


def belief_steps(env_id: str, count: int, decisions: int, seed: int, threads: int) -> dict[str, float]:
    """Measure all one after the other.

    Args:
        env_id: registered, such as "HapticSLAM/TwoFinger-v0".
        count: of environments side by side.
        decisions: of each.
        seed: of worlds and actions.
        threads: that step environments side by side.

    Returns:
        Control steps a second, by the keys of `NAMES`; and with ", processor" behind these the seconds of a processor
        that one takes, which other work on the machine changes less.
    """
    # No episode ends in the middle.
    never: dict[str, Any] = {"threshold": 1.0, "seconds": 600.0, "observation": SHOWN}
    world = TrainingWorld(env=env_id, **never, **EVALUATION)
    physics = partial(_held, world)
    training = partial(explored, TrainingWorld(env=env_id, **never))
    measured = {
        "alone": _rate([partial(explored, world)], world.hold, decisions, seed, 1),
        "training": _rate([training], world.hold, decisions, seed, 1),
        "together": _rate([partial(explored, world)] * count, world.hold, decisions, seed, threads),
        "physics": _rate([physics] * count, world.hold, decisions, seed, threads),
    }
    rates = {key: rate for key, (rate, _) in measured.items()}
    return rates | {f"{key}, processor": seconds for key, (_, seconds) in measured.items()}


def posterior_updates(env_id: str, sigma_deg: float, steps: int, seed: int) -> float:
    """Time the updates of evaluation's posterior in an exploration by random torques.

    Args:
        env_id: registered, such as "HapticSLAM/TwoFinger-v0".
        sigma_deg: noise of the felt angles, degrees.
        steps: how long is explored.
        seed: of environment, policy and posterior.

    Returns:
        Seconds of a processor of one update, on average; there is one every third step.
    """
    env = registration.make(env_id, shape="cube", sigma_deg=sigma_deg, episode_seconds=600.0, **UNKNOWN)
    hand = hand_of(env)
    namer = ShapePosterior(hand, **{**EVALUATION, "stride": 1}, **UNKNOWN)
    namer.reset(seed=seed)
    env = ObserverWrapper(env, PoseOnly(hand, sigma_deg, stride=EVALUATION["stride"]))
    policy, state, took = agents.make("random_torque", env, seed=seed), None, []
    observation, info = env.reset(seed=seed)
    for _ in range(steps):
        torque, state = agents.act(policy, observation, state)
        observation, *_, info = env.step(torque)
        start = time.thread_time()
        namer.update(info["belief"])
        if info["belief"].transition is not None:
            took.append(time.thread_time() - start)
    env.close()
    return float(np.mean(took))


def rows(found: dict[str, Any], count: int, threads: int) -> list[BenchRow]:
    """Make rows of the benchmark's table.

    Args:
        found: (rounds,) of each key of `belief_steps`, and seconds of `posterior_updates` as "posterior".
        count: as `belief_steps`'s.
        threads: likewise.

    Returns:
        A row for each key; a step a second is better where it is more, so that "least" is the slowest round.
    """
    alone = float(np.median(found["alone"]))
    notes = {
        "alone": "240 variants, every third step; 1 thread",
        "training": "96 variants, every fifth step; 1 thread",
        "together": f"{count} on {threads} threads; {np.median(found['together']) / alone:.2f} times as many as of one",
        "physics": f"{count} on {threads} threads: what physics and senses alone would allow",
    }
    update = 1e6 * found["posterior"]
    told = f"of a processor; 240 variants of four shapes; a third of it, {number(np.median(update) / 3)} µs, a step"
    first = BenchRow("posterior, an update", "µs", *spread(update), told)
    each = {key: number(1e6 * float(np.median(found[f"{key}, processor"]))) for key in NAMES}
    said = {key: f"{each[key]} µs of a processor each; {notes[key]}" for key in NAMES}
    return [first, *(BenchRow(name, "/s", *spread(found[key]), said[key]) for key, name in NAMES.items())]


def _held(world: TrainingWorld) -> gym.Env[Any, Any]:
    return HoldAction(unobserved(world), world.hold)


def _rate(
    makers: list[Callable[[], gym.Env[Any, Any]]], hold: int, decisions: int, seed: int, threads: int
) -> tuple[float, float]:
    """Control steps a second, and the seconds of a processor that one takes."""
    env = ThreadedVectorEnv(makers, threads=threads)
    env.reset(seed=seed)
    rng = np.random.default_rng(seed)
    joints = env.single_action_space.shape or ()
    torques = np.tanh(rng.standard_normal((2 + decisions, len(makers), *joints))).astype(np.float32)
    for torque in torques[:2]:
        env.step(torque)
    start, worked = clock(), time.process_time()
    for torque in torques[2:]:
        env.step(torque)
    took, worked = clock() - start, time.process_time() - worked
    env.close()
    steps = hold * decisions * len(makers)
    return steps / took, worked / steps
