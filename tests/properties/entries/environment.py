"""The environments, the hands and the sensors. J joints, P patches."""

from __future__ import annotations

from collections.abc import Mapping
from functools import lru_cache, partial
from typing import Any

import gymnasium as gym
import numpy as np

import haptic_env
from haptic_env import hands, sensors, shapes
from haptic_env.explore import ExploreEnv
from haptic_env.hands import wrist
from haptic_env.objects import RESET_OPTIONS
from tests.properties import samples
from tests.properties.entry import Entry
from tests.properties.parameters import (
    Parameter,
    array,
    binary,
    given,
    integer,
    name,
    number,
    one_of,
    seed,
    several,
    spread,
    switch,
)
from tests.properties.rule import Allowed
from tests.properties.strategies import odd_names, odd_numbers, odd_paths

FAULTS = Parameter(number(0.0, 0.4).valid | several(integer(0, 40), least=0).valid, odd_numbers | odd_names)
KEYWORDS: dict[str, Parameter] = {
    "shape": Parameter(
        name(shapes.SHAPES).valid | several(name(shapes.SHAPES)).valid, odd_names | odd_paths | several(name("x")).odd
    ),
    "scale": number(0.01, 2.0),
    "sigma_deg": spread(90.0, samples.JOINTS),
    "bias_deg": spread(10.0, samples.JOINTS),
    "drift_deg": spread(10.0, samples.JOINTS),
    "drift_seconds": number(0.1, 20.0),
    "proportional": number(0.0, 1.0),
    "motor_noise": number(0.0, 1.0),
    "contact_miss": number(0.0, 1.0),
    "contact_false_alarm": number(0.0, 1.0),
    "contact_confusion": number(0.0, 1.0),
    "patches_stuck": FAULTS,
    "patches_dead": FAULTS,
    "size_jitter": number(0.0, 0.2),
    "position_jitter": number(0.0, 0.01),
    "yaw_jitter": number(0.0, 90.0),
    "episode_seconds": number(0.1, 20.0),
    "control_hz": one_of(50.0, 100.0, 250.0, 10),
    "render_mode": one_of(None, "rgb_array"),
    "reveal_truth": switch(),
    "patches_along": integer(1, 4),
    "patches_around": integer(1, 4),
    "no_such_keyword": one_of(1),
}
BY_MAKE = {key: each for key, each in KEYWORDS.items() if key != "render_mode"}  # which Gymnasium looks at first
OPTIONS: dict[str, Parameter] = {
    "shape": name(shapes.SHAPES),
    "position": array((3,), -0.005, 0.005),
    "quaternion": array((4,)),
    "size": array((3,), 0.02, 0.05),
    "sigma_deg": number(0.0, 90.0),
    "no_such_option": one_of(1),
}
assert set(OPTIONS) >= set(RESET_OPTIONS)
GYMNASIUM = (gym.error.Error,)


@lru_cache(maxsize=2)
def _env(env_id: str) -> gym.Env:
    return gym.make(env_id, shape="sphere", reveal_truth=True)


def _begin(env: gym.Env) -> list[Any]:
    try:
        seen = [env.reset(seed=0)]
        seen.append(env.step(np.zeros(env.action_space.shape, np.float32)))
        return seen
    finally:
        env.close()


def _make(env_id: str, **keywords: Any) -> list[Any]:
    return _begin(gym.make(env_id, **keywords))


def _reset(env_id: str, **call: Any) -> list[Any]:
    env = _env(env_id).unwrapped  # what is odd about Gymnasium's own wrappers is theirs
    seen = [env.reset(**call)]
    return [*seen, env.step(np.zeros(env.action_space.shape, np.float32))]


def _act(actions: list[Any]) -> list[Any]:
    """Whatever is refused leaves the environment as it was: the step after it is the one that would have been."""
    env = _env(samples.TWO_FINGER).unwrapped
    env.reset(seed=0)
    if not isinstance(actions, list):
        return [env.step(actions)]
    for action in actions:
        try:
            env.step(action)
        except ValueError:
            after = env.step(np.zeros(samples.JOINTS))
            assert all(np.isfinite(each).all() for each in after[0].values())
            raise
    return [env.step(np.zeros(samples.JOINTS))]


def _options() -> Parameter:
    return Parameter(given(OPTIONS), given(OPTIONS) | odd_numbers | odd_names)


def _felt_angles(sigma_deg: Any) -> Any:
    env = _env(samples.TWO_FINGER).unwrapped
    assert isinstance(env, ExploreEnv)
    env.reset(seed=0)
    return env.felt_at(sigma_deg)(samples.hand().rest_pose)


def _sensor(kind: Any, **keywords: Any) -> Any:
    """Made, sampled and asked how likely that was."""
    made, rng = kind(**keywords), np.random.default_rng(0)
    angles = samples.hand().rest_pose
    if isinstance(made, sensors.ContactDetection):
        touched = np.arange(samples.PATCHES) % 3 == 0
        return made.sample(rng, touched), made.log_prob(touched, np.full(samples.PATCHES, 0.5))
    if isinstance(made, sensors.MotorNoise):
        command = np.linspace(-1, 1, samples.JOINTS)
        return made.sample(rng, command), made.log_prob(command, command)
    noise = sensors.Proprioception([made])
    noise.reset(rng, samples.JOINTS)
    felt = noise.sample(rng, angles)
    return felt, noise.log_prob(felt, angles), sensors.FeltAngles(noise, rng, samples.JOINTS)(angles)


def _hand(kind: str, **keywords: Any) -> Any:
    made = hands.make(kind, **keywords)
    return made.rest_pose, made.joint_limits, made.torque_limits, made.patches.position, made.patches.area


def _wrists(kind: str) -> tuple[str, ...]:
    return (wrist.ONLY[kind],) if kind in wrist.ONLY else wrist.WRISTS


def _hand_answers(size: Any, path: Any, rate: Any) -> Any:
    hand = samples.hand()
    return hand.place(size), hand.torques_along(path, rate)


PATCHES = {"patches_along": integer(1, 4), "patches_around": integer(1, 4)}
DEGREES = {"bias_deg": number(0, 90), "drift_deg": number(0, 90), "drift_seconds": number(0.1, 10)}
SENSORS: Mapping[str, tuple[Any, dict[str, Parameter]]] = {
    "White": (sensors.White, {"sigma_deg": number(0, 90).always}),
    "Bias": (sensors.Bias, {"bias_deg": DEGREES["bias_deg"].always}),
    "Drift": (
        sensors.Drift,
        {
            "drift_deg": number(0, 90).always,
            "drift_seconds": number(0.1, 10).always,
            "step_seconds": number(0.002, 1).always,
        },
    ),
    "Proportional": (sensors.Proportional, {"proportional": number(0, 1).always}),
    "MotorNoise": (sensors.MotorNoise, {"fraction": number(0, 1).always}),
    "ContactDetection": (
        partial(sensors.ContactDetection, patches=samples.hand().patches),
        {
            "miss": number(0, 1),
            "false_alarm": number(0, 1),
            "confusion": number(0, 1),
            "stuck": FAULTS,
            "dead": FAULTS,
        },
    ),
}
WORDS = {
    "fraction": ("motor_noise",),
    "miss": ("contact_miss",),
    "false_alarm": ("contact_false_alarm",),
    "confusion": ("contact_confusion",),
    "stuck": ("patch",),
    "dead": ("patch",),
}

ENTRIES: dict[str, Entry] = {
    **{
        f"haptic_env.ENVIRONMENTS[{env_id}]": Entry(
            partial(_make, env_id), BY_MAKE, Allowed(words=("mesh", "object")), weight=1 if "Two" in env_id else 0.2
        )
        for env_id in haptic_env.ENVIRONMENTS
    },
    "haptic_env.explore.ExploreEnv": Entry(
        lambda hand, **keywords: _begin(ExploreEnv(hand, **keywords)),
        {"hand": name(["two_finger"]).always, **KEYWORDS},
        Allowed(words=("mesh", "object")),
    ),
    "haptic_env.explore.ExploreEnv.step": Entry(
        _act, {"actions": several(array((samples.JOINTS,))).always}, Allowed(words=("action",)), weight=4
    ),
    **{
        f"haptic_env.explore.ExploreEnv.reset[{env_id}]": Entry(
            partial(_reset, env_id),
            {"options": _options(), "seed": seed()},
            Allowed(words=("object", "reset option", "sigma_deg", "shape", "mesh", "size"), errors=GYMNASIUM),
            weight=2 if "Two" in env_id else 0.2,
        )
        for env_id in haptic_env.ENVIRONMENTS
    },
    "haptic_env.explore.ExploreEnv.felt_at": Entry(_felt_angles, {"sigma_deg": number(0, 90).always}),
    **{
        f"haptic_env.hands.HANDS[{kind}]": Entry(
            partial(_hand, kind),
            {**PATCHES, "wrist": name(_wrists(kind)), "no_such_keyword": one_of(1)},
            weight=1 if kind == "two_finger" else 0.1,
        )
        for kind in hands.HANDS
    },
    "haptic_env.hands.make": Entry(
        lambda name: _hand(name), {"name": name(["two_finger"]).always}, Allowed(words=("hand",))
    ),
    "haptic_env.hands.check": Entry(
        lambda name: hands.check("hand", name), {"name": name(hands.HANDS).always}, Allowed(words=("hand",))
    ),
    "haptic_env.hands.keywords_of": Entry(
        hands.keywords_of, {"name": name(hands.HANDS).always}, Allowed(words=("hand",))
    ),
    "haptic_env.hand.Hand": Entry(
        _hand_answers,
        {
            "size": array((3,), 0.01, 0.1).always,
            "path": array((6, samples.JOINTS)).always,
            "rate": number(1.0, 500.0).always,
        },
    ),
    **{
        f"haptic_env.sensors.{kind}": Entry(
            partial(_sensor, made),
            keywords,
            Allowed(infinite=True, words=sum((WORDS.get(k, ()) for k in keywords), ())),
        )
        for kind, (made, keywords) in SENSORS.items()
    },
    "haptic_env.sensors.Proprioception.log_prob": Entry(
        lambda **call: sensors.Proprioception([sensors.White(3.0), sensors.Proportional(0.1)]).log_prob(**call),
        {"felt": array((samples.JOINTS,)).always, "joint_angles": array((samples.JOINTS,)).always},
        Allowed(infinite=True),
    ),
    "haptic_env.sensors.MotorNoise.log_prob": Entry(
        lambda **call: sensors.MotorNoise(0.1).log_prob(**call),
        {"torque": array((samples.JOINTS,)).always, "command": array((samples.JOINTS,)).always},
        Allowed(infinite=True),
    ),
    "haptic_env.sensors.ContactDetection.log_prob": Entry(
        lambda **call: sensors.ContactDetection(0.1, 0.1).log_prob(**call),
        {"contacts": binary((samples.PATCHES,)).always, "touch_probability": array((samples.PATCHES,), 0, 1).always},
    ),
}
