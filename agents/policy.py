"""What a policy is: Stable-Baselines3's `predict`, so that trained models and these are used alike.

Shapes: J joints.
"""

from __future__ import annotations

from typing import Any, ClassVar

import gymnasium as gym
import numpy as np
from numpy.typing import NDArray

from agents import observations
from haptic_env import hand_of, readable, validate
from haptic_env.arrays import Array
from observer.belief import Belief
from observer.shape.posterior import ShapePosterior

Remembered = tuple[tuple[int, ...] | None, ...]
State = tuple[Any, ...] | None
LARGEST = 1e9  # of a state's numbers
EpisodeStart = NDArray[np.bool_] | bool | None


class Policy:
    """A policy for `env`, whose hand (`env.unwrapped.hand`) and control rate it may read, never its truth.

    A new one has `decide`, which is asked at every step; `predict` is what others call.
    """

    guided: bool = False
    """Whether it reads beliefs, so that `env` must have an `ObserverWrapper` (see `Guided`)."""
    asks_shape: ClassVar[bool] = False
    """Whether it also asks what the object may be, so that the wrapper must have a `shape`."""
    blind: ClassVar[bool] = False
    """Whether it commands the same whatever is felt."""
    remembers: Remembered | None = None
    """Shapes of what `decide` hands to the next call, None for what is None; what is handed back is compared with them.
    Nothing is compared where it is None itself."""

    def __init__(self, env: gym.Env[Any, Any], seed: int | None = None) -> None:
        """Check the environment.

        Args:
            env: one environment, with a hand.
            seed: of the policy's chance; None: other chance every time.

        Raises:
            ValueError: for an environment without a hand, or a seed that is none.
        """
        hand_of(env)  # which it must have
        self.joints: int = env.action_space.shape[0]  # type: ignore[index]
        # None: an environment that is played back need not say what it shows.
        self.observation_space: gym.Space[Any] | None = getattr(env, "observation_space", None)
        self.rng = np.random.default_rng(validate.seed(seed))
        self.name = type(self).__name__  # `agents.make` puts the registered name here

    def __repr__(self) -> str:
        return f"<{type(self).__name__}: {', '.join([f'{self.joints} joints', *readable.kept(self)])}>"

    def decide(self, observation: Any, state: State, deterministic: bool) -> tuple[NDArray[np.float32], State]:
        """Decide for one environment.

        Args:
            observation: of one environment.
            state: what the last call returned; None starts anew.
            deterministic: whether to act without chance, where the policy can.

        Returns:
            Action (J,) in [-1, 1], and the state to hand to the next call.

        Raises:
            NotImplementedError: unless a policy defines it.
        """
        raise NotImplementedError(f"{type(self).__name__} must have `decide`")

    def predict(
        self, observation: Any, state: State = None, episode_start: EpisodeStart = None, deterministic: bool = False
    ) -> tuple[NDArray[np.float32], State]:
        """Decide, for one environment or, as Stable-Baselines3 does it, for E at once.

        A policy that reads beliefs reads those of its own environment, so that E is 1.

        Args:
            observation: of one environment, or its entries (E, ...).
            state: what the last call returned; None starts anew.
            episode_start: whether an episode starts, or (E,) for each environment; the state starts anew there.
            deterministic: whether to act without chance, where the policy can.

        Returns:
            Action (J,) or (E, J) in [-1, 1], and the state to hand to the next call.

        Raises:
            ValueError: for an observation that `env` cannot have given.
        """
        count = observations.count(observation, self.observation_space)
        if state is not None and not isinstance(state, tuple):
            raise ValueError(f"state must be None or what the last call returned, got {validate.shown(state)}")
        validate.boolean("deterministic", deterministic)
        if count is None:
            return self._checked(observation, None if starts(episode_start) else state, deterministic)
        if self.guided and count != 1:
            raise ValueError(
                f"policy {self.name!r} reads the beliefs about its own environment alone, got observations of {count}"
            )
        began = validate.binary("episode_start", False if episode_start is None else episode_start).ravel()
        if len(began) not in (1, count) or (state is not None and len(state) != count):
            raise ValueError(
                f"episode_start and state must be of {count} environments, as the observations are, got "
                f"{len(began)} and {0 if state is None else len(state)}"
            )
        began = np.broadcast_to(began, count)
        states: Any = (None,) * count if state is None else state
        actions, after = np.zeros((count, self.joints), np.float32), []
        for i in range(count):
            mine = None if began[i] else states[i]
            actions[i], kept = self._checked(observations.row(observation, i), mine, deterministic)
            after.append(kept)
        return actions, tuple(after)

    def _checked(self, observation: Any, state: State, deterministic: bool) -> tuple[NDArray[np.float32], State]:
        if not self.blind:
            observations.check(observation, self.observation_space)
        if state is not None and self.remembers is not None:
            self._check_state(state, self.remembers)
        return self.decide(observation, state, deterministic)

    def _check_state(self, state: Any, remembers: Remembered) -> None:
        fits = isinstance(state, tuple) and len(state) == len(remembers)
        if not fits or any((each is None) != (shape is None) for each, shape in zip(state, remembers, strict=True)):
            raise ValueError(f"state must be None or what the last call returned, got {validate.shown(state)}")
        for index, (each, shape) in enumerate(zip(state, remembers, strict=True)):
            if shape is not None:
                validate.array(f"entry {index} of state", each, shape, bound=LARGEST)


class Guided(Policy):
    """A policy that reads what an observer believes.

    The beliefs are those of the `ObserverWrapper(env, observer, shape)` that `env` is or has inside: whoever composes
    the three says which observer guides the hand. `predict` keeps its signature, and nothing else need be called.
    """

    guided = True

    def __init__(self, env: gym.Env[Any, Any], seed: int | None = None) -> None:
        """Find the observer.

        Args:
            env: an `ObserverWrapper`, or with one inside.
            seed: of the policy's chance; None: other chance every time.

        Raises:
            ValueError: for an environment without an observer.
        """
        super().__init__(env, seed)
        self.env = env
        self.hand = hand_of(env)
        if not env.has_wrapper_attr("belief"):
            raise ValueError(
                f"{type(self).__name__} is guided by beliefs, which {env} has none of; wrap it: "
                "ObserverWrapper(env, HapticSLAM(hand), ShapePosterior(hand))"
            )

    @property
    def belief(self) -> Belief:
        """What the observer believes now."""
        return self.env.get_wrapper_attr("belief")

    def map_now(self) -> Array:
        """Draw the map of the episode so far.

        Returns:
            (X, Y, Z) probability that each voxel is occupied, in hindsight where the observer has it so.
        """
        return self.env.get_wrapper_attr("map_now")()

    @property
    def shape(self) -> ShapePosterior:
        """What the object is believed to be.

        Raises:
            ValueError: where the observer is not asked.
        """
        shape = self.env.get_wrapper_attr("shape")
        if shape is None:
            raise ValueError(
                f"{self.name} asks what the object may be, which nothing infers here; wrap the environment in "
                "ObserverWrapper(env, observer, ShapePosterior(hand))"
            )
        return shape


def starts(episode_start: EpisodeStart) -> bool:
    """Tell whether an episode begins.

    Args:
        episode_start: as `Policy.predict`'s, of one environment.

    Returns:
        Whether it says so.

    Raises:
        ValueError: where it says neither.
    """
    return episode_start is not None and bool(validate.binary("episode_start", episode_start).any())


def act(
    policy: Policy, observation: Any, state: State = None, episode_start: EpisodeStart = None
) -> tuple[NDArray[np.float32], State]:
    """Ask a policy, and check what it says.

    Args:
        policy: any with `predict`.
        observation: of one environment.
        state: what the last call returned.
        episode_start: whether an episode starts.

    Returns:
        Action (J,), and the state to hand to the next call.

    Raises:
        ValueError: for torques that are of another shape, or not finite; it names the policy.
    """
    if not callable(getattr(policy, "predict", None)):
        raise ValueError(f"policy must have `predict`, as those of agents.make have, got {validate.shown(policy)}")
    action, state = policy.predict(observation, state, episode_start)
    name, joints = getattr(policy, "name", type(policy).__name__), getattr(policy, "joints", None)
    torques = validate.real(action)
    if torques is None:
        raise ValueError(f"policy {name!r} commands no torques, but {validate.shown(action)}")
    if (joints is not None and torques.shape[-1:] != (joints,)) or torques.size > validate.MOST:
        raise ValueError(f"policy {name!r} commands torques of shape {torques.shape}; the hand has {joints} joints")
    if not np.isfinite(torques).all():
        raise ValueError(f"policy {name!r} commands torques that are not finite: {validate.shown(torques.tolist())}")
    return action, state
