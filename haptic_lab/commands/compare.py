"""Say which observer explains a subject best, by answers that each was not told of (leave-one-out cross-validation).

A model may be NAME=FILE: an ideal observer of other courses, under a name of its own. --recovery N simulates N subjects
of each model, asked as those of the table were, to say how far these models can be told apart at all. Writes to --out:
compare.csv (a row for each subject and model; differences from the best, nats a trial, with their 95 % intervals),
compare.png, and with --recovery recovery.csv.
"""

from __future__ import annotations

import argparse
from pathlib import Path

import pandas as pd

from haptic_env import validate
from haptic_lab.files import write_csv, write_table
from haptic_lab.folder_lock import claimed
from haptic_lab.people import compare_report, fit_report, options
from haptic_lab.people.comparing import check_models, compare, recoveries, recovery_table
from haptic_lab.people.models import ASKED
from haptic_lab.style import styled
from haptic_lab.sweeps.driver import WIDTH, progress_on
from haptic_lab.terminal import Parser, as_path, make_console, refuse

EXAMPLE = """examples: haptic-slam compare example --courses example
          haptic-slam compare answers.csv --courses out/people --models ideal memory floor=out/people --recovery 20"""
USUAL = ("ideal", "memory", "noise", "lapse")


def parse(arguments: list[str] | None) -> argparse.Namespace:
    """Read and check the command line; ends the program with code 2 where it makes no sense. Nothing is written.

    Args:
        arguments: of the command line; None: those of this process.

    Returns:
        All options, `models`, and `tables`, the trials of each subject by name.
    """
    parser = Parser(description=__doc__, epilog=EXAMPLE, formatter_class=argparse.RawDescriptionHelpFormatter)
    add = parser.add_argument
    options.add_trials(parser)
    options.add_courses(parser)
    add("--models", nargs="+", default=USUAL, metavar="MODEL", help=f"of {', '.join(ASKED)}, or NAME=FILE")
    options.add_ranges(parser, "(default: all that can be told)")
    add("--recovery", type=int, metavar="N", help="also simulate N subjects of each model, and find their models")
    options.add_draws(parser)
    add("--out", type=as_path, default="out/compare", help="folder for the results (default out/compare)")
    given = parser.parse_args(arguments)
    try:
        options.check_draws(given)
        if given.recovery is not None:
            validate.integer("--recovery", given.recovery, 1, 10_000)
        table = options.read_table(given)
        ranges = options.ranges_of(given)
        courses = options.read_courses(given.courses, given.observer, given.standard)
        given.models = [options.model_of(each, courses, ranges, given.standard, offered=ASKED) for each in given.models]
        check_models(given.models)
        given.tables = options.by_subject(table, given.models)
        given.asked = sorted(set(table["seconds"]))
        given.trials = round(float(table.groupby("subject").size().median()))
    except (ValueError, OSError) as error:
        parser.error(options.in_flags(str(error)))
    return given


@styled
def main(arguments: list[str] | None = None) -> int:
    """Run the command.

    Args:
        arguments: of the command line; None: those of this process.

    Returns:
        Its exit code.
    """
    given = parse(arguments)
    out, console = Path(given.out), make_console(WIDTH)
    names = [model.name for model in given.models]
    with claimed(out, compare_report.FILES):
        options.tell(given.models, console)
        parts, recovered = [], []
        try:
            with progress_on(console) as progress:
                for name in progress.track(given.tables, description="subjects"):
                    found = compare(given.models, given.tables[name], draws=given.draws, seed=given.seed).table()
                    parts.append(found.assign(subject=name))
                if given.recovery is not None:
                    told = recoveries(
                        given.models, given.trials, given.asked, given.recovery, draws=given.draws, seed=given.seed
                    )
                    total = given.recovery * len(names)
                    recovered = list(progress.track(told, total=total, description="simulated subjects"))
        except ValueError as error:
            refuse(str(error))
        table = pd.concat(parts, ignore_index=True)
        table = table[["subject", *(column for column in table if column != "subject")]]
        compare_report.tell(table, console)
        best = table.groupby("subject", sort=False)["nats"].max()
        chance = fit_report.chance_of(given.models[0].courses)
        if guessed := list(best.index[best < chance]):
            console.print(f"note: {fit_report.worse_than_guesses(guessed, chance)}", highlight=False)
        for note in fit_report.unheeded(given.tables, given.models):
            console.print(f"note: {note}", highlight=False)
        recovery = recovery_table(recovered, names) if recovered else None
        written = write_table(out, "compare", table, compare_report.picture(table, recovery))
        if recovery is not None:
            compare_report.tell_recovery(recovery, given.trials, console)
            write_csv(out / "recovery.csv", recovery)
            written.append("recovery.csv")
        console.print(f"Written: {', '.join(str(out / each) for each in written)}", highlight=False)
    return 0
