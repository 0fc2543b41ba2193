"""What learns before it is judged, each in as many steps of the environment as the others.

`ppo` looks at what an observer believes; `recurrent_ppo` and `apple_lstm` have no observer: they feel, act and guess.
"""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np

import agents
from haptic_lab.learning.presets import NAME, TrainingWorld
from haptic_lab.tasks.guessing import guess_of, guessing

ENVS, SEED = 8, 0
LEARNERS: dict[str, str] = {
    "ppo": "PPO on the belief",
    "recurrent_ppo": "RecurrentPPO on what is felt, without an observer",
    "apple_lstm": "LSTM with a head that names, on what is felt, without an observer (after APPLE)",
}
END_TO_END = ("recurrent_ppo", "apple_lstm")  # which name the object themselves
NEEDED = ("stable_baselines3", "sb3_contrib", "torch")
Acts = Callable[[Any, bool], tuple[Any, Any]]


def learns(learner: str, world: TrainingWorld) -> bool:
    """Tell whether a learner is one for a task.

    Args:
        learner: one of `LEARNERS`.
        world: of the task.

    Returns:
        Whether it is; there is nothing to guess where nothing is to be named.
    """
    return world.task == NAME or learner not in END_TO_END


def train(learner: str, world: TrainingWorld, steps: int, path: Path, progress: Callable[[int], None]) -> None:
    """Let a learner learn, and write its weights as plain numbers.

    Args:
        learner: one of `LEARNERS`.
        world: of the task.
        steps: of the environment.
        path: of the .npz.
        progress: called with the steps that were taken since.
    """
    import torch

    torch.set_num_threads(1)
    path.parent.mkdir(parents=True, exist_ok=True)
    if learner == "apple_lstm":
        from haptic_lab.tasks import recurrent_guesser

        recurrent_guesser.write(recurrent_guesser.train(world, steps, SEED, progress), path)
        return
    from sb3_contrib import RecurrentPPO
    from stable_baselines3 import PPO
    from stable_baselines3.common.callbacks import BaseCallback
    from stable_baselines3.common.monitor import Monitor
    from stable_baselines3.common.vec_env import DummyVecEnv

    from haptic_lab.learning.environments import make_env

    class Told(BaseCallback):
        def _on_step(self) -> bool:
            progress(ENVS * world.hold)
            return True

    common: dict[str, Any] = {"seed": SEED, "device": "cpu", "gamma": 0.97, "gae_lambda": 0.95}
    decisions = max(1, steps // world.hold)
    rollout = max(8, min(128, decisions // ENVS))
    if learner == "ppo":
        env = DummyVecEnv([lambda: make_env(world)] * ENVS)
        model: Any = PPO(
            "MlpPolicy", env, n_steps=rollout, batch_size=2 * rollout, learning_rate=5e-4,
            target_kl=0.05, n_epochs=8, use_sde=True, sde_sample_freq=30,
            policy_kwargs={"net_arch": {"pi": [64], "vf": [64, 64]}, "log_std_init": -1.5}, **common,
        )  # fmt: skip
    else:
        env = DummyVecEnv([lambda: Monitor(guessing(world))] * ENVS)
        network = {"lstm_hidden_size": 64, "net_arch": [64], "log_std_init": -0.5}
        model = RecurrentPPO(
            "MultiInputLstmPolicy",
            env,
            n_steps=rollout,
            batch_size=rollout,
            n_epochs=5,
            policy_kwargs=network,
            **common,
        )
    model.learn(decisions, Told())
    agents.export(model, path)
    env.close()


def acting(learner: str, path: Path, joints: int) -> Acts:
    """Read what an end-to-end learner has learnt.

    Args:
        learner: one of `END_TO_END`.
        path: of its weights.
        joints: J.

    Returns:
        From an observation, and whether it is the first, to torques (J,) and probabilities (C,) of the names.

    Raises:
        ValueError: for a file of something else.
    """
    memory: Any = None
    last = np.zeros(joints, np.float32)
    if learner == "recurrent_ppo":
        network: Any = agents.load_model(path)
        rng = np.random.default_rng(0)

        def act(observation: Any, began: bool) -> tuple[Any, Any]:
            nonlocal memory
            action, memory = network.predict(observation, () if began else memory, began, True, rng)
            return action[:joints], guess_of(action, joints)

        return act

    import torch

    from haptic_lab.tasks import recurrent_guesser

    model = recurrent_guesser.read(path)

    def guess(observation: Any, began: bool) -> tuple[Any, Any]:
        nonlocal memory, last
        if began:
            memory, last = None, np.zeros(joints, np.float32)
        with torch.no_grad():
            seen = torch.as_tensor(recurrent_guesser.flat(observation, last))
            mean, logits, _, memory = model(seen[None, None], memory)
        last = mean[0, 0].numpy()
        return last, torch.softmax(logits[0, 0].double(), dim=-1).numpy()

    return guess
