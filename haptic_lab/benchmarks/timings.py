"""What the benchmark measures: how long each part takes, step by step of one recorded exploration.

Shapes: T steps, J joints, P patches, N particles. All times in seconds. Measurements are functions that may be called
again and again: each call takes every step anew, so that repetitions of all can be interleaved.
"""

from __future__ import annotations

import math
import subprocess
import sys
import time
from collections.abc import Iterable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from typing import Any

import gymnasium as gym
import mujoco
import numpy as np
from numpy.typing import NDArray

import agents
from haptic_env.arrays import Array
from haptic_env.compiled import kernel
from haptic_env.grid import Grid
from haptic_env.hand import Hand
from haptic_lab.benchmarks import reference
from observer import HapticSLAM, ShapePosterior
from observer.fastslam import PARTS
from observer.kinematics import Tree, body_frames, tree_of

LINE = 64  # bytes that the memory hands out at once
clock = time.perf_counter
RESTLESS = """
import os, sys, threading
threading.Thread(target=lambda: (sys.stdin.read(), os._exit(0)), daemon=True).start()
print(flush=True)
while True:
    pass
"""


@dataclass(frozen=True)
class BenchRecording:
    """An exploration.

    Attributes:
        env: in which it was made.
        hand: that explored.
        seed: of the exploration.
        sigma_deg: noise of the felt angles, degrees.
        torques: (T, J) commanded, fractions.
        controls: (T, J) with motor noise, fractions.
        felt: (T, J) rad.
        contacts: (T, P).
    """

    env: gym.Env[Any, Any]
    hand: Hand
    seed: int
    sigma_deg: float
    torques: NDArray[np.float32]
    controls: Array
    felt: NDArray[np.float32]
    contacts: NDArray[np.bool_]

    @property
    def touching(self) -> NDArray[np.bool_]:
        """(T,) whether any patch felt contact."""
        return np.asarray(self.contacts.any(axis=1))

    def lagged(self, lag: int) -> NDArray[np.bool_]:
        """Tell at which steps a touch enters the maps.

        Args:
            lag: steps of the observer.

        Returns:
            (T,) whether any patch felt contact at the step that enters the maps `lag` steps later.
        """
        return np.concatenate([np.zeros(lag, dtype=bool), self.touching[: len(self.touching) - lag]])


def record(env_id: str, shape: str, sigma_deg: float, seed: int, steps: int, **keywords: Any) -> BenchRecording:
    """Explore with random torques.

    Args:
        env_id: registered, such as "HapticSLAM/TwoFinger-v0".
        shape: that is explored.
        sigma_deg: noise of the felt angles, degrees.
        seed: of the exploration.
        steps: T.
        **keywords: of the environment.

    Returns:
        What was commanded and felt.
    """
    env = gym.make(env_id, shape=shape, sigma_deg=sigma_deg, episode_seconds=3600.0, **keywords)
    base: Any = env.unwrapped
    observation, _ = env.reset(seed=seed)
    policy, state = agents.make("random_torque", env, seed=seed), None
    rows = []
    for _ in range(steps):
        torque, state = policy.predict(observation, state)
        observation, *_ = env.step(torque)
        felt, contacts = observation["joint_angles"], observation["contacts"].astype(bool)
        rows.append((torque, base._data.ctrl.copy(), felt, contacts))
    return BenchRecording(env, base.hand, seed, sigma_deg, *(np.array(each) for each in zip(*rows, strict=True)))


def environment(recording: BenchRecording, turn: int = 0) -> dict[str, Array]:
    """Time the environment, and the physics in it.

    Args:
        recording: whose torques are commanded.
        turn: number of the round; what is measured first changes from one to the next.

    Returns:
        Seconds (T,) of `env.step` as a user calls it, and right before or after it of the bare `mj_step` calls from the
        same state, by the names of the rows.
    """
    base: Any = recording.env.unwrapped
    recording.env.reset(seed=recording.seed)
    model, data = base._model, mujoco.MjData(base._model)
    what = mujoco.mjtState.mjSTATE_INTEGRATION
    state = np.empty(mujoco.mj_stateSize(model, what))
    steps = len(recording.torques)
    whole, bare = np.empty(steps), np.empty(steps)
    for k in range(steps):
        mujoco.mj_getState(model, base._data, state, what)
        mujoco.mj_setState(model, data, state, what)
        data.ctrl[:] = recording.controls[k]
        bare_first = (k + turn) % 2
        for bare_now in (bare_first, not bare_first):
            start = clock()
            if not bare_now:
                recording.env.step(recording.torques[k])
                whole[k] = clock() - start
            else:
                mujoco.mj_step(model, data, base.substeps)
                bare[k] = clock() - start
    return {"env.step": whole, "mj_step": bare}


def make_slam(recording: BenchRecording, particles: int, voxels: int) -> HapticSLAM:
    """Make the observer that is timed.

    Args:
        recording: of whose hand.
        particles: N.
        voxels: along the longest edge of the hand's workspace.

    Returns:
        The observer.
    """
    hand = recording.hand
    grid = Grid.around(hand.grasp_centre, hand.workspace, float(hand.workspace.max()) / voxels)
    return HapticSLAM(hand, recording.sigma_deg, particles, grid=grid)


def pose_filter(slam: HapticSLAM, recording: BenchRecording) -> Array:
    """Time the pose filter with nothing else between its steps: what it needs stays in the processor's caches.

    Args:
        slam: whose filter.
        recording: what it is told.

    Returns:
        (T,) s of `PoseFilter.step`.
    """
    took = np.empty(len(recording.torques))
    slam.reset()
    torques, felt = recording.torques.astype(np.float64), recording.felt.astype(np.float64)
    for k, each in enumerate(zip(torques, felt, recording.contacts, strict=True)):
        start = clock()
        slam.pose.step(*each)
        took[k] = clock() - start
    return took


@contextmanager
def neighbours(count: int) -> Iterator[None]:
    """Start so many other processes that never rest; they end with this one, or with the context.

    Args:
        count: of them.

    Yields:
        Nothing, once all of them are busy.
    """
    command = [sys.executable, "-c", RESTLESS]
    others = [subprocess.Popen(command, stdin=subprocess.PIPE, stdout=subprocess.PIPE) for _ in range(count)]
    try:
        for other in others:
            assert other.stdout is not None
            other.stdout.readline()  # it runs
        yield
    finally:
        for other in others:
            other.kill()
            other.communicate()


def observe(slam: HapticSLAM, recording: BenchRecording, threads: int | None) -> Array:
    """Time the observer as a user calls it: the last belief is still held.

    Args:
        slam: the observer.
        recording: what it is told.
        threads: as `HapticSLAM`'s.

    Returns:
        (T,) s of `HapticSLAM.step`.
    """
    slam.threads = threads
    took = np.empty(len(recording.torques))
    belief = slam.reset(seed=0)
    for k, each in enumerate(zip(recording.torques, recording.felt, recording.contacts, strict=True)):
        start = clock()
        belief = slam.step(*each)
        took[k] = clock() - start
    del belief
    return took


class Stopwatch:
    """Seconds that went by until each named part was done, summed until `read`."""

    def __init__(self, names: Iterable[str]) -> None:
        """Begin at nothing.

        Args:
            names: of the parts.
        """
        self.spent = dict.fromkeys(names, 0.0)
        self.last = clock()

    def start(self) -> None:
        """What comes next begins now."""
        self.last = clock()

    def done(self, part: str) -> None:
        """Count what has gone by since the last part was done.

        Args:
            part: which it belongs to.
        """
        now = clock()
        self.spent[part] += now - self.last
        self.last = now

    def read(self) -> dict[str, float]:
        """Read the clock, and set it back.

        Returns:
            Seconds of each part since the last time.
        """
        spent, self.spent = self.spent, dict.fromkeys(self.spent, 0.0)
        return spent


def stages(slam: HapticSLAM, shape: ShapePosterior, recording: BenchRecording) -> dict[str, Array]:
    """Time each stage of a turn of the observer and its classifier, on one thread.

    The forward model predicts once more before each step, from the same state, to be timed by itself.

    Args:
        slam: the observer.
        shape: its classifier.
        recording: what both are told.

    Returns:
        (T,) s of each stage, by its name.
    """
    slam.threads = 1
    watch, rows, joints = Stopwatch((*PARTS, "model", "rest", "classify")), [], recording.hand.joints
    belief = slam.reset(seed=0)
    shape.reset(seed=0)
    slam.on_part = watch.done
    try:
        for torque, felt, contacts in zip(recording.torques, recording.felt, recording.contacts, strict=True):
            state, command = slam.pose.mean[: 2 * joints].copy(), torque.astype(np.float64)
            watch.start()
            slam.pose.model.predict(state, command)  # type: ignore[attr-defined]
            watch.done("model")
            belief = slam.step(torque, felt, contacts)
            watch.done("rest")
            shape.update(belief)
            watch.done("classify")
            rows.append(watch.read())
    finally:
        slam.on_part = None
    del belief
    took = {name: np.array([row[name] for row in rows]) for name in rows[0]}
    return {
        "forward model": took["model"],
        "pose filter and lag, without it": np.maximum(took["pose"] - took["model"], 0.0),
        "match and touch, every particle": took["match"],
        "geometry, sweeps, random numbers": took["gather"] + took["map"],
        "occupancy of the belief that is held": took["settle"],
        "weigh and resample": took["weigh"] + took["resample"],
        "proposal, belief and checks": took["predict"] + took["belief"] + took["rest"],
        "classify (ShapePosterior.update)": took["classify"],
    }


@kernel()
def _frames(tree: Any, poses: Any, position: Any, rotation: Any) -> None:
    for n in range(len(poses)):
        body_frames(tree, poses[n], position, rotation)


def kinematics(recording: BenchRecording, poses: int = 2000) -> float:
    """Time forward kinematics, on one thread.

    Args:
        recording: of whose hand.
        poses: that are computed, of which the mean is taken.

    Returns:
        Seconds for one pose.
    """
    tree: Tree = tree_of(recording.hand)
    angles = np.resize(recording.felt.astype(np.float64), (poses, recording.hand.joints))
    frames = np.empty((len(tree.parent), 3)), np.empty((len(tree.parent), 3, 3))
    _frames(tree, angles[:1], *frames)
    start = clock()
    _frames(tree, angles, *frames)
    return (clock() - start) / poses


def plain(slam: HapticSLAM, recording: BenchRecording, steps: int = 3) -> float:
    """Time `reference`, plain NumPy which the kernels are tested against; it scores K candidates and writes one map.

    Args:
        slam: whose candidates and grid.
        recording: what is felt.
        steps: with contact, of which the mean is taken.

    Returns:
        Seconds for one particle and step.
    """
    hand, grid, model, took = recording.hand, slam.grid, slam.contact_model, []
    log_odds = np.zeros(grid.shape, dtype=np.int8)
    watched, sure = np.ones(len(hand.links), dtype=bool), np.zeros(len(hand.links))
    for k in np.flatnonzero(recording.touching)[:steps]:
        q, contacts = recording.felt[k].astype(np.float64), recording.contacts[k]
        start = clock()
        for _ in range(slam.n_candidates):
            reference.log_likelihood(hand, grid, model, q, contacts, watched, log_odds)
        reference.write(hand, grid, model, q, sure, contacts, np.ones(len(contacts)), log_odds)
        took.append(clock() - start)
    return float(np.median(took)) if took else math.nan


def bytes_touched(slam: HapticSLAM, recording: BenchRecording) -> Array:
    """Count what a step reads and writes again of a particle's own map.

    Args:
        slam: the observer.
        recording: what it is told.

    Returns:
        (T,) bytes per particle: the cache lines that it changes.
    """
    slam.reset(seed=0)
    count, touched = slam.n_particles, np.empty(len(recording.torques))
    for k, each in enumerate(zip(recording.torques, recording.felt, recording.contacts, strict=True)):
        before = slam.particle_maps.copy()
        slam.step(*each)
        more = slam.particle_maps.shape[1] - before.shape[1]
        before = np.pad(before, ((0, 0), (0, more)))
        changed = slam.particle_maps != before
        changed = np.pad(changed, ((0, 0), (0, -changed.shape[1] % LINE)))
        touched[k] = 2 * LINE * changed.reshape(-1, LINE).any(axis=1).sum() / count
    return touched


def copy_bandwidth(megabytes: int) -> float:
    """Measure the memory by `np.copyto` of a large array.

    Args:
        megabytes: of the array.

    Returns:
        Bytes read and written a second.
    """
    source = np.ones(megabytes << 17)
    target = np.zeros_like(source)
    start = clock()
    np.copyto(target, source)
    return 2 * source.nbytes / (clock() - start)
