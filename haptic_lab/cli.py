"""The command `haptic-slam`. Each of its commands is a module with a `main`, which is loaded when it is asked for.

Command lines are read by argparse of the standard library, and what is told is drawn by rich. (click, and typer on it,
take a fixed number of values a flag; sweeps are asked for as `--sigmas 1 3 5`.)
"""

from __future__ import annotations

import argparse
import ctypes.util
import gc
import importlib
import os
import shutil
import signal
import sys
from importlib import metadata
from typing import NoReturn

from haptic_lab import given_files, without_computing
from haptic_lab.terminal import Parser, program, refuse

PROGRAM = "haptic-slam"
COMMANDS = {
    "demo": "watch a hand explore, in the browser",
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
EXAMPLES = {  # one of each; most need nothing but what is there
    "demo": "",
    "explore": "--shape pyramid --sigma 5",
    "learn": "can --shape cylinder",
    "library": "objects",
    "replay": "out/explore/recording.npz",
    "live": "--udp 5005 --hand two_finger",
    "evaluate": "--sigmas 3 5 --trials 20",
    "people": "example",
    "figures": "figure5 --quick",
    "fit": "example --courses example",
    "compare": "example --courses example",
    "design": "ideal memory --courses example --rounds 10",
    "simulate": "--courses example --sigma 5 --out a.csv",
    "train": "--preset trained --steps 20000",
    "export": "model.zip --trust",
    "benchmark": "--quick",
    "study": "--list",
    "objects": "--objects four",
    "bench": "--quick",
    "check-hand": "adroit",
    "picture-recording": "--recording a.npz --mesh a.stl",
    "scaling": "--quick",
    "scheduling": "--quick",
}
EXAMPLE = """examples: haptic-slam explore --shape pyramid --sigma 5 --out out/pyramid
          haptic-slam evaluate --sigmas 3 5 --trials 20 --out out/evaluate
          haptic-slam explore --help"""


def overview() -> str:
    """Say what can be done: each command with an example, in a line or, where the terminal is narrow, in two.

    Returns:
        The lines.
    """
    told = {f"{PROGRAM} {name} {EXAMPLES[name]}".rstrip(): what for name, what in COMMANDS.items()}
    room = max(map(len, told))
    lines = [f"  {example:{room}}  {what}" for example, what in told.items()]
    if max(map(len, lines)) > shutil.get_terminal_size().columns:
        lines = [f"  {what}\n      {example}" for example, what in told.items()]
    head = "A hand explores an object it cannot see; an observer says what it felt."
    foot = f"Begin with {PROGRAM} demo; {PROGRAM} COMMAND --help tells all flags of a command."
    return "\n".join([head, "", *lines, "", foot])


def run(command: str) -> NoReturn:
    """Run a command, and end this process with its exit code.

    Args:
        command: one of `COMMANDS`; it reads the arguments of this process.
    """
    signal.signal(signal.SIGINT, signal.SIG_DFL)  # while modules are loaded Ctrl-C ends it without a word
    arguments = sys.argv[1:]
    if arguments[:1] in (["-h"], ["--help"]):  # nothing before it is read
        without_computing.begin()
    elif wrong := given_files.first_wrong(command, arguments):
        refuse(wrong)
    if command in ONE_CORE:
        for name, value in THREADS.items():
            os.environ.setdefault(name, value)
    told = any(os.environ.get(name) for name in ("DISPLAY", "WAYLAND_DISPLAY", "MUJOCO_GL"))
    if command in OFFSCREEN and sys.platform.startswith("linux") and not told and ctypes.util.find_library("EGL"):
        os.environ["MUJOCO_GL"] = "egl"
    gc.disable()  # it takes a tenth of the time of loading, in which there is no garbage
    module = importlib.import_module(f"haptic_lab.commands.{command.replace('-', '_')}")
    gc.freeze()
    gc.enable()
    program(module.main)


def main() -> NoReturn:
    """The entry point of `haptic-slam`, and of `python -m haptic_lab`."""
    sys.argv[0] = PROGRAM
    if len(sys.argv) == 1:
        try:
            print(overview(), flush=True)
        except BrokenPipeError:  # `head` has seen enough; what is left is flushed to where nobody listens
            os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
        sys.exit(0)
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
    command = parser.parse_args(sys.argv[1:2]).command
    if command not in COMMANDS:
        from haptic_env import validate

        try:
            validate.choice("command", command, COMMANDS)
        except ValueError as error:
            refuse(str(error))
    sys.argv = [f"{PROGRAM} {command}", *sys.argv[2:]]  # so errors and help are told in its name
    run(command)
