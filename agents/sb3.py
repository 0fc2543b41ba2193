"""A trained model of Stable-Baselines3 or sb3-contrib as a policy."""

from __future__ import annotations

import zipfile
from importlib import resources
from pathlib import Path
from typing import Any, ClassVar

import gymnasium as gym
import numpy as np
from numpy.typing import NDArray

from agents.policy import EpisodeStart, Guided, Policy, State, starts
from observer.belief_observation import features_of

SHIPPED = Path(str(resources.files("agents"))) / "trained.zip"


class Sb3(Guided):
    """The policy that any algorithm of Stable-Baselines3 or sb3-contrib has saved at `path`; None: the shipped one.

    A model that was trained on `BeliefObservation` by `scripts/train.py` says which entries it was shown and for how
    many steps it holds an action; `env` may then be an `ObserverWrapper` with a `ShapePosterior`, of any observation.
    Any other model is used where `env` has the observations and actions that it was trained with.
    """

    asks_shape = True
    noiseless: ClassVar[bool] = False
    """Whether it acts without the noise with which it learnt, whatever `deterministic` says."""

    def __init__(self, env: gym.Env[Any, Any], seed: int | None = None, *, path: str | Path | None = None) -> None:
        """Raises `ValueError` for a file that is no model, or is one for other observations or actions than `env` has;
        `ImportError` without Stable-Baselines3."""
        self._network, told = _load(SHIPPED if path is None else Path(path))
        spaces = {"action": (self._network.action_space, env.action_space)}
        self._features = None
        if told.get("entries") and self._network.observation_space != env.observation_space:
            super().__init__(env, seed)
            self._features = features_of(env, told["entries"])
            spaces["observation"] = (self._network.observation_space, self._features.space)
        else:
            Policy.__init__(self, env, seed)
            spaces["observation"] = (self._network.observation_space, env.observation_space)
        wrong = [
            f"{what} {trained}, and here the {what} is {here}"
            for what, (trained, here) in sorted(spaces.items())
            if trained != here
        ]
        if wrong:
            raise ValueError(
                f"the model {path or SHIPPED.name} was trained for another hand or observation: {'; '.join(wrong)}"
            )
        self._hold = 1 if env.has_wrapper_attr("held") else told.get("hold", 1)

    def predict(
        self,
        observation: Any,
        state: State = None,
        episode_start: EpisodeStart = None,
        deterministic: bool = False,
    ) -> tuple[NDArray[np.float32], State]:
        import torch

        step, held, *memory = (np.zeros((), dtype=np.int64), None) if state is None or starts(episode_start) else state
        assert step is not None
        if int(step) % self._hold == 0:
            if self._features is not None:
                posterior = self.shape.posterior
                observation = self._features.vector(self.belief, observation["contacts"], posterior, int(step))
            with torch.random.fork_rng(devices=[]):  # sampling has no generator of its own
                torch.manual_seed(int(self.rng.integers(2**63)))
                if int(step) == 0 and getattr(self._network, "use_sde", False):
                    self._network.reset_noise()
                try:
                    held, after = self._network.predict(
                        observation,
                        tuple(memory) or None,
                        np.array([int(step) == 0]),
                        deterministic or self.noiseless,
                    )
                except ValueError as error:  # a distribution of what is not finite
                    raise ValueError(f"policy {self.name!r} has no finite torques to command: {error}") from error
            memory = list(after or ())
        assert held is not None
        return held.astype(np.float32), (step + 1, held, *memory)


class Trained(Sb3):
    """The model that ships, made by the preset of the same name, without the noise with which it learnt, whatever
    `deterministic` says."""

    noiseless = True

    def __init__(self, env: gym.Env[Any, Any], seed: int | None = None) -> None:
        super().__init__(env, seed)


def _load(path: Path) -> tuple[Any, dict[str, Any]]:
    """The network saved at `path`, and what `scripts/train.py` told of how it was trained.

    The network alone, so that it does not matter which algorithm has trained it.
    """
    try:
        import torch
        from stable_baselines3.common.save_util import load_from_zip_file
    except ImportError as error:
        raise ImportError(
            "trained policies need Stable-Baselines3, which is not installed: pip install 'haptic-slam[train]'"
        ) from error
    try:
        data, parameters, _ = load_from_zip_file(path, device="cpu")
        if data is None:
            raise ValueError("it tells nothing of how it was made")
        keywords = dict(data["policy_kwargs"])
        if "gae_lambda" in data:  # on-policy algorithms tell it apart
            keywords["use_sde"] = data["use_sde"]
        with torch.random.fork_rng(devices=[]):  # it begins with weights of chance
            network = data["policy_class"](data["observation_space"], data["action_space"], lambda _: 0.0, **keywords)
        network.load_state_dict(parameters["policy"])
    except (OSError, zipfile.BadZipFile, ValueError, KeyError, EOFError) as error:
        raise ValueError(f"{path} is no whole model of Stable-Baselines3 or sb3-contrib: {error}") from error
    network.set_training_mode(False)
    return network, data.get("exploration", {})
