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
import shutil
import sys
import time
import warnings
from dataclasses import asdict, replace
from pathlib import Path
from typing import Any

# Each process computes on one core: environments run side by side.
for _threads in ("NUMBA_NUM_THREADS", "OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS"):
    os.environ.setdefault(_threads, "1")
os.environ.setdefault("OMP_WAIT_POLICY", "passive")

import numpy as np
from explore import Parser
from files import write_json
from joblib import cpu_count
from rich.console import Console

if importlib.util.find_spec("stable_baselines3") is None:
    sys.exit("train.py needs Stable-Baselines3, which is not installed: pip install 'haptic-slam[train]'")

import checkpoints
import presets
import stable_baselines3
import torch
from learning_curve import draw
from presets import Preset
from sb3_contrib import RecurrentPPO
from stable_baselines3.common.base_class import BaseAlgorithm
from stable_baselines3.common.callbacks import BaseCallback, EvalCallback
from stable_baselines3.common.vec_env import VecEnv
from tasks import versions
from training_env import RAW, make_vector

from haptic_env import validate

EXAMPLE = """examples: python scripts/train.py --preset trained --out out/trained
          python scripts/train.py --preset sac --steps 200000 --seed 3 --out out/sac
          tensorboard --logdir out/trained/tensorboard"""
ALGORITHMS: dict[str, type[BaseAlgorithm]] = {
    "PPO": stable_baselines3.PPO,
    "SAC": stable_baselines3.SAC,
    "RecurrentPPO": RecurrentPPO,
}
EVALUATION_SEED = 5_000  # the same explorations at every evaluation
EVALUATIONS = "evaluations.npz"


class HeldOutEvaluation(EvalCallback):
    """Evaluates on the same explorations each time, so that only the policy makes a difference."""

    def __init__(self, env: VecEnv, preset: Preset, out: Path) -> None:
        super().__init__(
            env,
            n_eval_episodes=preset.episodes,
            eval_freq=max(1, preset.evaluate_every // (preset.world.hold * preset.envs)),
            log_path=str(out),
            best_model_save_path=str(out),
            deterministic=True,
            verbose=0,
        )

    def _on_step(self) -> bool:
        if self.n_calls % self.eval_freq == 0:
            self.eval_env.seed(EVALUATION_SEED)
        return super()._on_step()

    def restore(self, path: Path, best: float, decisions: int) -> None:
        """Go on from what was evaluated within the first `decisions`."""
        self.best_mean_reward = best
        if not path.exists():
            return
        with np.load(path) as kept:
            upto = kept["timesteps"] <= decisions
            self.evaluations_timesteps = list(kept["timesteps"][upto])
            self.evaluations_results = list(kept["results"][upto])
            self.evaluations_length = list(kept["ep_lengths"][upto])
            self.evaluations_successes = list(kept["successes"][upto])


class Save(BaseCallback):
    """Saves a checkpoint every so often, and says at which speed the environment runs."""

    def __init__(self, evaluation: HeldOutEvaluation, preset: Preset, folder: Path, seconds: float) -> None:
        super().__init__()
        self.evaluation, self.folder, self.before = evaluation, folder, seconds
        self.hold = preset.world.hold
        self.every = max(1, preset.checkpoint_every // preset.world.hold)

    def _on_training_start(self) -> None:
        self.began, self.first = time.monotonic(), self.model.num_timesteps
        self.saved = self.model.num_timesteps

    def _on_step(self) -> bool:
        if self.model.num_timesteps - self.saved >= self.every:
            self.save()
        return True

    def _on_rollout_end(self) -> None:
        steps = self.hold * (self.model.num_timesteps - self.first)
        self.logger.record("time/environment_steps_per_second", steps / (time.monotonic() - self.began))

    @property
    def seconds(self) -> float:
        """How long the run has taken, before it was stopped included."""
        return self.before + time.monotonic() - self.began

    def save(self) -> None:
        """Save a checkpoint now."""
        state = {"seconds": self.seconds, "best": float(self.evaluation.best_mean_reward)}
        checkpoints.save(self.folder, self.model, state)
        self.saved = self.model.num_timesteps


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
    """A folder holds one run; only how long it is may change."""
    config = json.loads(json.dumps({**asdict(preset), "steps": None}))
    if path.exists():
        kept = json.loads(path.read_text())
        for key in config:
            if kept.get(key) != config[key]:
                raise ValueError(
                    f"{path.parent} holds a run with {key} = {kept.get(key)!r}, not {config[key]!r}; choose another --out"
                )
    else:
        write_json(path, config)


def prepare(preset: Preset, env: VecEnv, found: checkpoints.Checkpoint | None, log: str | None) -> BaseAlgorithm:
    """The learner: a new one, or that of a checkpoint."""
    algorithm = ALGORITHMS[preset.algorithm]
    if found is not None:
        model = algorithm.load(found.folder / checkpoints.MODEL, env=env, device="cpu", tensorboard_log=log)
        if (found.folder / checkpoints.REPLAY).exists():
            model.load_replay_buffer(found.folder / checkpoints.REPLAY)  # type: ignore[attr-defined]
        model.set_random_seed(preset.seed + model.num_timesteps)  # not the episodes that it began with
        return model
    keywords = {**preset.learner, "policy_kwargs": dict(preset.learner.get("policy_kwargs", {}))}
    model = algorithm(env=env, seed=preset.seed, device="cpu", tensorboard_log=log, **keywords)  # type: ignore[arg-type]
    # Saved with the model: what the policy "sb3" must know to show it the same again.
    model.exploration = {  # type: ignore[attr-defined]
        "env": preset.world.env,
        "entries": [] if preset.world.observation == (RAW,) else list(preset.world.observation),
        "hold": preset.world.hold,
    }
    return model


def train(preset: Preset, given: argparse.Namespace, console: Console) -> int:
    """Train from the last whole checkpoint to the end; returns the exit code."""
    out: Path = given.out
    folder = out / "checkpoints"
    found, broken = checkpoints.newest(folder)
    for place in broken:
        console.print(f"{place} was cut short and is removed", style="yellow")
        shutil.rmtree(place)
    env = make_vector(preset.world, preset.envs, given.jobs)
    held_out = make_vector(preset.world, min(4, preset.envs), given.jobs, held_out=True)
    model = prepare(preset, env, found, str(out / "tensorboard"))
    evaluation = HeldOutEvaluation(held_out, preset, out)
    seconds = 0.0
    if found is not None:
        seconds = found.state["seconds"]
        best = found.state["best"]
        evaluation.restore(out / EVALUATIONS, -np.inf if best is None else best, model.num_timesteps)
        console.print(f"Going on after {preset.world.hold * model.num_timesteps} steps")
    save = Save(evaluation, preset, folder, seconds)
    left = preset.steps // preset.world.hold - model.num_timesteps
    code = 0
    try:
        if left > 0:
            model.learn(left, [evaluation, save], reset_num_timesteps=False, progress_bar=True, tb_log_name="run")
            save.save()
            seconds = save.seconds
    except KeyboardInterrupt:
        save.save()
        console.print("Stopped; the same command goes on from here.")
        code, seconds = 130, save.seconds
    finally:
        env.close()
        held_out.close()
    model.save(out / "model.zip")
    _report(preset, model, seconds, out, console)
    return code


def _report(preset: Preset, model: BaseAlgorithm, seconds: float, out: Path, console: Console) -> None:
    told: dict[str, Any] = {
        **asdict(preset),
        "environment_steps": preset.world.hold * model.num_timesteps,
        "seconds": round(seconds),
        "versions": {**versions(), "stable-baselines3": stable_baselines3.__version__, "torch": torch.__version__},
    }
    console.print(f"{told['environment_steps']} steps in {seconds / 60:.1f} min")
    if (out / EVALUATIONS).exists():
        with np.load(out / EVALUATIONS) as kept:
            rewards, right, lengths = kept["results"], kept["successes"], kept["ep_lengths"]
            step_seconds = preset.world.hold / 50.0
            steps = preset.world.hold * kept["timesteps"]
            draw(out / "learning_curve.png", steps, step_seconds * lengths, right)
        best = int(rewards.mean(axis=1).argmax())
        told["best"] = {
            "environment_steps": int(steps[best]),
            "median_seconds": float(np.median(step_seconds * lengths[best])),
            "right": float(right[best].mean()),
        }
        console.print(
            f"Best on held-out sizes: decided after {told['best']['median_seconds']:.2f} s (median), "
            f"{told['best']['right']:.0%} right, of {right.shape[1]} explorations"
        )
    write_json(out / "training.json", told)


def main(arguments: list[str] | None = None) -> int:
    """Run the command; returns its exit code."""
    preset, given = parse(arguments)
    torch.set_num_threads(1)
    with warnings.catch_warnings():
        warnings.filterwarnings("ignore", message=".*rich is experimental")  # of the progress bar
        return train(preset, given, Console())


if __name__ == "__main__":
    sys.exit(main())
