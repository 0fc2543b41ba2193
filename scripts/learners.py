"""The algorithms of Stable-Baselines3 that learn, made as a preset says, anew or from a checkpoint."""

from __future__ import annotations

import inspect
from collections.abc import Mapping
from typing import Any

import checkpoints
import gymnasium as gym
import stable_baselines3
import torch
from imitation import imitate
from presets import RAW, Preset
from sb3_contrib import RecurrentPPO
from stable_baselines3.common.base_class import BaseAlgorithm
from stable_baselines3.common.vec_env import VecEnv

from haptic_env import validate

ALGORITHMS: dict[str, type[BaseAlgorithm]] = {
    "PPO": stable_baselines3.PPO,
    "SAC": stable_baselines3.SAC,
    "RecurrentPPO": RecurrentPPO,
}
OURS = ("self", "env", "seed", "device", "tensorboard_log", "_init_setup_model")  # not a preset's to say
# What the algorithms take without a word and learn nothing with, or fail at after minutes: the least and most.
SHARES = {"gamma": (0.0, 1.0), "gae_lambda": (0.0, 1.0), "tau": (0.0, 1.0)}
COUNTS = {
    "n_steps": 1,
    "batch_size": 1,
    "n_epochs": 1,
    "buffer_size": 1,
    "learning_starts": 0,
    "train_freq": 1,
    "target_update_interval": 1,
}
POSITIVE = ("learning_rate", "clip_range", "clip_range_vf", "max_grad_norm", "target_kl")


def check(preset: Preset) -> None:
    """Raise `ValueError` where `preset.learner` has keywords that its algorithm has not, or numbers out of range."""
    _check_table("learner", preset.learner)
    _check_table("policy_kwargs of [learner]", preset.learner.get("policy_kwargs", {}))
    parameters = inspect.signature(ALGORITHMS[preset.algorithm]).parameters
    validate.keywords("[learner]", preset.learner, [name for name in parameters if name not in OURS])
    for name, value in preset.learner.items():
        what = f"{name} of [learner]"
        if name in SHARES:
            validate.number(what, value, *SHARES[name])
        elif name in COUNTS:
            validate.integer(what, value, COUNTS[name])
        elif name in POSITIVE:
            validate.number(what, value, above=0.0)
    if preset.learner.get("gradient_steps") == 0:
        raise ValueError(
            "gradient_steps of [learner] must be a number of steps, or -1 for as many as were taken, got 0"
        )
    if "policy" not in preset.learner:
        raise ValueError("[learner] must set policy, the name of one that the algorithm knows: MlpPolicy, …")


def _check_table(what: str, value: object) -> None:
    if not isinstance(value, Mapping):
        raise ValueError(f"{what} must be a table, got {value!r}")


def begin(preset: Preset, env: VecEnv, log: str | None) -> BaseAlgorithm:
    """A new learner; raises `ValueError` where its algorithm cannot be made as the preset says."""
    check(preset)
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
    """The learner: a new one, which copies a sweep where the preset has one, or as it was at a checkpoint."""
    model = begin(preset, env, log)
    if found is not None:
        checkpoints.restore(found, model)
        model.set_random_seed(preset.seed + model.num_timesteps)  # not the episodes that it began with
    elif preset.sweep is not None:
        assert isinstance(model, stable_baselines3.PPO | stable_baselines3.SAC)
        hand = gym.make(preset.world.env).unwrapped.hand  # type: ignore[attr-defined]
        imitate(model, env, preset.sweep, hand, decision_seconds(preset))
    return model


def decision_seconds(preset: Preset) -> float:
    """From one decision to the next."""
    base: Any = gym.make(preset.world.env).unwrapped
    return preset.world.hold / base.control_hz


def versions() -> dict[str, str]:
    """Of what learns."""
    return {"stable-baselines3": stable_baselines3.__version__, "torch": torch.__version__}
