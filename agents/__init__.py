"""The registry of exploration policies: add one as a file here and a line in `POLICIES`."""

from __future__ import annotations

import inspect
from typing import Any

import gymnasium as gym

from agents.policy import Policy
from agents.random_torque import RandomTorque
from haptic_env import validate

POLICIES: dict[str, type[Policy]] = {
    "random_torque": RandomTorque,
}

__all__ = ["POLICIES", "Policy", "make"]


def make(name: str, env: gym.Env[Any, Any], seed: int | None = None, **keywords: Any) -> Policy:
    """Make the policy `name` for `env`; raises `ValueError` for an unknown name or keyword."""
    policy = POLICIES[validate.choice("policy", name, POLICIES)]
    parameters = inspect.signature(policy).parameters.values()
    valid = [each.name for each in parameters if each.kind is inspect.Parameter.KEYWORD_ONLY]
    validate.keywords(f"{name} policy", keywords, valid)
    return policy(env, seed, **keywords)
