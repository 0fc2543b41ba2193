"""Do an experiment with the observers that was done with people: a preset's stimuli, hand and task in one command.

Prints what was published, with its source, beside what the observers do, and what does not fit. Explorations are those
of haptic-slam evaluate, but that observers only name: trials.csv of each condition, in trials, and the same command
goes on where it was stopped. Writes to --out: study.csv (thresholds or shares, with 95 % intervals), study.png,
published.csv, and of a discrimination counts.csv, the right answers to each stimulus. --adaptive lets QUEST+ choose the
stimuli, for one observer, and writes adaptive.csv (thresholds) and answers.csv (each trial) instead.
"""

from __future__ import annotations

import argparse
from pathlib import Path
from typing import Any

import pandas as pd
from rich.console import Console

from haptic_env import extras, validate
from haptic_lab.files import write_csv
from haptic_lab.folder_lock import claimed
from haptic_lab.people.studies import adaptive, presets, report, running
from haptic_lab.people.studies.presets import DISCRIMINATION, Study
from haptic_lab.style import styled
from haptic_lab.sweeps.driver import WIDTH, run
from haptic_lab.terminal import Parser, as_path, make_console
from haptic_lab.warm_up import get_ready

EXAMPLE = """examples: haptic-slam study --list
          haptic-slam study aspect_ratio --sigmas 0.5 1 2 3 5 8
          haptic-slam study size --adaptive --trials 60 --sigmas 3
          haptic-slam study mine.toml --out out/mine"""
SLAM = "haptic_slam"
SWEPT = ("sigmas", "seconds", "policy", "observers", "trials", "first_seed", "courses", "jobs", "cluster")


def parse(arguments: list[str] | None) -> argparse.Namespace:
    """Read and check the command line; ends the program with code 2 where it makes no sense. Nothing is written.

    Args:
        arguments: of the command line; None: those of this process.

    Returns:
        All options, `study` the experiment, None with --list, and `plans` its conditions.
    """
    parser = Parser(description=__doc__, epilog=EXAMPLE, formatter_class=argparse.RawDescriptionHelpFormatter)
    add = parser.add_argument
    add("name", nargs="?", type=as_path, metavar="NAME", help=f"{', '.join(presets.names())}, or a TOML file")
    add("--list", action="store_true", help="say what studies there are, and what was published")
    add("--sigmas", nargs="+", type=float, help="noise, SD in degrees (default: the study's)")
    add("--seconds", nargs="+", type=float, help="of an exploration (default: the study's)")
    add("--policy", nargs="+", type=as_path, help="of exploration (default: the study's)")
    add("--observers", nargs="+", help="as haptic-slam evaluate's (default: the study's)")
    add("--trials", type=int, help=f"explorations of each stimulus (default: the study's; adaptive {adaptive.TRIALS})")
    add("--first-seed", type=int, help="seed of the first trial (default: the study's)")
    add("--adaptive", action="store_true", help="find thresholds by QUEST+, of one observer")
    add(
        "--trials-of",
        type=as_path,
        metavar="FOLDER",
        help="explore nothing: report what is in this --out of another run",
    )
    switch = argparse.BooleanOptionalAction
    add("--courses", action=switch, help="also what is believed of every name each 0.1 s, for decision models to fit")
    add("--jobs", type=int, help="processes of this machine (default: one a core)")
    add("--cluster", metavar="ADDRESS", help="run on the workers of this dask scheduler instead (docs/clusters.md)")
    add("--out", type=as_path, help="folder for the results (default out/studies/NAME)")
    given = parser.parse_args(arguments)
    given.study = None
    if given.list:
        return given
    if given.name is None:
        parser.error(f"name a study: {', '.join(presets.names())}, or a TOML file; --list tells of them")
    try:
        given.study = study = presets.read(given.name)
        given.out = given.out or str(Path("out", "studies", study.name))
        said = {name: value for name in SWEPT if (value := getattr(given, name)) is not None}
        needed = ["questplus"] if given.adaptive else ["psignifit"] if study.task == DISCRIMINATION else []
        for package in needed:
            extras.folder(package, "people", "a threshold")
        if given.adaptive:
            _check_adaptive(given, said)
        _check_kept(given.trials_of, study)
        given.plans = running.plan(study, said, Path(given.out))
    except (ValueError, ImportError, OSError) as error:
        parser.error(str(error))
    return given


def _check_adaptive(given: argparse.Namespace, said: dict[str, Any]) -> None:
    study: Study = given.study
    if study.task != DISCRIMINATION:
        raise ValueError(f"--adaptive finds thresholds, and {study.name} asks for names")
    if given.trials_of is not None or given.cluster is not None:
        raise ValueError("--adaptive decides after each answer what is felt next: not with --trials-of or --cluster")
    said["trials"] = adaptive.TRIALS if given.trials is None else given.trials
    observers = [*said.get("observers", study.sweep.get("observers", []))] or [SLAM]
    said["observers"] = observers[:1] if "observers" in said or SLAM not in observers else [SLAM]


def _check_kept(folder: str | None, study: Study) -> None:
    if folder is None:
        return
    tables = _kept(folder, study)
    if not any(map(Path.is_file, tables.values())):
        raise ValueError(f"--trials-of must be the --out of a study {study.name}, got {folder!r}")
    running.read_tables(tables)


def _kept(folder: str, study: Study) -> dict[str, Path]:
    return {each.name: running.place_of(each.name, Path(folder)) / "trials.csv" for each in study.conditions}


@styled
def main(arguments: list[str] | None = None) -> int:
    """Run the command.

    Args:
        arguments: of the command line; None: those of this process.

    Returns:
        Its exit code.
    """
    given = parse(arguments)
    console = make_console(WIDTH)
    if given.study is None:
        console.print(report.listed([presets.read(name) for name in presets.names()]))
        return 0
    study, out = given.study, Path(given.out)
    with claimed(out, report.FILES):
        report.tell(study, console)
        if given.adaptive:
            return run(lambda: _adapt(given, console), console)
        code = 0
        if given.trials_of is None:
            code = run(lambda: running.explore(given.plans, console), console)
        tables = _kept(given.trials_of or given.out, study)
        return run(lambda: _report(study, tables, out, console), console) or code


def _report(study: Study, tables: dict[str, Path], out: Path, console: Console) -> None:
    written = report.save(study, running.read_tables(tables), out, console)
    console.print(f"Written: {', '.join(str(out / each) for each in written)}", highlight=False)


def _adapt(given: argparse.Namespace, console: Console) -> None:
    study, out = given.study, Path(given.out)
    get_ready(console, given.plans[0].sweep.settings.make_hand())
    answers, found = [], []
    for plan, results in running.one_by_one(given.plans, out, "adaptive"):
        (condition,), (observer,) = plan.sweep.conditions, plan.sweep.settings.observers
        stairs = adaptive.staircase(study, adaptive.observed(study, plan, results, observer), plan.sweep.trials)
        of_whom: dict[str, Any] = {"condition": plan.name, "observer": observer}
        of_whom |= {"seconds": condition.seconds, "sigma_deg": condition.sigma_deg}
        ends = {"threshold": stairs.threshold, "low": stairs.low, "high": stairs.high}
        found.append({**of_whom, **ends, "trials": len(stairs.values)})
        for number, (value, right) in enumerate(zip(stairs.values, stairs.answers, strict=True)):
            answers.append({**of_whom, "trial": number, "value": value, "correct": int(right)})
        after = validate.counted(len(stairs.values), "trial")
        told = f"{stairs.threshold:.4g} [{stairs.low:.4g}, {stairs.high:.4g}] after {after}"
        where = f"{plan.name}, σ = {condition.sigma_deg:g}°".removeprefix(", ")
        console.print(f"{observer}, {where}: threshold {told}", highlight=False)
    write_csv(out / "adaptive.csv", pd.DataFrame(found))
    write_csv(out / "answers.csv", pd.DataFrame(answers))
    console.print(f"Written: {out / 'adaptive.csv'}, {out / 'answers.csv'}", highlight=False)
