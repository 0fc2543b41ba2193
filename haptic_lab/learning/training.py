"""A training run with Stable-Baselines3: the learner, what watches it, and what is left of it."""

from __future__ import annotations

import shutil
import time
import warnings
from pathlib import Path
from typing import NamedTuple

import numpy as np
import torch
from rich.console import Console
from stable_baselines3.common.base_class import BaseAlgorithm
from stable_baselines3.common.callbacks import BaseCallback
from stable_baselines3.common.vec_env import VecEnv

from haptic_lab.learning import checkpoints, learners
from haptic_lab.learning.environments import close, make_env, make_vector
from haptic_lab.learning.evaluation import EVALUATIONS, HeldOutEvaluation, keep
from haptic_lab.learning.interrupt import InterruptGuard, stopped
from haptic_lab.learning.learners import ALGORITHMS as ALGORITHMS
from haptic_lab.learning.presets import Preset
from haptic_lab.learning.report import report
from haptic_lab.progress import ProgressLines

CHECKPOINTS = "checkpoints"


class SaveCheckpoints(BaseCallback):
    """Saves a checkpoint every so often, and says at which speed the environment runs."""

    def __init__(
        self, evaluation: HeldOutEvaluation, preset: Preset, folder: Path, seconds: float, stop: InterruptGuard
    ) -> None:
        """Save nothing yet.

        Args:
            evaluation: whose best is kept with a checkpoint.
            preset: of the run.
            folder: of all checkpoints.
            seconds: that the run has taken before.
            stop: tells of a Ctrl-C.
        """
        super().__init__()
        self.evaluation, self.folder, self.before, self.stop = evaluation, folder, seconds, stop
        self.began = time.monotonic()
        self.hold = preset.world.hold
        self.every = max(1, preset.checkpoint_every // preset.world.hold)

    def _on_training_start(self) -> None:
        self.began, self.first = time.monotonic(), self.model.num_timesteps
        self.saved = self.model.num_timesteps

    def _on_step(self) -> bool:
        self.stop.check()
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


class TellSteps(BaseCallback):
    """Says how far a run is, where no bar would be seen."""

    def __init__(self, steps: int, console: Console) -> None:
        """Say nothing yet.

        Args:
            steps: of the learner, until the end.
            console: to say it on.
        """
        super().__init__()
        self.lines = ProgressLines(console=console)
        self.task, self.first = self.lines.add_task("steps", total=steps), 0

    def _on_training_start(self) -> None:
        self.first = self.model.num_timesteps

    def _on_step(self) -> bool:
        return True

    def _on_rollout_end(self) -> None:
        self.lines.update(self.task, completed=self.model.num_timesteps - self.first)


class TrainingRun(NamedTuple):
    """What a run is made of, before it begins.

    Attributes:
        preset: how it trains.
        out: its folder.
        env: in which it learns.
        held_out: in which it is evaluated.
        model: that learns.
        evaluation: watches it.
        seconds: that the run has taken before, setting up included.
    """

    preset: Preset
    out: Path
    env: VecEnv
    held_out: VecEnv
    model: BaseAlgorithm
    evaluation: HeldOutEvaluation
    seconds: float

    def close(self) -> None:
        """End the environments."""
        close(self.env)
        close(self.held_out)


def prepare(preset: Preset, jobs: int, out: Path, stop: InterruptGuard, console: Console) -> TrainingRun:
    """Set up a run from the last whole checkpoint on. Where it raises, it has written nothing.

    Args:
        preset: how it trains.
        jobs: as `make_vector`'s.
        out: its folder.
        stop: tells of a Ctrl-C.
        console: says where it goes on.

    Returns:
        The run.

    Raises:
        ValueError: where the preset or what is in `out` makes no sense.
    """
    torch.set_num_threads(1)
    found, broken = checkpoints.newest(out / CHECKPOINTS)
    began = time.monotonic()
    if jobs > 1:  # a worker could not say what is wrong with a world
        make_env(preset.world).close()
    env = make_vector(preset.world, preset.envs, jobs)
    held_out = None
    try:
        held_out = make_vector(preset.world, min(4, preset.envs), jobs, held_out=True)
        model = learners.make(preset, env, found, str(out / "tensorboard"))
        evaluation = HeldOutEvaluation(held_out, preset, out)
        seconds = time.monotonic() - began
        if found is not None:
            seconds += found.state["seconds"]
            best = found.state.get("best")
            evaluation.restore(out / EVALUATIONS, -np.inf if best is None else best, model.num_timesteps)
            console.print(f"Going on after {preset.world.hold * model.num_timesteps} steps")
        stop.check()
    except BaseException:
        close(env)
        if held_out is not None:
            close(held_out)
        raise
    for place in broken:
        console.print(f"{place} was cut short and is removed", style="yellow")
        shutil.rmtree(place)
    return TrainingRun(preset, out, env, held_out, model, evaluation, seconds)


def train(ready: TrainingRun, stop: InterruptGuard, console: Console) -> int:
    """Train to the end, and keep what came of it.

    Args:
        ready: the run.
        stop: tells of a Ctrl-C.
        console: shows how it goes.

    Returns:
        Exit code; 130 where Ctrl-C stopped it.
    """
    preset, model, out = ready.preset, ready.model, ready.out
    save = SaveCheckpoints(ready.evaluation, preset, out / CHECKPOINTS, ready.seconds, stop)
    left = preset.steps // preset.world.hold - model.num_timesteps
    code, seconds = 0, ready.seconds
    try:
        if left > 0:
            with warnings.catch_warnings():
                warnings.filterwarnings("ignore", message="rich is experimental")  # tqdm's way to draw the progress bar
                callbacks: list[BaseCallback] = [ready.evaluation, save, TellSteps(left, console)]
                bar = console.is_terminal
                model.learn(left, callbacks, reset_num_timesteps=False, progress_bar=bar, tb_log_name="run")
            save.save()
            seconds = save.seconds
    except KeyboardInterrupt:
        save.save()
        code, seconds = stopped(console), save.seconds
    finally:
        ready.close()
    keep(model, out, "model")
    report(preset, preset.world.hold * model.num_timesteps, seconds, learners.versions(), out, console)
    return code
