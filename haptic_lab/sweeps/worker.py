"""What a worker runs: one exploration with all observers at once, and from it the rows of trials or the maps of
exemplars."""

from __future__ import annotations

import io
from collections.abc import Callable, Mapping, Sequence
from functools import lru_cache
from typing import Any

import numpy as np

from agents.few_joints import FewJoints
from haptic_env import hand_of, registration, shapes
from haptic_lab.limits import plain
from haptic_lab.records import BeliefTrace, Exploration
from haptic_lab.sweeps import log_courses, replayed
from haptic_lab.sweeps.measures import GroundTruth, measures_of
from haptic_lab.sweeps.meshes import measures_of_mesh
from haptic_lab.sweeps.rows import Exemplars, row_of
from haptic_lab.sweeps.tasks import SweepSettings, SweepTask
from haptic_lab.trial import TRUE_POSE, Trial, guided, make_observers
from haptic_lab.worlds import candidates_of
from observer import ShapePosterior
from observer.variants import Observer

GUIDE_VARIANTS = 24  # of each solid: enough to say where to go


def explore(
    tasks: Sequence[SweepTask],
    naming: bool,
    moves: Sequence[int] | None = None,
    make: Callable[..., dict[str, Observer]] = make_observers,
) -> tuple[Exploration, dict[SweepTask, dict[str, BeliefTrace]]]:
    """Run the exploration of a bundle.

    Args:
        tasks: of the bundle.
        naming: whether observers name the object.
        moves: indices of the joints that the policy drives, the others are left to their springs; None: all.
        make: makes the observers of a task, as `make_observers` does.

    Returns:
        What happened, and for each task what every observer made of it, by name.
    """
    first, *further = tasks
    recorded = first.condition.recording
    trial = replayed.make_trial(first, naming) if recorded else make_trial(first, naming, further, make)
    if moves is not None:
        trial.policy = FewJoints(trial.policy, moves)
    trial.run()
    trial.env.close()
    exploration, traces = trial.finish()
    told = {first: {name: traces[name] for name in first.settings.observers}}
    for task in further:
        told[task] = {name: traces[_felt_by(task, name, first)] for name in first.settings.observers}
    return exploration, told


def _felt_by(task: SweepTask, observer: str, first: SweepTask) -> str:
    """The name of `observer` in the trial of a bundle, for a `task` that is not the first."""
    same = plain(observer) == TRUE_POSE or task.condition.sigma_deg == first.condition.sigma_deg
    return observer if same else f"{observer} at {task.condition.sigma_deg}"


def make_trial(
    task: SweepTask,
    naming: bool,
    further: Sequence[SweepTask] = (),
    make: Callable[..., dict[str, Observer]] = make_observers,
) -> Trial:
    """Set up the exploration of a bundle.

    Args:
        task: the first of the bundle.
        naming: whether observers name the object.
        further: the others of the bundle.
        make: makes the observers of a task, as `make_observers` does.

    Returns:
        The trial, not begun.
    """
    settings, condition = task.settings, task.condition
    shapes.allow({task.shape, *settings.known})  # which whoever asked for the sweep has imported too
    env = registration.make(
        settings.env,
        wrist=settings.wrist,
        shape=task.shape,
        scale=settings.scale,
        **condition.noise,
        episode_seconds=condition.seconds,
        **settings.jitter,
        reveal_truth=True,
    )
    hand = hand_of(env)
    limits = settings.limits
    posterior = shape_posterior(settings)
    shared: dict[str, Any] = {"hand": hand, "particles": settings.particles, "limits": limits, "candidates": posterior}
    observers = make(settings.observers, **shared, **task.told(hand))
    felt_at: dict[str, float] = {}
    for other in further:
        mine = [name for name in settings.observers if _felt_by(other, name, task) not in observers]
        made = make(mine, **shared, **other.told(hand))
        renamed = {_felt_by(other, name, task): each for name, each in made.items()}
        observers |= renamed
        felt_at |= dict.fromkeys(renamed, other.condition.sigma_deg)
    env = guided(env, condition.policy, shape=shape_posterior(settings, GUIDE_VARIANTS), **task.told(hand))
    named = None if naming else ()
    told: dict[str, Any] = {"felt_at": felt_at, "trust": settings.trust, "courses": bool(settings.courses) and naming}
    told |= {"limits": limits, "maps_every": settings.maps_every if naming else None}
    return Trial(env, condition.policy, observers, posterior, task.seed, naming=named, **told)


def prepare(settings: SweepSettings) -> None:
    """Put on disk what takes long to find of objects, so that no worker has to find it again.

    Args:
        settings: what all trials share.

    Raises:
        ValueError: for an object that cannot be explored.
    """
    for name in dict.fromkeys((*settings.shapes, *settings.known)):
        shapes.find(name).prepare()
    if settings.recordings is None and any(shapes.find(name).content for name in settings.known):
        shape_posterior(settings)


@lru_cache(maxsize=8)
def shape_posterior(settings: SweepSettings, variants: int = 240) -> ShapePosterior:
    """Make the namer: it knows how much objects vary, not how. Candidates are at the grasp centre.

    Args:
        settings: what all trials share.
        variants: of each shape that it tries.

    Returns:
        The namer, the same object for the same settings: to be copied before use.
    """
    hand = settings.make_hand()
    return ShapePosterior(
        hand,
        candidates_of(hand, settings.known, scale=settings.scale),
        none=settings.none or 0.0,
        **settings.jitter,
        variants=variants,
    )


def run_exemplars(bundle: Sequence[SweepTask]) -> list[tuple[SweepTask, bytes]]:
    """Make the maps from which classifiers learn.

    Args:
        bundle: tasks of one exploration.

    Returns:
        Each task with the map that every observer ends with, as the content of an .npz file.
    """
    _, traces = explore(bundle, naming=False)
    made = []
    for task in bundle:
        maps: dict[str, Any] = {name: trace.belief.occupancy for name, trace in traces[task].items()}
        file = io.BytesIO()
        np.savez_compressed(file, **maps)
        made.append((task, file.getvalue()))
    return made


def run_trials(bundle: Sequence[SweepTask], *exemplars: Exemplars) -> list[list[dict[str, Any]]]:
    """Make the rows of trials.

    Args:
        bundle: tasks of one exploration.
        *exemplars: for each task the maps from which its classifiers learn.

    Returns:
        For each task a row for each observer.

    Raises:
        ValueError: for exemplars that are corrupt.
    """
    exploration, traces = explore(bundle, naming=True)
    ground_truth = GroundTruth.of(exploration, next(iter(traces[bundle[0]].values())).belief.grid)
    meshes = bundle[0].settings.meshes

    def measure(trace: BeliefTrace) -> dict[str, Any]:
        row = measures_of(exploration, ground_truth, trace)
        return row | measures_of_mesh(trace, exploration.solid, ground_truth) if meshes else row

    return rows_of(bundle, exemplars, exploration, traces, measure)


def rows_of(
    bundle: Sequence[SweepTask],
    exemplars: Sequence[Exemplars],
    exploration: Exploration,
    traces: Mapping[SweepTask, Mapping[str, BeliefTrace]],
    measure: Callable[[BeliefTrace], dict[str, Any]],
) -> list[list[dict[str, Any]]]:
    """Make the rows of trials from what observers made of an exploration.

    Args:
        bundle: tasks of the exploration.
        exemplars: for each task the maps from which its classifiers learn.
        exploration: what happened.
        traces: for each task those of all observers, by name.
        measure: says what there is to measure of a trace.

    Returns:
        For each task a row for each observer.
    """
    # An observer that does not feel the noise has one trace for the whole bundle.
    distinct = {id(trace): trace for each in traces.values() for trace in each.values()}
    measured = {key: measure(trace) for key, trace in distinct.items()}
    settings = bundle[0].settings
    if settings.courses:
        for key, trace in distinct.items():
            measured[key][log_courses.COLUMN] = log_courses.text_of(exploration.seconds, trace, settings.labels)
    return [
        [row_of(task, name, trace, measured[id(trace)], learnt) for name, trace in traces[task].items()]
        for task, learnt in zip(bundle, exemplars, strict=True)
    ]
