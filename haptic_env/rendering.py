"""Pictures of a simulation, by Gymnasium's renderer; exploring needs none of it."""

from __future__ import annotations

import os
import sys
import warnings
from typing import Any

import mujoco
import numpy as np
from numpy.typing import NDArray

from haptic_env import scene, validate

MODES = ("human", "rgb_array")


def renderer_of(model: mujoco.MjModel, data: mujoco.MjData, render_mode: str) -> Any:
    """Make Gymnasium's renderer of a simulation.

    Args:
        model: of the scene.
        data: its state, which is drawn.
        render_mode: "human" or "rgb_array".

    Returns:
        The renderer.

    Raises:
        RuntimeError: for a window where there is no display.
    """
    with warnings.catch_warnings():
        warnings.filterwarnings("ignore", module="glfw")  # on a missing display, which is dealt with here
        # Imported here: they need OpenGL, which exploring does not.
        import glfw
        from gymnasium.envs.mujoco.mujoco_rendering import MujocoRenderer

        display = bool(glfw.init())
    if render_mode == "human" and not display:
        raise RuntimeError('render_mode "human" opens a window and found no display; use "rgb_array" without one')
    if not display and sys.platform.startswith("linux") and not os.environ.get("MUJOCO_GL"):
        os.environ["MUJOCO_GL"] = "egl"  # Gymnasium would take GLFW, and fail
    return MujocoRenderer(model, data, width=640, height=480, max_geom=5000, camera_name=scene.CAMERA)


def draw(renderer: Any, render_mode: str) -> NDArray[np.uint8] | None:
    """Draw the scene.

    Args:
        renderer: of `renderer_of`.
        render_mode: "human" or "rgb_array".

    Returns:
        An (H, W, 3) picture in mode "rgb_array", else None.

    Raises:
        RuntimeError: where there is no OpenGL; it says how to get it.
    """
    first = renderer.viewer is None
    try:
        return renderer.render(render_mode)
    except Exception as error:
        if not first:
            raise
        told = f"render_mode {render_mode!r} {without_opengl(error)}, or make the environment without a render_mode"
        raise RuntimeError(told) from error


def without_opengl(error: Exception) -> str:
    """Say what to do where nothing can be drawn.

    Args:
        error: of whatever tried to.

    Returns:
        What stands after the name of what draws.
    """
    return (
        f"draws with OpenGL, which is not to be had here with MUJOCO_GL={os.environ.get('MUJOCO_GL', '')!r} ({error}); "
        "without a display set MUJOCO_GL=egl (it needs libegl1) or MUJOCO_GL=osmesa (libosmesa6)"
    )


class Window:
    """What draws a simulation, made when it is first asked to: none where `render_mode` is None."""

    def __init__(self, render_mode: str | None) -> None:
        """Check the mode; nothing is opened yet.

        Args:
            render_mode: one of `MODES` or None.

        Raises:
            ValueError: for another mode.
        """
        if render_mode is not None:
            validate.choice("render_mode", render_mode, MODES)
        self.render_mode = render_mode
        self._renderer: Any = None

    def draw(self, model: mujoco.MjModel, data: mujoco.MjData) -> NDArray[np.uint8] | None:
        """Draw the simulation, which is the same one until `close`.

        Args:
            model: of the scene.
            data: its state.

        Returns:
            An (H, W, 3) picture in mode "rgb_array", else None.

        Raises:
            RuntimeError: where there is no OpenGL, or no display for a window.
        """
        assert self.render_mode is not None
        if self._renderer is None:
            self._renderer = renderer_of(model, data, self.render_mode)
        elif self._renderer.viewer is not None:
            self._renderer.viewer.make_context_current()  # another environment may have drawn since
        try:
            return draw(self._renderer, self.render_mode)
        except RuntimeError:
            self.close()  # what is left of it draws nothing
            raise

    def close(self) -> None:
        """Close it, if it was opened."""
        if self._renderer is not None:
            self._renderer.close()
            self._renderer = None
