"""Let simulated people of known parameters answer, from courses of belief: tables as those of people.

Each trial takes one of the courses' repeats, every one once before any is taken again. The truth is in the columns
true_*, and subjects are called simulated. With --stop-at or --price they answer when they like, after --seconds at the
latest.
"""

from __future__ import annotations

import argparse
from pathlib import Path

import numpy as np
import pandas as pd

from haptic_env import validate
from haptic_lab.files import check_writable
from haptic_lab.people import options
from haptic_lab.people.models import Model
from haptic_lab.people.simulated import NAME, simulate, subject_of
from haptic_lab.people.trials import SEPARATORS, write_trials
from haptic_lab.sweeps.driver import WIDTH, progress_on
from haptic_lab.terminal import Parser, as_path, make_console, refuse

EXAMPLE = """examples: haptic-slam simulate --courses example --sigma 5 --memory-seconds 4 --lapse 0.05 --out table.csv
          haptic-slam simulate --courses example --subjects 20 --sigma 2 12 --lapse 0 0.1 --out twenty.csv"""


def parse(arguments: list[str] | None) -> argparse.Namespace:
    """Read and check the command line; ends the program with code 2 where it makes no sense. Nothing is written.

    Args:
        arguments: of the command line; None: those of this process.

    Returns:
        All options, `courses` themselves, and `model`, from whose ranges subjects are drawn.
    """
    parser = Parser(description=__doc__, epilog=EXAMPLE, formatter_class=argparse.RawDescriptionHelpFormatter)
    add = parser.add_argument
    options.add_courses(parser)
    options.add_ranges(parser, "(default: the ideal's; --sigma must be told)", without=())
    add("--subjects", type=int, default=1, help="how many (default 1)")
    add("--trials", type=int, default=300, help="of each subject (default 300)")
    add("--seconds", nargs="+", type=float, help="when they are asked (default: five times)")
    add("--seed", type=int, default=0, help=options.SEED)
    add("--out", type=as_path, required=True, metavar="FILE", help="the table, .csv or .tsv")
    given = parser.parse_args(arguments)
    try:
        validate.seed(given.seed)
        validate.integer("--subjects", given.subjects, 1, 100_000)
        validate.integer("--trials", given.trials, 1, 1_000_000)
        validate.choice("ending of --out", Path(given.out).suffix.lower(), SEPARATORS)
        check_writable("--out", Path(given.out))
        ranges = options.ranges_of(given)
        if "sigma_deg" not in ranges:
            parser.error("--sigma must be told: a value, or a least and a largest one, degrees")
        given.courses = options.read_courses(given.courses, given.observer)
        given.model = Model("simulated", given.courses, (), ranges)
        given.seconds = options.seconds_of(given.seconds, given.courses)
    except (ValueError, OSError) as error:
        parser.error(options.in_flags(str(error)))
    return given


def main(arguments: list[str] | None = None) -> int:
    """Run the command.

    Args:
        arguments: of the command line; None: those of this process.

    Returns:
        Its exit code.
    """
    given = parse(arguments)
    console, rng, tables = make_console(WIDTH), np.random.default_rng(given.seed), []
    try:
        with progress_on(console) as progress:
            for number in progress.track(range(given.subjects), description="subjects"):
                values = {name: grid.drawn(rng) for name, grid in given.model.grids.items()}
                subject, name = subject_of(values), NAME.format(number + 1)
                tables.append(simulate(given.courses, subject, given.trials, given.seconds, rng, name=name))
    except ValueError as error:
        refuse(str(error))
    table = pd.concat(tables, ignore_index=True)
    write_trials(table, given.out)
    right = float((table["object"] == table["response"]).mean())
    subjects = validate.counted(given.subjects, "simulated subject")
    trials = validate.counted(given.trials, "trial")
    told = f"{subjects}, {trials}{' each' if given.subjects > 1 else ''}, {right:.0%} right"
    console.print(f"{told}: {given.out}", highlight=False)
    return 0
