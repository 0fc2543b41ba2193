"""Find what limits a subject: fit an ideal observer with limits to a table of trials.

Each subject is fitted alone. The 95 % interval of a parameter is of its posterior, 2.5 % beyond each end; what is
probable beforehand is in fit.json. That courses have few repeats is in it. Writes to --out: fit.csv (a row for each
subject and parameter), predicted.csv (shares of right answers, given and expected, by object and time), fit.png,
fit.json.
"""

from __future__ import annotations

import argparse
from pathlib import Path

from haptic_lab.files import write_csv, write_json, write_table
from haptic_lab.folder_lock import claimed
from haptic_lab.people import fit_report, options
from haptic_lab.people.fitting import fit
from haptic_lab.people.models import MODELS, Model
from haptic_lab.people.predictions import predicted
from haptic_lab.style import styled
from haptic_lab.sweeps.driver import WIDTH, progress_on
from haptic_lab.terminal import Parser, as_path, make_console, refuse

EXAMPLE = """examples: haptic-slam fit example --courses example
          haptic-slam fit answers.csv --courses out/people --model memory --memory-seconds 0.5 10 --out out/fit"""


def parse(arguments: list[str] | None) -> argparse.Namespace:
    """Read and check the command line; ends the program with code 2 where it makes no sense. Nothing is written.

    Args:
        arguments: of the command line; None: those of this process.

    Returns:
        All options, `model`, and `tables`, the trials of each subject by name.
    """
    parser = Parser(description=__doc__, epilog=EXAMPLE, formatter_class=argparse.RawDescriptionHelpFormatter)
    add = parser.add_argument
    options.add_trials(parser)
    options.add_courses(parser)
    told = "; ".join(f"{name}: {', '.join(free)}" for name, free in MODELS.items())
    add("--model", default="limits", help=f"what is found: {told} (default limits)")
    options.add_ranges(parser, "(default: found within what can be told)")
    options.add_draws(parser)
    add("--out", type=as_path, default="out/fit", help="folder for the results (default out/fit)")
    given = parser.parse_args(arguments)
    try:
        options.check_draws(given)
        table = options.read_table(given)
        courses = options.read_courses(given.courses, given.observer, given.standard)
        given.model = Model.named(given.model, courses, options.ranges_of(given))
        given.tables = options.by_subject(table, [given.model])
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
    with claimed(out, fit_report.FILES):
        options.tell([given.model], console)
        fits = {}
        try:
            with progress_on(console) as progress:
                for name in progress.track(given.tables, description="subjects"):
                    fits[name] = fit(given.model, given.tables[name], draws=given.draws, seed=given.seed)
        except ValueError as error:
            refuse(str(error))
        found = fit_report.table(fits)
        fit_report.tell(found, given.model, console)
        for note in (*fit_report.notes(fits), *fit_report.unheeded(given.tables, [given.model])):
            console.print(f"note: {note}", highlight=False)
        write_table(out, "fit", found, fit_report.picture(fits))
        write_csv(out / "predicted.csv", predicted(fits))
        write_json(out / "fit.json", fit_report.content(fits, given.draws, given.seed))
        console.print(f"Written: {', '.join(str(out / each) for each in fit_report.FILES)}", highlight=False)
    return 0
