"""The registry of exploration policies: add one as a file here and a line in `POLICIES`."""

from __future__ import annotations

import inspect
import os
from typing import Any

import gymnasium as gym

from agents.contour_following import ContourFollowing
from agents.enclosure import Enclosure
from agents.exporting import export
from agents.information_gain import InformationGain
from agents.policy import Guided, Policy, act
from agents.random_torque import RandomTorque
from agents.sb3 import Sb3, Trained, is_model, load_model
from agents.synergy import Synergy
from haptic_env import validate
from haptic_env.moved import moved

POLICIES: dict[str, type[Policy]] = {
    "contour_following": ContourFollowing,
    "enclosure": Enclosure,
    "information_gain": InformationGain,
    "random_torque": RandomTorque,
    "sb3": Sb3,
    "synergy": Synergy,
    "trained": Trained,
}

moved({"agents.reach": ["agents.finger_kinematics"], "agents.smooth_chance": ["agents.ornstein_uhlenbeck"]})

__all__ = ["POLICIES", "Guided", "Policy", "act", "export", "find", "is_model", "load_model", "make"]


def find(name: str | os.PathLike[str], called: str = "policy") -> type[Policy]:
    """The policy `name`; `Sb3` for the path of a trained model (*.npz, or *.zip, which may run code: see `Sb3`). Raises
    `ValueError` for neither; `called`: what the name is called there."""
    if not is_model(name):
        return POLICIES[validate.choice(called, name, POLICIES)]
    if not os.path.isfile(name):
        raise ValueError(f"{called} must be a policy's name or a model that exists, got {str(name)!r}")
    return Sb3


def make(name: str | os.PathLike[str], env: gym.Env[Any, Any], seed: int | None = None, **keywords: Any) -> Policy:
    """Make the policy `name`, or that of the trained model (*.npz, *.zip) at the path `name`, for `env`; raises
    `ValueError` for an unknown name or keyword.

    Policies that are `guided` need an `env` with an `ObserverWrapper` (`agents.policy.Guided`).
    """
    policy = find(name)
    if is_model(name):
        keywords = {"path": name, **keywords}
    parameters = inspect.signature(policy).parameters.values()
    valid = [each.name for each in parameters if each.kind is inspect.Parameter.KEYWORD_ONLY]
    validate.keywords(f"{name} policy", keywords, valid)
    made = policy(env, seed, **keywords)
    made.name = str(name)
    return made
