"""What a policy has learnt, as numbers and a description: a network that NumPy computes, in a file that runs nothing.

The file is an .npz with the arrays of the network and `description`, a JSON text. `agents.export` makes it of a model
of Stable-Baselines3. Shapes: D numbers of an observation, L of the last hidden layer, J joints, H of a memory.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import gymnasium as gym
import numpy as np
from numpy.typing import NDArray

from agents import kept_arrays, spaces_json
from agents.instead import Instead, instead
from agents.kept_arrays import KeptArrays, restored
from agents.layers import ACTIVATIONS, Array, Cell, Layer, times
from agents.normalization import Normalization
from agents.training import checked_training
from haptic_env import readable, validate

Memory = tuple[NDArray[Any] | None, ...]
KIND = "haptic-slam policy"
NOISES = ("none", "constant", "by state", "lasting")
LEAST_LOG_STD, MOST_LOG_STD = -20.0, 2.0  # of the noise that the state decides (Haarnoja et al. 2018, SAC)


@dataclass(frozen=True)
class Network:
    """Observation → normalised → memory (`cells`) → `hidden` layers → `mean` torques, and the noise about them.

    Attributes:
        observation_space: what it was trained with.
        action_space: what it was trained with, (J,).
        hidden: the layers, each with its activation.
        mean: the last layer, of the mean torques.
        squash: whether torques go through tanh to the bounds of the action; else they are clipped.
        noise: "none"; "constant", of SD exp(`log_std`) (J,); "by state", the same with a `log_std` layer of the last
            hidden one; "lasting", the last hidden layer times a matrix of SD exp(`log_std`) (L, J), drawn once an
            episode.
        log_std: of the noise.
        cells: the memory, if it has any.
        most_mean: what the mean is clipped to before it is squashed, if it is.
        normalization: of the observation, if it is normalised.
        told: how it was trained.
        instead: what `agents.make` shows it in place of some numbers; None: it is shown all that is.
    """

    observation_space: gym.Space[Any]
    action_space: gym.spaces.Box
    hidden: tuple[tuple[Layer, str], ...]
    mean: Layer
    squash: bool
    noise: str = "none"
    log_std: Layer | Array | None = None
    cells: tuple[Cell, ...] = ()
    most_mean: float | None = None
    normalization: Normalization | None = None
    told: Mapping[str, Any] = field(default_factory=dict)
    instead: Instead | None = None

    __repr__ = readable.line

    def predict(
        self, observation: Any, memory: Memory, began: bool, deterministic: bool, rng: np.random.Generator
    ) -> tuple[Array, Memory]:
        """Compute an action.

        Args:
            observation: one of the observation space.
            memory: what the last call returned.
            began: whether it is the first of an episode.
            deterministic: whether noise is left out.
            rng: gives the noise.

        Returns:
            Action (J,), and what to hand to the next call as `memory`.
        """
        if self.normalization is not None:
            observation = self.normalization(observation)
        h, c, lasting = (self._nothing(), self._nothing(), None) if began else memory
        assert h is not None
        assert c is not None
        x = self._flat(observation)
        h, c = h.copy(), c.copy()
        for index, cell in enumerate(self.cells):
            h[index], c[index] = cell(x, h[index], c[index])
            x = h[index]
        for layer, activation in self.hidden:
            x = ACTIVATIONS[activation](layer(x))
        torque: NDArray[Any] = self.mean(x)
        if self.most_mean is not None:
            torque = np.clip(torque, -np.float32(self.most_mean), np.float32(self.most_mean))
        if not deterministic and self.noise != "none":
            if self.noise == "lasting" and lasting is None:
                assert isinstance(self.log_std, np.ndarray)
                drawn = rng.standard_normal(self.log_std.shape, dtype=np.float32)
                lasting = (np.exp(self.log_std) * drawn).astype(np.float32)
            torque = torque + self._noise(x, lasting, rng)
        low, high = self.action_space.low, self.action_space.high
        if self.squash:
            torque = low + np.float32(0.5) * (np.tanh(torque) + np.float32(1.0)) * (high - low)
        return np.clip(torque, low, high).astype(np.float32), (h, c, lasting)

    @property
    def memory(self) -> tuple[int, int]:
        """Shape of what the cells remember: how many there are, H."""
        return len(self.cells), self.cells[0].fed_back.weight.shape[1] if self.cells else 0

    def _nothing(self) -> Array:
        return np.zeros(self.memory, np.float32)

    def _flat(self, observation: Any) -> Array:
        space = self.observation_space
        parts = [observation[name] for name in space.spaces] if isinstance(space, gym.spaces.Dict) else [observation]
        return np.concatenate([np.asarray(each, np.float32).ravel() for each in parts])

    def _noise(self, x: Array, lasting: NDArray[Any] | None, rng: np.random.Generator) -> Array:
        if lasting is not None:
            return times(lasting.T, x)
        fresh = rng.standard_normal(len(self.mean.bias), dtype=np.float32)
        if isinstance(self.log_std, Layer):
            return np.exp(np.clip(self.log_std(x), LEAST_LOG_STD, MOST_LOG_STD)) * fresh
        assert self.log_std is not None
        return np.exp(self.log_std) * fresh

    def write(self, path: Path) -> None:
        """Write it to a file, as `read` reads it.

        Args:
            path: of the file.
        """
        arrays: dict[str, NDArray[Any]] = {}

        def put(name: str, layer: Layer) -> None:
            arrays[f"{name}.weight"], arrays[f"{name}.bias"] = layer

        for index, cell in enumerate(self.cells):
            put(f"cell.{index}.given", cell.given)
            put(f"cell.{index}.fed_back", cell.fed_back)
        for index, (layer, _) in enumerate(self.hidden):
            put(f"hidden.{index}", layer)
        put("mean", self.mean)
        if isinstance(self.log_std, Layer):
            put("log_std", self.log_std)
        elif self.log_std is not None:
            arrays["log_std"] = self.log_std
        if self.normalization is not None:
            arrays |= self.normalization.arrays()
        description = {
            "cells": len(self.cells),
            "activations": [activation for _, activation in self.hidden],
            "squash": self.squash,
            "noise": self.noise,
            "most_mean": self.most_mean,
            "normalization": None if self.normalization is None else self.normalization.description(),
        }
        kept_arrays.write(path, KIND, self, description, arrays)


def read(path: Path) -> Network:
    """Read a network from a file; runs nothing.

    Args:
        path: of the file.

    Returns:
        The network.

    Raises:
        ValueError: for a file that is none, or not whole.
    """
    return restored(path, {KIND: restore})[0]


def describe(path: Path) -> dict[str, Any]:
    """Tell what a file of `Network.write` says of its network.

    Args:
        path: of the file.

    Returns:
        Its description: what it sees, what it does, how it was trained.

    Raises:
        ValueError: as `read`.
    """
    return restored(path, {KIND: restore})[1]


def restore(told: dict[str, Any], arrays: KeptArrays) -> Network:
    """Make the network that a file holds.

    Args:
        told: the description of the file.
        arrays: of the file.

    Returns:
        The network.

    Raises:
        ValueError: for what is none.
    """
    observation, action = (spaces_json.restore(told[name], name) for name in ("observation", "action"))
    if not isinstance(action, gym.spaces.Box):
        raise ValueError(f"the action must be a Box, got {action}")
    joints, width = int(np.prod(action.shape)), gym.spaces.flatdim(observation)
    cells: list[Cell] = []
    for index in range(validate.integer("cells", told["cells"], 0, 100)):
        memory = cells[0].fed_back.weight.shape[1] if cells else len(arrays.left[f"cell.{index}.given.bias"]) // 4
        given = _layer(arrays, f"cell.{index}.given", width, 4 * memory)
        cells.append(Cell(given, _layer(arrays, f"cell.{index}.fed_back", memory, 4 * memory)))
        width = memory
    hidden = []
    for index, name in enumerate(told["activations"]):
        layer = _layer(arrays, f"hidden.{index}", width)
        hidden.append((layer, validate.choice("activation", name, ACTIVATIONS)))
        width = len(layer.bias)
    mean, noise = _layer(arrays, "mean", width, joints), validate.choice("noise", told["noise"], NOISES)
    log_std: Layer | Array | None = None
    if noise == "by state":
        log_std = _layer(arrays, "log_std", width, joints)
    elif noise != "none":
        log_std = arrays.take("log_std", *((width,) if noise == "lasting" else ()), joints)
    most = told["most_mean"]
    normalization = told["normalization"]
    return Network(
        observation,
        action,
        tuple(hidden),
        mean,
        validate.boolean("squash", told["squash"]),
        noise,
        log_std,
        tuple(cells),
        None if most is None else validate.number("most_mean", most, above=0.0),
        None if normalization is None else Normalization.restore(normalization, observation, arrays.take),
        checked_training(told["told"]),
        None if "instead" not in told else instead(told["instead"], gym.spaces.flatdim(observation), arrays.take),
    )


def _layer(arrays: KeptArrays, name: str, inputs: int, outputs: int | None = None) -> Layer:
    weight = arrays.take(f"{name}.weight", outputs, inputs)
    return Layer(weight, arrays.take(f"{name}.bias", len(weight)))
