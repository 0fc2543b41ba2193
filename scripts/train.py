"""Train a policy to name what the hand touches, as soon as it can, with Stable-Baselines3.

Objects and noise are drawn afresh for every episode; some sizes are kept for evaluation. Writes to --out:
best_model.npz (best in evaluation) and model.npz (the last), which --policy of the other commands and agents.make take,
the same as .zip for Stable-Baselines3, training.json, evaluations.npz, learning_curve.png, checkpoints, and what
TensorBoard shows. Killed at any moment, the same command goes on from the last whole checkpoint.
"""

from __future__ import annotations

import argparse
import importlib.util
import json
import os
import sys
import tempfile
from contextlib import suppress
from dataclasses import asdict, replace
from pathlib import Path
from typing import Any

if __name__ == "__main__":  # each process computes on one core: environments run side by side
    os.environ.setdefault("NUMBA_NUM_THREADS", "1")
    os.environ.setdefault("OMP_NUM_THREADS", "1")
    os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")
    os.environ.setdefault("OMP_WAIT_POLICY", "passive")

import presets
from explore import Parser
from files import write_json
from joblib import cpu_count
from presets import Preset
from rich.console import Console
from stopping import Stop

from haptic_env import validate

EXAMPLE = """examples: python scripts/train.py --preset trained --out out/trained
          python scripts/train.py --preset sac --steps 200000 --seed 3 --out out/sac
          tensorboard --logdir out/trained/tensorboard"""
NEEDED = ("stable_baselines3", "sb3_contrib", "tensorboard", "tqdm")


def parse(arguments: list[str] | None) -> tuple[Preset, argparse.Namespace]:
    """Read and check the command line; ends the program with code 2 where it makes no sense."""
    parser = Parser(description=__doc__, epilog=EXAMPLE, formatter_class=argparse.RawDescriptionHelpFormatter)
    add = parser.add_argument
    add("--preset", default="trained", help=f"{', '.join(presets.names())}, or a TOML file (default trained)")
    add("--steps", type=int, help="of the environment, in all (default: the preset's)")
    add("--seed", type=int, help="default: the preset's")
    add("--envs", type=int, help="environments side by side (default: the preset's)")
    add("--jobs", type=int, default=cpu_count(), help="1: all in one process, else each in its own (default: cores)")
    add("--out", help="folder for the results (default out/PRESET)")
    given = parser.parse_args(arguments)
    missing = [name for name in NEEDED if importlib.util.find_spec(name) is None]
    if missing:
        parser.error(f"training needs {', '.join(missing)}: pip install 'haptic-slam[train]'")
    try:
        validate.integer("--jobs", given.jobs, 1, 1024)
        changes = {name: getattr(given, name) for name in ("steps", "seed", "envs")}
        preset = replace(presets.read(given.preset), **{k: v for k, v in changes.items() if v is not None})
        given.out = Path(given.out or Path("out") / Path(given.preset).stem)
        given.made = not given.out.exists()
        given.out.mkdir(parents=True, exist_ok=True)
        with tempfile.TemporaryFile(dir=given.out):  # else it is found out after minutes
            pass
        given.config = _same_configuration(given.out / "config.json", preset)
    except ValueError as error:
        parser.error(str(error))
    except OSError as error:
        parser.error(f"--out must be a folder that can be written to: {error}")
    return preset, given


def _same_configuration(path: Path, preset: Preset) -> dict[str, Any]:
    """The configuration; a folder holds one run, of which only how long it is may change."""
    config = json.loads(json.dumps({**asdict(preset), "steps": None}))
    if path.exists():
        try:
            kept = json.loads(path.read_text())
        except ValueError as error:
            raise ValueError(f"{path} is not whole: {error}; choose another --out") from error
        for key in config:
            held = kept.get(key) if isinstance(kept, dict) else None
            if held != config[key]:
                raise ValueError(
                    f"{path.parent} holds a run with {key} = {held!r}, not {config[key]!r}; choose another --out"
                )
    return config


def main(arguments: list[str] | None = None) -> int:
    """Run the command; returns its exit code."""
    preset, given = parse(arguments)
    console = Console()
    with Stop() as stop:
        try:
            from learning import prepare, train  # takes seconds, and needs what `parse` has looked for

            stop.check()
            ready = prepare(preset, given.jobs, given.out, stop, console)
            write_json(given.out / "config.json", given.config)
        except (ValueError, ImportError, KeyboardInterrupt) as error:
            if given.made:
                with suppress(OSError):
                    given.out.rmdir()  # nothing was written yet
            stopped = stop.asked or isinstance(error, KeyboardInterrupt)
            sys.stderr.write("Stopped before it began.\n" if stopped else f"train.py: error: {error}\n")
            return 130 if stopped else 2
        try:
            return train(ready, stop, console)
        except ValueError as error:  # of torch, where the learner went astray and its weights are no longer finite
            sys.stderr.write(f"train.py: error: {error}; the checkpoints before are kept\n")
            return 1


if __name__ == "__main__":
    sys.exit(main())
