"""Measure the observer between its brackets over many trials: every combination of noises, policies and durations.

Writes to --out: trials.csv (one row for each trial and observer, with all that is needed to run it again),
summary.csv and evaluate.png, with the floor among the observers also against_floor.csv (differences to it in the same
explorations, and closures, with their intervals); with --ablation ablation.csv and ablation.png instead of
evaluate.png, with --calibration also calibration.csv and a picture for each observer, with --maps-every
names_through_time.csv and .png, with several policies also policies.csv and policies.png, which compare them. Where
more than sigma varies, pictures stand in a folder for each combination. The same command goes on where it was
stopped.
"""

from __future__ import annotations

from pathlib import Path

import pandas as pd
from rich.console import Console

from haptic_lab.analysis import ablation, against, novelty, policy_comparison, reliability, through_time
from haptic_lab.analysis.summary import FLOOR, parts, print_report, save_picture, summarise
from haptic_lab.files import write_csv
from haptic_lab.folder_lock import claimed
from haptic_lab.people.studies.naming import name_objects
from haptic_lab.style import styled
from haptic_lab.sweeps.driver import WIDTH, run, sweep
from haptic_lab.sweeps.measures import MEASURES
from haptic_lab.sweeps.meshes import MESHES
from haptic_lab.sweeps.meshes import TITLES as OF_MESHES
from haptic_lab.sweeps.options import check, open_results
from haptic_lab.sweeps.plan import SweepPlan
from haptic_lab.sweeps.results import Results
from haptic_lab.sweeps.worker import run_trials
from haptic_lab.terminal import make_console

AGAINST = "against_floor.csv"
FILES = ("config.json", "trials.csv", "summary.csv", "evaluate.png", AGAINST)
MOST_PARTS = 24  # combinations with pictures of their own: people's trials may last as many times as there are


@styled
def main(arguments: list[str] | None = None) -> int:
    """Run the command.

    Args:
        arguments: of the command line; None: those of this process.

    Returns:
        Its exit code.
    """
    plan = check(__doc__, arguments)
    with claimed(Path(plan.out), FILES):
        results = open_results(plan)
        console = make_console(WIDTH)
        work = name_objects if plan.settings.names_only else run_trials
        code = run(lambda: sweep(plan, results, console, work), console)
        return run(lambda: report(plan, results, console), console) or code


def report(plan: SweepPlan, results: Results, console: Console) -> None:
    """Put the table in order, and write and print what it says.

    Args:
        plan: of the sweep.
        results: its table, which may hold a part of the trials.
        console: to print to.
    """
    results.rewrite()
    if not results.trials:
        return
    table, settings = results.path, plan.settings
    written, summaries = [str(table), "summary.csv"], []
    all_rows = pd.read_csv(table, converters={"condition": str})
    if settings.recordings:
        console.print("Recordings are replayed: contacts are simulated with the objects that --shapes names.")
    combinations = list(parts(all_rows))
    for name, rows in combinations:
        of_novelty = [novelty.summarise(rows)] if settings.none else []
        told = (*MEASURES, *(MESHES if settings.meshes else ()), *(("new_correct",) if settings.none else ()))
        summaries.append(pd.concat([summarise(rows, told, settings.namers), *of_novelty]))
        if len(combinations) > MOST_PARTS:
            continue
        folder = _part(table.parent, name, console)
        labels = rows[[f"p_{label}" for label in settings.labels]].notna().any().sum()  # of this recording, say
        chance = 1.0 / max(1, labels)
        if plan.ablation:
            names = ablation.save(rows, folder)
            ablation.print_table(folder / "ablation.csv", console)
        else:
            save_picture(summaries[-1], settings.namers, chance, folder)
            print_report(summaries[-1], console, names_first=plan.cells is not None or bool(settings.names_only))
            if settings.meshes:
                print_report(summaries[-1], console, titles=OF_MESHES)
            names = ["evaluate.png"]
        if settings.maps_every is not None:
            lines = through_time.curves(rows, settings.classifiers, settings.maps_every)
            names += through_time.save(lines, chance, folder)
            through_time.print_table(lines, console)
        if plan.calibration:
            names += reliability.save(rows, folder)
        written += [str(Path(name, each)) for each in names]
    if all_rows["policy"].nunique() > 1:
        for name, rows in parts(all_rows, together=("sigma_deg", "policy")):
            folder = _part(table.parent, name, console)
            written += [str(Path(name, each)) for each in policy_comparison.save(rows, folder)]
            policy_comparison.print_table(folder / "policies.csv", console)
    write_csv(table.parent / "summary.csv", pd.concat(summaries))
    if FLOOR in {*all_rows["observer"]} and all_rows["observer"].nunique() > 1 and len(combinations) <= MOST_PARTS:
        gaps = against.compare(all_rows, [*MEASURES, *MESHES, *(f"{namer}_correct" for namer in settings.namers)])
        write_csv(table.parent / AGAINST, gaps)
        against.print_table(gaps, console)
        written.append(AGAINST)
    if len(combinations) > MOST_PARTS:
        console.print(f"Pictures are made of {MOST_PARTS} combinations at most; these are {len(combinations)}")
    console.print(f"Written: {', '.join(written)}", highlight=False)


def _part(folder: Path, name: str, console: Console) -> Path:
    """Where the part `name` of a table is told of, under a heading; "" is the whole."""
    place = folder / name
    place.mkdir(exist_ok=True)
    if name:
        console.rule(name)
    return place
