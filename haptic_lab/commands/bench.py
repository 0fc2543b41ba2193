"""How fast it is: medians of interleaved repetitions on one exploration that the environment makes itself.

Prints one table; --json writes the same figures to a file. Compare ratios rather than times between machines.
"""

from __future__ import annotations

import argparse
import sys
from dataclasses import asdict
from pathlib import Path

from rich.console import Console

from haptic_env import shapes
from haptic_lab.benchmarks.settings import BenchSettings
from haptic_lab.benchmarks.suite import Bench, learner_figures
from haptic_lab.benchmarks.table import machine, table
from haptic_lab.files import write_json
from haptic_lab.terminal import Parser, as_path
from haptic_lab.worlds import HANDS_OR_IDS, SETS, as_shape, environment

EXAMPLE = "example: haptic-slam bench --rounds 5 --json out/bench.json"


def parse(arguments: list[str] | None) -> BenchSettings:
    """Read and check the command line; ends the program with code 2 where it makes no sense.

    Args:
        arguments: of the command line; None: those of this process.

    Returns:
        What is measured.
    """
    parser = Parser(description=__doc__, epilog=EXAMPLE, formatter_class=argparse.RawDescriptionHelpFormatter)
    add = parser.add_argument
    add("--env", "--hand", default="two_finger", help=f"{HANDS_OR_IDS} (default two_finger)")
    add("--shape", type=as_shape, default="cube", help=f"{', '.join(shapes.SHAPES)} or any other (default cube)")
    add("--objects", type=as_path, default="fifty", metavar="SET", help=f"among which is named: {SETS} (default fifty)")
    add("--sigma", type=float, default=3.0, help="noise of the felt joint angles, SD in degrees (default 3)")
    add("--seed", type=int, default=0, help="of the exploration (default 0)")
    add("--rounds", type=int, default=3, help="repetitions of everything, interleaved (default 3)")
    add("--quick", action="store_true", help="few particles and steps: to see that it runs, not how fast")
    add("--learner", action="store_true", help="only how many steps a learner gets, of environments side by side")
    add("--json", type=as_path, metavar="FILE", help="write the figures to FILE too")
    try:
        given = vars(parser.parse_args(arguments))
        return BenchSettings(**given | {"env": environment(given["env"])})
    except ValueError as error:
        parser.error(str(error))


def main(arguments: list[str] | None = None) -> int:
    """Run the command.

    Args:
        arguments: of the command line; None: those of this process.

    Returns:
        Its exit code.
    """
    settings = parse(arguments)
    console = Console(width=None if sys.stdout.isatty() else 150)
    if settings.learner:
        figures = learner_figures(settings, console)
    else:
        bench = Bench(settings)
        bench.warm_up()
        figures = bench.figures(console)
    console.print(table(figures, settings.rounds))
    if settings.json is not None:
        write_json(
            Path(settings.json),
            {"settings": asdict(settings), "machine": machine(), "figures": [asdict(each) for each in figures]},
        )
        console.print(f"Figures: {settings.json}", highlight=False)
    return 0
