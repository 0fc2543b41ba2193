"""What a learner explores: objects and noise drawn afresh each episode, a belief to look at, a reward for deciding."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import partial
from typing import Any

import gymnasium as gym
import numpy as np
from numpy.typing import NDArray
from stable_baselines3.common.monitor import Monitor
from stable_baselines3.common.vec_env import DummyVecEnv, SubprocVecEnv, VecEnv

import haptic_env
from agents.hold_action import HoldAction
from haptic_env import shapes, validate
from observer import (
    BeliefObservation,
    DecideWhenSure,
    DecisionReward,
    HapticSLAM,
    ObserverWrapper,
    PoseOnly,
    ShapePosterior,
)
from observer.belief_observation import ENTRIES

BANDS = 10  # of the range of sizes; of these
HELD_OUT = (2, 7)  # are never trained with
RAW = "raw"


@dataclass(frozen=True)
class World:
    """What is explored and how it is rewarded.

    `sigma_deg`: least and largest noise, drawn for each episode; the jitters as the environment's keyword arguments;
    `observation`: entries of the belief, or ("raw",) for what is felt; `hold`: control steps of an action; `price` and
    `threshold`, `sure_seconds`: of `DecisionReward` and `DecideWhenSure`; `variants`, `samples`, `stride` and `temper` of
    the `ShapePosterior` that is asked, a coarser one than evaluation has, as it is most of the time that a step takes;
    evidence adds up as fast: `temper` / `stride` is the same.
    """

    env: str = "HapticSLAM/TwoFinger-v0"
    seconds: float = 10.0
    sigma_deg: tuple[float, float] = (2.0, 6.0)
    size_jitter: float = 0.2
    yaw_jitter: float = 45.0
    position_jitter: float = 0.005
    observation: tuple[str, ...] = tuple(ENTRIES)
    hold: int = 5
    price: float = 0.25
    threshold: float = 0.98
    sure_seconds: float = 0.0
    variants: int = 32
    samples: int = 8
    stride: int = 5
    temper: float = 0.083

    def __post_init__(self) -> None:
        validate.choice("env", self.env, haptic_env.ENVIRONMENTS)
        low, high = (validate.number("sigma_deg", each, 0.0, 90.0, above=0.0, unit="degrees") for each in self.sigma_deg)
        if low > high:
            raise ValueError(f"sigma_deg must be the least and the largest, got {self.sigma_deg!r}")
        if self.observation != (RAW,):
            for entry in self.observation:
                validate.choice("entry of observation", entry, (*ENTRIES, RAW))


class Varied(gym.Wrapper):
    """Draws sigma for each episode, tells it to `observer`, and keeps the sizes of training and evaluation apart:
    the range of sizes has `BANDS`, those in `HELD_OUT` belong to evaluation."""

    def __init__(self, env: gym.Env[Any, Any], observer: HapticSLAM, world: World, held_out: bool) -> None:
        super().__init__(env)
        self._observer, self._world, self._held_out = observer, world, held_out
        self._rng = np.random.default_rng()

    def reset(self, *, seed: int | None = None, options: dict[str, Any] | None = None) -> tuple[Any, dict[str, Any]]:
        if seed is not None:
            self._rng = np.random.default_rng(seed)
        sigma = float(self._rng.uniform(*self._world.sigma_deg))
        self._observer.pose.sigma = np.deg2rad(sigma)  # type: ignore[attr-defined]
        while True:
            observation, info = self.env.reset(seed=seed, options={**(options or {}), "sigma_deg": sigma})
            if self._mine(info["truth"]):
                return observation, info
            seed = None

    def _mine(self, truth: dict[str, Any]) -> bool:
        if self._world.size_jitter == 0.0:
            return True
        scale = float(truth["object_size"][0] / shapes.SHAPES[truth["shape"]].default_size[0])
        place = 0.5 * ((scale - 1.0) / self._world.size_jitter + 1.0)
        return (int(BANDS * place) in HELD_OUT) == self._held_out


class Brief(gym.Wrapper):
    """Leaves of `info` what a learner reads: beliefs would be copied from process to process at every step."""

    def step(self, action: NDArray[np.float32]) -> tuple[Any, Any, bool, bool, dict[str, Any]]:
        *told, info = self.env.step(action)
        return *told, {key: info[key] for key in ("is_success", "decision") if key in info}  # type: ignore[return-value]

    def reset(self, **keywords: Any) -> tuple[Any, dict[str, Any]]:
        return self.env.reset(**keywords)[0], {}


def make_env(world: World, held_out: bool = False) -> gym.Env[Any, Any]:
    """The environment of `world`, with the sizes of training or those `held_out`."""
    vary = {name: getattr(world, name) for name in ("size_jitter", "yaw_jitter", "position_jitter")}
    env = gym.make(world.env, episode_seconds=world.seconds, reveal_truth=True, **vary)
    base: Any = env.unwrapped
    if "occupancy" in world.observation:
        observer = HapticSLAM(base.hand, particles=1, control_hz=base.control_hz)
    else:
        observer = PoseOnly(base.hand, control_hz=base.control_hz)
    coarse = {name: getattr(world, name) for name in ("variants", "samples", "stride", "temper")}
    shape = ShapePosterior(base.hand, **coarse, **vary)
    env = ObserverWrapper(Varied(env, observer, world, held_out), observer, shape)
    env = DecisionReward(DecideWhenSure(env, world.threshold, world.sure_seconds), world.price)
    if world.observation != (RAW,):
        env = BeliefObservation(env, world.observation)
    return Monitor(Brief(HoldAction(env, world.hold)))


def make_vector(world: World, count: int, jobs: int, held_out: bool = False) -> VecEnv:
    """`count` environments, each in a process of its own where `jobs` is more than one."""
    makers: list[Callable[[], gym.Env[Any, Any]]] = [partial(make_env, world, held_out) for _ in range(count)]
    return SubprocVecEnv(makers) if jobs > 1 else DummyVecEnv(makers)
