"""Measure the observer between its brackets: accuracy, pose error and map, per shape and noise, over many trials.

Writes to --out: trials.csv (one row for each trial and observer, with all that is needed to run it again),
summary.csv and evaluate.png. The same command goes on where it was stopped.
"""

from __future__ import annotations

import argparse
import hashlib
import importlib.metadata
import multiprocessing
import platform
import signal
import sys
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import Executor, ProcessPoolExecutor, as_completed
from concurrent.futures.process import BrokenProcessPool
from contextlib import contextmanager
from dataclasses import asdict, dataclass
from functools import lru_cache
from pathlib import Path
from typing import Any
from zipfile import BadZipFile

import gymnasium as gym
import numba
import numpy as np
from explore import Parser
from files import atomic
from joblib import cpu_count  # type: ignore[import-untyped]
from report import print_report, save_report
from results import KEY, Results
from rich.console import Console
from rich.progress import BarColumn, MofNCompleteColumn, Progress, TextColumn, TimeElapsedColumn, TimeRemainingColumn
from threadpoolctl import threadpool_limits  # type: ignore[import-untyped]
from trial import Account, Exploration, Trial, make_observers

import agents
import haptic_env
import observer as observer_package
from haptic_env import shapes, validate
from observer import OBSERVERS, ShapePosterior, metrics
from observer.classifiers import CLASSIFIERS, MapClassifier

EXAMPLE = "example: python scripts/evaluate.py --shapes cube sphere --sigmas 3 5 --trials 20 --out out/two_shapes"
FIRST_SEED = 10_000  # below 1000 are the seeds that tuning may use
WIDTH = 120  # of what is printed to a file
EXEMPLAR_SEED = 2_000_000_000
STREAM = "shape_posterior"  # the name of what names the object from the whole stream of beliefs
NAMERS = (STREAM, *CLASSIFIERS)
PACKAGES = ("haptic-slam", "gymnasium", "mujoco", "numba", "numpy", "scipy", "scikit-learn")
QUICK = {"sigmas": [3.0], "trials": 2, "seconds": 5.0, "exemplars": 1}
MEASURES = (
    "pose_error_online_deg",
    "pose_error_lagged_deg",
    "pose_error_touching_deg",
    "coverage_90",
    "coverage_90_lagged",
    *(f"surface_{what}_{n}" for n in (1, 2) for what in ("precision", "recall", "f_score")),
    "surface_coverage",
    "occupancy_ece",
    "occupancy_brier",
    "touching_share",
    "n_eff",
    "time_to_decision",
    "step_accuracy",
)


@dataclass(frozen=True)
class Settings:
    """What is the same for all trials of a table."""

    env: str
    policy: str
    seconds: float
    particles: int
    shapes: tuple[str, ...]
    observers: tuple[str, ...]
    exemplars: int
    first_seed: int

    def __post_init__(self) -> None:
        validate.choice("--env", self.env, haptic_env.ENVIRONMENTS)
        validate.choice("--policy", self.policy, agents.POLICIES)
        validate.number("--seconds", self.seconds, 0.0, 3600.0, above=0.0, unit="s")
        validate.integer("--particles", self.particles, 1, 100_000)
        validate.integer("--exemplars", self.exemplars, 1, 1000)
        validate.integer("--first-seed", self.first_seed, 0, EXEMPLAR_SEED - 1)
        for what, given, valid in (("shape", self.shapes, shapes.SHAPES), ("observer", self.observers, OBSERVERS)):
            for name in given:
                validate.choice(f"--{what}s", name, valid)
            if len(set(given)) < len(given):
                raise ValueError(f"--{what}s must name each {what} once, got {', '.join(given)}")


@dataclass(frozen=True)
class Task:
    """One exploration: a trial, or an exemplar that is kept as a map."""

    settings: Settings
    shape: str
    sigma_deg: float
    seed: int
    folder: Path

    @property
    def exemplar_path(self) -> Path:
        """Where the maps of an exemplar are kept."""
        return self.folder / "exemplars" / f"sigma{self.sigma_deg!r}_{self.shape}_{self.seed}.npz"


# In a worker


def prepare_worker() -> None:
    """A worker is one core's work; Ctrl-C is the business of whoever started it."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    numba.set_num_threads(1)
    threadpool_limits(1)


def explore(task: Task, naming: bool) -> tuple[Exploration, dict[str, Account]]:
    """Run the exploration of `task`."""
    settings = task.settings
    env = gym.make(
        settings.env,
        shape=task.shape,
        sigma_deg=task.sigma_deg,
        episode_seconds=settings.seconds,
        reveal_truth=True,
    )
    observers = make_observers(settings.observers, env.unwrapped.hand, task.sigma_deg, settings.particles)  # type: ignore[attr-defined]
    posterior = shape_posterior(settings.env, settings.shapes)
    trial = Trial(env, settings.policy, observers, posterior, task.seed, naming=None if naming else ())
    for _ in trial:
        pass
    env.close()
    return trial.finish()


@lru_cache(maxsize=4)
def shape_posterior(env_id: str, names: tuple[str, ...]) -> ShapePosterior:
    """The namer whose candidates are `names`, each at its default size at the grasp centre."""
    hand = gym.make(env_id).unwrapped.hand  # type: ignore[attr-defined]
    return ShapePosterior(hand, {name: [shapes.make(name, position=hand.grasp_centre)] for name in names})


def run_exemplar(task: Task) -> None:
    """Explore once and keep the map that each observer ends with."""
    _, accounts = explore(task, naming=False)
    maps: dict[str, Any] = {name: account.belief.occupancy for name, account in accounts.items()}
    with atomic(task.exemplar_path) as place:
        np.savez_compressed(place, **maps)


def run_trial(task: Task) -> list[dict[str, Any]]:
    """Explore once; a row for each observer."""
    exploration, accounts = explore(task, naming=True)
    truth = exploration.true_angles
    touching = exploration.contacts.any(axis=1)
    touched = metrics.touched_places(exploration.hand, truth, exploration.contacts, exploration.solid)
    grid = accounts[task.settings.observers[0]].belief.grid
    cells = metrics.reachable(exploration.hand, truth, grid)
    occupied = exploration.solid.occupancy(grid)
    rows = []
    for name, account in accounts.items():
        occupancy = account.belief.occupancy
        calibration = metrics.reliability(occupancy, occupied, cells)
        row: dict[str, Any] = {
            "sigma_deg": task.sigma_deg,
            "shape": task.shape,
            "seed": task.seed,
            "observer": name,
            "pose_error_online_deg": metrics.pose_rmse_deg(account.joint_angles, truth),
            "pose_error_lagged_deg": metrics.pose_rmse_deg(account.lagged_joint_angles, truth),
            "pose_error_touching_deg": metrics.pose_rmse_deg(account.lagged_joint_angles[touching], truth[touching]),
            "coverage_90": metrics.credible_coverage(account.joint_angles, account.joint_std, truth),
            "coverage_90_lagged": metrics.credible_coverage(
                account.lagged_joint_angles, account.lagged_joint_std, truth
            ),
            "surface_coverage": metrics.surface_coverage(occupancy, grid, exploration.solid),
            "occupancy_ece": calibration.ece,
            "occupancy_brier": calibration.brier,
            "touching_share": float(touching.mean()),
            "n_eff": float(account.n_eff.mean()),
            "time_to_decision": metrics.time_to_decision(exploration.seconds, account.posterior),
            "step_accuracy": float((account.posterior.argmax(axis=1) == account.labels.index(task.shape)).mean()),
        }
        for n in (1, 2):
            score = metrics.surface_score(occupancy, grid, exploration.solid, touched, n)
            row |= {f"surface_{what}_{n}": value for what, value in score._asdict().items()}
        row |= {f"p_{label}": float(p) for label, p in zip(account.labels, account.posterior[-1], strict=True)}
        named = {STREAM: [account.name]}
        for namer in CLASSIFIERS:
            fitted = classifiers(namer, name, task.settings, task.sigma_deg, task.folder)
            named[namer] = [each.predict(occupancy) for each in fitted]
        for namer, names in named.items():
            row[namer] = " ".join(names)
            row[f"{namer}_correct"] = float(np.mean([each == task.shape for each in names]))
        rows.append(row | constants(task.settings))
    return rows


@lru_cache(maxsize=128)
def classifiers(namer: str, observer: str, settings: Settings, sigma_deg: float, folder: Path) -> list[MapClassifier]:
    """The classifier `namer`, fitted once on each draw of the observer's exemplars."""
    names = list(settings.shapes)
    fitted = []
    for draw in exemplar_tasks(settings, sigma_deg, folder):
        maps = []
        for task in draw:
            try:
                with np.load(task.exemplar_path) as kept:
                    maps.append(kept[observer])
            except (OSError, ValueError, KeyError, EOFError, BadZipFile) as error:
                raise ValueError(f"{task.exemplar_path} is corrupt ({error}); delete it and run again") from error
        fitted.append(CLASSIFIERS[namer]().fit(maps, names))
    return fitted


# In the program itself


def exemplar_tasks(settings: Settings, sigma_deg: float, folder: Path) -> list[list[Task]]:
    """For each draw, one exploration of each shape, of seeds that no trial has."""
    count = len(settings.shapes)
    return [
        [
            Task(settings, shape, sigma_deg, EXEMPLAR_SEED + draw * count + index, folder)
            for index, shape in enumerate(settings.shapes)
        ]
        for draw in range(settings.exemplars)
    ]


@lru_cache
def constants(settings: Settings) -> dict[str, str]:
    """What every row says of how it was made."""
    told = {
        name: " ".join(value) if isinstance(value, tuple) else str(value) for name, value in asdict(settings).items()
    }
    told = {("candidates" if name == "shapes" else name): value for name, value in told.items()}
    return told | versions()


@lru_cache
def versions() -> dict[str, str]:
    """What the figures may depend on: packages, interpreter, and a digest of this project's own code."""
    digest = hashlib.sha256()
    for package in (haptic_env, observer_package, agents):
        root = Path(str(package.__file__)).parent
        for path in sorted(root.rglob("*.py")):
            digest.update(path.relative_to(root).as_posix().encode() + path.read_bytes())
    found = {f"version_{name}": importlib.metadata.version(name) for name in PACKAGES}
    return found | {"version_python": platform.python_version(), "code": digest.hexdigest()[:12]}


def columns(settings: Settings) -> tuple[list[str], list[str]]:
    """The columns of the table, and those that hold numbers."""
    correct = [f"{namer}_correct" for namer in NAMERS]
    numbers = [*MEASURES, *(f"p_{shape}" for shape in settings.shapes), *correct]
    return [*KEY, *numbers, *NAMERS, *constants(settings)], [*numbers, "sigma_deg", "seed"]


@contextmanager
def workers(jobs: int) -> Iterator[Executor]:
    """`jobs` processes; where anything goes wrong, Ctrl-C included, they end at once."""
    executor = ProcessPoolExecutor(jobs, multiprocessing.get_context("spawn"), prepare_worker)
    try:
        yield executor
        executor.shutdown()
    except BaseException:
        executor.shutdown(wait=False, cancel_futures=True)
        for child in multiprocessing.active_children():
            child.terminate()
        raise


def parse(arguments: list[str] | None) -> argparse.Namespace:
    """Read and check the command line; ends the program with code 2 where it makes no sense."""
    parser = Parser(description=__doc__, epilog=EXAMPLE, formatter_class=argparse.RawDescriptionHelpFormatter)
    add = parser.add_argument
    add("--env", default="HapticSLAM/TwoFinger-v0", help=f"one of {', '.join(haptic_env.ENVIRONMENTS)}")
    add("--shapes", nargs="+", default=list(shapes.SHAPES), help="what is explored, and the candidates (default all)")
    add("--sigmas", nargs="+", type=float, default=[1.0, 3.0, 5.0], help="noise, SD in degrees (default 1 3 5)")
    add("--trials", type=int, default=20, help="explorations for each shape and sigma (default 20)")
    add("--first-seed", type=int, default=FIRST_SEED, help=f"seed of the first trial (default {FIRST_SEED})")
    add("--observers", nargs="+", default=list(OBSERVERS), help="default: all")
    add("--policy", default="random_torque", help=f"{', '.join(agents.POLICIES)} (default random_torque)")
    add("--seconds", type=float, default=10.0, help="of each exploration (default 10)")
    add("--particles", type=int, default=200, help="of haptic_slam (default 200)")
    add("--exemplars", type=int, default=3, help="draws over which one-shot learning is averaged (default 3)")
    add("--jobs", type=int, default=cpu_count(), help="processes (default: one a core)")
    add("--out", default="out/evaluate", help="folder for the results (default out/evaluate)")
    quick = ", ".join(
        f"--{name} {' '.join(map(str, value)) if isinstance(value, list) else value}" for name, value in QUICK.items()
    )
    add("--quick", action="store_true", help=f"a first look in under two minutes: {quick}")
    given = parser.parse_args(arguments)
    if given.quick:
        parser.set_defaults(**QUICK)
        given = parser.parse_args(arguments)
    try:
        given.settings = Settings(
            given.env,
            given.policy,
            given.seconds,
            given.particles,
            tuple(given.shapes),
            tuple(given.observers),
            given.exemplars,
            given.first_seed,
        )
        given.sigmas = sorted(
            {validate.number("--sigmas", each, high=90.0, above=0.0, unit="degrees") for each in given.sigmas}
        )
        validate.integer("--trials", given.trials, 1, 100_000)
        validate.integer("--jobs", given.jobs, 1, 1024)
        given.folder = Path(given.out)
        (given.folder / "exemplars").mkdir(parents=True, exist_ok=True)
        config = asdict(given.settings) | versions()
        given.results = Results(given.folder, config, *columns(given.settings), given.settings.observers)
    except ValueError as error:
        parser.error(str(error))
    except OSError as error:
        parser.error(f"--out must be a folder that can be written to: {error}")
    return given


def sweep(given: argparse.Namespace, console: Console) -> None:
    """Run what is not in the table yet."""
    settings, results = given.settings, given.results
    trials = [
        Task(settings, shape, sigma, given.settings.first_seed + number, given.folder)
        for sigma in given.sigmas
        for number in range(given.trials)
        for shape in settings.shapes
    ]
    missing = [task for task in trials if (task.sigma_deg, task.shape, task.seed) not in results.trials]
    noises = sorted({task.sigma_deg for task in missing})
    exemplars = [task for sigma in noises for draw in exemplar_tasks(settings, sigma, given.folder) for task in draw]
    exemplars = [task for task in exemplars if not task.exemplar_path.exists()]
    if len(missing) < len(trials):
        console.print(f"{len(trials) - len(missing)} of {len(trials)} trials are in {results.path} already")
    shown = (TextColumn("{task.description}"), BarColumn(), MofNCompleteColumn(), TimeElapsedColumn())
    progress = Progress(*shown, TextColumn("left"), TimeRemainingColumn(), console=console)
    with progress, workers(given.jobs) as executor:
        bar = progress.add_task("exemplars", total=len(exemplars))
        for _ in as_results(executor, run_exemplar, exemplars):
            progress.advance(bar)
        bar = progress.add_task("trials", total=len(missing))
        for rows in as_results(executor, run_trial, missing):
            if any(row["code"] != versions()["code"] for row in rows):
                raise ValueError("the code was changed while the sweep ran; its trials would not belong together")
            results.append(rows)
            progress.advance(bar)


def as_results(executor: Executor, work: Callable[[Task], Any], tasks: Sequence[Task]) -> Iterator[Any]:
    """What `work` returns for each of `tasks`, in the order in which they finish."""
    for future in as_completed([executor.submit(work, task) for task in tasks]):
        yield future.result()


def main(arguments: list[str] | None = None) -> int:
    """Run the command; returns its exit code."""
    given = parse(arguments)
    console = Console() if sys.stdout.isatty() else Console(width=WIDTH)
    code = 0
    try:
        sweep(given, console)
    except KeyboardInterrupt:
        console.print("Stopped; every finished trial is kept, and the same command goes on from here.")
        code = 130
    except BrokenProcessPool:
        console.print(
            "A worker died (out of memory?); every finished trial is kept, the same command goes on from here."
        )
        code = 1
    except ValueError as error:
        console.print(f"{error}. Every trial that finished before is kept.", style="red")
        code = 1
    given.results.rewrite()
    if not given.results.trials:
        return code
    save_report(given.results.path, MEASURES, NAMERS)
    print_report(given.folder / "summary.csv", console)
    console.print(f"Rows, summary and picture: {given.results.path}, summary.csv, evaluate.png", highlight=False)
    return code


if __name__ == "__main__":
    sys.exit(main())
