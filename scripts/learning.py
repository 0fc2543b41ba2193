"""A training run with Stable-Baselines3: the learner, what watches it, and what is left of it."""

from __future__ import annotations

import shutil
import sys
import time
import warnings
from dataclasses import asdict
from pathlib import Path
from typing import Any

import checkpoints
import gymnasium as gym
import numpy as np
import stable_baselines3
import torch
from files import write_json
from imitation import imitate
from learning_curve import draw
from presets import RAW, Preset, configuration
from rich.console import Console
from sb3_contrib import RecurrentPPO
from stable_baselines3.common.base_class import BaseAlgorithm
from stable_baselines3.common.callbacks import BaseCallback, EvalCallback
from stable_baselines3.common.vec_env import VecEnv
from tasks import versions
from training_env import make_vector

from haptic_env import reading

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

    def _on_training_start(self) -> None:
        if not self.evaluations_timesteps:
            self._on_step()  # what it begins with

    def _on_step(self) -> bool:
        if self.n_calls % self.eval_freq == 0:
            self.eval_env.seed(EVALUATION_SEED)
        return super()._on_step()

    def restore(self, path: Path, best: float, decisions: int) -> None:
        """Go on from what was evaluated within the first `decisions`."""
        self.best_mean_reward = best
        if not path.exists():
            return
        kept = reading.npz(path)
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
    try:
        model = algorithm(env=env, seed=preset.seed, device="cpu", tensorboard_log=log, **keywords)
    except (AssertionError, TypeError, ValueError) as error:  # of values that do not go together
        raise ValueError(f"[learner] makes no {preset.algorithm}: {error}") from error
    # Saved with the model: what the policy "sb3" must know to show it the same again.
    model.exploration = {  # type: ignore[attr-defined]
        "env": preset.world.env,
        "entries": [] if preset.world.observation == (RAW,) else list(preset.world.observation),
        "hold": preset.world.hold,
    }
    if preset.sweep is not None:
        assert isinstance(model, stable_baselines3.PPO | stable_baselines3.SAC)
        hand = gym.make(preset.world.env).unwrapped.hand  # type: ignore[attr-defined]
        imitate(model, env, preset.sweep, hand, _decision_seconds(preset))
    return model


def _decision_seconds(preset: Preset) -> float:
    base: Any = gym.make(preset.world.env).unwrapped
    return preset.world.hold / base.control_hz


def train(preset: Preset, jobs: int, out: Path, console: Console) -> int:
    """Train from the last whole checkpoint in `out` to the end, in `jobs` processes; returns the exit code."""
    torch.set_num_threads(1)
    folder = out / "checkpoints"
    found, broken = checkpoints.newest(folder)
    for place in broken:
        console.print(f"{place} was cut short and is removed", style="yellow")
        shutil.rmtree(place)
    env = make_vector(preset.world, preset.envs, jobs)
    held_out = make_vector(preset.world, min(4, preset.envs), jobs, held_out=True)
    began = time.monotonic()
    try:
        model = prepare(preset, env, found, str(out / "tensorboard"))
    except ValueError as error:
        env.close()
        held_out.close()
        sys.stderr.write(f"train.py: error: {error}\n")
        return 2
    write_json(out / "config.json", configuration(preset))
    evaluation = HeldOutEvaluation(held_out, preset, out)
    seconds = time.monotonic() - began
    if found is not None:
        seconds += found.state["seconds"]
        best = found.state["best"]
        evaluation.restore(out / EVALUATIONS, -np.inf if best is None else best, model.num_timesteps)
        console.print(f"Going on after {preset.world.hold * model.num_timesteps} steps")
    save = Save(evaluation, preset, folder, seconds)
    left = preset.steps // preset.world.hold - model.num_timesteps
    code = 0
    try:
        if left > 0:
            with warnings.catch_warnings():
                warnings.filterwarnings("ignore", message="rich is experimental")  # tqdm's way to draw the progress bar
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
        kept = reading.npz(out / EVALUATIONS)
        rewards, right, lengths = kept["results"], kept["successes"], kept["ep_lengths"]
        decisions = kept["timesteps"]
        steps, seconds_of = preset.world.hold * decisions, _decision_seconds(preset) * lengths
        draw(out / "learning_curve.png", steps, rewards, seconds_of, right, preset.world.seconds)
        best = int(rewards.mean(axis=1).argmax())
        told["best"] = {
            "environment_steps": int(steps[best]),
            "median_seconds": float(np.median(seconds_of[best])),
            "right": float(right[best].mean()),
        }
        console.print(
            f"Best on held-out sizes: decided after {told['best']['median_seconds']:.2f} s (median), "
            f"{told['best']['right']:.0%} right, of {right.shape[1]} explorations"
        )
    write_json(out / "training.json", told)
