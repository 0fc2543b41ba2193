"""Measure the observer between its brackets: accuracy, pose error and map, per shape and noise, over many trials.

Writes to --out: trials.csv (one row for each trial and observer, with all that is needed to run it again),
summary.csv and evaluate.png; with --ablation ablation.csv and ablation.png instead of the latter, with --calibration
also calibration.csv and a picture for each observer. The same command goes on where it was stopped.
"""

from __future__ import annotations

import argparse
import multiprocessing
import signal
import sys
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import Executor, ProcessPoolExecutor, as_completed
from concurrent.futures.process import BrokenProcessPool
from contextlib import contextmanager
from dataclasses import asdict, fields
from pathlib import Path
from typing import Any

import ablation
import calibration
import numba
from explore import Parser
from joblib import cpu_count
from report import print_report, save_picture, save_summary
from results import Results
from rich.console import Console
from rich.progress import BarColumn, MofNCompleteColumn, Progress, TextColumn, TimeElapsedColumn, TimeRemainingColumn
from tasks import MEASURES, Settings, Task, columns, exemplar_tasks, run_exemplar, run_trial, versions
from threadpoolctl import threadpool_limits

import agents
import haptic_env
from haptic_env import shapes, validate
from observer import OBSERVERS
from observer.classifiers import CLASSIFIERS
from observer.variants import ABLATION, VARIANTS

EXAMPLE = "example: python scripts/evaluate.py --shapes cube sphere --sigmas 3 5 --trials 20 --out out/two_shapes"
FIRST_SEED = 10_000  # below 1000 are the seeds that tuning may use
NAMERS = ("nearest_neighbour", "touched_nearest_neighbour")  # one-shot: the paper's, and what touch has added
WIDTH = 120  # of what is printed to a file
QUICK = {"sigmas": [3.0], "trials": 2, "seconds": 5.0, "exemplars": 1}


def prepare_worker() -> None:
    """A worker is one core's work; Ctrl-C is the business of whoever started it."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    numba.set_num_threads(1)
    threadpool_limits(1)


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
    add(
        "--trials",
        type=int,
        default=20,
        help="explorations for each shape and sigma (default 20: with four shapes names are known to ± 10 %%)",
    )
    add("--first-seed", type=int, default=FIRST_SEED, help=f"seed of the first trial (default {FIRST_SEED})")
    add(
        "--observers",
        nargs="+",
        default=list(OBSERVERS),
        help=f"default: {' '.join(OBSERVERS)}; or {', '.join(VARIANTS)}",
    )
    add("--ablation", action="store_true", help="haptic_slam with one idea changed at a time, in one table")
    add("--calibration", action="store_true", help="also pictures of how sure each observer is and may be")
    add("--policy", default="random_torque", help=f"{', '.join(agents.POLICIES)} (default random_torque)")
    add("--seconds", type=float, default=10.0, help="of each exploration (default 10)")
    add("--particles", type=int, default=200, help="of the observers that have any (default 200)")
    add("--exemplars", type=int, default=3, help="draws over which one-shot learning is averaged (default 3)")
    add(
        "--classifiers",
        nargs="+",
        default=list(NAMERS),
        help=f"of finished maps: {', '.join(CLASSIFIERS)} (default {' '.join(NAMERS)})",
    )
    add("--size-jitter", type=float, default=0.0, help="how the object's size varies, a fraction (default 0)")
    add("--position-jitter", type=float, default=0.0, help="how far it is off the grasp centre, in m (default 0)")
    add("--yaw-jitter", type=float, default=0.0, help="how far it is turned, in degrees (default 0)")
    add("--believed-sigma", type=float, default=1.0, help="the observers are told so many times sigma (default 1)")
    add("--jobs", type=int, default=cpu_count(), help="processes (default: one a core)")
    add("--out", default="out/evaluate", help="folder for the results (default out/evaluate)")
    quick = ", ".join(
        f"--{name} {' '.join(map(str, value)) if isinstance(value, list) else value}" for name, value in QUICK.items()
    )
    add("--quick", action="store_true", help=f"a first look in under two minutes: {quick}")
    given = parser.parse_args(arguments)
    if given.ablation:
        parser.set_defaults(observers=list(ABLATION))
    if given.quick:
        parser.set_defaults(**QUICK)
    given = parser.parse_args(arguments)
    try:
        told: dict[str, Any] = {}
        for each in fields(Settings):
            value = getattr(given, each.name)
            told[each.name] = tuple(value) if isinstance(value, list) else value
        given.settings = Settings(**told)
        given.sigmas = sorted(
            {validate.number("--sigmas", each, high=90.0, above=0.0, unit="degrees") for each in given.sigmas}
        )
        most = given.sigmas[-1] * given.settings.believed_sigma
        validate.number("--sigmas times --believed-sigma", most, high=90.0, above=0.0, unit="degrees")
        validate.integer("--trials", given.trials, 1, 100_000)
        validate.integer("--jobs", given.jobs, 1, 1024)
        if given.ablation and ABLATION[0] not in given.observers:
            raise ValueError(f"--ablation compares with {ABLATION[0]}, which is not among --observers")
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
    report(given, console)
    return code


def report(given: argparse.Namespace, console: Console) -> None:
    """Write and print what the table says."""
    table, namers = given.results.path, given.settings.namers
    save_summary(table, MEASURES, namers)
    written = [str(table), "summary.csv"]
    if given.ablation:
        ablation.save(table)
        ablation.print_table(table.parent / "ablation.csv", console)
        written += ["ablation.csv", "ablation.png"]
    else:
        save_picture(table, namers)
        print_report(table.parent / "summary.csv", console)
        written.append("evaluate.png")
    if given.calibration:
        written += calibration.save(table)
    console.print(f"Written: {', '.join(written)}", highlight=False)


if __name__ == "__main__":
    sys.exit(main())
