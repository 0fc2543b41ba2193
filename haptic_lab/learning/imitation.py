"""A learner's start: it copies a sweep that was made by hand, and learns what such a sweep is worth.

Shapes: E environments, J joints, D numbers of an observation, T decisions.
"""

from __future__ import annotations

import numpy as np
import torch
from numpy.typing import NDArray
from stable_baselines3 import PPO, SAC
from stable_baselines3.common.vec_env import VecEnv

from haptic_env.hand import Hand
from haptic_lab.learning.sweeping_motion import SweepingMotion

BATCH = 256


def imitate(model: PPO | SAC, env: VecEnv, sweep: SweepingMotion, hand: Hand, decision_seconds: float) -> None:
    """Fit the mean of a policy to a sweep; PPO also its value to the returns that were had, while SAC keeps what
    happened in its replay buffer.

    Args:
        model: that has not yet learnt.
        env: E environments.
        sweep: that is copied.
        hand: whose fingers sweep.
        decision_seconds: from one decision to the next.
    """
    rng = np.random.default_rng(model.seed)
    observation = env.reset()
    clock = np.zeros(env.num_envs)
    rows = []
    for _ in range(sweep.decisions):
        wanted = sweep.torques(clock, hand)
        action = np.clip(wanted + sweep.noise * rng.standard_normal(wanted.shape), -1.0, 1.0).astype(np.float32)
        after, reward, done, infos = env.step(action)
        assert isinstance(observation, np.ndarray)
        assert isinstance(after, np.ndarray)
        if isinstance(model, SAC):
            assert model.replay_buffer is not None
            last = np.array([info.get("terminal_observation", row) for info, row in zip(infos, after, strict=True)])
            model.replay_buffer.add(observation, last, action, reward, done, infos)
        rows.append((observation, wanted, reward, done))
        observation = after
        clock = np.where(done, 0.0, clock + decision_seconds)
    seen, wanted, rewards, dones = (np.array(each) for each in zip(*rows, strict=True))
    returns, known = _returns(rewards, dones, model.gamma)
    shown = tuple(torch.as_tensor(each[known]) for each in (seen, wanted, returns))
    _fit(model, shown, sweep.epochs)


def _returns(
    rewards: NDArray[np.float64], dones: NDArray[np.bool_], gamma: float
) -> tuple[NDArray[np.float32], NDArray[np.bool_]]:
    """Discounted returns (T, E), and of which the end was seen (T, E)."""
    result, known = np.zeros(rewards.shape, np.float32), np.zeros(rewards.shape, bool)
    later, seen = np.zeros(rewards.shape[1]), np.zeros(rewards.shape[1], bool)
    for t in reversed(range(len(rewards))):
        seen = seen | dones[t]
        later = rewards[t] + gamma * np.where(dones[t], 0.0, later)
        result[t], known[t] = later, seen
    return result, known


def _fit(model: PPO | SAC, shown: tuple[torch.Tensor, ...], epochs: int) -> None:
    seen, wanted, returns = shown
    if isinstance(model, SAC):  # which squashes its torques, while those of PPO are clipped where they are used
        wanted = wanted.clip(-1.0, 1.0)
    learnt = model.policy.parameters() if isinstance(model, PPO) else model.actor.parameters()
    optimiser = torch.optim.Adam(learnt, lr=1e-2)
    generator = torch.Generator().manual_seed(int(model.seed or 0))
    for _ in range(epochs):
        for batch in torch.randperm(len(seen), generator=generator).split(BATCH):
            if isinstance(model, PPO):
                mean = model.policy.get_distribution(seen[batch]).distribution.mean  # type: ignore[union-attr]
                values = model.policy.predict_values(seen[batch]).squeeze(1)
                error = 0.1 * ((values - returns[batch]) ** 2).mean()
            else:
                mean, error = torch.tanh(model.actor.get_action_dist_params(seen[batch])[0]), torch.zeros(())
            error = error + ((mean - wanted[batch]) ** 2).mean()
            optimiser.zero_grad()
            error.backward()
            optimiser.step()
