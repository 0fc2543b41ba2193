"""A population search: candidates explore the same objects, and the next are drawn about those that did best.

The search is separable CMA-ES (Ros & Hansen 2008, PPSN) of the library `cmaes`. Shapes: K weights, P candidates.

A checkpoint is what the candidates of each generation were worth: told again, the search is where it was, bit for bit.
"""

from __future__ import annotations

import time
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import cmaes
import gymnasium as gym
import numpy as np
from rich.console import Console

import agents
from agents.network import Network
from agents.sb3 import Trained, is_model, load_model
from haptic_env import hand_env, reading
from haptic_env.arrays import Array
from haptic_lab.files import atomic
from haptic_lab.learning.candidates import Judge, Outcome, doubts
from haptic_lab.learning.evaluation import BEST, EVALUATION_SEED, EVALUATIONS, OF_EVALUATIONS, read_evaluations
from haptic_lab.learning.explored import explored
from haptic_lab.learning.finger_weights import FingerWeights
from haptic_lab.learning.interrupt import InterruptGuard, stopped
from haptic_lab.learning.presets import NAME, Preset
from haptic_lab.learning.report import report
from haptic_lab.learning.rhythm_gains import RhythmGains
from haptic_lab.progress import ProgressLines
from observer.wrappers.belief_observation import labels_of

FIRST_SEED = 10_000_000  # of what candidates explore; what policies are reported on has seeds below
HISTORY = "search.npz"


@dataclass
class History:
    """What came of a search so far.

    Attributes:
        costs: (G, P) s, for how long the truth was in doubt, on average, of each generation's candidates.
        steps: of the environment, in all.
        seconds: that it took.
        best: mean doubt of the best in evaluation, s.
        kept: decisions before that evaluation.
        table: of evaluations, lists by the names of `OF_EVALUATIONS`.
    """

    costs: list[Array] = field(default_factory=list)
    steps: int = 0
    seconds: float = 0.0
    best: float = np.inf
    kept: int = 0
    table: dict[str, list[Any]] = field(default_factory=lambda: {name: [] for name in OF_EVALUATIONS})

    def write(self, out: Path) -> None:
        """Write it to a folder; each file whole or not at all.

        Args:
            out: the folder of the run.
        """
        with atomic(out / EVALUATIONS) as place, place.open("wb") as file:
            np.savez(file, allow_pickle=False, **{name: np.array(rows) for name, rows in self.table.items()})
        with atomic(out / HISTORY) as place, place.open("wb") as file:
            counters = np.array([self.steps, self.seconds, self.best, self.kept])
            np.savez(file, costs=np.array(self.costs) if self.costs else np.zeros((0, 0)), counters=counters)


def read_history(out: Path, population: int, hold: int) -> History:
    """Read what a run that was stopped has left.

    Args:
        out: its folder.
        population: P.
        hold: control steps of a decision, by which evaluations are counted.

    Returns:
        The history; an empty one where there is none. Evaluations after its last generation are forgotten.

    Raises:
        ValueError: for files that are not of such a run.
    """
    path = out / HISTORY
    if not path.exists():
        return History()
    try:
        kept = reading.npz(path)
        costs, (steps, seconds, best, decisions) = kept["costs"], kept["counters"].tolist()
        table = read_evaluations(out / EVALUATIONS)
        if (
            costs.shape not in ((len(costs), population), (0, 0))
            or not np.isfinite([*costs.ravel(), steps, seconds, decisions]).all()
        ):
            raise ValueError(f"costs must be finite, of shape (any, {population}), got {costs.dtype} {costs.shape}")
    except (OSError, KeyError, TypeError, ValueError) as error:
        raise ValueError(f"{path} is no search of {population} candidates: {error}; choose another --out") from error
    upto = table["timesteps"] <= steps // hold
    rows = {name: list(each[upto]) for name, each in table.items()}
    return History(list(costs), int(steps), float(seconds), float(best), int(decisions), rows)


@dataclass
class SearchRun:
    """What a search is made of, before it begins.

    Attributes:
        preset: how it searches.
        out: its folder.
        weights: that are searched.
        judge: lets candidates explore.
        history: what came of it so far.
        search: where it is.
    """

    preset: Preset
    out: Path
    weights: FingerWeights | RhythmGains
    judge: Judge
    history: History
    search: cmaes.SepCMA


def prepare(preset: Preset, jobs: int, out: Path, stop: InterruptGuard, console: Console) -> SearchRun:
    """Set up a search, from what a run that was stopped has left on. Where it raises, it has written nothing.

    Args:
        preset: how it searches.
        jobs: processes in which candidates explore; 1: this one.
        out: its folder.
        stop: tells of a Ctrl-C.
        console: says where it goes on.

    Returns:
        The run.

    Raises:
        ValueError: where the preset or what is in `out` makes no sense.
    """
    env = explored(preset.world)
    try:
        weights = _weights(env, preset)
    finally:
        env.close()
    history = read_history(out, preset.learner["population"], preset.world.hold)
    search = cmaes.SepCMA(
        np.zeros(weights.size),
        preset.learner["step"],
        seed=preset.seed,
        population_size=preset.learner["population"],
    )
    for costs in history.costs:
        search.tell(list(zip([search.ask() for _ in costs], costs.tolist(), strict=True)))
    if history.costs:
        console.print(f"Going on after {history.steps} steps")
    stop.check()
    return SearchRun(preset, out, weights, Judge(preset.world, jobs), history, search)


def _weights(env: gym.Env[Any, Any], preset: Preset) -> FingerWeights | RhythmGains:
    features, base = env.get_wrapper_attr("features"), hand_env(env)
    if preset.rhythm is None:
        labels = len(labels_of(env)) if preset.world.task == NAME else 0
        begin = preset.sweep if preset.begin is None else _begun(preset.begin)
        weights = FingerWeights(base.hand, features, labels, begin)
        if isinstance(begin, Network) and (held := begin.told.get("hold")) != preset.world.hold:
            raise ValueError(f"hold must be that of begin, {held}, got {preset.world.hold}")
        return weights
    seconds = preset.world.hold / base.control_hz
    return RhythmGains(base.hand, features, preset.rhythm, seconds, _told(preset))


def _begun(name: str) -> Network:
    """The weights that a search goes on with."""
    if not isinstance(name, str):
        raise ValueError(f"begin must be the name of a policy or a file, got {name!r}")
    policy = agents.find(name, "begin")
    path = policy.shipped if issubclass(policy, Trained) else name
    model = load_model(path) if is_model(path) else None
    if not isinstance(model, Network):
        raise ValueError(f"begin must be a policy of linear weights, got {name!r}")
    return model


def _told(preset: Preset) -> dict[str, Any]:
    """What whoever uses the model must know."""
    world = preset.world
    return {"env": world.env, "entries": list(world.observation), "hold": world.hold}


def train(ready: SearchRun, stop: InterruptGuard, console: Console) -> int:
    """Search to the end, and keep what came of it.

    Args:
        ready: the run.
        stop: tells of a Ctrl-C.
        console: shows how it goes.

    Returns:
        Exit code; 130 where Ctrl-C stopped it.
    """
    preset, history, out = ready.preset, ready.history, ready.out
    began, before, code = time.monotonic(), history.seconds, 0
    out.mkdir(parents=True, exist_ok=True)
    try:
        if not history.table["timesteps"]:
            _evaluate(ready)
            history.write(out)
        with ProgressLines(console=console) as progress:
            bar = progress.add_task("steps", total=preset.steps, completed=history.steps)
            while history.steps < preset.steps:
                turn = history.steps // preset.evaluate_every
                _generation(ready)
                stop.check()
                history.seconds = before + time.monotonic() - began
                if history.steps // preset.evaluate_every > turn or history.steps >= preset.steps:
                    _evaluate(ready)
                history.write(out)
                progress.update(bar, completed=history.steps)
    except KeyboardInterrupt:
        code = stopped(console)
    finally:
        ready.judge.close()
    _keep(ready, "model")
    versions = {"cmaes": cmaes.__version__}
    report(preset, history.steps, history.seconds, versions, out, console, history.kept)
    return code


def _generation(ready: SearchRun) -> None:
    """Ask for candidates, let all of them explore the same objects, and tell what they are worth."""
    preset, history, search = ready.preset, ready.history, ready.search
    population, worlds = preset.learner["population"], preset.learner["worlds"]
    candidates = [search.ask() for _ in range(population)]
    first = FIRST_SEED + preset.seed % 1000 * 1_000_000 + len(history.costs) * worlds
    made = [ready.weights.candidate(each) for each in candidates]
    outcomes = ready.judge.judge((each, first + world) for world in range(worlds) for each in made)
    costs = doubts(outcomes, (worlds, population)).mean(axis=0)
    search.tell(list(zip(candidates, costs.tolist(), strict=True)))
    history.costs.append(costs)
    history.steps += preset.world.hold * sum(each.decisions for each in outcomes)


def _evaluate(ready: SearchRun) -> None:
    """Let the mean of the search explore what is kept for that, and keep it where it is the best so far."""
    history, mean = ready.history, ready.weights.candidate(ready.search.mean)
    seeds = range(EVALUATION_SEED, EVALUATION_SEED + ready.preset.episodes)
    outcomes: list[Outcome] = ready.judge.judge(((mean, seed) for seed in seeds), held_out=True)
    _, *told = zip(*outcomes, strict=True)
    decisions = history.steps // ready.preset.world.hold
    for name, row in zip(OF_EVALUATIONS, (decisions, *told), strict=True):
        history.table[name].append(row)
    doubt = float(doubts(outcomes, (-1,)).mean())
    if doubt < history.best:
        history.best, history.kept = doubt, decisions
        _keep(ready, BEST)


def _keep(ready: SearchRun, name: str) -> None:
    weights, mean = ready.weights, ready.search.mean
    model = weights.candidate(mean) if isinstance(weights, RhythmGains) else weights.network(mean, _told(ready.preset))
    with atomic(ready.out / f"{name}.npz") as place:
        model.write(place)
