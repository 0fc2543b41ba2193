"""Networks that NumPy computes: what their files must be, and the noise with which they act."""

from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path

import gymnasium as gym
import numpy as np
import pytest

from agents import network, spaces_json
from agents.layers import Cell, Layer
from agents.network import Network
from agents.normalization import Normalization

SPACES = {
    "uniform": gym.spaces.Box(-2.0, 2.0, (3,), np.float32),
    "each its own": gym.spaces.Box(np.array([-1.0, -np.inf]), np.array([1.0, np.inf]), dtype=np.float64),
    "binary": gym.spaces.MultiBinary(4),
    "picture": gym.spaces.Box(0, 255, (2, 3, 1), np.uint8),
    "named": gym.spaces.Dict({"b": gym.spaces.MultiBinary(2), "a": gym.spaces.Box(0.0, 1.0, (2,), np.float32)}),
}


def made(seed: int = 0, **changes) -> Network:
    """A network of every kind of part: 4 numbers, 3 units that remember, 5 units, 2 torques."""
    rng = np.random.default_rng(seed)

    def layer(outputs: int, inputs: int) -> Layer:
        return Layer(*(rng.standard_normal(size).astype(np.float32) for size in ((outputs, inputs), (outputs,))))

    space = gym.spaces.Dict({"felt": gym.spaces.MultiBinary(2), "pose": gym.spaces.Box(-3.0, 3.0, (2,), np.float32)})
    usual = Network(
        observation_space=space,
        action_space=gym.spaces.Box(-1.0, 1.0, (2,), np.float32),
        hidden=((layer(5, 3), "Tanh"), (layer(4, 5), "ReLU")),
        mean=layer(2, 4),
        squash=True,
        noise="by state",
        log_std=layer(2, 4),
        cells=(Cell(layer(12, 4), layer(12, 3)), Cell(layer(12, 3), layer(12, 3))),
        most_mean=2.0,
        normalization=Normalization({"pose": (np.ones(2), np.full(2, 4.0))}, 1e-8, 10.0),
        told={"entries": [], "hold": 3},
    )
    return replace(usual, **changes)


def _episode(it: Network, deterministic: bool = True, seed: int = 1) -> np.ndarray:
    rng, memory, actions = np.random.default_rng(seed), (), []
    for step in range(6):
        seen = {"felt": np.array([step % 2, 1]), "pose": np.array([0.3 * step, -1.0])}
        action, memory = it.predict(seen, memory, step == 0, deterministic, rng)
        actions.append(action)
    return np.array(actions)


@pytest.mark.parametrize("space", SPACES.values(), ids=SPACES)
def test_a_space_comes_back_from_json(space):
    again = spaces_json.restore(json.loads(json.dumps(spaces_json.describe(space))), "observation")
    assert again == space
    if isinstance(space, gym.spaces.Dict):
        assert list(again) == list(space)


@pytest.mark.parametrize("noise", network.NOISES)
def test_a_network_comes_back_from_its_file_and_acts_the_same(tmp_path, noise):
    sizes = {"constant": (2,), "lasting": (4, 2)}
    changes = {"noise": noise}
    if noise != "by state":
        changes["log_std"] = np.full(sizes[noise], -1.0, np.float32) if noise in sizes else None
    whole = made(**changes)
    whole.write(tmp_path / "model.npz")
    again = network.read(tmp_path / "model.npz")
    assert again.told == whole.told
    for deterministic in (True, False):
        np.testing.assert_array_equal(_episode(again, deterministic), _episode(whole, deterministic))


def test_noise_is_what_was_learnt():
    """Its SD, that it lasts where it should, and that it is seeded."""
    plain = {"squash": False, "most_mean": None, "cells": (), "hidden": (), "normalization": None}
    wide = gym.spaces.Box(-99.0, 99.0, (2,), np.float32)
    it = made(**plain, action_space=wide, mean=Layer(np.zeros((2, 4), np.float32), np.zeros(2, np.float32)))
    seen = {"felt": np.array([1, 0]), "pose": np.array([2.0, 0.0])}
    log_std = np.log(np.array([0.5, 3.0], np.float32))
    by_state = Layer(np.zeros((2, 4), np.float32), log_std)
    lasting = np.log(np.array([[0.5, 1.0]] * 4, np.float32))
    for noise, given, expected in (
        ("constant", log_std, [0.5, 3.0]),
        ("by state", by_state, [0.5, 3.0]),
        ("lasting", lasting, [0.5 * 5**0.5, 5**0.5]),  # of a row of the length of what is seen
    ):
        noisy, rng = replace(it, noise=noise, log_std=given), np.random.default_rng(0)
        drawn = np.array([noisy.predict(seen, (), True, False, rng)[0] for _ in range(4000)])
        np.testing.assert_allclose(drawn.std(axis=0), expected, rtol=0.05)
        assert np.abs(drawn.mean(axis=0)).max() < 0.2
        rng = np.random.default_rng(0)
        first, memory = noisy.predict(seen, (), True, False, rng)
        np.testing.assert_array_equal(first, drawn[0])
        second, _ = noisy.predict(seen, memory, False, False, rng)
        assert (first == second).all() == (noise == "lasting")


def _rewritten(path: Path, **changes) -> Path:
    """A whole file with some of its parts changed, None: without them."""
    made().write(path)
    with np.load(path) as file:
        content = {name: file[name] for name in file.files}
    description = json.loads(str(content["description"]))
    for name, change in changes.items():
        if name in description:  # of its keys
            description[name] = change
            content["description"] = np.array(json.dumps(description))
        elif change is None:
            del content[name]
        else:
            content[name] = change
    np.savez(path, **content)
    return path


@pytest.mark.parametrize(
    ("changes", "said"),
    [
        ({"kind": "another"}, "not of a haptic-slam policy of version 1"),
        ({"version": 2}, "not of a haptic-slam policy of version 1"),
        ({"description": None}, "it has no description"),
        ({"description": np.array("[" * 5000)}, "is no policy"),
        ({"description": np.array("3")}, "is no policy"),
        ({"mean.weight": None}, r"lacks 'mean\.weight'"),
        ({"cell.1.fed_back.bias": None}, r"lacks 'cell\.1\.fed_back\.bias'"),
        ({"cell.0.given.bias": None}, "is no policy"),
        ({"mean.bias": np.zeros(3, np.float32)}, r"'mean\.bias' must be finite numbers of shape \(2,\)"),
        ({"mean.bias": np.full(2, np.nan, np.float32)}, r"'mean\.bias' must be finite numbers"),
        ({"hidden.0.weight": np.zeros((5, 4), np.float32)}, r"'hidden\.0\.weight' must be .* shape \('any', 3\)"),
        ({"mean.weight": np.full((2, 4), "a")}, r"'mean\.weight' must be finite numbers of .*, got <U1"),
        ({"activations": ["Tanh", "Exp"]}, "unknown activation 'Exp'; choose from ELU"),
        ({"activations": None}, "is no policy"),
        ({"activations": ["Tanh"]}, r"'mean\.weight' must be"),
        ({"noise": "pink"}, "unknown noise 'pink'"),
        ({"cells": -1}, r"cells must be an integer in \[0, 100\], got -1"),
        ({"squash": 1}, "squash must be True or False, got 1"),
        ({"most_mean": "2"}, "most_mean must be a finite number"),
        ({"observation": {"kind": "box"}}, "the space of observation is not told as it should be"),
        ({"observation": {"kind": "binary", "shape": [10**9]}}, "size of observation must be an integer in"),
        ({"observation": {"kind": "binary", "shape": [10**6] * 4}}, "numbers of observation must be an integer in"),
        ({"observation": {"kind": "tuple"}}, "unknown kind of observation 'tuple'"),
        ({"action": {"kind": "binary", "shape": [2]}}, "the action must be a Box"),
        ({"action": {"kind": "box", "shape": [2], "low": 1, "high": [1, 2, 3], "dtype": "float32"}}, "is no policy"),
        ({"action": {"kind": "box", "shape": [2], "low": 0, "high": 1, "dtype": "O"}}, "unknown dtype of action 'O'"),
        ({"told": {"hold": 0}}, "hold must be an integer in"),
        ({"told": {"entries": [3]}}, "entries must be names"),
        ({"told": [3]}, "must be a table"),
        ({"normalization": {"entries": ["nose"], "epsilon": 0, "clip": 1}}, "unknown entry .* 'nose'"),
        ({"normalization": {"entries": ["pose"], "epsilon": 0, "clip": "far"}}, "clip of normalize must be"),
        ({"normalization.variance.pose": np.full(2, -1.0)}, "variance .* must be positive"),
    ],
)
def test_a_file_that_is_not_whole_is_told(tmp_path, changes, said):
    _rewritten(tmp_path / "model.npz", **changes)
    with pytest.raises(ValueError, match=said) as error:
        network.read(tmp_path / "model.npz")
    assert "model.npz" in str(error.value)
