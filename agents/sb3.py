"""A trained model as a policy: the weights that `agents.export` has written, or what Stable-Baselines3 has saved."""

from __future__ import annotations

import os
from dataclasses import replace
from importlib import resources
from pathlib import Path
from typing import Any, ClassVar

import gymnasium as gym
import numpy as np
from numpy.typing import NDArray

from agents import network, rhythm
from agents.kept_arrays import restored
from agents.network import Network
from agents.policy import Guided, Policy, Remembered, State
from agents.rhythm import Rhythm
from agents.saved_model import WHY, SavedModel
from agents.space_difference import difference
from haptic_env import hand_env, hand_of, validate
from observer.wrappers.belief_observation import features_of, tell_names

FOLDER = Path(str(resources.files("agents")))
SHIPPED = FOLDER / "trained.npz"
UNTOLD = (
    "; it does not say which entries of a belief it was shown: agents.export tells them of a model that has its "
    "environment, or with entries="
)
WEIGHTS, SAVED = ".npz", ".zip"
FELT = ["contacts"]


class Sb3(Guided):
    """The policy of a model that was trained with Stable-Baselines3 or sb3-contrib.

    An .npz file is what `haptic-slam train` or `agents.export` has written, numbers and a description: nothing in it
    can run, and torch is not needed. A .zip is what any algorithm has saved. It holds pickles, which can run any code
    when they are read, so that it is opened with `trust=True` alone: as you would run a program of whoever made it.

    A model that was trained on `BeliefObservation` says, where `haptic-slam train` or `agents.export` has written it,
    which entries it was shown and for how many steps it holds an action; `env` may then be an `ObserverWrapper` with a
    `ShapePosterior`, of any observation.
    Any other model is used where `env` has the observations and actions that it was trained with. One that was trained
    under `VecNormalize` needs its statistics; in an .npz they are included.
    """

    asks_shape = True
    noiseless: ClassVar[bool] = False
    """Whether it acts without the noise with which it learnt, whatever `deterministic` says."""
    shipped: ClassVar[Path] = SHIPPED
    """The model where no path is given."""

    def __init__(
        self,
        env: gym.Env[Any, Any],
        seed: int | None = None,
        *,
        path: str | os.PathLike[str] | None = None,
        normalize: Any = None,
        trust: bool = False,
    ) -> None:
        """Read the model, and check that it fits `env`.

        Args:
            env: with the observations and actions that the model was trained with.
            seed: of the policy's chance; None: other chance every time.
            path: of the model, .npz or .zip; None: the shipped one.
            normalize: the `VecNormalize` of a .zip, or the file where it was saved, a pickle likewise.
            trust: whether a .zip may run what it likes.

        Raises:
            ValueError: for a file that is no model, that is not to be trusted, or is one for other observations or
                actions than `env` has.
            ImportError: for a .zip without Stable-Baselines3.
        """
        hand_of(env)  # which it must have
        model = self._fitted(load_model(self.shipped if path is None else path, normalize, trust=trust), env)
        entries = model.told.get("entries", [])
        spaces = {"action": (model.action_space, env.action_space)}
        self._model, self._features = model, None
        self._felt = entries == FELT and isinstance(env.observation_space, gym.spaces.Dict)
        if self._felt:  # which no observer need tell of
            Policy.__init__(self, env, seed)
            self.env, self.guided = env, False
            spaces["observation"] = (model.observation_space, features_of(env, entries).space)
        elif entries and model.observation_space != env.observation_space:
            super().__init__(env, seed)
            self._features = features_of(env, entries)
            spaces["observation"] = (model.observation_space, self._features.space)
        else:
            Policy.__init__(self, env, seed)
            spaces["observation"] = (model.observation_space, env.observation_space)
        differ = {what: difference(*both) for what, both in sorted(spaces.items())}
        if differ["observation"] and entries:
            differ["observation"] += f" (of {', '.join(entries)})"
        wrong = [f"{what} {how}" for what, how in differ.items() if how]
        if wrong:
            told = "; ".join(wrong) + ("" if entries or differ["action"] else UNTOLD)
            which = path or self.shipped.name
            raise ValueError(f"the model {which} was trained for another hand or observation: {told}")
        holds = model.told.get("hold", 1)
        if isinstance(model, Network):
            noise = model.log_std if model.noise == "lasting" else None
            lasting = noise.shape if isinstance(noise, np.ndarray) else None
            self.remembers = ((), (self.joints,), *[model.memory] * 2, lasting)
        elif isinstance(model, Rhythm):
            self.remembers = ((), (self.joints,), *model.remembers)
            steps = env.get_wrapper_attr("held") if env.has_wrapper_attr("held") else holds
            self._model = replace(model, seconds=steps / hand_env(env).control_hz)
        self._hold = 1 if env.has_wrapper_attr("held") else holds
        self._instead = None if isinstance(model, SavedModel) else model.instead
        self._episode = 0 if self._instead is None else int(self.rng.integers(len(self._instead.shown)))

    def _fitted(self, model: Network | Rhythm | SavedModel, env: gym.Env[Any, Any]) -> Network | Rhythm | SavedModel:
        """The model as the hand of `env` needs it."""
        return model

    def decide(self, observation: Any, state: State, deterministic: bool) -> tuple[NDArray[np.float32], State]:
        """Ask the model, where it is time.

        Args:
            observation: of one environment.
            state: steps of the episode, the action in force, and what the network remembers.
            deterministic: whether noise is left out.

        Returns:
            Action (J,), and the next state.

        Raises:
            ValueError: where the model has no finite torques.
        """
        step, held, *memory = (np.zeros((), dtype=np.int64), None) if state is None else state
        assert step is not None
        if int(step) % self._hold == 0:
            if self._felt:
                observation = np.asarray(observation["contacts"], np.float32)
            elif self._features is not None:
                posterior = self.shape.posterior if tell_names(self._features.entries) else None
                observation = self._features.vector(self.belief, observation["contacts"], posterior, int(step))
            if self._instead is not None:
                observation = self._instead.put(observation, self._episode, int(step) // self._hold)
            quiet, began = deterministic or self.noiseless, int(step) == 0
            try:
                held, after = self._model.predict(observation, tuple(memory), began, quiet, self.rng)
                if not np.isfinite(held).all():
                    raise ValueError(f"got {held.tolist()}")
            except ValueError as error:
                raise ValueError(f"policy {self.name!r} has no finite torques to command: {error}") from error
            memory = list(after)
        assert held is not None
        return held.astype(np.float32), (step + 1, held, *memory)

    def _check_state(self, state: Any, remembers: Remembered) -> None:
        # Noise that lasts is drawn when it is first needed.
        drawn = isinstance(state, tuple) and len(state) == len(remembers) and state[-1] is not None
        super()._check_state(state, remembers if drawn else (*remembers[:-1], None))


class Trained(Sb3):
    """The model that ships, made by the preset of the same name, and always without the noise with which it learnt."""

    noiseless = True

    def __init__(self, env: gym.Env[Any, Any], seed: int | None = None) -> None:
        """Read the model that ships.

        Args:
            env: with what it was trained with.
            seed: of no effect, since no noise is drawn.

        Raises:
            ValueError: where it does not fit `env`.
        """
        super().__init__(env, seed)


class Searched(Trained):
    """The model that ships of the preset `searched`: linear weights that a population search has found."""

    asks_shape = False
    shipped = FOLDER / "searched.npz"


class Reflexes(Trained):
    """The model that ships of the preset `reflexes`: a rhythm that touch changes, its gains found by a search.

    It reads contacts alone, and needs no observer.
    """

    guided = asks_shape = False
    shipped = FOLDER / "reflexes.npz"


class WholeHand(Reflexes):
    """The model that ships of the preset `whole_hand`: a rhythm of the fingers and wrist of MyoHand, found by a search.

    Other hands take its gains with strokes of their own, and leave a wrist alone; it was not searched for them.
    """

    shipped = FOLDER / "whole_hand.npz"

    def _fitted(self, model: Network | Rhythm | SavedModel, env: gym.Env[Any, Any]) -> Network | Rhythm | SavedModel:
        space = features_of(env, FELT).space
        if not isinstance(model, Rhythm) or (model.observation_space, model.action_space) == (space, env.action_space):
            return model
        return rhythm.rhythm_for(hand_of(env), space, model.gains, model.seconds, model.told)


def is_model(name: object) -> bool:
    """Tell whether a name is the path of a model, by how it ends, rather than the name of a policy.

    Args:
        name: of either.

    Returns:
        Whether it is.
    """
    return isinstance(name, str | os.PathLike) and Path(name).suffix in (WEIGHTS, SAVED)


def asks_of(path: str | os.PathLike[str]) -> tuple[bool, bool]:
    """Tell what a model must be given beside what is felt.

    Args:
        path: of the model; what a .zip was shown is not told by it.

    Returns:
        Whether it reads beliefs, and whether it asks what the object may be.

    Raises:
        ValueError: for a file that is none.
    """
    saved = is_model(path) and Path(path).suffix == SAVED
    entries = [] if saved else load_model(path).told.get("entries", [])
    return entries != FELT, not entries or tell_names(entries)


def load_model(
    path: str | os.PathLike[str], normalize: Any = None, *, trust: bool = False
) -> Network | Rhythm | SavedModel:
    """Read a model.

    Args:
        path: of the model, .npz or .zip.
        normalize: the `VecNormalize` of a .zip, or its file.
        trust: whether a .zip may run what it likes.

    Returns:
        The model.

    Raises:
        ValueError: for a file that is none, or that is not to be trusted.
        ImportError: for a .zip without Stable-Baselines3.
    """
    if not is_model(path):
        raise ValueError(f"the path of a model must end in {WEIGHTS} or {SAVED}, got {path!r}")
    if not os.path.isfile(path):
        raise ValueError(f"the path of a model must be a file that exists, got {str(path)!r}")
    validate.boolean("trust", trust)
    if Path(path).suffix == SAVED:
        if not trust:
            raise ValueError(f"{path} is not read: {WHY}")
        return SavedModel(Path(path), normalize)
    if normalize is not None:
        raise ValueError(f"normalize is for a {SAVED} file; {str(path)!r} holds its own statistics if it has any")
    return read_model(Path(path))


def read_model(path: Path) -> Network | Rhythm:
    """Read a file that runs nothing.

    Args:
        path: of the file.

    Returns:
        The model.

    Raises:
        ValueError: for a file of none.
    """
    kinds: dict[str, Any] = {network.KIND: network.restore, rhythm.KIND: rhythm.restore}
    model: Network | Rhythm = restored(path, kinds)[0]
    return model
