"""What figures are drawn, and of which trials: the command line of `haptic-slam figures`, checked."""

from __future__ import annotations

import argparse
import os
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

from joblib import cpu_count

from haptic_env import shapes, validate
from haptic_lab import believed, conditions
from haptic_lab.figures import FIGURES, FROM_NOISES, FROM_TRIALS, offsets, pose_error
from haptic_lab.figures.figure6 import AS_THE_PAPER, PAPER, TITLES
from haptic_lab.sweeps import options
from haptic_lab.sweeps.measures import COURSE_SECONDS
from haptic_lab.sweeps.plan import SweepPlan
from haptic_lab.sweeps.tasks import STREAM
from haptic_lab.terminal import Parser, as_path, refuse
from haptic_lab.worlds import typed_shape

EXAMPLE = """examples: haptic-slam figures --out out/figures
          haptic-slam figures figure5 film --seed 3 --show-seconds 60 --out out/long
          haptic-slam figures figure6 confusion --trials-of out/evaluate"""
DEFAULTS: dict[str, Any] = {  # of the sweep; flags of evaluate.py
    "shapes": list(shapes.SHAPES),
    "scale": 1.0,
    "sigmas": [1.0, 2.0, 3.0, 4.0, 5.0],
    "trials": 72,
    "seconds": 10.0,
    "first_seed": 30_000,
    "exemplars": 5,
    "particles": 200,
    "policy": "random_torque",
    "env": "HapticSLAM/TwoFinger-v0",
    "wrist": None,
    "observers": ["floor", "haptic_slam", "ceiling"],
    "classifiers": [name for name in TITLES if name != STREAM],
    "jobs": cpu_count(),
    **conditions.DEFAULTS,
    **dict.fromkeys(believed.BELIEVED),
}
POSE, NAMES = "pose_error", "figure6"  # also have trials of their own
PAPER_TRIALS = 12  # the paper's recursion takes some 6 s of a core for each, ten times as long as this project's
QUICK = {
    "sigmas": [1.0, 3.0, 5.0],
    "trials": 2,
    "seconds": 3.0,
    "exemplars": 1,
    "show_seconds": 3.0,
    "offsets": [0.0, 3.0],
    "offset_sigmas": [1.0],
}


@dataclass(frozen=True)
class FiguresPlan:
    """What the command line asks for.

    Attributes:
        names: of the figures.
        out: folder for them.
        seed: of the explorations that are shown.
        show_seconds: how long these are.
        trials_of: folder of a sweep that is there already.
        sweep: what `haptic-slam evaluate` makes of the flags of the trials, which explorations have too.
        poses: the sweep of observers without maps; None where it is not needed.
        noises: the sweep of other noises; None where it is not needed.
        papers: the sweep of the paper's own recursion; None where it is not needed.
    """

    names: tuple[str, ...]
    out: Path
    seed: int
    show_seconds: float
    trials_of: str | None
    sweep: SweepPlan
    poses: SweepPlan | None
    noises: SweepPlan | None
    papers: SweepPlan | None

    @property
    def sweeps(self) -> list[SweepPlan]:
        """Those that are run."""
        of_trials = self.trials_of is None and any(name in FROM_TRIALS for name in self.names)
        return [
            each
            for each in (self.sweep if of_trials else None, self.poses, self.noises, self.papers)
            if each is not None
        ]


def parse(description: str | None, arguments: list[str] | None) -> FiguresPlan:
    """Read and check the command line; ends the program with code 2 where it makes no sense. Nothing is written.

    Args:
        description: of the command, for its help.
        arguments: of the command line; None: those of this process.

    Returns:
        What is drawn.
    """
    parser = Parser(description=description, epilog=EXAMPLE, formatter_class=argparse.RawDescriptionHelpFormatter)
    add = parser.add_argument
    add("names", nargs="*", metavar="NAME", help=f"which figures (default all): {', '.join(FIGURES)}")
    add("--out", type=as_path, default="out/figures", help="folder for the figures (default out/figures)")
    explored = "what is explored, and the candidates: shapes, sets (default the four shapes)"
    add("--shapes", nargs="+", type=typed_shape, metavar="SHAPE", help=explored)
    add("--scale", type=float, help="metres that the unit of a mesh file is long (default 1)")
    add("--sigmas", nargs="+", type=float, help="noise of the sweep, SD in degrees (default 1 2 3 4 5)")
    add("--trials", type=int, help="explorations of the sweep for each shape and sigma (default 72, the paper's)")
    add("--seconds", type=float, help="of an exploration of the sweep (default 10, the paper's)")
    few = f"of these that the paper's own recursion repeats for figure6 (default {PAPER_TRIALS}); 0: none"
    add("--paper-trials", type=int, metavar="TRIALS", default=PAPER_TRIALS, help=few)
    add("--first-seed", type=int, help="seed of its first trial (default 30000)")
    add("--exemplars", type=int, help="draws over which one-shot learning is averaged (default 5)")
    add("--observers", nargs="+", help=f"of the sweep (default {' '.join(DEFAULTS['observers'])})")
    add("--trials-of", type=as_path, metavar="FOLDER", help="take the trials of this sweep of evaluate.py instead")
    add("--seed", type=int, default=0, help="of the explorations that are shown (default 0)")
    add("--show-seconds", type=float, default=30.0, help="how long they are (default 30, the paper's)")
    add("--particles", type=int, help="of the observer (default 200)")
    add("--policy", type=as_path, help="as evaluate.py's (default random_torque)")
    add("--trust", action="store_true", help="as evaluate.py's")
    add("--env", "--hand", help="as evaluate.py's")
    add("--wrist", help="as evaluate.py's")
    add("--jobs", type=int, help="processes of this machine (default: one a core)")
    add("--cluster", metavar="ADDRESS", help="run on the workers of this dask scheduler instead (docs/clusters.md)")
    quick = ", ".join(f"--{name.replace('_', '-')} {_told(value)}" for name, value in QUICK.items())
    conditions.add_flags(add, "as the environment's, of all trials")
    believed.add_flags(add)
    add("--offsets", nargs="+", type=float, help="of the figure of that name: SDs of bias, drift (default 0 1 3 5)")
    add("--offset-sigmas", nargs="+", type=float, help="its sigmas (default 1 3)")
    add("--quick", action="store_true", help=f"a first look: {quick}")
    parser.set_defaults(**DEFAULTS, offsets=list(offsets.AMOUNTS), offset_sigmas=list(offsets.SIGMAS))
    given = parser.parse_args(arguments)
    if given.quick:
        parser.set_defaults(**QUICK)
        given = parser.parse_args(arguments)
    told = {name: getattr(given, name) for name in DEFAULTS if getattr(given, name) is not None}
    told["out"] = str(Path(given.out) / "trials")
    if given.cluster is not None:
        told["cluster"] = given.cluster
    sweep = options.check_values(told, trust=given.trust)
    usual = FIGURES if given.trials_of is None else tuple(name for name in FIGURES if name not in FROM_NOISES)
    out, names = Path(given.out), tuple(dict.fromkeys(given.names)) or usual
    try:
        for name in names:
            validate.choice("figure", name, FIGURES)
        for sigma in given.offset_sigmas:
            validate.number("--offset-sigmas", sigma, high=90.0, above=0.0, unit="degrees")
        validate.integer("--seed", given.seed, 0, 2**32 - 1)
        validate.integer("--paper-trials", given.paper_trials, 0, 100_000)
        validate.number("--show-seconds", given.show_seconds, 0.0, 3600.0, above=0.0, unit="s")
        if given.trials_of is None and "time_course" in names:
            validate.number("--seconds (of time_course)", sweep.conditions[0].seconds, COURSE_SECONDS, 3600.0, unit="s")
        if given.trials_of is not None and not os.path.isfile(Path(given.trials_of) / "trials.csv"):
            refuse(f"--trials-of must be a folder of evaluate.py, with trials.csv in it, got {given.trials_of!r}")
    except ValueError as error:
        refuse(str(error))
    poses = None
    if given.trials_of is None and POSE in names and {"kalman", "smoother"}.isdisjoint(given.observers):
        own = {"observers": [pose_error.SMOOTHER], "classifiers": [], "out": str(out / "poses")}
        poses = options.check_values(told | own, trust=given.trust)
    papers = None
    repeated = min(given.paper_trials, given.trials)
    if given.trials_of is None and NAMES in names and repeated and PAPER not in given.observers:
        own = {"observers": [PAPER], "classifiers": [AS_THE_PAPER], "trials": repeated, "out": str(out / PAPER)}
        papers = options.check_values(told | own, trust=given.trust)
    noises = None
    if given.trials_of is None and any(name in FROM_NOISES for name in names):
        own = {"observers": list(offsets.OBSERVERS), "classifiers": [], "out": str(out / "noises")}
        noises = options.check_values(told | own | {"sigmas": given.offset_sigmas}, trust=given.trust)
        try:
            some = offsets.conditions(
                noises.conditions[0], sorted(set(given.offset_sigmas)), sorted(set(given.offsets))
            )
        except ValueError as error:
            refuse(f"--offsets: {error}")
        noises = replace(noises, conditions=some)
    return FiguresPlan(names, out, given.seed, given.show_seconds, given.trials_of, sweep, poses, noises, papers)


def _told(value: Any) -> str:
    return " ".join(map(str, value)) if isinstance(value, list) else str(value)
