"""How a model was trained: the entries of the belief that it was shown, and for how many steps it held an action."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import gymnasium as gym

from agents.space_difference import brief
from haptic_env import validate
from observer.wrappers.belief_observation import ENTRIES

MOST_HELD = 10_000  # control steps of an action


def training_of(model: Any, entries: Sequence[str] | None = None, hold: int | None = None) -> dict[str, Any]:
    """Say what a policy must know to use a model as it was trained.

    Args:
        model: an algorithm of Stable-Baselines3 or sb3-contrib.
        entries: of the belief that it was shown; None: what the model itself says, or else its environment.
        hold: control steps for which an action lasts; None: likewise.

    Returns:
        What JSON can say: "entries" and "hold" as far as they are known, and what else the model says.

    Raises:
        ValueError: for entries of no belief, or that the model was not shown.
    """
    told = dict(getattr(model, "exploration", {}))
    told = told or of_spaces(model.observation_space, model.action_space) | _of_environment(model)
    if entries is not None:
        given = list(validate.names("entries", entries))
        for entry in given:
            validate.choice("entry", entry, ENTRIES)
        shown = model.observation_space
        if len(shown.shape or ()) != 1:
            raise ValueError(f"entries are of a belief, one row of numbers; it was shown {brief(shown)}")
        if told.get("entries", given) != given:
            raise ValueError(f"entries must be {', '.join(told['entries'])}, as it was shown, got {', '.join(given)}")
        told["entries"] = given
    if hold is not None:
        told["hold"] = validate.integer("hold", hold, 1, MOST_HELD)
    return told


def checked_training(told: Any) -> dict[str, Any]:
    """Check what a file says of how its model was trained.

    Args:
        told: of the file.

    Returns:
        The same: "entries" of the belief that it saw (none: what is felt), and "hold", the steps of an action.

    Raises:
        ValueError: where it says something else.
    """
    if not isinstance(told, dict):
        raise ValueError(f"how it was trained must be a table, got {told!r}")
    if not all(isinstance(each, str) for each in told.get("entries", [])):
        raise ValueError(f"entries must be names, got {told['entries']!r}")
    validate.integer("hold", told.get("hold", 1), 1, MOST_HELD)
    return told


def of_spaces(observation: gym.Space[Any], action: gym.Space[Any]) -> dict[str, Any]:
    """Say what spaces know of how a model was trained, also those that Stable-Baselines3 saves with it.

    Args:
        observation: of the model; a `BeliefSpace` knows its entries.
        action: of the model; a `HeldSpace` knows for how long it is held.

    Returns:
        "entries" and "hold", as far as they are known.
    """
    entries, held = getattr(observation, "entries", None), getattr(action, "held", None)
    told: dict[str, Any] = {} if entries is None else {"entries": list(entries)}
    return told if held is None else told | {"hold": int(held)}


def _of_environment(model: Any) -> dict[str, Any]:
    """What the environment of `model`, if it has one, shows it and does with its actions."""
    env = model.get_env() if hasattr(model, "get_env") else None
    told: dict[str, Any] = {}
    if env is None:
        return told
    if env.has_attr("features") and env.has_attr("belief"):
        features = env.get_attr("features")[0]
        if getattr(features, "space", None) == model.observation_space:  # nothing else has changed what it sees
            told["entries"] = list(features.entries)
    if env.has_attr("held"):
        told["hold"] = int(env.get_attr("held")[0])
    return told
