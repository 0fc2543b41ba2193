"""Compare objects with what the physics can touch of them, and tell which cannot be explored, and why.

A concave mesh is convex pieces to the physics, which are found when they are first needed. Writes objects.csv and
objects.png to --out. Ends with code 1 where an object is refused.
"""

from __future__ import annotations

import argparse
from pathlib import Path

from haptic_env import shapes, validate
from haptic_lab.files import write_table
from haptic_lab.folder_lock import claimed
from haptic_lab.objects.report import frame_of, picture, refusals, report, table
from haptic_lab.style import styled
from haptic_lab.terminal import Parser, as_path, make_console, tell_error
from haptic_lab.warm_up import told_on
from haptic_lab.worlds import SETS, expanded, typed_shape

EXAMPLE = """examples: haptic-slam objects mug.stl cup.stl --scale 0.001
          haptic-slam objects --objects daily.toml --out out/daily
          haptic-slam objects "noise(4, 0.3)" twelve"""
FILES = ("objects.csv", "objects.png")
WIDTH = 120  # of what is printed to a file


def parse(arguments: list[str] | None) -> argparse.Namespace:
    """Read and check the command line; ends the program with code 2 where it makes no sense. Nothing is written.

    Args:
        arguments: of the command line; None: those of this process.

    Returns:
        `names` of the objects, `scale`, and `out`, the folder for the results.
    """
    parser = Parser(description=__doc__, epilog=EXAMPLE, formatter_class=argparse.RawDescriptionHelpFormatter)
    add = parser.add_argument
    named = "shapes, mesh files, sets, module:Class (default: every shape and family)"
    add("names", nargs="*", type=typed_shape, metavar="NAME", help=named)
    add("--objects", type=as_path, metavar="SET", help=f"all objects of a set: {SETS}")
    add("--scale", type=float, default=1.0, help="metres that the unit of a mesh file is long (default 1)")
    add("--trust", action="store_true", help="import the modules of classes that a set names")
    add("--out", type=as_path, default="out/objects", help="folder for the results (default out/objects)")
    given = parser.parse_args(arguments)
    try:
        given.scale = validate.number("--scale", given.scale, above=0.0, unit="m")
        of_set = [] if given.objects is None else shapes.read_set(given.objects)
        names = expanded([*given.names, *of_set], trust=given.trust)
    except ValueError as error:
        parser.error(str(error))
    given.names = list(dict.fromkeys(names)) or [*shapes.SHAPES, *shapes.FAMILIES]
    return given


@styled
def main(arguments: list[str] | None = None) -> int:
    """Run the command.

    Args:
        arguments: of the command line; None: those of this process.

    Returns:
        Its exit code: 1 where an object cannot be explored.
    """
    given = parse(arguments)
    out, console = Path(given.out), make_console(WIDTH)
    with claimed(out, FILES):
        with told_on(console):
            reports = report(given.names, given.scale)
        console.print(table(reports))
        written = write_table(out, "objects", frame_of(reports), picture(reports))
        console.print(f"Table and picture: {', '.join(str(out / each) for each in written)}", highlight=False)
    refused = refusals(reports)
    for line in refused:
        tell_error(line)
    return 1 if refused else 0
