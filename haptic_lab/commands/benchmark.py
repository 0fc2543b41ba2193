"""Hold policies against each other in the worlds of the tasks (docs/tasks.md): chance, what was made by hand, what was
learnt, and learners without any observer, which all learn from as many steps of the environment.

Writes to --out: trials.csv (a row for each task, policy and world), benchmark.csv, benchmark.md and benchmark.png (each
measure with its interval over worlds), and models/, what was learnt on the way. The same command goes on where it was
stopped; with more --worlds, --policies or --tasks it adds them.
"""

from __future__ import annotations

import argparse
import importlib.util
import sys
from pathlib import Path

from joblib import cpu_count

from haptic_env import validate
from haptic_env.extras import how_to_install
from haptic_lab.files import write_table, write_text
from haptic_lab.folder_lock import check_configuration, claimed
from haptic_lab.style import styled
from haptic_lab.sweeps.driver import run as keeping
from haptic_lab.tasks import benchmark, report
from haptic_lab.tasks.benchmark import CONFIG, POLICIES, Benchmark
from haptic_lab.tasks.learners import LEARNERS, NEEDED
from haptic_lab.tasks.registry import TASKS
from haptic_lab.terminal import Parser, as_path, make_console
from haptic_lab.worlds import HANDS_OR_IDS, WRISTS

EXAMPLE = """examples: haptic-slam benchmark --quick --out out/quick
          haptic-slam benchmark --tasks Name Map --worlds 40 --steps 100000 --out out/benchmark
          haptic-slam benchmark --policies random_torque enclosure model.npz --tasks Name"""
WORLDS, STEPS, MOST = 400, 1_000_000, 10**10
QUICK = {"worlds": 2, "steps": 2_000}
FILES = ("trials.csv", "benchmark.csv", "benchmark.md", "benchmark.png")


def parse(arguments: list[str] | None) -> tuple[Benchmark, argparse.Namespace]:
    """Read and check the command line; ends the program with code 2 where it makes no sense.

    Args:
        arguments: of the command line; None: those of this process.

    Returns:
        What is held against each other, and the flags.
    """
    parser = Parser(description=__doc__, epilog=EXAMPLE, formatter_class=argparse.RawDescriptionHelpFormatter)
    add = parser.add_argument
    add("--tasks", nargs="+", default=list(TASKS), metavar="TASK", help=f"{', '.join(TASKS)} (default all)")
    add(
        "--policies",
        nargs="+",
        type=as_path,
        default=list(POLICIES),
        metavar="POLICY",
        help=f"{', '.join(POLICIES)} (default all), or a model.npz; a .zip needs --trust",
    )
    add("--worlds", type=int, help=f"of each task, the first ones of {WORLDS} (default all)")
    add("--steps", type=int, help=f"of the environment that each learner learns from (default {STEPS})")
    add("--hand", default="two_finger", help=f"{HANDS_OR_IDS} (default two_finger)")
    add("--wrist", help=WRISTS)
    add("--jobs", type=int, default=cpu_count(), help="processes (default: cores)")
    add(
        "--quick", action="store_true", help=f"only to see it work: --worlds {QUICK['worlds']} --steps {QUICK['steps']}"
    )
    add("--trust", action="store_true", help="run what a model.zip has in it")
    add("--out", type=as_path, default="out/benchmark", help="folder for the results (default out/benchmark)")
    given = parser.parse_args(arguments)
    usual = QUICK if given.quick else {"worlds": WORLDS, "steps": STEPS}
    try:
        for task in given.tasks:
            validate.choice("--tasks", task, TASKS)
        validate.integer("--jobs", given.jobs, 1, 1024)
        plan = Benchmark(
            tuple(dict.fromkeys(given.tasks)),
            tuple(dict.fromkeys(given.policies)),
            validate.integer("--worlds", usual["worlds"] if given.worlds is None else given.worlds, 1, WORLDS),
            validate.integer("--steps", usual["steps"] if given.steps is None else given.steps, 1, MOST),
            given.hand,
            given.trust,
            given.wrist,
        )
        benchmark.check(plan)
    except (ValueError, ImportError) as error:
        parser.error(str(error))
    missing = [name for name in NEEDED if importlib.util.find_spec(name) is None]
    if missing and set(plan.policies) & set(LEARNERS):
        parser.error(
            f"{', '.join(LEARNERS)} need {', '.join(missing)}: {how_to_install('train')}, or name other --policies"
        )
    return plan, given


@styled
def main(arguments: list[str] | None = None) -> int:
    """Run the command.

    Args:
        arguments: of the command line; None: those of this process.

    Returns:
        Its exit code.
    """
    plan, given = parse(arguments)
    out = Path(given.out)
    command = f"haptic-slam benchmark {' '.join(sys.argv[1:] if arguments is None else arguments)}".strip()
    console = make_console()
    with claimed(out, FILES):
        check_configuration(out / CONFIG, plan.configuration(), "benchmark")

        def work() -> None:
            rows, left = benchmark.run(plan, out, given.jobs, console)
            table = report.table_of(rows)
            names = write_table(out, "benchmark", table, report.draw(table))
            text = report.page(table, command, plan.steps, left)
            write_text(out / "benchmark.md", text)
            console.print(text, highlight=False, markup=False, soft_wrap=True)
            console.print(
                f"Written: {', '.join(str(out / name) for name in (*names, 'benchmark.md'))}", highlight=False
            )

        return keeping(work, console)
