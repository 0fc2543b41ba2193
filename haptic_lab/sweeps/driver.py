"""Runs a sweep: the trials and exemplars that are not in its results yet, over local or cluster workers."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from contextlib import AbstractContextManager
from pathlib import Path
from typing import Any

from rich.console import Console
from rich.progress import BarColumn, MofNCompleteColumn, Progress, TextColumn, TimeElapsedColumn, TimeRemainingColumn

from haptic_lab.conditions import Condition
from haptic_lab.files import atomic
from haptic_lab.progress import ProgressLines
from haptic_lab.sweeps.executors import workers
from haptic_lab.sweeps.plan import SweepPlan
from haptic_lab.sweeps.provenance import versions
from haptic_lab.sweeps.results import Results
from haptic_lab.sweeps.tasks import SweepTask, bundles, exemplar_tasks
from haptic_lab.sweeps.worker import prepare, run_exemplars, run_trials
from haptic_lab.sweeps.workers import Workers, WorkersLostError
from haptic_lab.warm_up import get_ready, told_on

WIDTH = 120  # of what is printed to a file


def sweep(
    plan: SweepPlan,
    results: Results,
    console: Console,
    work: Callable[..., list[list[dict[str, Any]]]] = run_trials,
    who: AbstractContextManager[Workers] | None = None,
) -> None:
    """Run what is not in the table yet.

    Args:
        plan: of the sweep.
        results: its table.
        console: shows how it goes.
        work: makes rows of a bundle of trials.
        who: runs it; None: the workers that `plan` asks for.

    Raises:
        ValueError: where the code was changed while the sweep ran.
    """
    settings, folder = plan.settings, results.folder / "exemplars"
    trials = [
        SweepTask(settings, condition, shape, settings.first_seed + number)
        for condition in plan.conditions
        for number in range(plan.trials)
        for shape in plan.explored(condition)
    ]
    missing = [task for task in trials if task.key not in results.trials]
    if len(missing) < len(trials):
        console.print(f"{len(trials) - len(missing)} of {len(trials)} trials are in {results.path} already")
    if not missing:
        return
    if who is None and plan.cluster is None:
        get_ready(console, settings.make_hand(), load=False)
        with told_on(console):
            prepare(settings)
    conditions = list(dict.fromkeys(task.condition for task in missing))
    exemplars = [task for each in conditions for draw in exemplar_tasks(settings, each) for task in draw]
    with progress_on(console) as progress, who or workers(plan.jobs, plan.cluster) as team:
        console.print(f"Run by {team.told}", highlight=False)
        make_files(team, progress, "exemplars", run_exemplars, {_file(folder, task): task for task in exemplars})
        bar = progress.add_task("trials", total=len(missing))
        for trials_of_bundle in team.run(work, _calls(team, bundles(missing), folder)):
            for rows in trials_of_bundle:
                if any(row["code"] != versions()["code"] for row in rows):
                    raise ValueError("the code was changed while the sweep ran; its trials would not belong together")
                results.append(rows)
                progress.advance(bar)


def progress_on(console: Console) -> Progress:
    """Make bars with the time that is left.

    Args:
        console: to draw on.

    Returns:
        The bars, not yet shown.
    """
    shown = (TextColumn("{task.description}"), BarColumn(), MofNCompleteColumn(), TimeElapsedColumn())
    return ProgressLines(*shown, TextColumn("left"), TimeRemainingColumn(), console=console)


def make_files(
    team: Workers,
    progress: Progress,
    what: str,
    work: Callable[[Sequence[SweepTask]], list[tuple[SweepTask, bytes]]],
    tasks: Mapping[Path, SweepTask],
) -> None:
    """Make the files that are not there yet, bundle by bundle.

    Args:
        team: that works.
        progress: shows how it goes.
        what: the files are, for the bar.
        work: makes the content of the files of a bundle of tasks.
        tasks: by the path of the file of each.
    """
    missing = {task: path for path, task in tasks.items() if not path.exists()}
    bar = progress.add_task(what, total=len(missing))
    for made in team.run(work, [(bundle,) for bundle in bundles(missing)]):
        for task, content in made:
            with atomic(missing[task]) as place:
                place.write_bytes(content)
            progress.advance(bar)


def _file(folder: Path, task: SweepTask) -> Path:
    return folder / f"{task.name}.npz"


def _calls(team: Workers, trials: Iterable[tuple[SweepTask, ...]], folder: Path) -> Iterator[tuple[Any, ...]]:
    """Each bundle of trials with the exemplars of its conditions, which are read when their turn comes."""
    shared: dict[Condition, Any] = {}
    for bundle in trials:
        conditions = [task.condition for task in bundle]
        shared = {each: shared[each] for each in conditions if each in shared}
        for task in bundle:
            if task.condition not in shared:
                draws = exemplar_tasks(task.settings, task.condition)
                files = [[_file(folder, each) for each in draw] for draw in draws]
                content = tuple(tuple((each.name, each.read_bytes()) for each in draw) for draw in files)
                shared[task.condition] = team.share(content)
        yield bundle, *(shared[each] for each in conditions)


def run(work: Callable[[], None], console: Console) -> int:
    """Do something that keeps each finished trial, and say what stopped it.

    Args:
        work: to be done.
        console: says what stopped it.

    Returns:
        Exit code.
    """
    try:
        work()
    except KeyboardInterrupt:
        console.print("Stopped; every finished trial is kept, and the same command goes on from here.")
        return 130
    except WorkersLostError as error:
        console.print(f"Stopped: {error}. Every finished trial is kept, and the same command goes on from here.")
        return 1
    except (ValueError, OSError) as error:
        console.print(f"{error}. Every trial that finished before is kept.", style="red")
        return 1
    return 0
