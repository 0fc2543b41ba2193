"""A task as an environment of Gymnasium, belief and reward inside.

Shapes: D numbers of an observation, J joints, C labels.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import fields, replace
from pathlib import Path
from typing import Any

import gymnasium as gym
import numpy as np
from numpy.typing import NDArray

from haptic_env import validate
from haptic_lab.learning.explored import explored
from haptic_lab.learning.presets import TrainingWorld
from haptic_lab.tasks.picture import Picture
from haptic_lab.tasks.registry import TASKS
from haptic_lab.terminal import as_keys
from haptic_lab.worlds import environment, shapes_of

CHANGES = tuple(each.name for each in fields(TrainingWorld) if each.name not in ("env", "task", "soon"))
TOLD = ("posterior", "decision", "is_success")  # of the info; beliefs are attributes, for they are large


def changed(world: TrainingWorld, hand: Any, changes: Mapping[str, Any]) -> TrainingWorld:
    """Make the world of a task another one.

    Args:
        world: of the task.
        hand: that explores, as `TaskEnv`'s.
        changes: keywords of the world; lists may stand for tuples, and among `shapes` sets for what is in them.

    Returns:
        The world.

    Raises:
        ValueError: for an unknown hand, or a value out of range.
    """
    told: dict[str, Any] = {k: tuple(value) if isinstance(value, list) else value for k, value in changes.items()}
    if "shapes" in told:
        told["shapes"] = shapes_of(told["shapes"])
    try:
        env = environment(str(hand) if isinstance(hand, Path) else hand)
    except ValueError as error:
        raise ValueError(as_keys(str(error))) from error
    return replace(world, env=env, **told)


class OuterEnv(gym.Env[Any, Any]):
    """An environment with another one inside, of which `get_wrapper_attr` finds whatever it and its wrappers have."""

    metadata: dict[str, Any] = {"render_modes": ["human", "rgb_array"]}  # noqa: RUF012 - as gymnasium declares it
    __repr__ = gym.Env.__str__

    def __init__(self, inside: gym.Env[Any, Any], hold: int, render_mode: str | None) -> None:
        """Keep what is inside.

        Args:
            inside: what is explored.
            hold: control steps of an action.
            render_mode: of the scene.
        """
        self._explored, self.render_mode = inside, render_mode
        self.metadata = {**type(self).metadata, "render_fps": max(1, round(inside.metadata["render_fps"] / hold))}

    def __getattr__(self, name: str) -> Any:
        if name.startswith("_"):
            raise AttributeError(f"{type(self).__name__} has no attribute {name!r}")
        return self._explored.get_wrapper_attr(name)

    def render(self) -> Any:
        """Show the scene.

        Returns:
            An (H, W, 3) picture in mode "rgb_array", else None.

        Raises:
            gymnasium.error.ResetNeeded: before the first reset.
            RuntimeError: where there is no OpenGL, or no display for a window.
        """
        scene = self._explored.render()
        return self._drawn(scene) if isinstance(scene, np.ndarray) else None

    def _drawn(self, scene: NDArray[np.uint8]) -> NDArray[np.uint8]:
        """(H, W', 3): what is shown of a scene (H, W, 3)."""
        return scene

    def close(self) -> None:
        """Close the window, if any."""
        self._explored.close()


class TaskEnv(OuterEnv):
    """Explore one object, see what is believed of it, and be paid for what one comes to know.

    Whatever the environment, the observer and the wrappers inside have is found by `get_wrapper_attr`: `hand`,
    `belief`, `shape` (the namer), `features`. What is not known of the world is drawn at each reset; `info` tells
    none of it.
    """

    def __init__(
        self,
        task: str,
        hand: str | Path = "two_finger",
        *,
        held_out: bool = False,
        render_mode: str | None = None,
        **changes: Any,
    ) -> None:
        """Check all arguments; the world is drawn at the reset.

        Args:
            task: one of `TASKS`.
            hand: name of a hand, or the path of a TOML file that describes one's own.
            held_out: whether objects have the sizes that are kept for evaluation, which training does not see.
            render_mode: "human": the scene; "rgb_array": scene, belief and posterior; or None.
            **changes: of the `TrainingWorld`, such as `seconds`, `hold`, `observation`; it is then another task.

        Raises:
            ValueError: for an unknown name or keyword, or a value out of range; it lists what is valid.
        """
        world = TASKS[validate.choice("task", task, TASKS)]
        keywords = ("hand", "held_out", "render_mode", *CHANGES)
        validate.keywords(f"HapticSLAM/{task}-v0", changes, keywords)
        self.world = changed(world, hand, changes)
        inside = explored(self.world, validate.boolean("held_out", held_out), render_mode)
        super().__init__(inside, self.world.hold, render_mode)
        self.observation_space, self.action_space = inside.observation_space, inside.action_space
        self._picture: Picture | None = None

    def reset(self, *, seed: int | None = None, options: dict[str, Any] | None = None) -> tuple[Any, dict[str, Any]]:
        """Start an episode in a world that is drawn anew.

        Args:
            seed: of the world and all chance in it; None goes on with the present one.
            options: as the environment's, of what is not to be drawn.

        Returns:
            The observation (D,), and the info: `posterior` (C,) where the object is to be named.
        """
        super().reset(seed=seed)
        observation, info = self._explored.reset(seed=seed, options=options)
        return observation, self._noted(info)

    def step(self, action: NDArray[np.float32]) -> tuple[Any, float, bool, bool, dict[str, Any]]:
        """Decide once; the action is held for `hold` control steps.

        Args:
            action: (J,) torques as fractions of their limits, in [-1, 1].

        Returns:
            The observation (D,), the reward (nats or bits: docs/tasks.md), whether a name is sure, whether time is
            over, and the info: as `reset`'s, and at the end `is_success` and, where one was sure, `decision`.

        Raises:
            ValueError: for an action of the wrong shape, not finite, or outside [-1, 1].
            gymnasium.error.ResetNeeded: before the first reset.
        """
        observation, reward, terminated, truncated, info = self._explored.step(action)
        return observation, float(reward), terminated, truncated, self._noted(info)

    def _drawn(self, scene: NDArray[np.uint8]) -> NDArray[np.uint8]:
        """(H, W', 3): the scene, and beside it what is believed."""
        if self._picture is None:
            self._picture = Picture(self._explored, scene.shape)
        return self._picture.draw(scene, self._posterior)

    def _noted(self, info: dict[str, Any]) -> dict[str, Any]:
        self._posterior = info.get("posterior")
        return {name: info[name] for name in TOLD if name in info}
