"""Observations as a network that was trained under `VecNormalize` of Stable-Baselines3 was shown them."""

from __future__ import annotations

import os
import pickle
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import gymnasium as gym
import numpy as np
from numpy.typing import NDArray

from haptic_env import validate
from haptic_env.arrays import Array

PARTS = "mean", "variance"
WHOLE = ""  # the name of an observation that has no entries


@dataclass(frozen=True)
class Normalization:
    """Mean and variance of each entry that is normalised, of an observation without entries of `WHOLE`; what is beyond
    ± `clip` afterwards is clipped."""

    statistics: Mapping[str, tuple[Array, Array]]
    epsilon: float
    clip: float

    def __call__(self, observation: Any) -> Any:
        """The same observation, normalised."""
        if WHOLE in self.statistics:
            return self._scaled(observation, WHOLE)
        return {**observation, **{name: self._scaled(observation[name], name) for name in self.statistics}}

    def _scaled(self, values: Any, name: str) -> NDArray[np.float32]:
        mean, variance = self.statistics[name]
        scaled = (np.asarray(values) - mean) / np.sqrt(variance + self.epsilon)
        return np.clip(scaled, -self.clip, self.clip).astype(np.float32)

    def arrays(self) -> dict[str, Array]:
        """Its arrays, by the names that they have in a file."""
        pairs = {name: zip(PARTS, pair, strict=True) for name, pair in self.statistics.items()}
        return {f"normalization.{part}.{name}": array for name, pair in pairs.items() for part, array in pair}

    def description(self) -> dict[str, Any]:
        """The rest of it, as JSON."""
        return {"entries": list(self.statistics), "epsilon": self.epsilon, "clip": self.clip}

    @classmethod
    def restore(
        cls, told: Mapping[str, Any], space: gym.Space[Any], take: Callable[..., NDArray[Any]]
    ) -> Normalization:
        """From `description` and `arrays`, of which `take` gives one by its name, shape and dtype."""
        shapes = shapes_of(space)
        statistics = {}
        for name in told["entries"]:
            shape = shapes[validate.choice("entry that is normalised", name, shapes)]
            mean, variance = (take(f"normalization.{part}.{name}", *shape, dtype=float) for part in PARTS)
            statistics[name] = mean, variance
        return cls(statistics, told["epsilon"], told["clip"])._checked(space)

    @classmethod
    def of(cls, given: Any, space: gym.Space[Any], *, trust: bool) -> Normalization | None:
        """From a `VecNormalize`, or the path of the file where one was saved, which is a pickle; None: observations of
        `space` are not normalised. Raises `ValueError` for anything else, and for a file that is not to be trusted."""
        if isinstance(given, str | Path):
            given = _unpickled(Path(given), trust)
        try:
            if not given.norm_obs:
                return None
            kept = given.obs_rms if isinstance(given.obs_rms, dict) else {WHOLE: given.obs_rms}
            statistics = {name: (np.asarray(each.mean), np.asarray(each.var)) for name, each in kept.items()}
            made = cls(statistics, float(given.epsilon), float(given.clip_obs))
        except (AttributeError, TypeError) as error:
            raise ValueError(
                f"normalize must be a VecNormalize or the path of the file where one was saved, got {given!r}"
            ) from error
        return made._checked(space)

    def _checked(self, space: gym.Space[Any]) -> Normalization:
        shapes = shapes_of(space)
        validate.number("epsilon of normalize", self.epsilon, 0.0)
        validate.number("clip of normalize", self.clip, above=0.0)
        for name, (mean, variance) in self.statistics.items():
            if name not in shapes:
                raise ValueError(
                    f"normalize has statistics of {name!r}; the model was trained on {', '.join(map(repr, shapes))}"
                )
            validate.array(f"the mean that normalize has of {name!r}", mean, shapes[name])
            validate.array(f"the variance that normalize has of {name!r}", variance, shapes[name])
            if (variance + self.epsilon <= 0.0).any():
                raise ValueError(f"the variance that normalize has of {name!r} must be positive, got {variance.min()}")
        return self


def shapes_of(space: gym.Space[Any]) -> dict[str, tuple[int, ...]]:
    """Shape of each entry of an observation, or of the whole one."""
    if isinstance(space, gym.spaces.Dict):
        return {name: each.shape or () for name, each in space.spaces.items()}
    return {WHOLE: space.shape or ()}


def _unpickled(path: Path, trust: bool) -> Any:
    if not os.path.isfile(path):
        raise ValueError(f"normalize must be the path of a file that exists, got {str(path)!r}")
    if not trust:
        raise ValueError(
            f"{path} is a pickle, which can run any code when it is read; if you made it yourself, or trust whoever "
            "made it as you trust a program of theirs, give trust=True"
        )
    try:
        with path.open("rb") as file:
            return pickle.load(file)
    except Exception as error:  # a pickle may raise anything
        raise ValueError(f"{path} is no whole file of VecNormalize: {error}") from error
