"""Say what people answered, and hold them against observers.

TABLE has a row for each trial: subject, object, response and seconds explored, and where there are any condition,
confidence and response_time (.csv or .tsv, or BIDS events; several are put together). Writes to --out: report.html,
which needs no other file, a table (CSV) and a picture (PNG and PDF) for each thing that is said.
"""

from __future__ import annotations

import argparse
import io
from importlib import metadata
from pathlib import Path

import matplotlib
import pandas as pd
from matplotlib.figure import Figure

from haptic_env import validate
from haptic_lab.figures.paper_figure import PRINT
from haptic_lab.files import atomic, write_csv
from haptic_lab.folder_lock import claimed
from haptic_lab.people.agreement import FLOOR
from haptic_lab.people.analysis import CAPTIONS, Analysis, analyse
from haptic_lab.people.observed import Observed, read_observers
from haptic_lab.people.options import EXAMPLE as EXAMPLE_TABLE
from haptic_lab.people.options import shipped
from haptic_lab.people.report import HEADINGS, html, print_tables
from haptic_lab.people.scoring import DESIGNS, Design, design_of
from haptic_lab.people.table_flags import add_table_flags, read_tables
from haptic_lab.style import styled
from haptic_lab.terminal import Parser, as_path, make_console, refuse
from haptic_lab.worlds import as_shape

EXAMPLE = """examples: haptic-slam people trials.csv --out out/people
          haptic-slam people trials.csv --observers out/evaluate
          haptic-slam people sub-*_events.tsv --column response=key --name left=cube --name right=sphere
          haptic-slam people answers.csv --absent sphere --level aspect_ratio"""
REPORT = "report.html"
WIDTH = 120  # of what is printed to a file
FILES = (
    REPORT,
    *(f"{name}.csv" for name in HEADINGS),
    *(f"{name}.{kind}" for name in CAPTIONS for kind in ("png", "pdf")),
)


def parse(arguments: list[str] | None) -> tuple[argparse.Namespace, pd.DataFrame, Design, list[Observed]]:
    """Read and check the command line and all files; ends the program with code 2 where something makes no sense.

    Args:
        arguments: of the command line; None: those of this process.

    Returns:
        The flags, the trials, what was asked, and the observers.
    """
    parser = Parser(description=__doc__, epilog=EXAMPLE, formatter_class=argparse.RawDescriptionHelpFormatter)
    add = parser.add_argument
    add(
        "tables",
        nargs="+",
        type=as_path,
        metavar="TABLE",
        help=f"trials, .csv or .tsv; {EXAMPLE_TABLE!r}: simulated ones that ship",
    )
    add_table_flags(parser)
    add(
        "--design",
        choices=DESIGNS,
        help="what was asked (default: by the answers; 2afc has “yes” for the right interval)",
    )
    add("--candidates", nargs="+", type=as_shape, default=[], metavar="SHAPE",
        help="what people could choose from (default: all objects and answers)")  # fmt: skip
    add(
        "--absent",
        nargs="+",
        type=as_shape,
        default=[],
        metavar="SHAPE",
        help="objects of which “no” is the right answer",
    )
    add(
        "--standard",
        type=as_shape,
        metavar="SHAPE",
        help="of 2afc: what the other interval had, so that observers can be asked as people were",
    )
    add("--level", metavar="COLUMN", help="column with the level of the stimulus (default: what varies in the objects)")
    add("--observers", nargs="+", type=as_path, default=[], metavar="FOLDER",
        help="results of haptic-slam evaluate in the same objects and seconds, or .npz files of courses")  # fmt: skip
    add("--floor", type=float, default=FLOOR,
        help=f"how often an answer is any at all, in likelihoods of answers (default {FLOOR:g})")  # fmt: skip
    add("--out", type=as_path, default="out/people", help="folder for the results (default out/people)")
    given = parser.parse_args(arguments)
    try:
        validate.number("--floor", given.floor, 0.0, 1.0)
        table = read_tables([shipped("table", each) for each in given.tables], given)
        design = design_of(table, given.design, given.candidates, given.absent, given.standard or "")
        observers = [each for path in given.observers for each in read_observers(shipped("courses", str(path)))]
    except (ValueError, OSError) as error:
        parser.error(str(error))
    return given, table, design, observers


@styled
def main(arguments: list[str] | None = None) -> int:
    """Run the command.

    Args:
        arguments: of the command line; None: those of this process.

    Returns:
        Its exit code.
    """
    given, table, design, observers = parse(arguments)
    console, out = make_console(WIDTH), Path(given.out)
    with claimed(out, FILES), matplotlib.rc_context(PRINT):
        try:
            analysis = analyse(table, design, observers, floor=given.floor, level=given.level)
        except ValueError as error:
            refuse(str(error))
        print_tables(analysis, console)
        for note in analysis.notes:
            console.print(f"Note: {note}", highlight=False)
        written = write(analysis, out, f"People: {validate.listed(Path(path).name for path in given.tables)}")
    console.print(f"Written to {out}: {', '.join(written)}", highlight=False)
    return 0


def write(analysis: Analysis, out: Path, title: str) -> list[str]:
    """Write tables, pictures and the report; those of an earlier run that are not there now are taken away.

    Args:
        analysis: of a table.
        out: folder to write to.
        title: of the report.

    Returns:
        The names of the files.
    """
    pictures = {name: _png(figure) for name, figure in analysis.figures.items()}
    contents: dict[str, bytes] = {f"{name}.png": content for name, content in pictures.items()}
    version = f"haptic-slam {metadata.version('haptic-slam')}"
    contents[REPORT] = html(analysis, pictures, title, version).encode()
    for name, content in contents.items():
        with atomic(out / name) as place:
            place.write_bytes(content)
    for name, figure in analysis.figures.items():
        with atomic(out / f"{name}.pdf") as place:
            figure.savefig(place, metadata={"CreationDate": None})
    for name, table in analysis.tables.items():
        write_csv(out / f"{name}.csv", table)
    kinds = [(analysis.tables, "csv"), (analysis.figures, "png"), (analysis.figures, "pdf")]
    written = [REPORT, *(f"{name}.{kind}" for several, kind in kinds for name in several)]
    for name in {*FILES} - {*written}:
        (out / name).unlink(missing_ok=True)
    return written


def _png(figure: Figure) -> bytes:
    content = io.BytesIO()
    figure.savefig(content, format="png")
    return content.getvalue()
