"""Draw the figures of the paper, and those beyond it.

Each is written to --out as PNG and PDF, with its data as CSV beside it (the film also as GIF). One sweep of trials, in
--out/trials, feeds figure6, confusion, time_course, pose_error and reliability. pose_error also shows the Kalman filter
and the smoother, of the same explorations but without maps, in --out/poses, and figure6 the paper's own recursion, of
the first of them, in --out/paper. offsets has a sweep of its own, with bias and drift, in --out/noises. figure2,
figure4, figure5 and film show single explorations, kept in --out/explorations. The same command goes on where it was
stopped.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping
from contextlib import ExitStack
from dataclasses import replace
from pathlib import Path

import matplotlib
import pandas as pd
from rich.console import Console

from haptic_lab.analysis.summary import SLAM, parts
from haptic_lab.conditions import UNTOLD
from haptic_lab.figures import FROM_EXPLORATIONS, FROM_NOISES, FROM_TRIALS, PaperFigure, offsets, save
from haptic_lab.figures import plan as plans
from haptic_lab.figures.explorations import ShownExploration, file_of, read, run_shown_explorations
from haptic_lab.figures.paper_figure import KINDS, PRINT
from haptic_lab.figures.plan import DEFAULTS as DEFAULTS
from haptic_lab.figures.plan import NAMES, POSE, FiguresPlan
from haptic_lab.folder_lock import claimed
from haptic_lab.style import styled
from haptic_lab.sweeps import options
from haptic_lab.sweeps.driver import WIDTH, make_files, progress_on, run, sweep
from haptic_lab.sweeps.executors import workers
from haptic_lab.sweeps.measures import COURSES, HISTOGRAMS, MEASURES
from haptic_lab.sweeps.plan import SweepPlan
from haptic_lab.sweeps.results import KEY, Results
from haptic_lab.sweeps.tasks import SweepTask
from haptic_lab.terminal import make_console
from haptic_lab.warm_up import get_ready

PaperFigures = Iterator[tuple[str, PaperFigure]]


def parse(arguments: list[str] | None) -> FiguresPlan:
    """Read and check the command line; ends the program with code 2 where it makes no sense. Nothing is written.

    Args:
        arguments: of the command line; None: those of this process.

    Returns:
        What is drawn.
    """
    return plans.parse(__doc__, arguments)


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
    hand = settings.make_hand()
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
    more = {POSE: plan.poses, NAMES: plan.papers}
    for name in names:
        also = more.get(name)
        own = [] if also is None else [_read(_swept(also, tables, console))]
        yield name, FROM_TRIALS[name](pd.concat([rows, *own]))


def of_noises(
    plan: FiguresPlan, tables: Mapping[SweepPlan, Results], names: Iterable[str], console: Console
) -> PaperFigures:
    """Run the sweep of other noises, or take one that there is, then draw what is said of it one by one.

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
    folder = _swept(plan.noises, tables, console) if plan.noises is not None else Path(str(plan.trials_of))
    rows = _read(folder)
    if len(list(parts(rows, together=("sigma_deg", *offsets.KINDS)))) > 1:
        raise ValueError(f"the trials of {folder} vary in more than sigma, bias and drift; a figure shows no more")
    for name in names:
        yield name, FROM_NOISES[name](rows)


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
    key = [name for name in KEY if name not in UNTOLD or name in rows]
    missing = [name for name in (*key, *MEASURES, *HISTOGRAMS, *COURSES, "candidates") if name not in rows]
    if missing:
        raise ValueError(f"{table} is no table of evaluate.py, or of another version: it has no {', '.join(missing)}")
    if rows.empty:
        raise ValueError(f"{table} has no trials yet")
    wrong = [name for name in MEASURES if not pd.api.types.is_numeric_dtype(rows[name])]
    if wrong:
        raise ValueError(f"{table} is corrupt: not all are numbers in {', '.join(wrong)}")
    if rows.duplicated(key).any():
        lines = ", ".join(str(index + 2) for index in rows.index[rows.duplicated(key)][:5])
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
        kinds = (FROM_EXPLORATIONS, FROM_TRIALS, FROM_NOISES)
        shown, counted, noisy = ([name for name in plan.names if name in each] for each in kinds)
        if shown:
            yield from explorations(plan, shown, console)
        if counted:
            yield from trials(plan, tables, counted, console)
        if noisy:
            yield from of_noises(plan, tables, noisy, console)

    def work() -> None:
        with matplotlib.rc_context(PRINT):
            for name, figure in drawn():
                console.print(f"Written: {', '.join(save(figure, name, plan.out))}", highlight=False)

    with ExitStack() as stack:
        stack.enter_context(claimed(plan.out, [f"{name}.{kind}" for name in plan.names for kind in (*KINDS, "gif")]))
        for each in plan.sweeps:
            stack.enter_context(claimed(Path(each.out)))
        tables |= {each: options.open_results(each) for each in plan.sweeps}
        (plan.out / "explorations").mkdir(exist_ok=True)
        return run(work, console)
