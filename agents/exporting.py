"""Models of Stable-Baselines3 and sb3-contrib as files that hold numbers and a description, and run nothing."""

from __future__ import annotations

import copy
import hashlib
import json
import os
from collections.abc import Sequence
from dataclasses import replace
from types import SimpleNamespace
from typing import Any

import gymnasium as gym
import numpy as np

from agents.layers import ACTIVATIONS, Array, Cell, Layer
from agents.network import Memory, Network, describe
from agents.normalization import Normalization
from agents.saved_model import WHY, SavedModel
from agents.training import training_of
from haptic_env import validate
from haptic_env.files import atomic, check_writable

SAMPLES = 8  # observations at which the file must act as the model
TOLERANCE = 1e-4  # of the torque limits: float32, summed in another order


def export(
    model: Any,
    path: str | os.PathLike[str],
    normalize: Any = None,
    *,
    entries: Sequence[str] | None = None,
    hold: int | None = None,
) -> None:
    """Write the policy of a model to a file, whole or not at all; `agents.make("sb3", env, path=path)` uses it, without
    torch.

    Args:
        model: an algorithm of Stable-Baselines3 or sb3-contrib.
        path: of the file, *.npz.
        normalize: the `VecNormalize` under which it was trained, if it was.
        entries: of the `BeliefObservation` that it was shown, so that it can be shown the same again; None: those of
            the model's own environment, which one that was loaded from a file has not.
        hold: control steps for which each of its actions lasts; None: as the `HoldAction` of its environment says.

    Raises:
        ValueError: for another path, one that cannot be written, a model that is no plain network: of images, with
            layers that are not known, or that does not act as its layers say, and for entries that it cannot have been
            shown.
        OSError: where the disk is full.
    """
    path = validate.path("path", path)
    if path.suffix != ".npz":
        raise ValueError(f"path must end in .npz, got {str(path)!r}")
    check_writable("path", path)
    network = network_of(model, normalize, entries, hold)
    with atomic(path) as place:
        network.write(place)


def export_saved(
    saved: str | os.PathLike[str],
    path: str | os.PathLike[str],
    normalize: Any = None,
    *,
    trust: bool = False,
    entries: Sequence[str] | None = None,
    hold: int | None = None,
) -> dict[str, Any]:
    """Write the policy of a model that Stable-Baselines3 has saved to a file as `export` does, and beside it, in
    *.json, what it is for.

    Args:
        saved: path of the .zip.
        path: of the file, *.npz.
        normalize: the `VecNormalize` under which it was trained, or the file where that was saved, a pickle likewise.
        trust: whether these may run what they like, for they hold pickles.
        entries: as `export`'s.
        hold: as `export`'s.

    Returns:
        What the JSON says: the network's description, and the file with its SHA-256.

    Raises:
        ValueError: as `export`, where the file is no model, and where it is not to be trusted.
        ImportError: without Stable-Baselines3.
        OSError: where the disk is full.
    """
    target, source = validate.path("path", path), validate.path("saved", saved)
    if target.suffix != ".npz" or source.suffix != ".zip":
        raise ValueError(f"a .zip is made an .npz, got {str(source)!r} and {str(target)!r}")
    if not os.path.isfile(source):
        raise ValueError(f"{str(source)!r} must be a file that exists")
    if not validate.boolean("trust", trust):
        raise ValueError(f"{source} is not read: {WHY}")
    for each in (target, target.with_suffix(".json")):
        check_writable("path", each)
    model = SavedModel(source, normalize)
    policy = model.policy
    network = network_of(
        SimpleNamespace(
            policy=policy,
            observation_space=model.observation_space,
            action_space=model.action_space,
            predict=policy.predict,
            exploration=model.told,
        ),
        None,
        entries,
        hold,
    )
    with atomic(target) as place:
        replace(network, normalization=model.normalization).write(place)
    said = {"file": target.name, "sha256": hashlib.sha256(target.read_bytes()).hexdigest(), **describe(target)}
    with atomic(target.with_suffix(".json")) as place:
        place.write_text(json.dumps(said, indent=1) + "\n", encoding="utf-8")
    return said


def network_of(
    model: Any, normalize: Any = None, entries: Sequence[str] | None = None, hold: int | None = None
) -> Network:
    """Take the network out of a model: what `export` writes.

    Args:
        model: an algorithm of Stable-Baselines3 or sb3-contrib.
        normalize: the `VecNormalize` under which it was trained, if it was.
        entries: as `export`'s.
        hold: as `export`'s.

    Returns:
        The network.

    Raises:
        ValueError: for a model that is no plain network, or was not shown such entries.
    """
    policy, space = getattr(model, "policy", None), getattr(model, "action_space", None)
    if policy is None or not isinstance(space, gym.spaces.Box):
        raise ValueError(f"model must be one of Stable-Baselines3 whose actions are a Box, got {model!r}")
    parts = _parts(policy)
    network = Network(
        observation_space=copy.deepcopy(model.observation_space),
        action_space=copy.deepcopy(space),
        normalization=None if normalize is None else Normalization.of(normalize, model.observation_space, trust=False),
        told=training_of(model, entries, hold),
        **parts,
    )
    _compare(model, network)
    return network


def _parts(policy: Any) -> dict[str, Any]:
    """Layers and noise of the network that acts."""
    if hasattr(policy, "mlp_extractor"):  # PPO, A2C, TRPO, RecurrentPPO
        _check_flat(policy.pi_features_extractor)
        mean, squash, most = _layer(policy.action_net), bool(policy.squash_output), None
        parts: dict[str, Any] = {"hidden": _hidden(policy.mlp_extractor.policy_net)}
        if hasattr(policy, "lstm_actor"):
            parts["cells"] = _cells(policy.lstm_actor)
        return parts | {"mean": mean, "squash": squash, "most_mean": most, **_noise(policy)}
    actor = getattr(policy, "actor", policy)
    _check_flat(getattr(actor, "features_extractor", None))
    if hasattr(actor, "latent_pi"):  # SAC, TQC
        mean, *clipped = actor.mu if hasattr(actor.mu, "__iter__") else [actor.mu]
        most = float(clipped[0].max_val) if clipped else None
        return {
            "hidden": _hidden(actor.latent_pi),
            "mean": _layer(mean),
            "squash": True,
            "most_mean": most,
            **_noise(actor),
        }
    layers = list(getattr(actor, "mu", getattr(actor, "action_net", ())))  # TD3, DDPG, ARS
    squash = bool(layers) and type(layers[-1]).__name__ == "Tanh"
    if squash:
        layers.pop()
    if not layers:
        raise ValueError(f"no layers that act are known in {type(policy).__name__}")
    return {"hidden": _hidden(layers[:-1]), "mean": _layer(layers[-1]), "squash": squash}


def _noise(actor: Any) -> dict[str, Any]:
    kind = type(actor.action_dist).__name__
    if kind == "DiagGaussianDistribution":
        return {"noise": "constant", "log_std": _array(actor.log_std)}
    if kind == "SquashedDiagGaussianDistribution":
        return {"noise": "by state", "log_std": _layer(actor.log_std)}
    if kind == "StateDependentNoiseDistribution":
        std = actor.action_dist.get_std(actor.log_std)
        wide = std.expand(-1, actor.action_dist.action_dim)  # without full_std all joints have the same
        return {"noise": "lasting", "log_std": np.log(_array(wide))}
    raise ValueError(f"the noise {kind} is not known")


def _check_flat(extractor: Any) -> None:
    """Raise `ValueError` unless all that `extractor` does is to put numbers in a row."""
    extractors = getattr(extractor, "extractors", None)
    parts = [extractor] if extractors is None else list(extractors.values())
    if not all(type(each).__name__ in ("Flatten", "FlattenExtractor") for each in parts):
        raise ValueError(f"the features of {extractor} are not known; observations must be plain numbers")


def _hidden(layers: Any) -> tuple[tuple[Layer, str], ...]:
    steps = list(layers)
    names = [type(each).__name__ for each in steps[1::2]]
    unknown = [name for name in names if name not in ACTIVATIONS]
    if unknown or len(steps) % 2:
        raise ValueError(f"hidden layers must be linear, each before one of {', '.join(ACTIVATIONS)}, got {steps}")
    return tuple((_layer(each), name) for each, name in zip(steps[::2], names, strict=True))


def _cells(lstm: Any) -> tuple[Cell, ...]:
    def layer(what: str, index: int) -> Layer:
        return Layer(*(_array(getattr(lstm, f"{part}_{what}_l{index}")) for part in ("weight", "bias")))

    return tuple(Cell(layer("ih", index), layer("hh", index)) for index in range(lstm.num_layers))


def _layer(linear: Any) -> Layer:
    if type(linear).__name__ != "Linear":
        raise ValueError(f"a layer must be linear, got {linear}")
    weight = _array(linear.weight)
    return Layer(weight, np.zeros(len(weight), np.float32) if linear.bias is None else _array(linear.bias))


def _array(tensor: Any) -> Array:
    array = tensor.detach().cpu().numpy().astype(np.float32)  # a copy
    if not np.isfinite(array).all():
        raise ValueError(f"the weights of a model must be finite, got {array[~np.isfinite(array)][0]}")
    return array


def _compare(model: Any, network: Network) -> None:
    """Raise `ValueError` where `network` does not act as `model`, which may do anything with its layers."""
    space, rng = copy.deepcopy(model.observation_space), np.random.default_rng(0)
    space.seed(0)
    bare = replace(network, normalization=None)
    for _ in range(SAMPLES):
        observation, state = space.sample(), None
        memory: Memory = ()
        for step in range(2):  # the second has something to remember
            expected, state = model.predict(observation, state, np.array([step == 0]), deterministic=True)
            action, memory = bare.predict(observation, memory, step == 0, True, rng)
            if not np.allclose(action, expected, rtol=0.0, atol=TOLERANCE):
                off = float(np.abs(action - expected).max())
                raise ValueError(f"{type(model.policy).__name__} does not act as its layers say: {off:.3g} off")
