"""A learner after APPLE: a recurrent network on what is felt, with a head that acts and one that names the object.

The name is learnt from the truth (cross-entropy), the torques by PPO from how good the name is. All weights learn from
both. An episode is a row of decisions that has the same length each time.

Shapes: E environments, T decisions of an episode, D numbers that are felt, J joints, C names.

References:
    Schneider et al. 2025, Active Perception with Policy and Loss-based Estimation (APPLE).
"""

from __future__ import annotations

from pathlib import Path
from typing import Any

import gymnasium as gym
import numpy as np
import torch
from numpy.typing import NDArray
from torch import nn

from haptic_env import reading
from haptic_lab.files import atomic
from haptic_lab.tasks.guessing import SCALE, guessing

WIDTH, ENVS, EPOCHS, CLIP, GAMMA, LAMBDA, RATE = 64, 8, 4, 0.2, 0.97, 0.95, 1e-3


class Guesser(nn.Module):
    """The network."""

    def __init__(self, felt: int, joints: int, names: int) -> None:
        """Begin with weights of chance.

        Args:
            felt: D.
            joints: J.
            names: C.
        """
        super().__init__()
        self.sees = nn.Linear(felt + joints, WIDTH)
        self.remembers = nn.LSTM(WIDTH, WIDTH, batch_first=True)
        self.acts, self.names, self.values = nn.Linear(WIDTH, joints), nn.Linear(WIDTH, names), nn.Linear(WIDTH, 1)
        self.log_std = nn.Parameter(torch.full((joints,), -0.5))

    def forward(self, seen: torch.Tensor, memory: Any = None) -> tuple[torch.Tensor, torch.Tensor, torch.Tensor, Any]:
        """Compute all heads.

        Args:
            seen: (E, T, D + J), what is felt and the action before.
            memory: of the decisions before; None: there were none.

        Returns:
            Mean torques (E, T, J), logits (E, T, C), values (E, T), and the memory.
        """
        hidden, memory = self.remembers(torch.tanh(self.sees(seen)), memory)
        return torch.tanh(self.acts(hidden)), self.names(hidden), self.values(hidden).squeeze(-1), memory


def flat(observation: Any, action: NDArray[np.float32]) -> NDArray[np.float32]:
    """Put what is felt, and the action before, in a row.

    Args:
        observation: of the environment.
        action: (J,).

    Returns:
        (D + J,).
    """
    return np.concatenate([observation["joint_angles"], observation["contacts"], action]).astype(np.float32)


def train(world: Any, steps: int, seed: int, progress: Any) -> Guesser:
    """Learn a task.

    Args:
        world: of the task.
        steps: of the environment, in all.
        seed: of everything random.
        progress: called with the steps that were taken since.

    Returns:
        The network.
    """
    torch.manual_seed(seed)
    envs = [guessing(world) for _ in range(ENVS)]
    joints, names = envs[0].get_wrapper_attr("joints"), len(world.shapes)
    seen = [env.reset(seed=1000 * seed + index)[0] for index, env in enumerate(envs)]
    model = Guesser(len(flat(seen[0], np.zeros(0, np.float32))), joints, names)
    optimiser = torch.optim.Adam(model.parameters(), RATE)
    taken = 0
    while taken < steps:
        episode = _explore(model, envs, joints)
        _learn(model, optimiser, *episode)
        now = ENVS * episode[0].shape[1] * world.hold
        taken += now
        progress(now)
    for env in envs:
        env.close()
    return model


def _explore(model: Guesser, envs: list[gym.Env[Any, Any]], joints: int) -> tuple[torch.Tensor, ...]:
    """An episode in each environment: seen (E, T, D + J), actions (E, T, J), their log p (E, T), rewards and truth."""
    observations = [env.reset()[0] for env in envs]
    actions, memory, over = np.zeros((len(envs), joints), np.float32), None, False
    rows: list[tuple[torch.Tensor, ...]] = []
    rewards: list[list[float]] = []
    while not over:
        seen = torch.as_tensor(np.stack([flat(each, a) for each, a in zip(observations, actions, strict=True)]))
        with torch.no_grad():
            mean, logits, _, memory = model(seen[:, None], memory)
            noise = torch.distributions.Normal(mean[:, 0], model.log_std.exp())
            drawn = noise.sample()
            said = (logits[:, 0] / SCALE).clamp(-1.0, 1.0).numpy()
        rows.append((seen, drawn, noise.log_prob(drawn).sum(-1)))
        actions = drawn.clamp(-1.0, 1.0).numpy()
        stepped = [env.step(np.append(a, guess)) for env, a, guess in zip(envs, actions, said, strict=True)]
        observations = [each[0] for each in stepped]
        rewards.append([float(each[1]) for each in stepped])
        over = stepped[0][3]
    columns = [torch.stack(each, dim=1) for each in zip(*rows, strict=True)]
    truth = torch.tensor([env.get_wrapper_attr("truth") for env in envs])
    return (*columns, torch.tensor(np.array(rewards, np.float32).T), truth)


def _learn(
    model: Guesser,
    optimiser: torch.optim.Optimizer,
    seen: torch.Tensor,
    actions: torch.Tensor,
    before: torch.Tensor,
    rewards: torch.Tensor,
    truth: torch.Tensor,
) -> None:
    with torch.no_grad():
        values = model(seen)[2]
    later = torch.cat([values[:, 1:], torch.zeros(len(values), 1)], dim=1)
    surprise, gains, gain = rewards + GAMMA * later - values, torch.zeros_like(rewards), torch.zeros(len(rewards))
    for t in reversed(range(rewards.shape[1])):
        gain = surprise[:, t] + GAMMA * LAMBDA * gain
        gains[:, t] = gain
    returns, scaled = gains + values, (gains - gains.mean()) / (gains.std() + 1e-6)
    wanted = truth[:, None].expand(rewards.shape)
    for _ in range(EPOCHS):
        mean, logits, values, _ = model(seen)
        ratio = (torch.distributions.Normal(mean, model.log_std.exp()).log_prob(actions).sum(-1) - before).exp()
        policy = -torch.minimum(ratio * scaled, ratio.clamp(1.0 - CLIP, 1.0 + CLIP) * scaled).mean()
        named = nn.functional.cross_entropy(logits.flatten(0, 1), wanted.flatten())
        loss = policy + 0.5 * ((values - returns) ** 2).mean() + named
        optimiser.zero_grad()
        loss.backward()
        nn.utils.clip_grad_norm_(model.parameters(), 0.5)
        optimiser.step()


def write(model: Guesser, path: Path) -> None:
    """Write the weights as plain numbers.

    Args:
        model: the network.
        path: of the .npz.
    """
    with atomic(path) as place, place.open("wb") as file:
        arrays: dict[str, Any] = {name: each.numpy() for name, each in model.state_dict().items()}
        np.savez(file, allow_pickle=False, **arrays)


def read(path: Path) -> Guesser:
    """Read the weights; runs nothing.

    Args:
        path: of the .npz.

    Returns:
        The network.

    Raises:
        ValueError: for a file of something else.
    """
    kept = reading.npz(path)
    try:
        joints, names = len(kept["log_std"]), len(kept["names.bias"])
        model = Guesser(kept["sees.weight"].shape[1] - joints, joints, names)
        model.load_state_dict({name: torch.as_tensor(each) for name, each in kept.items()})
    except (KeyError, RuntimeError, TypeError, IndexError) as error:
        raise ValueError(f"{path} holds no such network: {error}") from error
    return model.eval()
