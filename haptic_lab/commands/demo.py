"""Watch a blind hand explore a hidden object, in the browser, as fast as it would in the world.

Nothing is written. Where there is no screen, the page is called from another machine: the command that is printed
leads it there. Ctrl-C ends it.
"""

from __future__ import annotations

import argparse
import os
import sys
import webbrowser
from contextlib import closing
from time import monotonic, sleep
from typing import Any

from rich.console import Console

import agents
from haptic_env import shapes
from haptic_lab.exploration import learnt
from haptic_lab.exploration.run import begin, explore, make_trial
from haptic_lab.exploration.settings import DEFAULTS, OBSERVER, ExplorationSettings
from haptic_lab.exploration.summary import summarise, table
from haptic_lab.style import titles_of, with_article
from haptic_lab.terminal import Parser, as_path, make_console, refuse
from haptic_lab.trial import Trial
from haptic_lab.view.options import PORT, ViewOptions
from haptic_lab.view.trial_view import TrialView, verdict
from haptic_lab.view.viewer import Viewer, opened
from haptic_lab.warm_up import get_ready, told_on
from haptic_lab.worlds import HANDS_OR_IDS, environment, typed_shape

EXAMPLE = """examples: haptic-slam demo --shape pyramid --sigma 5
          haptic-slam demo --no-browser"""
SECONDS = 30.0


def parse(arguments: list[str] | None) -> tuple[ExplorationSettings, bool]:
    """Read and check the command line; ends the program with code 2 where it makes no sense.

    Args:
        arguments: of the command line; None: those of this process.

    Returns:
        What is explored, and whether a browser is opened.
    """
    parser = Parser(description=__doc__, epilog=EXAMPLE, formatter_class=argparse.RawDescriptionHelpFormatter)
    add = parser.add_argument
    named = f"{', '.join(shapes.SHAPES)}, or any that explore takes (default: drawn at random, hidden until the end)"
    add("--shape", type=typed_shape, help=named)
    add("--hand", dest="env", default="two_finger", help=f"{HANDS_OR_IDS} (default two_finger)")
    add("--policy", type=as_path, default="random_torque", help=f"{', '.join(agents.POLICIES)} (default random_torque)")
    add("--sigma", type=float, help="noise of the felt joint angles, SD in degrees (default 3)")
    add("--seconds", type=float, default=SECONDS, help=f"how long it explores (default {SECONDS:g})")
    add("--seed", type=int, help="the same seed is the same exploration (default 0)")
    add("--no-browser", action="store_true", help="print the address, and open no browser")
    free = f"of the page (default {PORT}, or any that is free where that is taken)"
    add("--view-port", type=int, metavar="PORT", help=free)
    given = vars(parser.parse_args(arguments))
    browser, port = not given.pop("no_browser"), given.pop("view_port")
    told: dict[str, Any] = {**DEFAULTS, **{name: value for name, value in given.items() if value is not None}}
    try:
        told["env"] = environment(told["env"])
        view = ViewOptions(page=True, port=PORT if port is None else port)
        settings = ExplorationSettings(**told, out=os.curdir, view=view)
    except (ValueError, ImportError) as error:
        parser.error(str(error))
    return settings, browser


def main(arguments: list[str] | None = None) -> int:
    """Run the command.

    Args:
        arguments: of the command line; None: those of this process.

    Returns:
        Its exit code.
    """
    settings, browser = parse(arguments)
    console = make_console()
    try:
        with told_on(console):
            session = begin(settings, None)
        get_ready(console, session.hand)
        trial = make_trial(settings, session)
        viewer = _opened(settings.view, console)
    except (ValueError, ImportError) as error:  # a hand that is not installed, a policy that is not for it
        refuse(str(error))
    with closing(viewer):
        if browser and _has_screen():
            webbrowser.open(viewer.address)
        else:
            console.print(_way(viewer.port), highlight=False, soft_wrap=True)

        def right(solid: shapes.Solid) -> str:
            return learnt.truth(settings, solid, session.candidates, session.namer.none > 0.0)

        what = "a hidden object"
        if settings.shape:
            what = with_article(titles_of((*session.candidates, settings.shape))[settings.shape])
        console.print(f"Exploring {what} by blind touch for {settings.seconds:g} s; Ctrl-C ends it …", highlight=False)
        view = _InTime(viewer, trial, f"Blind touch of {what}", right)
        try:
            exploration, traces, took, stopped = explore(trial, console, view)
        except ValueError as error:  # an object that this hand cannot hold
            refuse(str(error))
        slam = traces[OBSERVER]
        viewer.finish(verdict(slam.posterior[-1], slam.labels), console)
        console.print(table(summarise(settings, exploration, traces, right(exploration.solid), took)))
        if stopped:
            return 130
        viewer.stay(console)
    return 0


class _InTime(TrialView):
    """Shows a trial, no faster than it would happen."""

    def __init__(self, viewer: Viewer, trial: Trial, *told: Any) -> None:
        super().__init__(viewer, trial, *told)
        self._seconds, self._start = trial.step_seconds, monotonic()

    def show(self, step: int) -> None:
        super().show(step)
        sleep(max(0.0, self._start + step * self._seconds - monotonic()))


def _opened(options: ViewOptions, console: Console) -> Viewer:
    """Open the page at the port that was asked for, or where it is usual and taken at any other."""
    try:
        viewer = opened(options, console)
    except ValueError:
        if options.port != PORT:
            raise
        viewer = opened(ViewOptions(page=True, port=0), console)
    assert viewer is not None
    return viewer


def _has_screen() -> bool:
    """Whether a browser could show anything here."""
    return not sys.platform.startswith("linux") or bool(os.environ.get("DISPLAY") or os.environ.get("WAYLAND_DISPLAY"))


def _way(port: int) -> str:
    return f"Open that address in a browser; from another machine first: ssh -L {port}:127.0.0.1:{port} HOST"
