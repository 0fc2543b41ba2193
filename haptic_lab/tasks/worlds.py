"""The worlds in which policies are judged, fixed by seeds in `worlds.json`, with a digest of what the seeds draw."""

from __future__ import annotations

import hashlib
import json
from collections.abc import Iterator
from dataclasses import dataclass, replace
from functools import cache
from importlib import resources
from typing import Any

import gymnasium as gym
import numpy as np

from haptic_env import validate
from haptic_lab.learning.explored import DomainRandomisation, unobserved
from haptic_lab.learning.presets import TrainingWorld
from haptic_lab.tasks.registry import TASKS, world_of

FIRST = 20
DECIMALS = 9  # of what is digested: metres, degrees, radians


@dataclass(frozen=True)
class EvaluationSet:
    """The worlds of a task. A change of any of it, or of what the seeds draw, is another version.

    Attributes:
        task: one of `TASKS`.
        version: of the set.
        first_seed: of its worlds, one after the other.
        count: how many worlds there are.
        sigmas_deg: degrees, noises that the worlds have in turn.
        sha256: of what the two-finger hand explores in them.
        sha256_first: likewise of the first `FIRST`, which are quickly drawn.
    """

    task: str
    version: int
    first_seed: int
    count: int
    sigmas_deg: tuple[float, ...]
    sha256: str
    sha256_first: str

    def world(self, index: int, hand: str = "two_finger", wrist: str | None = None) -> tuple[TrainingWorld, int]:
        """Say what is explored.

        Args:
            index: of a world.
            hand: that explores it.
            wrist: how it is held; None: as it usually is.

        Returns:
            What may be drawn, and the seed that draws.

        Raises:
            ValueError: for an index that is none, an unknown hand, and a wrist that it has not.
        """
        index = validate.integer("index of a world", index, 0, self.count - 1)
        sigma = self.sigmas_deg[index % len(self.sigmas_deg)]
        return replace(world_of(self.task, hand, wrist), sigma_deg=(sigma, sigma)), self.first_seed + index


def evaluation_set(task: str) -> EvaluationSet:
    """Look up the worlds in which a task is judged.

    Args:
        task: one of `TASKS`.

    Returns:
        The worlds.

    Raises:
        ValueError: for an unknown task.
    """
    said = _sets()[validate.choice("task", task, TASKS)]
    return EvaluationSet(task, **{**said, "sigmas_deg": tuple(said["sigmas_deg"])})


@cache
def _sets() -> dict[str, Any]:
    """What `worlds.json` says of each task."""
    told = resources.files("haptic_lab.tasks").joinpath("worlds.json").read_text(encoding="utf-8")
    sets: dict[str, Any] = json.loads(told)["sets"]
    return sets


def as_drawn(world: TrainingWorld) -> gym.Env[Any, Any]:
    """Make the environment that draws worlds of evaluation, of the sizes that training does not see.

    Args:
        world: what may be drawn.

    Returns:
        The environment without an observer.
    """
    return DomainRandomisation(unobserved(world), None, world, held_out=True)


def drawn(worlds: EvaluationSet, count: int) -> Iterator[dict[str, Any]]:
    """Draw worlds of a set.

    Args:
        worlds: the set.
        count: how many, the first ones.

    Yields:
        What each is: object, size and pose, noises, and the constant error of each joint.
    """
    made: dict[tuple[float, float], gym.Env[Any, Any]] = {}
    for index in range(count):
        world, seed = worlds.world(index)
        env = made.setdefault(world.sigma_deg, as_drawn(world))
        truth = env.reset(seed=seed)[1]["truth"]
        numbers = ("object_size", "object_position", "object_quaternion", "joint_offset")
        yield {
            "seed": seed,
            "sigma_deg": world.sigma_deg[0],
            "noise": world.noise,
            "shape": truth["shape"],
            **{name: (np.round(truth[name], DECIMALS) + 0.0).tolist() for name in numbers if name in truth},
        }


def digest(worlds: EvaluationSet, count: int) -> str:
    """Digest what the seeds of a set draw.

    Args:
        worlds: the set.
        count: how many, the first ones.

    Returns:
        SHA-256 of a line of JSON for each world.
    """
    lines = "".join(json.dumps(each, sort_keys=True) + "\n" for each in drawn(worlds, count))
    return hashlib.sha256(lines.encode()).hexdigest()
