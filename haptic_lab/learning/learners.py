"""The algorithms of Stable-Baselines3 that learn, made as a preset says, anew or from a checkpoint."""

from __future__ import annotations

import stable_baselines3
import torch
from sb3_contrib import RecurrentPPO
from stable_baselines3.common.base_class import BaseAlgorithm
from stable_baselines3.common.vec_env import VecEnv

from haptic_env import hand_of
from haptic_lab.learning import checkpoints
from haptic_lab.learning.explored import unobserved
from haptic_lab.learning.imitation import imitate
from haptic_lab.learning.presets import RAW, Preset
from haptic_lab.learning.report import decision_seconds

ALGORITHMS: dict[str, type[BaseAlgorithm]] = {
    "PPO": stable_baselines3.PPO,
    "SAC": stable_baselines3.SAC,
    "RecurrentPPO": RecurrentPPO,
}


def begin(preset: Preset, env: VecEnv, log: str | None) -> BaseAlgorithm:
    """Make a new learner.

    Args:
        preset: algorithm, keyword arguments and seed.
        env: in which it will learn.
        log: folder for TensorBoard; None: nothing is logged.

    Returns:
        The learner.

    Raises:
        ValueError: where its algorithm cannot be made as the preset says.
    """
    keywords = {**preset.learner, "policy_kwargs": dict(preset.learner.get("policy_kwargs", {}))}
    algorithm = ALGORITHMS[preset.algorithm]
    try:
        model = algorithm(env=env, seed=preset.seed, device="cpu", tensorboard_log=log, **keywords)
    except Exception as error:  # it says in many ways what it cannot be made of
        raise ValueError(f"[learner] makes no {preset.algorithm}: {error or type(error).__name__}") from error
    # Saved with the model: what the policy "sb3" must know to show it the same again.
    model.exploration = {  # type: ignore[attr-defined]
        "env": preset.world.env,
        "entries": [] if preset.world.observation == (RAW,) else list(preset.world.observation),
        "hold": preset.world.hold,
    }
    return model


def make(preset: Preset, env: VecEnv, found: checkpoints.Checkpoint | None, log: str | None) -> BaseAlgorithm:
    """Make a learner, ready to go on.

    Args:
        preset: as `begin`'s.
        env: in which it will learn.
        found: a checkpoint, as which it will be; None: a new one, which copies a sweep where the preset has one.
        log: as `begin`'s.

    Returns:
        The learner.
    """
    model = begin(preset, env, log)
    if found is not None:
        checkpoints.restore(found, model)
        model.set_random_seed(preset.seed + model.num_timesteps)  # not the episodes that it began with
    elif preset.sweep is not None:
        assert isinstance(model, stable_baselines3.PPO | stable_baselines3.SAC)
        hand = hand_of(unobserved(preset.world))
        imitate(model, env, preset.sweep, hand, decision_seconds(preset))
    return model


def versions() -> dict[str, str]:
    """Say what learns.

    Returns:
        Versions of the packages that figures of training may depend on, by name.
    """
    return {"stable-baselines3": stable_baselines3.__version__, "torch": torch.__version__}
