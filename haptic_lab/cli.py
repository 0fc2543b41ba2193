"""The command `haptic-slam`. Each of its commands is a module with a `main`, which is loaded when it is asked for.

Command lines are read by argparse of the standard library, and what is told is drawn by rich. (click, and typer on it,
take a fixed number of values a flag; sweeps are asked for as `--sigmas 1 3 5`.)
"""

from __future__ import annotations

import argparse
import ctypes.util
import importlib
import os
import signal
import sys
from importlib import metadata
from typing import NoReturn

from haptic_lab.terminal import Parser, program, refuse

PROGRAM = "haptic-slam"
COMMANDS = {
    "explore": "let a blind hand explore a hidden object, and name it",
    "learn": "let it feel a new object, to recognise it later",
    "library": "list the objects that were learnt",
    "replay": "let the hand repeat a recording, and name what it touched",
    "live": "observe a hand as it moves, from streams of joints and contacts",
    "evaluate": "measure the observer between its brackets over many trials",
    "people": "say what people answered, and hold them against observers",
    "figures": "draw the figures of the paper, and those beyond it",
    "fit": "find what limits a subject, from a table of its answers",
    "compare": "say which observer explains a subject best",
    "design": "say how many trials tell two observers apart",
    "simulate": "let simulated people answer",
    "train": "train a policy to name what the hand touches",
    "export": "make a trained model one that runs nothing when it is read",
    "benchmark": "hold policies against each other in the worlds of the tasks",
    "study": "do an experiment with the observers that was done with people",
    "objects": "compare objects with what physics can touch of them",
    "bench": "measure how fast it is",
    "check-hand": "draw a hand with its patches, list its joints, and say what is wrong with it",
    "picture-recording": "draw a recorded hand, and the map that it built",
    "scaling": "measure how the time of a step grows",
    "scheduling": "measure what a sweep costs beyond its trials",
}
ONE_CORE = ("benchmark", "train")  # each of its processes computes on one core: environments run side by side
THREADS = {
    "NUMBA_NUM_THREADS": "1",
    "OMP_NUM_THREADS": "1",
    "OPENBLAS_NUM_THREADS": "1",
    "OMP_WAIT_POLICY": "passive",
}
OFFSCREEN = ("picture-recording",)  # draws by MuJoCo's renderer, which asks when it is imported how
EXAMPLE = """examples: haptic-slam explore --shape pyramid --sigma 5 --out out/pyramid
          haptic-slam evaluate --sigmas 3 5 --trials 20 --out out/evaluate
          haptic-slam explore --help"""


def run(command: str) -> NoReturn:
    """Run a command, and end this process with its exit code.

    Args:
        command: one of `COMMANDS`; it reads the arguments of this process.
    """
    signal.signal(signal.SIGINT, signal.SIG_DFL)  # while modules are loaded Ctrl-C ends it without a word
    if command in ONE_CORE:
        for name, value in THREADS.items():
            os.environ.setdefault(name, value)
    told = any(os.environ.get(name) for name in ("DISPLAY", "WAYLAND_DISPLAY", "MUJOCO_GL"))
    if command in OFFSCREEN and sys.platform.startswith("linux") and not told and ctypes.util.find_library("EGL"):
        os.environ["MUJOCO_GL"] = "egl"
    module = importlib.import_module(f"haptic_lab.commands.{command.replace('-', '_')}")
    program(module.main)


def main() -> NoReturn:
    """The entry point of `haptic-slam`, and of `python -m haptic_lab`."""
    sys.argv[0] = PROGRAM
    told = "\n".join(f"  {name:18} {what}" for name, what in COMMANDS.items())
    parser = Parser(
        PROGRAM,
        usage="%(prog)s [--help] [--version] COMMAND ...",
        description=f"A hand explores an object it cannot see; an observer says what it felt.\n\ncommands:\n{told}",
        epilog=EXAMPLE,
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )
    parser.add_argument("command", metavar="COMMAND", help=argparse.SUPPRESS)
    parser.add_argument("--version", action="version", version=f"%(prog)s {metadata.version(PROGRAM)}")
    command = parser.parse_args(sys.argv[1:2] or ["--help"]).command
    if command not in COMMANDS:
        from haptic_env import validate  # takes a second

        try:
            validate.choice("command", command, COMMANDS)
        except ValueError as error:
            refuse(str(error))
    sys.argv = [f"{PROGRAM} {command}", *sys.argv[2:]]  # so errors and help are told in its name
    run(command)
