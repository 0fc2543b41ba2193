"""Say how many trials a subject must do so that two observers can be told apart.

Subjects of each are simulated, with parameters drawn from the ranges; the power is the share of them whom the true one
explains best (leave-one-out cross-validation), of the observer with the lower share. Who is simulated explores as one
half of the courses' repeats did, and is fitted by the other. A model may be NAME=FILE: an ideal observer of other
courses. Writes design.csv and design.png to --out.
"""

from __future__ import annotations

import argparse
from pathlib import Path

from haptic_env import validate
from haptic_lab.files import write_table
from haptic_lab.folder_lock import claimed
from haptic_lab.people import compare_report, options
from haptic_lab.people.comparing import check_models
from haptic_lab.people.designing import ROUNDS, design
from haptic_lab.people.models import ASKED
from haptic_lab.style import styled
from haptic_lab.sweeps.driver import WIDTH, progress_on
from haptic_lab.terminal import Parser, as_path, make_console, refuse

EXAMPLE = """examples: haptic-slam design ideal memory --courses example --memory-seconds 0.5 2 --rounds 40
          haptic-slam design ideal floor=out/people --courses out/people --sigma 2 10 --seconds 1 2 5"""
FILES = ("design.csv", "design.png")


def parse(arguments: list[str] | None) -> argparse.Namespace:
    """Read and check the command line; ends the program with code 2 where it makes no sense. Nothing is written.

    Args:
        arguments: of the command line; None: those of this process.

    Returns:
        All options, and `models`.
    """
    parser = Parser(description=__doc__, epilog=EXAMPLE, formatter_class=argparse.RawDescriptionHelpFormatter)
    add = parser.add_argument
    add("models", nargs=2, metavar="MODEL", help=f"the two observers, of {', '.join(ASKED)}, or NAME=FILE")
    options.add_courses(parser)
    options.add_ranges(parser, "(default: all that can be told)")
    add("--seconds", nargs="+", type=float, help="when subjects are asked (default: five times)")
    add("--power", nargs="+", type=float, default=[0.8, 0.95], help="shares to be told rightly (default 0.8 0.95)")
    add("--most", type=int, default=1000, help="trials that a subject can do (default 1000)")
    add("--rounds", type=int, default=ROUNDS, help=f"subjects of each observer (default {ROUNDS})")
    add("--seed", type=int, default=0, help=options.SEED)
    add("--out", type=as_path, default="out/design", help="folder for the results (default out/design)")
    given = parser.parse_args(arguments)
    try:
        validate.seed(given.seed)
        validate.integer("--most", given.most, 20, 100_000)
        validate.integer("--rounds", given.rounds, 2, 100_000)
        for power in given.power:
            validate.number("--power", power, 0.5, 0.999)
        courses, ranges = options.read_courses(given.courses, given.observer), options.ranges_of(given)
        given.models = [options.model_of(each, courses, ranges, offered=ASKED) for each in given.models]
        check_models(given.models)
        given.seconds = options.seconds_of(given.seconds, courses)
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
    with claimed(out, FILES):
        options.tell(given.models, console)
        try:
            with progress_on(console) as progress:
                rounds = design(given.models, given.most, given.seconds, rounds=given.rounds, seed=given.seed)
                *_, result = progress.track(rounds, total=given.rounds, description="rounds")
        except ValueError as error:
            refuse(str(error))
        table = result.table()
        for power in given.power:
            trials, low, high = (f"{value:.0f}" if value < float("inf") else "more" for value in result.needed(power))
            told = f"more than {given.most}" if trials == "more" else trials
            console.print(f"Power {power:g}: {told} trials (95 % interval {low} to {high})", highlight=False)
        names = [model.name for model in given.models]
        written = write_table(out, "design", table, compare_report.design_picture(table, given.power, names))
        console.print(f"Written: {', '.join(str(out / each) for each in written)}", highlight=False)
    return 0
