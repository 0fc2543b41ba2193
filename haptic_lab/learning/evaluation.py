"""Evaluation while a policy is trained, on sizes of objects that were held out, and the models that are kept of it."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from numpy.typing import NDArray
from stable_baselines3.common.base_class import BaseAlgorithm
from stable_baselines3.common.callbacks import BaseCallback, EvalCallback
from stable_baselines3.common.vec_env import VecEnv

import agents
from haptic_env import reading
from haptic_lab.files import UNFINISHED, atomic
from haptic_lab.learning.presets import Preset

EVALUATION_SEED = 5_000  # the same explorations at every evaluation
EVALUATIONS, BEST = "evaluations.npz", "best_model"
OF_EVALUATIONS = ("timesteps", "results", "ep_lengths", "successes")


class HeldOutEvaluation(EvalCallback):
    """Evaluates on the same explorations each time, so that only the policy makes a difference."""

    def __init__(self, env: VecEnv, preset: Preset, out: Path) -> None:
        """Say when to evaluate, and where the table goes.

        Args:
            env: with the sizes of evaluation.
            preset: of the run.
            out: its folder.
        """
        super().__init__(
            env,
            n_eval_episodes=preset.episodes,
            eval_freq=max(1, preset.evaluate_every // (preset.world.hold * preset.envs)),
            log_path=str(out),
            callback_on_new_best=_KeepBest(out),
            deterministic=True,
            verbose=0,
        )
        self._table, self._written = out / EVALUATIONS, out / f"{UNFINISHED}{EVALUATIONS}"
        self.log_path = str(self._written)

    def _on_training_start(self) -> None:
        if not self.evaluations_timesteps:
            self._on_step()  # what it begins with

    def _on_step(self) -> bool:
        if self.n_calls % self.eval_freq == 0:
            self.eval_env.seed(EVALUATION_SEED)
        go_on = super()._on_step()
        if self._written.exists():  # else it was no turn of evaluation
            self._written.replace(self._table)
        return go_on

    def restore(self, path: Path, best: float, decisions: int) -> None:
        """Go on from the evaluations of a run that was stopped.

        Args:
            path: of their table.
            best: mean reward of the best model, -inf where there was none.
            decisions: of the checkpoint from which the run goes on; later evaluations are forgotten.

        Raises:
            ValueError: for a file that is no such table.
        """
        self.best_mean_reward = best
        if not path.exists():
            return
        kept = read_evaluations(path)
        upto = kept["timesteps"] <= decisions
        self.evaluations_timesteps = list(kept["timesteps"][upto])
        self.evaluations_results = list(kept["results"][upto])
        self.evaluations_length = list(kept["ep_lengths"][upto])
        self.evaluations_successes = list(kept["successes"][upto])


class _KeepBest(BaseCallback):
    """Keeps the model that was best in evaluation."""

    def __init__(self, out: Path) -> None:
        super().__init__()
        self.out = out

    def _on_step(self) -> bool:
        keep(self.model, self.out, BEST)
        return True


def keep(model: BaseAlgorithm, out: Path, name: str) -> None:
    """Write a model for use (.npz, which runs nothing when it is read) and as Stable-Baselines3 saves it (.zip).

    Args:
        model: that has learnt.
        out: folder for both files.
        name: of both.
    """
    agents.export(model, out / f"{name}.npz")
    with atomic(out / f"{name}.zip") as place:
        model.save(place)


def read_evaluations(path: Path) -> dict[str, NDArray[Any]]:
    """Read the table of evaluations.

    Args:
        path: of the .npz file.

    Returns:
        `OF_EVALUATIONS` by name: decisions (N,), and of each of E explorations (N, E) reward, decisions and whether it
        was right.

    Raises:
        ValueError: for a file that is no such table.
    """
    kept = reading.npz(path)
    found = {name: kept[name] for name in OF_EVALUATIONS if name in kept}
    count = found["timesteps"].shape if "timesteps" in found else ()
    fits = len(count) == 1 and all(each.ndim == 2 and each.shape[:1] == count for each in list(found.values())[1:])
    if len(found) < len(OF_EVALUATIONS) or not fits or not all(each.dtype.kind in "bif" for each in found.values()):
        raise ValueError(f"{path} holds no evaluations: {', '.join(OF_EVALUATIONS)}")
    return found
