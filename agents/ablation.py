"""What a model's decisions owe to what it is shown: the same model, shown something else in place of some entries.

Shapes: D numbers of an observation, N episodes, T decisions of each, C of the numbers.
"""

from __future__ import annotations

import os
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

import gymnasium as gym
import numpy as np
from numpy.typing import NDArray

from agents.instead import Instead
from agents.sb3 import Sb3, read_model
from haptic_env import validate
from haptic_env.files import atomic
from observer.wrappers.belief_observation import BeliefObservation, features_of, labels_of


def ablate(
    env: gym.Env[Any, Any],
    path: str | os.PathLike[str],
    to: str | os.PathLike[str],
    entries: Sequence[str],
    *,
    episodes: int = 0,
    seed: int = 0,
) -> None:
    """Write a model that acts as another one, but is blind to some entries of its observation.

    Args:
        env: an `ObserverWrapper` with a `ShapePosterior`, of the hand that the model drives.
        path: of the model, an .npz that `agents.export` or `haptic-slam train` has written, which sees a belief.
        to: where the blind one goes, .npz.
        entries: to which it is blind.
        episodes: 0: it is shown zeros. N: it is shown what the model itself saw, decision by decision, in one of so
            many other episodes, about the objects in turn, which is drawn when the policy is made. A constant torque
            that an entry gives on average is then kept, and what is lost is what the entry told.
        seed: of the first of these episodes.

    Raises:
        ValueError: for a file that is no such model, an entry that it does not see, or another hand.
        OSError: where it cannot be written.
    """
    source, target = validate.path("path", path), validate.path("to", to)
    if target.suffix != ".npz":
        raise ValueError(f"to must end in .npz, got {str(target)!r}")
    validate.integer("episodes", episodes, 0, 1000)
    model = read_model(Path(source))
    seen = list(model.told.get("entries", []))
    blind = [validate.choice("entry that the model sees", entry, seen) for entry in validate.names("entries", entries)]
    watched = BeliefObservation(env, seen)
    policy = Sb3(watched, path=source)  # which checks that it fits
    ends = np.cumsum([features_of(env, [entry]).space.shape[0] for entry in seen])
    parts = np.split(np.arange(ends[-1]), ends[:-1])
    columns = np.concatenate([part for entry, part in zip(seen, parts, strict=True) if entry in blind])
    shown: NDArray[np.float32] = np.zeros((1, 1, len(columns)), np.float32)
    if episodes:
        labels, hold = labels_of(env), model.told.get("hold", 1)
        told = [_watch(watched, policy, seed + i, labels[i % len(labels)])[::hold] for i in range(episodes)]
        longest = max(map(len, told))
        padded = [np.pad(each[:, columns], ((0, longest - len(each)), (0, 0)), "edge") for each in told]
        shown = np.stack(padded).astype(np.float32)
    with atomic(target) as place:
        replace(model, instead=Instead(columns, shown)).write(place)


def _watch(env: BeliefObservation, policy: Sb3, seed: int, shape: str) -> NDArray[np.float32]:
    """(steps, D): what is shown in an episode, at each step but the last."""
    observation, _ = env.reset(seed=seed, options={"shape": shape})
    state, rows, over = None, [], False
    while not over:
        rows.append(observation)
        torque, state = policy.predict(observation, state, deterministic=True)
        observation, _, terminated, truncated, _ = env.step(torque)
        over = terminated or truncated
    return np.array(rows, np.float32)
