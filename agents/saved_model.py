"""A model as Stable-Baselines3 or sb3-contrib has saved it: a zip that holds pickles, which may run code when read."""

from __future__ import annotations

import inspect
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from agents.network import Memory
from agents.normalization import Normalization
from agents.training import of_spaces
from haptic_env.extras import how_to_install

WHY = (
    "a model that Stable-Baselines3 has saved holds pickles, which can run any code when they are read. If you made it "
    "yourself, or trust whoever made it as you trust a program of theirs, give trust=True (commands: --trust). "
    "haptic-slam export makes an .npz file of it that runs nothing, as haptic-slam train and agents.export write"
)


class SavedModel:
    """The network of a saved algorithm, computed by torch; it does not matter which one has trained it."""

    def __init__(self, path: Path, normalize: Any = None) -> None:
        """Read a file that is trusted.

        Args:
            path: of the zip.
            normalize: the `VecNormalize` under which it was trained, or its file.

        Raises:
            ValueError: where it is no model.
            ImportError: without Stable-Baselines3.
        """
        self._network, self.told = _load(path)
        self.observation_space, self.action_space = self._network.observation_space, self._network.action_space
        self.normalization: Normalization | None = None
        if normalize is not None:
            self.normalization = Normalization.of(normalize, self.observation_space, trust=True)

    @property
    def policy(self) -> Any:
        """The network of Stable-Baselines3, or sb3-contrib."""
        return self._network

    def predict(
        self, observation: Any, memory: Memory, began: bool, deterministic: bool, rng: np.random.Generator
    ) -> tuple[NDArray[np.float32], Memory]:
        """Compute an action, as `Network.predict`.

        Args:
            observation: one of the observation space.
            memory: what the last call returned.
            began: whether it is the first of an episode.
            deterministic: whether noise is left out.
            rng: gives the noise.

        Returns:
            Action (J,), and what to hand to the next call as `memory`.

        Raises:
            ValueError: where the model has no finite torques.
        """
        import torch

        if self.normalization is not None:
            observation = self.normalization(observation)
        with torch.random.fork_rng(devices=[]):  # sampling has no generator of its own
            torch.manual_seed(int(rng.integers(2**63)))
            if began and getattr(self._network, "use_sde", False):
                self._network.reset_noise()
            try:
                action, after = self._network.predict(observation, memory or None, np.array([began]), deterministic)
            except ValueError as error:  # a distribution of what is not finite
                raise ValueError(f"no finite torques: {error}") from error
        return action, tuple(after or ())


def _load(path: Path) -> tuple[Any, dict[str, Any]]:
    """The network saved at `path`, and what `haptic-slam train` told of how it was trained."""
    try:
        import torch
        from stable_baselines3.common.save_util import load_from_zip_file
    except ImportError as error:
        raise ImportError(
            f"models that Stable-Baselines3 has saved need it, and it is not installed: {how_to_install('train')}"
        ) from error
    try:
        data, parameters, _ = load_from_zip_file(path, device="cpu")
        if data is None:
            raise ValueError("it tells nothing of how it was made")
        keywords = dict(data["policy_kwargs"])
        if "gae_lambda" in data:  # on-policy algorithms tell it apart
            keywords["use_sde"] = data["use_sde"]
        kind = data["policy_class"]
        rate = [lambda _: 0.0] if "lr_schedule" in inspect.signature(kind).parameters else []  # ARS needs none
        with torch.random.fork_rng(devices=[]):  # it begins with weights of chance
            network = kind(data["observation_space"], data["action_space"], *rate, **keywords)
        network.load_state_dict(parameters["policy"])
        network.set_training_mode(False)
        return network, data.get("exploration") or of_spaces(data["observation_space"], data["action_space"])
    except Exception as error:  # what is unpickled may raise anything
        raise ValueError(f"{path} is no whole model of Stable-Baselines3 or sb3-contrib: {error}") from error
