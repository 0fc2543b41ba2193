"""The environments by their ids, and which hand each is of.

A hand is told by its name (`haptic_env.hands.HANDS`), or by the path of a TOML file that describes one's own.
"""

from __future__ import annotations

from pathlib import Path
from typing import Any

import gymnasium as gym

EXPLORE = "HapticSLAM/Explore-v0"  # of any hand, its keyword `hand`
ENVIRONMENTS = {
    "HapticSLAM/TwoFinger-v0": "two_finger",
    "HapticSLAM/TwoFingerArm-v0": "two_finger_arm",
    "HapticSLAM/AdroitHand-v0": "adroit",
    "HapticSLAM/MyoHand-v0": "myo",
}
# With a belief and a reward, of any hand: made by a package that this one does not import, when they are asked for.
TASKS = {f"HapticSLAM/{name}-v0": name for name in ("Name", "NameUnknown", "Map")}


def register() -> None:
    """Let `gym.make` know all of them."""
    for env_id, hand in {**ENVIRONMENTS, EXPLORE: None}.items():
        if env_id not in gym.registry:
            told = {} if hand is None else {"hand": hand}
            gym.register(env_id, entry_point="haptic_env.explore:ExploreEnv", kwargs=told)
    for env_id, task in TASKS.items():
        if env_id not in gym.registry:
            gym.register(
                env_id,
                entry_point="haptic_lab.tasks.environment:TaskEnv",
                vector_entry_point="haptic_lab.tasks.vector:make_vector",
                kwargs={"task": task},
            )


def is_file(hand: object) -> bool:
    """Tell whether a hand is one's own, described by a file.

    Args:
        hand: name, or path.

    Returns:
        Whether it is the path of a TOML file.
    """
    return isinstance(hand, Path | str) and Path(hand).suffix.lower() == ".toml"


def hand_name(env: str) -> str:
    """Find the hand of an environment.

    Args:
        env: id of the environment, or the path of a hand of one's own.

    Returns:
        What `haptic_env.hands.make` takes.

    Raises:
        ValueError: for neither.
    """
    from haptic_env import validate  # registering needs none

    return env if is_file(env) else ENVIRONMENTS[validate.choice("environment", env, ENVIRONMENTS)]


def make(env: str, *, wrist: str | None = None, **keywords: Any) -> gym.Env[Any, Any]:
    """Make an environment.

    Args:
        env: id of the environment, or the path of a hand of one's own.
        wrist: how the hand is held, one of `haptic_env.hands.wrist.WRISTS`; None: as it usually is.
        **keywords: of the environment.

    Returns:
        The environment.

    Raises:
        ValueError: for neither, an unknown keyword, and a value out of range.
    """
    if wrist is not None:
        keywords["wrist"] = wrist
    return gym.make(EXPLORE, hand=env, **keywords) if is_file(env) else gym.make(env, **keywords)


def check_wrist(env: str, wrist: str | None) -> None:
    """Check how the hand of an environment is to be held.

    Args:
        env: id of the environment, or the path of a hand of one's own.
        wrist: as `make`'s.

    Raises:
        ValueError: for neither, an unknown wrist, and one that this hand has not.
    """
    from haptic_env.hands import wrist as wrists

    if wrist is not None:
        wrists.check(hand_name(env), wrist)


def check(what: str, env: Any) -> str:
    """Check what names an environment or a hand of one's own.

    Args:
        what: the value is, for the message.
        env: that was given.

    Returns:
        The value.

    Raises:
        ValueError: for an unknown id, and a file that describes no hand.
    """
    from haptic_env import hands, validate

    if is_file(env):
        hands.make(env)
        return str(env)
    return validate.choice(what, env, ENVIRONMENTS)
