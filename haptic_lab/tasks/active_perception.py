"""The tasks in which an object is named, as `ap_gym` has them, and agents of either side on the other one.

Importing this module registers "HapticSLAM/ActiveName-v0" and "HapticSLAM/ActiveNameUnknown-v0". An action is
`{"action": torques, "prediction": logits}`, the reward is minus the loss of the prediction (cross-entropy, 1 where
nothing is known), and `info["prediction"]` has target and loss.

Shapes: J joints, C names.

References:
    Schneider et al., Active Perception Gym, https://github.com/TimSchneider42/active-perception-gym
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import gymnasium as gym
import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.special import softmax

import agents
from haptic_env import extras, validate
from haptic_lab.learning.explored import explored
from haptic_lab.learning.presets import NAME
from haptic_lab.tasks.environment import CHANGES, OuterEnv, changed
from haptic_lab.tasks.guessing import felt_alone
from haptic_lab.tasks.registry import TASKS

ap_gym: Any = extras.load("ap_gym", "ap_gym", "the adapter to ap_gym")

NAMING = tuple(name for name, world in TASKS.items() if world.task == NAME)
LEAST = 1e-12  # probability of a logit
Agent = Callable[[Any], dict[str, Any]]


class ActiveNaming(OuterEnv, ap_gym.ActiveClassificationEnv):  # type: ignore[misc]
    """A task whose reward is the loss of what the agent predicts, not what an observer believes.

    An episode lasts as long as the task's at most; a name that is sure does not end it. Where an observer runs beside
    it, `get_wrapper_attr` finds `belief` and `shape`, as in the task itself.
    """

    def __init__(
        self,
        task: str = "Name",
        hand: str | Path = "two_finger",
        *,
        observed: bool = False,
        held_out: bool = False,
        render_mode: str | None = None,
        **changes: Any,
    ) -> None:
        """Make the task.

        Args:
            task: one of `NAMING`.
            hand: as `TaskEnv`'s.
            observed: whether the agent sees what an observer believes (the task's own observation), or what is felt.
            held_out: as `TaskEnv`'s.
            render_mode: of the scene.
            **changes: as `TaskEnv`'s.

        Raises:
            ValueError: as `TaskEnv`.
        """
        world = TASKS[validate.choice("task", task, NAMING)]
        validate.keywords("ActiveNaming", changes, ("hand", "observed", "held_out", "render_mode", *CHANGES))
        self.world = replace(changed(world, hand, changes), threshold=1.0)
        made = explored if validate.boolean("observed", observed) else felt_alone
        inside = made(self.world, validate.boolean("held_out", held_out), render_mode)
        OuterEnv.__init__(self, inside, self.world.hold, render_mode)
        ap_gym.ActiveClassificationEnv.__init__(self, len(self.world.shapes), inside.action_space)
        self.observation_space = inside.observation_space

    def reset(self, *, seed: int | None = None, options: dict[str, Any] | None = None) -> tuple[Any, dict[str, Any]]:
        """Start an episode in a world that is drawn anew.

        Args:
            seed: of the world and all chance in it; None goes on with the present one.
            options: of what is not to be drawn.

        Returns:
            The observation, and an info that tells nothing.
        """
        gym.Env.reset(self, seed=seed)
        observation, info = self._explored.reset(seed=seed, options=options)
        self._target = np.int64(self.world.shapes.index(info["truth"]["shape"]))
        return observation, {}

    def _step(
        self, action: NDArray[np.float32], prediction: NDArray[np.float32]
    ) -> tuple[Any, float, bool, bool, dict[str, Any], np.int64]:
        """What `ap_gym` asks for: the base reward is 0, and the target (an index) comes last."""
        observation, _, terminated, truncated, _ = self._explored.step(action)
        return observation, 0.0, terminated, truncated, {}, self._target


def logits_of(posterior: ArrayLike) -> NDArray[np.float32]:
    """Make a belief a prediction.

    Args:
        posterior: (C,) probabilities.

    Returns:
        (C,) logits.
    """
    return np.log(np.maximum(np.asarray(posterior, dtype=np.float64), LEAST)).astype(np.float32)


def predicting(policy: str, env: gym.Env[Any, Any], seed: int | None = None, **keywords: Any) -> Agent:
    """Make one of our policies an agent of `ap_gym`: it acts, and predicts what the observer believes.

    Args:
        policy: as `agents.make`'s.
        env: an `ActiveNaming` with `observed=True`, for policies made by hand also with `observation=["raw"]` and
            `hold=1`.
        seed: of the policy's chance.
        **keywords: of the policy.

    Returns:
        From the observation to the action and the prediction; it begins anew where `env` was reset.

    Raises:
        ValueError: where nothing names the object in `env`, and as `agents.make`.
    """
    inner = env.unwrapped
    if not isinstance(inner, ActiveNaming) or not inner.has_wrapper_attr("shape"):
        raise ValueError(f"env must be an ActiveNaming with observed=True, got {validate.shown(env)}")
    made, state = agents.make(policy, inner._explored, seed, **keywords), None

    def act(observation: Any) -> dict[str, Any]:
        nonlocal state
        if inner.steps == 0:
            state = None
        action, state = agents.act(made, observation, state)
        return {"action": action, "prediction": logits_of(inner.shape.posterior)}

    return act


def acts_of(agent: Agent) -> Callable[[Any, bool], tuple[Any, Any]]:
    """Make an agent of `ap_gym`, of what is felt, one that `haptic_lab.tasks.judging.guessed` judges.

    Args:
        agent: from the observation to {"action": (J,), "prediction": (C,) logits}.

    Returns:
        What is judged.
    """

    def acts(observation: Any, began: bool) -> tuple[Any, Any]:
        told = agent(observation)
        return told["action"], softmax(np.asarray(told["prediction"], dtype=np.float64))

    return acts


class FlatActions(gym.Wrapper):
    """An environment of `ap_gym` as any other: one row of torques and logits, so that learners which know of no
    prediction run in it."""

    def __init__(self, env: gym.Env[Any, Any], bound: float = 8.0) -> None:
        """Join the two spaces.

        Args:
            env: of `ap_gym`, whose actions and predictions are Boxes.
            bound: of the logits, which a learner's -1 and 1 stand for.

        Raises:
            ValueError: for another environment.
        """
        super().__init__(env)
        space: Any = env.action_space
        if not isinstance(space, gym.spaces.Dict) or set(space) != {"action", "prediction"}:
            raise ValueError(f"env must be one of ap_gym, with actions and predictions, got {validate.shown(env)}")
        self._bound = validate.number("bound", bound, 0.0, 1e6, above=0.0)
        self._acts = gym.spaces.flatdim(space["action"])
        acts: Any = space["action"]
        low, high = acts.low.ravel(), acts.high.ravel()
        wide = np.ones(gym.spaces.flatdim(space["prediction"]), np.float32)
        self.action_space = gym.spaces.Box(np.append(low, -wide), np.append(high, wide), dtype=np.float32)

    def step(self, action: NDArray[np.float32]) -> tuple[Any, Any, bool, bool, dict[str, Any]]:
        space: Any = self.env.action_space
        torques, logits = np.split(action, [self._acts])
        parts = {"action": torques.reshape(space["action"].shape), "prediction": self._bound * logits}
        observation, reward, terminated, truncated, info = self.env.step(parts)
        return observation, float(reward), terminated, truncated, info


def _made(**keywords: Any) -> Any:
    return ap_gym.ActiveClassificationLogWrapper(ActiveNaming(**keywords))


for _task in NAMING:
    if f"HapticSLAM/Active{_task}-v0" not in gym.registry:
        ap_gym.register(f"HapticSLAM/Active{_task}-v0", entry_point=_made, kwargs={"task": _task})
