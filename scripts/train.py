"""Train a policy to name what the hand touches, as soon as it can, with Stable-Baselines3.

Objects and noise are drawn afresh for every episode; some sizes are kept for evaluation. Writes to --out:
best_model.zip (best in evaluation), model.zip (the last), training.json, evaluations.npz, learning_curve.png,
checkpoints, and what TensorBoard shows. Killed at any moment, the same command goes on from the last whole checkpoint.
"""

from __future__ import annotations

import argparse
import importlib.util
import json
import os
import sys
from dataclasses import replace
from pathlib import Path

if __name__ == "__main__":  # each process computes on one core: environments run side by side
    os.environ.setdefault("NUMBA_NUM_THREADS", "1")
    os.environ.setdefault("OMP_NUM_THREADS", "1")
    os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")
    os.environ.setdefault("OMP_WAIT_POLICY", "passive")

import presets
from explore import Parser
from joblib import cpu_count
from presets import Preset
from rich.console import Console

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
        given.out.mkdir(parents=True, exist_ok=True)
        _same_configuration(given.out / "config.json", preset)
    except ValueError as error:
        parser.error(str(error))
    except OSError as error:
        parser.error(f"--out must be a folder that can be written to: {error}")
    return preset, given


def _same_configuration(path: Path, preset: Preset) -> None:
    """A folder holds one run."""
    if not path.exists():
        return
    kept = json.loads(path.read_text())
    for key, value in presets.configuration(preset).items():
        if kept.get(key) != value:
            raise ValueError(
                f"{path.parent} holds a run with {key} = {kept.get(key)!r}, not {value!r}; choose another --out"
            )


def main(arguments: list[str] | None = None) -> int:
    """Run the command; returns its exit code."""
    preset, given = parse(arguments)
    from learning import train  # takes seconds, and needs what `parse` has looked for

    return train(preset, given.jobs, given.out, Console())


if __name__ == "__main__":
    sys.exit(main())
