"""Sweeps over recordings: hands that repeat what was recorded, with the noise of each draw.

Each recording is a condition of its own, and has the object that it is replayed with.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import asdict
from functools import lru_cache
from pathlib import Path
from typing import Any

from haptic_env import hand_env, registration, shapes, validate
from haptic_env.recordings import MeasuredTouch, Recording
from haptic_lab import conditions, recorded, replay
from haptic_lab.believed import BELIEVED
from haptic_lab.conditions import Condition
from haptic_lab.exploration import run
from haptic_lab.exploration.settings import ExplorationSettings
from haptic_lab.sweeps.tasks import SweepSettings, SweepTask
from haptic_lab.trial import Trial


def objects_of(recordings: Sequence[str], said: Sequence[str] | None) -> dict[str, str]:
    """Say with which object each recording is replayed.

    Args:
        recordings: paths.
        said: an object for each of them, or one for all; None: the mesh that each names, beside it.

    Returns:
        Names of shapes by path.

    Raises:
        ValueError: for what cannot be replayed, or with which object nobody says.
    """
    for path in recordings:
        if recordings.count(path) > 1:
            raise ValueError(f"--recordings must name each recording once, got {validate.shown(path)} again")
    if said is None:
        return {path: _beside(path) for path in recordings}
    if len(said) not in (1, len(recordings)):
        raise ValueError(
            f"--shapes with --recordings are one object, or one for each in their order: there are {len(recordings)} "
            f"recordings, got {len(said)} objects"
        )
    return dict(zip(recordings, said if len(said) > 1 else [said[0]] * len(recordings), strict=True))


def _beside(path: str) -> str:
    """The mesh that a recording names, where it lies in the same folder."""
    mesh = _read(path, None).mesh
    there = Path(path).parent / Path(mesh).name
    if not mesh or not there.is_file():
        named = f"the mesh that it names, {validate.shown(mesh)}, is not beside it" if mesh else "it names no mesh"
        raise ValueError(f"--recordings {path}: say what was held by --shapes: {named}")
    return shapes.written(str(there))


@lru_cache(maxsize=64)
def _read(path: str, hand: str | None) -> Recording:
    try:
        Path(path).stat()  # before it is told by its name what is in it
        found = None if recorded.has_touch(Path(path)) else recorded.load(path, None, None, hand)
    except (ImportError, OSError) as error:
        raise ValueError(f"--recordings: {path} cannot be read: {error}") from error
    if found is None or isinstance(found, MeasuredTouch) or found.felt is not None:
        raise ValueError(
            f"--recordings {path}: it tells what was felt, so that no noise is to be drawn: haptic-slam replay plays it"
        )
    return found


def environment_of(recordings: Sequence[str], said: str | None) -> str:
    """Find the environment of the hand that all recordings are of.

    Args:
        recordings: paths.
        said: its id, or the path of a hand's TOML; None: it is found by the names of joints.

    Returns:
        The same.

    Raises:
        ValueError: for recordings of several hands, or of none.
    """
    if said is not None:
        return said
    first, *others = ((path, recorded.environment_of(_read(path, None))) for path in recordings)
    for path, env in others:
        if env != first[1]:
            raise ValueError(
                f"--recordings must all be of one hand: {first[0]} is of {registration.hand_name(first[1])}, {path} of "
                f"{registration.hand_name(env)}"
            )
    return first[1]


def seconds_of(settings: SweepSettings, condition: Condition, shape: str, whole: bool) -> float:
    """Check that a recording can be replayed, and say how long that takes.

    Args:
        settings: what all trials share.
        condition: with the recording.
        shape: of the object.
        whole: to its end, however long the condition says.

    Returns:
        s, not longer than the recording.

    Raises:
        ValueError: where it does not fit the hand or the object.
    """
    task = SweepTask(settings, condition, shape, settings.first_seed)
    told = _settings(task) if not whole else _settings(task, seconds=None)
    env, _ = replay.world(told, _recording(task))
    base = hand_env(env)
    env.close()
    return float(base.episode_steps / base.control_hz)


def make_trial(task: SweepTask, naming: bool) -> Trial:
    """Set up the replay of a recording.

    Args:
        task: whose condition has one.
        naming: whether observers name the object.

    Returns:
        The trial, not begun.
    """
    settings, observers = _settings(task), task.settings.observers
    session = replay.session(settings, _recording(task))
    told: dict[str, Any] = {"courses": bool(task.settings.courses) and naming, "limits": task.settings.limits}
    return run.make_trial(settings, session, observers, observers if naming else (), **told)


def _recording(task: SweepTask) -> Recording:
    return _read(task.condition.recording, registration.hand_name(task.settings.env))


def _settings(task: SweepTask, **changed: Any) -> ExplorationSettings:
    """What `haptic-slam replay` would be told."""
    shared, condition = task.settings, task.condition
    believed = {name: getattr(shared, name) for name in BELIEVED}
    if shared.believed_sigma != 1.0:
        believed["believed_sigma_deg"] = shared.believed_sigma * condition.sigma_deg
    told = {name: value for name, value in asdict(condition).items() if name in conditions.DEFAULTS} | believed
    return ExplorationSettings(
        **{
            **told,
            "env": shared.env,
            "shape": task.shape,
            "scale": shared.scale,
            "sigma": condition.sigma_deg,
            "seconds": condition.seconds,
            "particles": shared.particles,
            "policy": Condition.policy,
            "seed": task.seed,
            "out": "",
            "candidates": shared.among,
            "none": shared.none or 0.0,
            **changed,
        }
    )
