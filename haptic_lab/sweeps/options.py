"""The command line of a sweep, or the TOML file in its place, turned into a checked `SweepPlan` and the opened
`Results`."""

from __future__ import annotations

import argparse
from collections.abc import Mapping
from dataclasses import asdict
from pathlib import Path
from typing import Any

from joblib import cpu_count

import agents
from haptic_env import shapes
from haptic_lab import believed, conditions, limits
from haptic_lab.conditions import TRUST
from haptic_lab.sweeps import trial_tables
from haptic_lab.sweeps.config_files import Options as Options
from haptic_lab.sweeps.config_files import read as read
from haptic_lab.sweeps.config_files import typed as typed
from haptic_lab.sweeps.plan import HAND, SweepPlan, planned
from haptic_lab.sweeps.provenance import versions
from haptic_lab.sweeps.results import Results
from haptic_lab.sweeps.rows import columns, unusual
from haptic_lab.sweeps.tasks import files_of
from haptic_lab.terminal import Called, Parser, as_keys, as_path, refuse
from haptic_lab.worlds import HANDS_OR_IDS, SETS, WRISTS, typed_shape
from observer import OBSERVERS
from observer.classifiers import CLASSIFIERS
from observer.variants import ABLATION, VARIANTS, WITHOUT_MAP

EXAMPLE = """examples: haptic-slam evaluate --shapes cube sphere --sigmas 3 5 --trials 20 --out out/two_shapes
          haptic-slam evaluate --bias-deg 0 2 --contact-miss 0 0.1 --seconds 5 10 --out out/product
          haptic-slam evaluate --config sweep.toml --cluster tcp://10.0.0.1:8786"""
FIRST_SEED = 10_000  # below 1000 are the seeds that tuning may use
NAMERS = ("nearest_neighbour", "overlap_nearest_neighbour")  # one-shot: the paper's, and what touch has added
REPLAYED: dict[str, Any] = {"seconds": None, "classifiers": []}  # what is usual of these, and of people's trials: whole
QUICK = {"sigmas": [3.0], "trials": 2, "seconds": [5.0], "exemplars": 1}
RARE = ("white", "second_look")  # which is haptic_slam where no error lasts, and takes several times as long
USUAL = [name for name in OBSERVERS if name not in RARE]
TRUSTED = ["--trust"]


def parse(description: str | None, arguments: list[str] | None) -> tuple[SweepPlan, Results]:
    """Read and check the command line, and open the table; ends the program with code 2 where either makes no sense.

    Args:
        description: of the command, for its help.
        arguments: of the command line; None: those of this process.

    Returns:
        The plan, and its table.
    """
    plan = check(description, arguments)
    return plan, open_results(plan)


def check(description: str | None, arguments: list[str] | None) -> SweepPlan:
    """Read and check the command line; ends the program with code 2 where it makes no sense. Nothing is written.

    Args:
        description: of the command, for its help.
        arguments: of the command line; None: those of this process.

    Returns:
        The plan.
    """
    parser, options = make_parser(description)
    file: dict[str, Any] = {}
    given = parser.parse_args(arguments)
    if given.config is not None:
        try:
            file = read(Path(given.config), options)
            planned(settle(parser, TRUSTED if given.trust else [], file))
            for mine, other in (("shapes", "objects"), ("objects", "shapes")):
                if getattr(given, mine) is not None:
                    file[other] = None  # flags win
        except (ValueError, OSError) as error:
            parser.error(f"{given.config}: {as_keys(str(error))}")
    return _planned(settle(parser, arguments, file))


def check_values(values: Mapping[str, Any], *, trust: bool = False) -> SweepPlan:
    """Check what another command says that the flags would; ends the program with code 2 where it makes no sense.

    Args:
        values: of flags, by their keys; the others are as usual.
        trust: whether a policy may run code when it is read.

    Returns:
        The plan.
    """
    parser, options = make_parser(None)
    several = {name for name, option in options.items() if option.nargs in ("+", "*")}
    lists = {
        name: [value] if name in several and not isinstance(value, list) else value for name, value in values.items()
    }
    return _planned(settle(parser, TRUSTED if trust else [], lists))


def _planned(given: argparse.Namespace) -> SweepPlan:
    try:
        return planned(given)
    except (ValueError, OSError) as error:
        refuse(str(error))


def open_results(plan: SweepPlan, also: Mapping[str, Any] | None = None) -> Results:
    """Open the table of a plan, as far as it is there; ends the program with code 2 where its folder holds that of
    other settings.

    Args:
        plan: of the sweep.
        also: what else all its rows share, by name.

    Returns:
        The table.
    """
    try:
        folder = Path(plan.out)
        (folder / "exemplars").mkdir(parents=True, exist_ok=True)
        config = asdict(plan.settings) | versions() | files_of(plan.settings) | dict(also or {})
        return Results(folder, config, *columns(plan.settings), plan.settings.observers, unusual(plan.conditions))
    except ValueError as error:
        refuse(str(error))
    except OSError as error:
        refuse(f"--out must be a folder that can be written to: {error}")


def make_parser(description: str | None) -> tuple[argparse.ArgumentParser, Options]:
    """Make what reads the command line.

    Args:
        description: of the command, for its help.

    Returns:
        The parser, and by its key each option that a file may set.
    """
    parser = Parser(description=description, epilog=EXAMPLE, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument(
        "--config", type=as_path, metavar="FILE", help="TOML: any of these, first_seed = 20 for --first-seed 20"
    )
    # No key of a file, which may be a stranger's too.
    parser.add_argument("--trust", action="store_true", help=TRUST)
    options: dict[str, argparse.Action] = {}

    def add(*flags: str, **keywords: Any) -> None:
        option = parser.add_argument(*flags, **keywords)
        options[option.dest] = option

    add("--env", "--hand", help=f"{HANDS_OR_IDS} (default {HAND}, or the one that recordings are of)")
    add("--wrist", help=WRISTS)
    add(
        "--shapes",
        nargs="+",
        type=typed_shape,
        help=f'what is explored, and the candidates: {", ".join(shapes.SHAPES)} (default these), "torus(0.4)" and such '
        f"({', '.join(shapes.FAMILIES)}), mesh files, sets, module:Class",
    )
    add("--objects", type=as_path, metavar="SET", help=f"or all objects of a set: {SETS}")
    add(
        "--recordings",
        nargs="+",
        type=as_path,
        metavar="FILE",
        help="replay these, each with its object of --shapes (one for all, or one for each in their order; default the "
        "mesh that each names, beside it), whole",
    )
    trial_tables.add_flags(add)
    named = "what the object may be, shapes or sets (default: what is explored)"
    add("--candidates", type=typed_shape, nargs="+", metavar="SHAPE", help=named)
    add("--none", type=float, help="prior probability that it is none of these (default 0)")
    add("--scale", type=float, default=1.0, help="metres that the unit of a mesh file is long (default 1)")
    add("--sigmas", nargs="+", type=float, default=[1.0, 3.0, 5.0], help="noise, SD in degrees (default 1 3 5)")
    conditions.add_flags(add, "as the environment's, one or more", nargs="+")
    add(
        "--policy",
        nargs="+",
        type=as_path,
        default=["random_torque"],
        help=f"{', '.join(agents.POLICIES)}, or a trained model.npz; a .zip needs --trust (default random_torque)",
    )
    add("--seconds", nargs="+", type=float, default=[10.0], help="of an exploration, one or more (default 10)")
    add(
        "--trials",
        "--repeats",
        action=Called,
        type=int,
        default=20,
        help="explorations for each of these (default 20: with four shapes names are known to ± 10 %%)",
    )
    add("--first-seed", type=int, default=FIRST_SEED, help=f"seed of the first trial (default {FIRST_SEED})")
    add(
        "--observers",
        nargs="+",
        default=USUAL,
        help=f"default: {' '.join(USUAL)}; or {', '.join([*RARE, *VARIANTS, *WITHOUT_MAP])}; several joined by +",
    )
    switch = argparse.BooleanOptionalAction
    add("--ablation", action=switch, default=False, help="haptic_slam with one idea changed at a time, in one table")
    add("--calibration", action=switch, default=False, help="also pictures of how sure observers are and may be")
    add("--courses", action=switch, default=False, help="also what is believed of every name each 0.1 s, in the table")
    add(
        "--names-only",
        action=switch,
        default=False,
        help="observers only name the object: the same names without maps, sooner",
    )
    add("--particles", type=int, default=200, help="of the observers that have any (default 200)")
    add("--exemplars", type=int, default=3, help="draws over which one-shot learning is averaged (default 3)")
    add(
        "--classifiers",
        nargs="*",
        default=list(NAMERS),
        help=f"of finished maps: {', '.join(CLASSIFIERS)} (default {' '.join(NAMERS)})",
    )
    soon = "they also name the map in hindsight each so many seconds: how soon each is right"
    add("--maps-every", type=float, metavar="SECONDS", help=f"{soon} (default: only the last)")
    add("--meshes", action=switch, default=False, help="also how much of the surface is known, and how well meshes fit")
    add("--size-jitter", type=float, default=0.0, help="how the object's size varies, a fraction (default 0)")
    add("--position-jitter", type=float, default=0.0, help="how far it is off the grasp centre, in m (default 0)")
    add("--yaw-jitter", type=float, default=0.0, help="how far it is turned, in degrees (default 0)")
    add("--rotation-jitter", type=float, help="or how far about any axis; 180: it lies any way (default 0)")
    add("--believed-sigma", type=float, default=1.0, help="the observers are told so many times sigma (default 1)")
    believed.add_flags(add)
    limits.add_flags(add)
    add("--jobs", type=int, default=cpu_count(), help="processes of this machine (default: one a core)")
    add("--cluster", metavar="ADDRESS", help="run on the workers of this dask scheduler instead (docs/clusters.md)")
    add("--out", type=as_path, default="out/evaluate", help="folder for the results (default out/evaluate)")
    quick = ", ".join(
        f"--{name} {' '.join(map(str, value)) if isinstance(value, list) else value}" for name, value in QUICK.items()
    )
    add("--quick", action=switch, default=False, help=f"a first look in under two minutes: {quick}")
    return parser, options


def settle(parser: argparse.ArgumentParser, arguments: list[str] | None, file: Mapping[str, Any]) -> argparse.Namespace:
    """Read flags, which win over --quick, that over the file, that over the defaults.

    Args:
        parser: of `make_parser`.
        arguments: of the command line; None: those of this process.
        file: what `read` returns.

    Returns:
        All options.
    """
    parser.set_defaults(**file)
    given = parser.parse_args(arguments)
    if given.recordings is not None or given.trial_table is not None:
        parser.set_defaults(**{name: file.get(name, value) for name, value in REPLAYED.items()})
    if given.names_only:
        parser.set_defaults(classifiers=file.get("classifiers", []))
    if given.ablation and "observers" not in file:
        parser.set_defaults(observers=list(ABLATION))
    if given.quick:
        parser.set_defaults(**QUICK)
    return parser.parse_args(arguments)
