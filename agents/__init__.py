"""The registry of exploration policies: add one as a file here and a line in `POLICIES`."""

from __future__ import annotations

import os
from typing import Any

import gymnasium as gym

from agents.ablation import ablate
from agents.contour_following import ContourFollowing
from agents.coverage import Coverage
from agents.enclosure import Enclosure
from agents.exporting import export
from agents.information_gain import InformationGain
from agents.policy import Guided, Policy, act
from agents.random_torque import RandomTorque
from agents.sb3 import Reflexes, Sb3, Searched, Trained, WholeHand, is_model, load_model
from agents.sweep import Sweep
from agents.synergy import Synergy
from haptic_env import validate
from haptic_env.moved import moved

POLICIES: dict[str, type[Policy]] = {
    "contour_following": ContourFollowing,
    "coverage": Coverage,
    "enclosure": Enclosure,
    "information_gain": InformationGain,
    "random_torque": RandomTorque,
    "reflexes": Reflexes,
    "sb3": Sb3,
    "searched": Searched,
    "sweep": Sweep,
    "synergy": Synergy,
    "trained": Trained,
    "whole_hand": WholeHand,
}

moved({"agents.reach": ["agents.finger_kinematics"], "agents.smooth_chance": ["agents.ornstein_uhlenbeck"]})

__all__ = ["POLICIES", "Guided", "Policy", "ablate", "act", "export", "find", "is_model", "load_model", "make"]


def find(name: str | os.PathLike[str], called: str = "policy") -> type[Policy]:
    """Find a policy's class.

    Args:
        name: in `POLICIES`, or the path of a trained model (*.npz, or *.zip, which may run code: see `Sb3`).
        called: what the name is called there, for messages.

    Returns:
        The class; `Sb3` for a model.

    Raises:
        ValueError: for a name that is neither.
    """
    if not is_model(name):
        return POLICIES[validate.choice(called, name, POLICIES)]
    if not os.path.isfile(name):
        raise ValueError(f"{called} must be a policy's name or a model that exists, got {str(name)!r}")
    return Sb3


def make(name: str | os.PathLike[str], env: gym.Env[Any, Any], seed: int | None = None, **keywords: Any) -> Policy:
    """Make a policy for an environment.

    Policies that are `guided` need an `env` with an `ObserverWrapper` (`agents.policy.Guided`).

    Args:
        name: in `POLICIES`, or the path of a trained model (*.npz, *.zip).
        env: one environment, with a hand.
        seed: of the policy's chance; None: other chance every time.
        **keywords: of that policy.

    Returns:
        The policy.

    Raises:
        ValueError: for an unknown name or keyword, or what the policy refuses.
    """
    policy = find(name)
    if is_model(name):
        keywords = {"path": name, **keywords}
    validate.keywords(f"{name} policy", keywords, validate.keywords_of(policy))
    made = policy(env, seed, **keywords)
    made.name = str(name)
    return made
