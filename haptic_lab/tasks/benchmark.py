"""Policies × tasks: learners learn, all are judged in the same worlds, and every row is kept as it comes."""

from __future__ import annotations

import time
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
from rich.console import Console

import agents
from haptic_env import hand_of, registration, validate
from haptic_lab.files import part_of_name, write_csv, write_json
from haptic_lab.learning.explored import unobserved
from haptic_lab.sweeps.driver import progress_on
from haptic_lab.sweeps.executors import local_workers
from haptic_lab.tasks import judging, learners
from haptic_lab.tasks.judging import DECISION, measured
from haptic_lab.tasks.learners import END_TO_END, LEARNERS
from haptic_lab.tasks.registry import TASKS, world_of
from haptic_lab.tasks.worlds import evaluation_set
from haptic_lab.worlds import environment

MADE_BY_HAND = ("random_torque", "synergy", "enclosure", "contour_following", "coverage", "information_gain")
POLICIES = (*MADE_BY_HAND, "trained", "searched", "reflexes", *LEARNERS)
TRIALS, CONFIG, MODELS = "trials.csv", "config.json", "models"
KEY = ["task", "policy", "world"]
EVERY = 5.0  # s, from one writing of the table to the next


@dataclass(frozen=True)
class Benchmark:
    """What is held against each other.

    Attributes:
        tasks: of `TASKS`.
        policies: of `POLICIES` or `agents.POLICIES`, or paths of models.
        worlds: of each task's evaluation, the first ones.
        steps: of the environment that each learner learns from.
        hand: that explores.
        trust: whether models may run code when they are read.
        wrist: how the hand is held; None: as it usually is.

    Raises:
        ValueError: for an unknown hand, and a wrist that it has not.
    """

    tasks: tuple[str, ...]
    policies: tuple[str, ...]
    worlds: int
    steps: int
    hand: str
    trust: bool = False
    wrist: str | None = None

    def __post_init__(self) -> None:
        registration.check_wrist(environment(self.hand), self.wrist)

    def configuration(self) -> dict[str, Any]:
        """Say what rows of one table must have in common.

        Returns:
            What JSON can say.
        """
        sets = {task: evaluation_set(task) for task in TASKS}
        told = {task: {"version": each.version, "sha256": each.sha256} for task, each in sets.items()}
        held = {} if self.wrist is None else {"wrist": self.wrist}  # of which tables from before do not tell
        return {"hand": self.hand, **held, "steps": self.steps, "worlds": told}


def check(plan: Benchmark) -> None:
    """Check the policies, as far as it is the same for every task.

    Args:
        plan: what is asked for.

    Raises:
        ValueError: for an unknown policy, or a model that cannot be read, or is not to be trusted.
        ImportError: for a model that needs what is not installed.
    """
    for policy in plan.policies:
        if policy in LEARNERS:
            continue
        if agents.is_model(policy):
            agents.find(policy, "--policies")
            agents.load_model(policy, trust=plan.trust)
        else:
            validate.choice("--policies", policy, dict.fromkeys((*POLICIES, *agents.POLICIES)))


def entries(plan: Benchmark) -> tuple[list[tuple[str, str]], dict[tuple[str, str], str]]:
    """Find which policies can act in which tasks.

    Args:
        plan: what is asked for.

    Returns:
        Pairs of task and policy, and why others are left out.
    """
    found, left = [], {}
    for task in plan.tasks:
        for policy in plan.policies:
            if policy in LEARNERS:
                if learners.learns(policy, TASKS[task]):
                    found.append((task, policy))
                continue
            try:
                judging.check(policy, task, plan.hand, plan.trust, plan.wrist)
                found.append((task, policy))
            except ValueError as error:
                left[task, policy] = " ".join(str(error).split())
    return found, left


def run(plan: Benchmark, out: Path, jobs: int, console: Console) -> tuple[pd.DataFrame, dict[tuple[str, str], str]]:
    """Run what is not done yet.

    Args:
        plan: what is held against each other.
        out: folder, whose rows are kept.
        jobs: processes.
        console: shows how it goes.

    Returns:
        The rows, one for each task, policy and world, and why policies were left out of tasks.

    Raises:
        ValueError: for a folder whose table is none, and where nothing is left to judge.
    """
    pairs, left = entries(plan)
    for (task, policy), why in left.items():
        console.print(f"{policy} is left out of {task}: {why}", style="yellow", highlight=False, soft_wrap=True)
    if not pairs:
        raise ValueError("no policy can act in any of these tasks")
    write_json(out / CONFIG, plan.configuration())
    rows = read(out / TRIALS)
    done = {(row["task"], row["policy"], int(row["world"])) for row in rows}
    with progress_on(console) as progress:
        for task, policy in pairs:
            path = model_path(out, task, policy)
            if policy in LEARNERS and not path.exists():
                bar = progress.add_task(f"{policy} learns {task}", total=plan.steps)
                world = world_of(task, plan.hand, plan.wrist)
                learners.train(policy, world, plan.steps, path, lambda now, bar=bar: progress.advance(bar, now))  # type: ignore[misc]
        bar = progress.add_task("explorations", total=len(pairs) * plan.worlds)
        calls = [
            (task, index, policy, plan.hand, plan.trust, str(model_path(out, task, policy)), plan.wrist)
            for index in range(plan.worlds)
            for task, policy in pairs
            if index < evaluation_set(task).count
        ]
        asked = [call for call in calls if (call[0], call[2], call[1]) not in done]
        progress.advance(bar, len(calls) - len(asked))
        written = time.monotonic()
        try:
            for row in _run(asked, jobs):
                rows.append(row)
                progress.advance(bar)
                if time.monotonic() - written > EVERY:
                    _write(out, rows)
                    written = time.monotonic()
        finally:
            _write(out, rows)
    table = pd.DataFrame(rows)
    asked_for = [(row["task"], row["policy"]) in pairs and row["world"] < plan.worlds for row in rows]
    order = {pair: place for place, pair in enumerate(pairs)}
    mine = table[asked_for]
    places = [order[pair] for pair in zip(mine["task"], mine["policy"], strict=True)]
    return mine.iloc[np.argsort(places, kind="stable")], left


def model_path(out: Path, task: str, policy: str) -> Path:
    """Say where the weights of a learner are.

    Args:
        out: folder of the results.
        task: that it has learnt.
        policy: its name, or the path of a model.

    Returns:
        The path of its file, or of the model.
    """
    if agents.is_model(policy):
        return Path(policy)
    return out / MODELS / f"{part_of_name(task)}_{part_of_name(policy)}.npz"


def judged(
    task: str, index: int, policy: str, hand: str, trust: bool, model: str, wrist: str | None = None
) -> dict[str, Any]:
    """Judge one policy in one world: what a worker does.

    Args:
        task: of `TASKS`.
        index: of the world.
        policy: its name, or the path of a model.
        hand: that explores.
        trust: whether a model may run code when it is read.
        model: path of what a learner has learnt.
        wrist: how the hand is held; None: as it usually is.

    Returns:
        The row.
    """
    worlds = evaluation_set(task)
    if policy in END_TO_END:
        joints = hand_of(unobserved(world_of(task, hand, wrist))).joints
        return judging.guessed(worlds, index, hand, policy, learners.acting(policy, Path(model), joints), wrist)
    row = judging.judge(worlds, index, model if policy in LEARNERS else policy, hand, trust, wrist)
    return row | {"policy": policy}


def read(path: Path) -> list[dict[str, Any]]:
    """Read the rows of a run that was stopped.

    Args:
        path: of the table; there need be none.

    Returns:
        The rows.

    Raises:
        ValueError: for a table of something else.
    """
    if not path.exists():
        return []
    try:
        table = pd.read_csv(path)
        _check(table)
    except (ValueError, OSError) as error:
        raise ValueError(f"{path} is no table of this command: {error}; choose another --out") from error
    rows: list[Any] = table.to_dict("records")
    return rows


def _check(table: pd.DataFrame) -> None:
    """Raise `ValueError` unless each row is a whole one of this command; without a decision is whole."""
    if not set(KEY) <= set(table) or not set(table["task"]) <= set(TASKS) or table[KEY].isna().any(axis=None):
        raise ValueError(f"it must have the columns {', '.join(KEY)}, with tasks of {', '.join(TASKS)}")
    broken = table.duplicated(KEY)
    for task, mine in table.groupby("task"):
        shares = [each for each in measured(TASKS[str(task)]) if each != DECISION]
        numbers = mine.reindex(columns=["world", *shares]).apply(pd.to_numeric, errors="coerce")
        whole = numbers["world"].isin(range(evaluation_set(str(task)).count))
        for share in shares:
            whole &= numbers[share].between(0.0, 1.0)
        broken[mine.index] |= ~whole
    if broken.any():
        raise ValueError(f"line {int(np.argmax(broken)) + 2} is broken, or there twice")


def _run(calls: list[tuple[Any, ...]], jobs: int) -> Iterator[dict[str, Any]]:
    if jobs == 1:
        for call in calls:
            yield judged(*call)
        return
    with local_workers(jobs) as workers:
        yield from workers.run(judged, calls)


def _write(out: Path, rows: list[dict[str, Any]]) -> None:
    if rows:
        order = {name: index for index, name in enumerate(TASKS)}
        table = pd.DataFrame(rows)
        table["order"] = table["task"].map(order)
        write_csv(out / TRIALS, table.sort_values(["order", "policy", "world"]).drop(columns="order"))
