"""One policy in one world of evaluation: how soon the object was known, how much of it was covered.

Whatever the policy reads, it is judged by the same observer: a `HapticSLAM` of one particle, and the namer that sweeps
have. It is not stopped when a name is sure, and a model acts without the noise with which it learnt.
"""

from __future__ import annotations

from functools import lru_cache
from typing import Any

import gymnasium as gym
import numpy as np

import agents
from agents.policy import Policy
from haptic_env import hand_env, hand_of
from haptic_lab.learning.explored import jitter, unobserved
from haptic_lab.learning.presets import NAME, TrainingWorld
from haptic_lab.sweeps.measures import FIRST_SECONDS, measures_without_map
from haptic_lab.sweeps.worker import GUIDE_VARIANTS
from haptic_lab.tasks.registry import world_of
from haptic_lab.tasks.worlds import EvaluationSet, as_drawn
from haptic_lab.trial import GUIDE, Trial, check_model, guided, make_observers
from haptic_lab.worlds import candidates_of
from observer import ShapePosterior, metrics

DECISION, ACCURACY, COVERED = "time_to_decision", f"step_accuracy_{FIRST_SECONDS}s", "surface_coverage"
RIGHT = "right"
VARIANTS = 240  # of each shape that the judge tries
TO_MAP = "information_gain"  # looks ahead to what it is told to


def measured(world: TrainingWorld) -> tuple[str, ...]:
    """Say what is measured of a task.

    Args:
        world: of the task.

    Returns:
        Columns of a row.
    """
    return (DECISION, ACCURACY, RIGHT) if world.task == NAME else (COVERED,)


def check(policy: str, task: str, hand: str, trust: bool, wrist: str | None = None) -> None:
    """Refuse a policy that cannot act in a task, before it is judged.

    Args:
        policy: name, or path of a model.
        task: one of `TASKS`.
        hand: that explores.
        trust: whether a model may run code when it is read.
        wrist: how the hand is held; None: as it usually is.

    Raises:
        ValueError: for an unknown policy, a model that is not to be trusted, or was trained on something else.
    """
    world = world_of(task, hand, wrist)
    check_model(unobserved(world), policy, namer(world, GUIDE_VARIANTS), trust)


def judge(
    worlds: EvaluationSet,
    index: int,
    policy: str | type[Policy],
    hand: str = "two_finger",
    trust: bool = False,
    wrist: str | None = None,
) -> dict[str, Any]:
    """Let a policy explore one world.

    Args:
        worlds: of evaluation.
        index: of one of them.
        policy: name, or path of a model; or a class of one's own, which is made with the environment and a seed.
        hand: that explores.
        trust: whether a model may run code when it is read.
        wrist: how the hand is held; None: as it usually is.

    Returns:
        A row: the world, and what is `measured`.
    """
    world, seed = worlds.world(index, hand, wrist)
    env, (sigma, _) = as_drawn(world), world.sigma_deg
    base, names = hand_of(env), world.task == NAME
    told = world.told(world.noise, base)
    observers = make_observers((GUIDE,), base, sigma, 1, **told)
    env = guided(env, policy, sigma, namer(world, GUIDE_VARIANTS), **told)
    chance = int(np.random.SeedSequence(seed).generate_state(2)[0])  # as `Trial` would have it
    explorer: Any = policy
    if isinstance(policy, type):
        explorer = policy(env, chance)
    elif policy == TO_MAP and not names:
        explorer = agents.make(policy, env, chance, objective="map")
    elif agents.is_model(policy):
        explorer = agents.make(policy, env, chance, trust=trust)
        explorer.noiseless = True
    judging = namer(world, VARIANTS if names else 1)
    trial = Trial(env, explorer, observers, judging, seed, naming=None if names else (), trust=trust)
    trial.run()
    exploration, traces = trial.finish()
    trace = traces[GUIDE]
    env.close()
    name = policy.__name__ if isinstance(policy, type) else policy
    row = {"task": worlds.task, "policy": name, "world": index, "seed": seed, "sigma_deg": sigma}
    row["shape"] = exploration.solid.name
    if not names:
        occupancy, grid = trace.belief.occupancy, trace.belief.grid
        surface = metrics.surface_places(exploration.solid, grid)
        return row | {COVERED: float(metrics.surface_recall(occupancy, grid, surface))}
    found = measures_without_map(exploration, trace)
    last = trace.labels[int(np.argmax(trace.posterior[-1]))]
    return row | {DECISION: found[DECISION], ACCURACY: found[ACCURACY], RIGHT: float(last == exploration.solid.name)}


def guessed(
    worlds: EvaluationSet, index: int, hand: str, learner: str, acts: Any, wrist: str | None = None
) -> dict[str, Any]:
    """Let a learner that names the object itself, without an observer, explore one world.

    Args:
        worlds: of evaluation.
        index: of one of them.
        hand: that explores.
        learner: its name.
        acts: from an observation, and whether it is the first, to torques (J,) and probabilities (C,).
        wrist: how the hand is held; None: as it usually is.

    Returns:
        A row as that of `judge`; a guess holds until the next decision.
    """
    world, seed = worlds.world(index, hand, wrist)
    env: gym.Env[Any, Any] = as_drawn(world)
    base = hand_env(env)
    observation, info = env.reset(seed=seed)
    truth, guesses = world.shapes.index(info["truth"]["shape"]), np.zeros((base.episode_steps, len(world.shapes)))
    for step in range(base.episode_steps):
        if step % world.hold == 0:
            action, guess = acts(observation, step == 0)
        guesses[step] = guess
        observation, *_ = env.step(action)
    env.close()
    seconds = np.arange(1, base.episode_steps + 1) / base.control_hz
    right = guesses.argmax(axis=1) == truth
    return {
        "task": worlds.task,
        "policy": learner,
        "world": index,
        "seed": seed,
        "sigma_deg": world.sigma_deg[0],
        "shape": world.shapes[truth],
        DECISION: metrics.time_to_decision(seconds, guesses),
        ACCURACY: float(right[seconds <= FIRST_SECONDS + 1e-9].mean()),
        RIGHT: float(right[-1]),
    }


def namer(world: TrainingWorld, variants: int) -> ShapePosterior:
    """Make who names the object, told how much the world varies.

    Args:
        world: of a task.
        variants: of each shape that are tried.

    Returns:
        The namer, always the same object for the same task, hand and number: to be copied before use.
    """
    return _namer(world.env, world.wrist, world.shapes, tuple(jitter(world).items()), variants)


@lru_cache(maxsize=8)
def _namer(
    env: str, wrist: str | None, shapes: tuple[str, ...], varies: tuple[tuple[str, float], ...], variants: int
) -> ShapePosterior:
    hand = hand_of(unobserved(TrainingWorld(env=env, wrist=wrist)))
    keywords: dict[str, Any] = dict(varies)
    return ShapePosterior(hand, candidates_of(hand, shapes), **keywords, variants=variants)
