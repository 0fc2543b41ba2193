"""What the benchmark measures: how long each part takes, step by step of one recorded exploration.

Shapes: T steps, J joints, P patches, N particles. All times in seconds. Measurements are functions that may be called
again and again: each call takes every step anew, so that repetitions of all can be interleaved.
"""

from __future__ import annotations

import math
import subprocess
import sys
import time
from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any

import mujoco
import numpy as np

from haptic_env.arrays import Array
from haptic_env.compiled import kernel
from haptic_lab.benchmarks import reference
from haptic_lab.benchmarks.recording import BenchRecording
from observer import HapticSLAM
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
