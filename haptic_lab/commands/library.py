"""List the objects of a library: their names, how large they are, and how much of each is known."""

from __future__ import annotations

import argparse

import numpy as np
from rich.table import Table

from haptic_env import validate
from haptic_lab.terminal import Parser, as_path, make_console, tell
from observer.library import Library
from observer.surface.felt_shape import KNOWN

EXAMPLE = """examples: haptic-slam library objects
          haptic-slam library objects --remove mug1"""


def main(arguments: list[str] | None = None) -> int:
    """Run the command.

    Args:
        arguments: of the command line; None: those of this process.

    Returns:
        Its exit code.
    """
    parser = Parser(description=__doc__, epilog=EXAMPLE, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("library", type=as_path, metavar="DIR", help="the library, a folder")
    parser.add_argument("--remove", metavar="NAME", help="remove this object first")
    given = parser.parse_args(arguments)
    try:
        library = Library(given.library)
        if not library.path.is_dir():
            parser.error(f"there is no folder {given.library!r}")
        if given.remove is not None:
            library.remove(given.remove)
    except KeyError as error:
        parser.error(error.args[0])
    except (ValueError, OSError) as error:
        parser.error(str(error))
    table = Table(title=f"{validate.counted(len(library), 'object')} in {given.library}", title_justify="left")
    for head in ("name", "size (mm)", "known to 3 mm", "learnt"):
        table.add_column(head)
    whole, damaged = library.read()
    for name in sorted({*whole, *damaged}):
        if name in damaged:
            tell("warning", damaged[name])
            table.add_row(name, "", "", "cannot be read")
            continue
        surface, about = whole[name]
        size = " × ".join(f"{1e3 * extent:.0f}" for extent in np.ptp(surface.vertices, axis=0))
        told = ", ".join(f"{key} {value}" for key, value in about.items())
        table.add_row(name, size, f"{(surface.std < KNOWN).mean():.0%}", told)
    make_console().print(table)
    return 0
