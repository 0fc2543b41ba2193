"""Draw the figures of the paper, and those beyond it.

Each is written to --out as PNG and PDF, with its data as CSV beside it (the film also as GIF). One sweep of trials, in
--out/trials, feeds figure6, confusion, time_course, pose_error and reliability. pose_error also shows the Kalman filter
and the smoother, of the same explorations but without maps, in --out/poses. figure2, figure4, figure5 and film show
single explorations, kept in --out/explorations. The same command goes on where it was stopped.
"""

from __future__ import annotations

import argparse
import os
from collections.abc import Iterable, Iterator, Mapping
from contextlib import ExitStack
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import gymnasium as gym
import matplotlib
import pandas as pd
from joblib import cpu_count
from rich.console import Console

from haptic_env import hand_of, shapes, validate
from haptic_lab.analysis.summary import SLAM, parts
from haptic_lab.figures import FIGURES, FROM_EXPLORATIONS, FROM_TRIALS, PaperFigure, pose_error, save
from haptic_lab.figures.explorations import ShownExploration, file_of, read, run_shown_explorations
from haptic_lab.figures.figure6 import TITLES
from haptic_lab.figures.paper_figure import PRINT
from haptic_lab.folder_lock import claimed
from haptic_lab.style import styled
from haptic_lab.sweeps import options
from haptic_lab.sweeps.driver import WIDTH, make_files, progress_on, run, sweep
from haptic_lab.sweeps.executors import workers
from haptic_lab.sweeps.measures import COURSE_SECONDS, COURSES, HISTOGRAMS, MEASURES
from haptic_lab.sweeps.plan import SweepPlan
from haptic_lab.sweeps.results import KEY, Results
from haptic_lab.sweeps.tasks import STREAM, SweepTask
from haptic_lab.terminal import Parser, as_path, make_console, refuse
from haptic_lab.warm_up import get_ready

EXAMPLE = """examples: haptic-slam figures --out out/figures
          haptic-slam figures figure5 film --seed 3 --show-seconds 60 --out out/long
          haptic-slam figures figure6 confusion --trials-of out/evaluate"""
DEFAULTS: dict[str, Any] = {  # of the sweep; flags of evaluate.py
    "shapes": list(shapes.SHAPES),
    "scale": 1.0,
    "sigmas": [1.0, 2.0, 3.0, 4.0, 5.0],
    "trials": 72,
    "seconds": 10.0,
    "first_seed": 30_000,
    "exemplars": 5,
    "particles": 200,
    "policy": "random_torque",
    "env": "HapticSLAM/TwoFinger-v0",
    "observers": ["floor", "haptic_slam", "ceiling"],
    "classifiers": [name for name in TITLES if name != STREAM],
    "jobs": cpu_count(),
}
PaperFigures = Iterator[tuple[str, PaperFigure]]
POSE = "pose_error"  # also has trials of its own
QUICK = {"sigmas": [1.0, 3.0, 5.0], "trials": 2, "seconds": 3.0, "exemplars": 1, "show_seconds": 3.0}


@dataclass(frozen=True)
class FiguresPlan:
    """What the command line asks for.

    Attributes:
        names: of the figures.
        out: folder for them.
        seed: of the explorations that are shown.
        show_seconds: how long these are.
        trials_of: folder of a sweep that is there already.
        sweep: what `haptic-slam evaluate` makes of the flags of the trials, which explorations have too.
        poses: the sweep of observers without maps; None where it is not needed.
    """

    names: tuple[str, ...]
    out: Path
    seed: int
    show_seconds: float
    trials_of: str | None
    sweep: SweepPlan
    poses: SweepPlan | None

    @property
    def sweeps(self) -> list[SweepPlan]:
        """Those that are run."""
        if self.trials_of is not None or not any(name in FROM_TRIALS for name in self.names):
            return []
        return [self.sweep] if self.poses is None else [self.sweep, self.poses]


def parse(arguments: list[str] | None) -> FiguresPlan:
    """Read and check the command line; ends the program with code 2 where it makes no sense. Nothing is written.

    Args:
        arguments: of the command line; None: those of this process.

    Returns:
        What is drawn.
    """
    parser = Parser(description=__doc__, epilog=EXAMPLE, formatter_class=argparse.RawDescriptionHelpFormatter)
    add = parser.add_argument
    add("names", nargs="*", metavar="NAME", help=f"which figures (default all): {', '.join(FIGURES)}")
    add("--out", type=as_path, default="out/figures", help="folder for the figures (default out/figures)")
    add("--shapes", nargs="+", type=as_path, help="what is explored, and the candidates (default all)")
    add("--scale", type=float, help="metres that the unit of a mesh file is long (default 1)")
    add("--sigmas", nargs="+", type=float, help="noise of the sweep, SD in degrees (default 1 2 3 4 5)")
    add("--trials", type=int, help="explorations of the sweep for each shape and sigma (default 72, the paper's)")
    add("--seconds", type=float, help="of an exploration of the sweep (default 10, the paper's)")
    add("--first-seed", type=int, help="seed of its first trial (default 30000)")
    add("--exemplars", type=int, help="draws over which one-shot learning is averaged (default 5)")
    add("--observers", nargs="+", help=f"of the sweep (default {' '.join(DEFAULTS['observers'])})")
    add("--trials-of", type=as_path, metavar="FOLDER", help="take the trials of this sweep of evaluate.py instead")
    add("--seed", type=int, default=0, help="of the explorations that are shown (default 0)")
    add("--show-seconds", type=float, default=30.0, help="how long they are (default 30, the paper's)")
    add("--particles", type=int, help="of the observer (default 200)")
    add("--policy", type=as_path, help="as evaluate.py's (default random_torque)")
    add("--trust", action="store_true", help="as evaluate.py's")
    add("--env", help="as evaluate.py's")
    add("--jobs", type=int, help="processes of this machine (default: one a core)")
    add("--cluster", metavar="ADDRESS", help="run on the workers of this dask scheduler instead (docs/clusters.md)")
    quick = ", ".join(f"--{name.replace('_', '-')} {_told(value)}" for name, value in QUICK.items())
    add("--quick", action="store_true", help=f"a first look: {quick}")
    parser.set_defaults(**DEFAULTS)
    given = parser.parse_args(arguments)
    if given.quick:
        parser.set_defaults(**QUICK)
        given = parser.parse_args(arguments)
    told = {name: getattr(given, name) for name in DEFAULTS} | {"out": str(Path(given.out) / "trials")}
    if given.cluster is not None:
        told["cluster"] = given.cluster
    sweep = options.check_values(told, trust=given.trust)
    out, names = Path(given.out), tuple(dict.fromkeys(given.names)) or FIGURES
    try:
        for name in names:
            validate.choice("figure", name, FIGURES)
        validate.integer("--seed", given.seed, 0, 2**32 - 1)
        validate.number("--show-seconds", given.show_seconds, 0.0, 3600.0, above=0.0, unit="s")
        if given.trials_of is None and "time_course" in names:
            validate.number("--seconds (of time_course)", sweep.conditions[0].seconds, COURSE_SECONDS, 3600.0, unit="s")
        if given.trials_of is not None and not os.path.isfile(Path(given.trials_of) / "trials.csv"):
            refuse(f"--trials-of must be a folder of evaluate.py, with trials.csv in it, got {given.trials_of!r}")
    except ValueError as error:
        refuse(str(error))
    poses = None
    if given.trials_of is None and POSE in names and {"kalman", "smoother"}.isdisjoint(given.observers):
        own = {"observers": [pose_error.SMOOTHER], "classifiers": [], "out": str(out / "poses")}
        poses = options.check_values(told | own, trust=given.trust)
    return FiguresPlan(names, out, given.seed, given.show_seconds, given.trials_of, sweep, poses)


def _told(value: Any) -> str:
    return " ".join(map(str, value)) if isinstance(value, list) else str(value)


def explorations(plan: FiguresPlan, names: Iterable[str], console: Console) -> PaperFigures:
    """Explore what scenes show and is not there yet, then draw them one by one.

    Args:
        plan: of the figures.
        names: of the scenes.
        console: says how far it is.

    Yields:
        Name and figure.
    """
    sweep, folder = plan.sweep, plan.out / "explorations"
    settings = replace(sweep.settings, observers=(SLAM,), classifiers=(), exemplars=1, first_seed=0)
    condition = replace(sweep.conditions[0], seconds=plan.show_seconds)

    def place(shape: str, sigma: float) -> tuple[Path, SweepTask]:
        task = SweepTask(settings, replace(condition, sigma_deg=sigma), shape, plan.seed)
        return file_of(folder, task), task

    def find(shape: str, sigma: float) -> ShownExploration:
        return read(place(shape, sigma)[0])

    wanted = {name: FROM_EXPLORATIONS[name].wanted(settings.shapes) for name in names}
    tasks = dict(place(*each) for several in wanted.values() for each in several)
    hand = hand_of(gym.make(settings.env))
    if not all(path.exists() for path in tasks):
        if sweep.cluster is None:
            get_ready(console, hand, load=False)
        with progress_on(console) as progress, workers(sweep.jobs, sweep.cluster) as team:
            console.print(f"Run by {team.told}", highlight=False)
            make_files(team, progress, "explorations", run_shown_explorations, tasks)
    for name, several in wanted.items():
        yield name, FROM_EXPLORATIONS[name].draw(several, find, hand)


def trials(
    plan: FiguresPlan, tables: Mapping[SweepPlan, Results], names: Iterable[str], console: Console
) -> PaperFigures:
    """Run a sweep, or take the one that there is, then draw what is said of it one by one.

    Args:
        plan: of the figures.
        tables: of the plans of sweeps.
        names: of the figures.
        console: says how far it is.

    Yields:
        Name and figure.

    Raises:
        ValueError: for trials that the figures cannot show.
    """
    folder = Path(plan.trials_of) if plan.trials_of is not None else _swept(plan.sweep, tables, console)
    rows = _read(folder)
    if len(list(parts(rows))) > 1:
        raise ValueError(f"the trials of {folder} vary in more than sigma; a figure shows no more")
    if SLAM not in set(rows["observer"]):
        raise ValueError(f"the trials of {folder} are without the observer {SLAM}, which figures are about")
    for name in names:
        own = [_read(_swept(plan.poses, tables, console))] if name == POSE and plan.poses else []
        yield name, FROM_TRIALS[name](pd.concat([rows, *own]))


def _swept(plan: SweepPlan, tables: Mapping[SweepPlan, Results], console: Console) -> Path:
    """The folder of the sweep `plan`, with all of its trials."""
    results = tables[plan]
    try:
        sweep(plan, results, console)
    finally:
        results.rewrite()
    return results.folder


def _read(folder: Path) -> pd.DataFrame:
    """The trials of a sweep; raises `ValueError` for a table that is cut off, or is not that of a sweep."""
    table = folder / "trials.csv"
    if not table.read_bytes().endswith(b"\n"):
        raise ValueError(f"{table} is cut off in its last line; run its sweep again, which mends it")
    rows = pd.read_csv(table)
    missing = [name for name in (*KEY, *MEASURES, *HISTOGRAMS, *COURSES, "candidates") if name not in rows]
    if missing:
        raise ValueError(f"{table} is no table of evaluate.py, or of another version: it has no {', '.join(missing)}")
    if rows.empty:
        raise ValueError(f"{table} has no trials yet")
    wrong = [name for name in MEASURES if not pd.api.types.is_numeric_dtype(rows[name])]
    if wrong:
        raise ValueError(f"{table} is corrupt: not all are numbers in {', '.join(wrong)}")
    if rows.duplicated([*KEY]).any():
        lines = ", ".join(str(index + 2) for index in rows.index[rows.duplicated([*KEY])][:5])
        raise ValueError(f"{table} has trials more than once, first in lines {lines}; delete one of each")
    return rows


@styled
def main(arguments: list[str] | None = None) -> int:
    """Run the command.

    Args:
        arguments: of the command line; None: those of this process.

    Returns:
        Its exit code.
    """
    plan = parse(arguments)
    console = make_console(WIDTH)
    tables: dict[SweepPlan, Results] = {}

    def drawn() -> PaperFigures:
        shown, counted = ([name for name in plan.names if name in each] for each in (FROM_EXPLORATIONS, FROM_TRIALS))
        if shown:
            yield from explorations(plan, shown, console)
        if counted:
            yield from trials(plan, tables, counted, console)

    def work() -> None:
        with matplotlib.rc_context(PRINT):
            for name, figure in drawn():
                console.print(f"Written: {', '.join(save(figure, name, plan.out))}", highlight=False)

    with ExitStack() as stack:
        for folder in (plan.out, *(Path(each.out) for each in plan.sweeps)):
            stack.enter_context(claimed(folder))
        tables |= {each: options.open_results(each) for each in plan.sweeps}
        (plan.out / "explorations").mkdir(exist_ok=True)
        return run(work, console)
