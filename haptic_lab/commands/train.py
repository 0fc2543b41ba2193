"""Train a policy to name what the hand touches, as soon as it can, with Stable-Baselines3.

Objects and noise are drawn afresh for every episode; some sizes are kept for evaluation. Writes to --out:
best_model.npz (best in evaluation) and model.npz (the last), which --policy of the other commands and agents.make take,
the same as .zip for Stable-Baselines3, training.json, evaluations.npz, learning_curve.png, checkpoints, and what
TensorBoard shows. Killed at any moment, the same command goes on from the last whole checkpoint.
"""

from __future__ import annotations

import argparse
import importlib
import importlib.util
from collections.abc import Iterable
from dataclasses import replace
from pathlib import Path
from typing import Any

from joblib import cpu_count

from haptic_env import validate
from haptic_env.extras import how_to_install
from haptic_lab import believed, conditions, folder_lock
from haptic_lab.files import write_json
from haptic_lab.learning import presets
from haptic_lab.learning.interrupt import InterruptGuard
from haptic_lab.learning.presets import Preset
from haptic_lab.terminal import Parser, as_path, make_console, tell_error
from haptic_lab.worlds import HANDS_OR_IDS, SETS, environment, expanded, named_or_set, typed_shape

EXAMPLE = """examples: haptic-slam train --preset trained --out out/trained
          haptic-slam train --preset sac --steps 200000 --seed 3 --out out/sac
          tensorboard --logdir out/trained/tensorboard"""
NEEDED = ("stable_baselines3", "sb3_contrib", "tensorboard", "tqdm", "cmaes")
CONFIG = "config.json"
LEARNT_BY = {presets.SEARCH: "search"}  # all others by Stable-Baselines3
MODELS = [f"{name}.{kind}" for name in ("model", "best_model") for kind in ("npz", "zip")]
FILES = (CONFIG, "training.json", "evaluations.npz", "learning_curve.png", "search.npz", *MODELS)


def parse(arguments: list[str] | None) -> tuple[Preset, argparse.Namespace]:
    """Read and check the command line; ends the program with code 2 where it makes no sense. Nothing is written.

    Args:
        arguments: of the command line; None: those of this process.

    Returns:
        The preset, changed as flags say, and the flags.
    """
    parser = Parser(description=__doc__, epilog=EXAMPLE, formatter_class=argparse.RawDescriptionHelpFormatter)
    add = parser.add_argument
    add(
        "--preset",
        type=as_path,
        default="trained",
        help=f"{', '.join(presets.names())}, or a TOML file (default trained)",
    )
    add("--steps", type=int, help="of the environment, in all (default: the preset's)")
    add("--seed", type=int, help="default: the preset's")
    add("--envs", type=int, help="environments side by side (default: the preset's)")
    stepped = "threads that step environments; above 4: a process for each (default: cores)"
    add("--jobs", type=int, default=cpu_count(), help=stepped)
    explored = "what is explored, and the candidates, shapes or sets (default: the preset's, the four shapes)"
    add("--shapes", nargs="+", type=typed_shape, metavar="SHAPE", help=explored)
    add("--objects", type=as_path, metavar="SET", help=f"or all objects of a set: {SETS}")
    add("--env", "--hand", help=f"{HANDS_OR_IDS} (default: the preset's)")
    add("--wrist", help="of its hand, as explore's (default: the preset's)")
    conditions.add_flags(add, "of its world, as the environment's; the observer is told", ": the preset's")
    believed.add_flags(add)
    add("--out", type=as_path, help="folder for the results (default out/PRESET)")
    given = parser.parse_args(arguments)
    missing = [name for name in NEEDED if importlib.util.find_spec(name) is None]
    if missing:
        parser.error(f"training needs {', '.join(missing)}: {how_to_install('train')}")
    try:
        validate.integer("--jobs", given.jobs, 1, 1024)
        preset = presets.read(given.preset)
        given.env = None if given.env is None else environment(given.env)
        world = replace(preset.world, **_given(given, (*presets.NOISES, "env", "wrist")), **_explored(given))
        preset = replace(preset, world=world, **_given(given, ("steps", "seed", "envs")))
    except ValueError as error:
        parser.error(str(error))
    given.out = Path(given.out or Path("out") / Path(given.preset).stem)
    return preset, given


def _explored(flags: argparse.Namespace) -> dict[str, Any]:
    """What the command line says of objects."""
    said = named_or_set(flags.shapes, flags.objects)
    return {} if said is None else {"shapes": tuple(expanded(said))}


def _given(flags: argparse.Namespace, names: Iterable[str]) -> dict[str, Any]:
    """Those of `names` that the command line says."""
    return {name: value for name in names if (value := getattr(flags, name)) is not None}


def check_configuration(path: Path, preset: Preset) -> None:
    """End the program with code 2 where a folder holds another run.

    Args:
        path: of the file in the folder that says which it holds.
        preset: of this run.
    """
    folder_lock.check_configuration(path, presets.configuration(preset), "run")


def main(arguments: list[str] | None = None) -> int:
    """Run the command.

    Args:
        arguments: of the command line; None: those of this process.

    Returns:
        Its exit code.
    """
    preset, given = parse(arguments)
    with folder_lock.claimed(given.out, FILES), InterruptGuard() as stop:
        check_configuration(given.out / CONFIG, preset)
        try:
            # Takes seconds, and needs what `parse` has looked for.
            learning = importlib.import_module("haptic_lab.learning." + LEARNT_BY.get(preset.algorithm, "training"))
            stop.check()
            console = make_console()
            ready = learning.prepare(preset, given.jobs, given.out, stop, console)
            write_json(given.out / CONFIG, presets.configuration(preset))
        except (ValueError, ImportError) as error:
            stop.check()  # an import that it has cut short may fail in its own way
            tell_error(str(error))
            return 2
        try:
            return int(learning.train(ready, stop, console))
        except ValueError as error:  # of torch, where the learner went astray and its weights are no longer finite
            stop.check()
            tell_error(f"{error}; the checkpoints before are kept")
            return 1
