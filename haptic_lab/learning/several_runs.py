"""Runs of one preset that differ in their seed alone, held against each other: a table and a picture.

Shapes: R runs, E evaluations of each, K explorations of an evaluation.
"""

from __future__ import annotations

import json
from collections.abc import Mapping, Sequence
from dataclasses import fields
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
import pandas as pd

from haptic_env import reading
from haptic_env.arrays import Array
from haptic_lab.analysis.statistics import interval
from haptic_lab.files import write_csv
from haptic_lab.learning.evaluation import EVALUATIONS, read_evaluations
from haptic_lab.learning.learning_curve import draw_runs
from haptic_lab.learning.presets import MAP, SEARCH, Preset, TrainingWorld, configuration
from haptic_lab.learning.report import decision_seconds
from haptic_lab.learning.sweeping_motion import SweepingMotion

TABLE, PICTURE = "runs.csv", "runs.png"
LABELS = {  # of a picture, by measure
    "reward": "reward of an exploration",
    "median_seconds": "ends after, median (s)",
    "touched": "surface touched",
}


class Run(NamedTuple):
    """A run of training that has ended.

    Attributes:
        preset: of it.
        steps: (E,) of the environment, before each evaluation.
        measures: (E,) each, by name.
    """

    preset: Preset
    steps: Array
    measures: Mapping[str, Array]


def compare(folders: Sequence[str | Path], out: str | Path) -> pd.DataFrame:
    """Hold runs of one preset with different seeds against each other.

    Args:
        folders: R of them, each the `--out` of a run of `haptic-slam train` that has ended.
        out: folder, to which `TABLE` and `PICTURE` are written.

    Returns:
        The table: for each evaluation and measure what each seed came to, and the mean over seeds with its 95 %
        interval (Student's t over runs), whose seed is empty.

    Raises:
        ValueError: for fewer than two runs, a folder that holds none, and runs that differ in more than their seed.
    """
    if isinstance(folders, str) or not (
        isinstance(folders, Sequence) and all(isinstance(f, str | Path) for f in folders)
    ):
        raise ValueError(f"folders must be a list of the folders of two runs or more, got {folders!r}")
    runs = [read(Path(folder)) for folder in folders]
    if len(runs) < 2:
        raise ValueError(f"folders must be of two runs or more, got {len(runs)}")
    alike = [configuration(each.preset) | {"seed": None, "evaluations": len(each.steps)} for each in runs]
    seeds = [each.preset.seed for each in runs]
    for folder, each in zip(folders, alike, strict=True):
        if each != alike[0]:
            other = [name for name, value in each.items() if value != alike[0][name]]
            raise ValueError(f"runs must differ in their seed alone: {folder} has another {', '.join(other)}")
    if len({*seeds}) < len(seeds):
        raise ValueError(f"runs must have a seed each, got {', '.join(map(str, seeds))}")
    steps = np.array([each.steps for each in runs])
    rows: list[dict[str, Any]] = []
    curves = {name: np.array([each.measures[name] for each in runs]) for name in runs[0].measures}
    for evaluation in range(steps.shape[1]):
        for name, values in curves.items():
            told = {"evaluation": evaluation, "measure": name}
            for seed, at, value in zip(seeds, steps[:, evaluation], values[:, evaluation], strict=True):
                rows.append({**told, "seed": seed, "environment_steps": at, "value": value})
            mean, low, high, _ = interval(values[:, evaluation])
            ends = {"value": mean, "low": low, "high": high}
            rows.append({**told, "environment_steps": round(steps[:, evaluation].mean()), **ends})
    columns = ["evaluation", "environment_steps", "seed", "measure", "value", "low", "high"]
    table = pd.DataFrame(rows)[columns].astype({"seed": "Int64"})
    place = Path(out)
    place.mkdir(parents=True, exist_ok=True)
    write_csv(place / TABLE, table)
    draw_runs(place / PICTURE, steps, {LABELS[name]: values for name, values in curves.items()}, seeds)
    return table


def read(folder: Path) -> Run:
    """Read a run of training that has ended.

    Args:
        folder: of the run.

    Returns:
        The run.

    Raises:
        ValueError: where there is none.
    """
    try:
        kept = json.loads(reading.text(folder / "training.json"))
        told: dict[str, Any] = {each.name: kept[each.name] for each in fields(Preset) if each.name in kept}
        world, sweep = told.pop("world"), told.pop("sweep")
        lists: dict[str, Any] = {
            name: tuple(value) if isinstance(value, list) else value for name, value in world.items()
        }
        swept = None if sweep is None else SweepingMotion(**sweep)
        preset = Preset(world=TrainingWorld(**lists), sweep=swept, **told)
        decisions, rewards, lengths, _ = read_evaluations(folder / EVALUATIONS).values()
    except (OSError, KeyError, TypeError, AttributeError, ValueError) as error:
        raise ValueError(f"{folder} holds no run of training that has ended: {error}") from error
    if preset.algorithm == SEARCH and preset.world.task == MAP:
        measures = {"touched": rewards.mean(axis=1)}
    else:
        ended = np.minimum(decision_seconds(preset) * lengths, preset.world.seconds)  # which may cut a decision short
        seconds = np.median(ended, axis=1)
        measures = {"reward": rewards.mean(axis=1), "median_seconds": seconds}
    return Run(preset, preset.world.hold * decisions, measures)
