"""Candidates of a search, each judged by explorations: in this process, or in others beside it."""

from __future__ import annotations

import signal
from collections.abc import Iterable, Sequence
from concurrent.futures import ProcessPoolExecutor
from functools import partial
from multiprocessing import get_context
from typing import Any, NamedTuple

import gymnasium as gym
import numpy as np

from agents.rhythm import Memory
from haptic_env import hand_env
from haptic_env.arrays import Array
from haptic_lab.learning.acting import Candidate, act
from haptic_lab.learning.covering import Covering
from haptic_lab.learning.explored import explored
from haptic_lab.learning.presets import MAP, TrainingWorld
from haptic_lab.processes import end_with_parent
from observer.wrappers.belief_observation import labels_of

Pair = tuple[Candidate, int]
SURE, MOST = 0.95, 1.0 - 1e-6
SOFTNESS = 1.5  # nats


class Outcome(NamedTuple):
    """What an exploration came to.

    Attributes:
        doubt: s, how long the truth was in doubt; of a map the share of the surface that it lacks, or, where it is paid
            how soon it is touched, by how many nats that share falls short of 1.
        reward: of it, nats; of a map the share of the surface that was touched.
        decisions: that it took.
        right: whether it ended with the right name the most probable; never, of a map.
    """

    doubt: float
    reward: float
    decisions: int
    right: bool


class Judge:
    """Explorations of candidates: linear policies, (J, 1 + D) the constant first, or rhythms.

    Seeds that follow each other have the shapes of the world in turn, so that each is explored as often.
    """

    def __init__(self, world: TrainingWorld, jobs: int) -> None:
        """Start processes.

        Args:
            world: that is explored.
            jobs: 1: all in this process, else so many others.
        """
        self._here = _Player(world) if jobs == 1 else None
        self._pool = None
        if jobs > 1:
            spawn = get_context("spawn")
            self._pool = ProcessPoolExecutor(jobs, spawn, initializer=_begin, initargs=(world,))

    def judge(self, pairs: Iterable[Pair], held_out: bool = False) -> list[Outcome]:
        """Let candidates explore.

        Args:
            pairs: each a candidate and the seed of what it explores.
            held_out: whether objects have the sizes of evaluation.

        Returns:
            What came of each.
        """
        asked = list(pairs)
        if self._pool is None:
            assert self._here is not None
            return [self._here.play(held_out, pair) for pair in asked]
        return list(self._pool.map(partial(_play, held_out), asked, chunksize=2))

    def close(self) -> None:
        """End the processes, when they have ended the explorations that they are at."""
        if self._pool is not None:
            self._pool.shutdown(cancel_futures=True)


class _Player:
    """Plays in an environment for training and one for evaluation, each made when it is needed."""

    def __init__(self, world: TrainingWorld) -> None:
        self._world = world
        self._env: dict[bool, gym.Env[Any, Any]] = {}
        self._covering: dict[bool, Covering] = {}

    def play(self, held_out: bool, pair: Pair) -> Outcome:
        candidate, seed = pair
        if self._world.task == MAP:
            if held_out not in self._covering:
                self._covering[held_out] = Covering(self._world, held_out)
            covered, decisions = self._covering[held_out].play(candidate, seed)
            return Outcome(-float(np.log(covered)) if self._world.soon else 1.0 - covered, covered, decisions, False)
        if held_out not in self._env:
            self._env[held_out] = explored(self._world, held_out)
        env = self._env[held_out]
        shapes = self._world.shapes
        observation, _ = env.reset(seed=seed, options={"shape": shapes[seed % len(shapes)]})
        base = hand_env(env)
        told = np.log(1.0 / len(labels_of(env)))  # log p(truth), to whose changes rewards add up
        doubt, total, decisions, over, terminated = 0.0, 0.0, 0, False, False
        seconds = self._world.hold / base.control_hz
        info: dict[str, Any] = {}
        memory: Memory = ()
        while not over:
            torque, memory = act(candidate, observation, memory, decisions == 0)
            observation, reward, terminated, truncated, info = env.step(torque)
            total, decisions, over = total + float(reward), decisions + 1, terminated or truncated
            told += float(reward) + self._world.price * seconds
            doubt += seconds * _doubt(told)
        right = bool(info["is_success"])
        if not (terminated and right):  # what was decided is in doubt no more
            doubt += max(0.0, self._world.seconds - decisions * seconds) * _doubt(told)
        return Outcome(doubt, total, decisions, right)


def _doubt(log_p: float) -> float:
    """A share of 1 with soft edges at `SURE`, so that what nearly decided counts for something."""
    p = min(np.exp(log_p), MOST)
    odds = np.log(p / (1.0 - p)) - np.log(SURE / (1.0 - SURE))
    return float(1.0 / (1.0 + np.exp(odds / SOFTNESS)))


_players: list[_Player] = []  # of a process beside


def _begin(world: TrainingWorld) -> None:
    signal.signal(signal.SIGINT, signal.SIG_IGN)  # a terminal sends Ctrl-C to all processes of a command
    end_with_parent()
    _players[:] = [_Player(world)]


def _play(held_out: bool, pair: Pair) -> Outcome:
    return _players[0].play(held_out, pair)


def doubts(outcomes: Sequence[Outcome], shape: tuple[int, ...]) -> Array:
    """Say for how long the truth was in doubt.

    Args:
        outcomes: in the order of the shape.
        shape: of the result.

    Returns:
        Seconds.
    """
    return np.array([each.doubt for each in outcomes]).reshape(shape)
