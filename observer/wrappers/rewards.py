"""Rewards for coming to know: of the truth, for training alone, for it reads what no policy may; or of anything."""

from __future__ import annotations

from abc import abstractmethod
from typing import Any

import gymnasium as gym
import numpy as np
from numpy.typing import ArrayLike, NDArray

from haptic_env import validate
from observer.wrappers.belief_observation import labels_of
from observer.wrappers.stepped_apart import SteppedApart


class PotentialReward(SteppedApart):
    """Reward of a step: by how much `potential` has risen, in place of the environment's reward.

    The sum over an episode is the potential at its end less that at its start, whatever the path (Ng, Harada & Russell
    1999, ICML), so that an episode is worth what it ends with, but a learner hears of it at once.
    """

    @abstractmethod
    def potential(self, info: dict[str, Any]) -> float:
        """Tell what it is worth to know as much.

        Args:
            info: of the environment.

        Returns:
            The potential.
        """

    def reset(self, *, seed: int | None = None, options: dict[str, Any] | None = None) -> tuple[Any, dict[str, Any]]:
        """Start an episode.

        Args:
            seed: as the environment's.
            options: as the environment's.

        Returns:
            What the environment gives.
        """
        observation, info = self.env.reset(seed=seed, options=options)
        self._before = self.potential(info)
        return observation, info

    def potential_now(self) -> float:
        """Tell what is known after the last step.

        Returns:
            The potential.
        """
        return self.potential(self.told_inside()[1])

    def advance(self, action: NDArray[Any]) -> tuple[float, bool, bool]:
        _, terminated, truncated = self.advance_inside(action)
        now = self.potential_now()
        gain, self._before = now - self._before, now
        return gain, terminated, truncated

    def told(self) -> tuple[Any, dict[str, Any]]:
        return self.told_inside()


class DecisionReward(PotentialReward, gym.utils.RecordConstructorArgs):
    """Reward of a step: what was gained in log p(truth), in nats, less `price` times the seconds that it took.

    A probability below `least` counts as `least`. At the end `info["is_success"]` (Stable-Baselines3's name for it)
    says whether the truth is the most probable. Reads `info["truth"]`: `env` needs `reveal_truth=True`.
    """

    def __init__(self, env: gym.Env[Any, Any], price: float = 0.25, least: float = 1e-3) -> None:
        """Check the arguments.

        Args:
            env: with an `ObserverWrapper` that names the object, and `reveal_truth=True`.
            price: nats a second.
            least: probability, that of the truth counts as at least.

        Raises:
            ValueError: for a value out of range, or where nothing names the object.
        """
        gym.utils.RecordConstructorArgs.__init__(self, price=price, least=least)
        gym.Wrapper.__init__(self, env)
        base: Any = env.unwrapped
        if not getattr(base, "reveal_truth", False):
            raise ValueError("DecisionReward compares with the truth: make the environment with reveal_truth=True")
        self._least = validate.number("least", least, 0.0, 0.1, above=0.0)
        self._cost = validate.number("price", price, 0.0) / base.control_hz
        self._labels = labels_of(env)

    def potential(self, info: dict[str, Any]) -> float:
        """Tell how probable the truth is.

        Args:
            info: of the environment.

        Returns:
            log p(truth), nats.

        Raises:
            ValueError: where the truth is not among the labels.
        """
        return self._worth(info["posterior"][self._truth(info)])

    def reset(self, *, seed: int | None = None, options: dict[str, Any] | None = None) -> tuple[Any, dict[str, Any]]:
        observation, info = super().reset(seed=seed, options=options)
        self._true, self._over = self._truth(info), False  # the same all along
        return observation, info

    def potential_now(self) -> float:
        if type(self).potential is not DecisionReward.potential:
            return super().potential_now()
        return self._worth(self.posterior_now()[self._true])

    def advance(self, action: NDArray[Any]) -> tuple[float, bool, bool]:
        gain, terminated, truncated = super().advance(action)
        self._over = terminated or truncated
        return gain - self._cost, terminated, truncated

    def told(self) -> tuple[Any, dict[str, Any]]:
        observation, info = super().told()
        if not self._over:
            return observation, info
        return observation, {**info, "is_success": bool(np.argmax(info["posterior"]) == self._true)}

    def _worth(self, probability: float) -> float:
        return float(np.log(max(probability, self._least)))

    def _truth(self, info: dict[str, Any]) -> int:
        return self._labels.index(validate.choice("label of the true shape", info["truth"]["shape"], self._labels))


class InformationGainReward(PotentialReward, gym.utils.RecordConstructorArgs):
    """Reward of a step: by how many bits the entropy has fallen, of the `objective`: the posterior over names, or the
    map, its voxels taken as independent; of "surface" it is that of occupied voxels alone, each of which is worth up to
    one bit, so that it grows with the surface that was covered, and not with the space that was found to be empty.
    It needs no truth: a belief pays it to itself, also where it is wrong."""

    def __init__(self, env: gym.Env[Any, Any], objective: str = "class") -> None:
        """Check the arguments.

        Args:
            env: with an `ObserverWrapper`; for "class" one that names the object.
            objective: whose entropy: "class", "map" or "surface".

        Raises:
            ValueError: for an unknown objective, where nothing observes, or names the object.
        """
        gym.utils.RecordConstructorArgs.__init__(self, objective=objective)
        gym.Wrapper.__init__(self, env)
        self._objective = validate.choice("objective", objective, ("class", "map", "surface"))
        if objective == "class":
            labels_of(env)
        elif not env.has_wrapper_attr("belief"):
            raise ValueError(f"nothing observes {env}; wrap it: ObserverWrapper(env, HapticSLAM(hand))")

    def potential(self, info: dict[str, Any]) -> float:
        """Tell how sure one is.

        Args:
            info: of the environment.

        Returns:
            Minus the entropy, bits.
        """
        if self._objective == "class":
            return float(_bits(info["posterior"]).sum())
        occupied = info["belief"].occupancy
        if self._objective == "surface":
            occupied = occupied[occupied > 0.5]
            return float((1.0 + _bits(occupied) + _bits(1.0 - occupied)).sum())
        return float((_bits(occupied) + _bits(1.0 - occupied)).sum())


def _bits(probability: ArrayLike) -> NDArray[np.float64]:
    """p log2 p (...,) of `probability` (...,); 0 where it is 0."""
    p = np.asarray(probability, dtype=np.float64)
    return p * np.log2(np.where(p > 0.0, p, 1.0))
