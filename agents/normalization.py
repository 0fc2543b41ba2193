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
    """How observations are normalised, each entry by its mean and variance; entries of `WHOLE` are not.

    Attributes:
        statistics: mean and variance of each entry, by its name.
        epsilon: added to the variance.
        clip: what is beyond ± this afterwards is clipped.
    """

    statistics: Mapping[str, tuple[Array, Array]]
    epsilon: float
    clip: float

    def __call__(self, observation: Any) -> Any:
        """Normalise an observation.

        Args:
            observation: one of the space that it was made for.

        Returns:
            The same, normalised.
        """
        if WHOLE in self.statistics:
            return self._scaled(observation, WHOLE)
        return {**observation, **{name: self._scaled(observation[name], name) for name in self.statistics}}

    def _scaled(self, values: Any, name: str) -> NDArray[np.float32]:
        mean, variance = self.statistics[name]
        scaled = (np.asarray(values) - mean) / np.sqrt(variance + self.epsilon)
        return np.clip(scaled, -self.clip, self.clip).astype(np.float32)

    def arrays(self) -> dict[str, Array]:
        """Give its arrays, as a file holds them.

        Returns:
            The arrays by their names in a file.
        """
        pairs = {name: zip(PARTS, pair, strict=True) for name, pair in self.statistics.items()}
        return {f"normalization.{part}.{name}": array for name, pair in pairs.items() for part, array in pair}

    def description(self) -> dict[str, Any]:
        """Give the rest of it.

        Returns:
            What JSON can say.
        """
        return {"entries": list(self.statistics), "epsilon": self.epsilon, "clip": self.clip}

    @classmethod
    def restore(
        cls, told: Mapping[str, Any], space: gym.Space[Any], take: Callable[..., NDArray[Any]]
    ) -> Normalization:
        """Make it of `description` and `arrays`.

        Args:
            told: the description.
            space: of the observations.
            take: gives an array by its name, shape and dtype.

        Returns:
            The normalization.

        Raises:
            ValueError: for a description that is none.
        """
        shapes = shapes_of(space)
        statistics = {}
        for name in told["entries"]:
            shape = shapes[validate.choice("entry that is normalised", name, shapes)]
            mean, variance = (take(f"normalization.{part}.{name}", *shape, dtype=float) for part in PARTS)
            statistics[name] = mean, variance
        return cls(statistics, told["epsilon"], told["clip"])._checked(space)

    @classmethod
    def of(cls, given: Any, space: gym.Space[Any], *, trust: bool) -> Normalization | None:
        """Make it of a `VecNormalize`.

        Args:
            given: that object, or the path of the file where one was saved, which is a pickle.
            space: of the observations.
            trust: whether the file may run what it likes.

        Returns:
            The normalization; None where observations are not normalised.

        Raises:
            ValueError: for anything else, and for a file that is not to be trusted.
        """
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
    """Tell the shape of each entry of an observation, or of the whole one.

    Args:
        space: of the observations.

    Returns:
        The shapes by the names of the entries.
    """
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
