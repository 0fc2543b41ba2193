"""Pictures of a simulation, by Gymnasium's renderer; exploring needs none of it."""

from __future__ import annotations

import os
import sys
import warnings
from typing import Any

import mujoco
import numpy as np
from numpy.typing import NDArray

from haptic_env import scene


def renderer_of(model: mujoco.MjModel, data: mujoco.MjData, render_mode: str) -> Any:
    """Gymnasium's renderer of `data`; raises `RuntimeError` for a window where there is no display."""
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
    """An (H, W, 3) picture in mode "rgb_array"; raises `RuntimeError` that says how to get OpenGL where there is
    none."""
    first = renderer.viewer is None
    try:
        return renderer.render(render_mode)
    except Exception as error:
        if not first:
            raise
        raise RuntimeError(
            f"render_mode {render_mode!r} draws with OpenGL, which is not to be had here with "
            f"MUJOCO_GL={os.environ.get('MUJOCO_GL', '')!r} ({error}); without a display set MUJOCO_GL=egl (it needs "
            "libegl1) or MUJOCO_GL=osmesa (libosmesa6), or make the environment without a render_mode"
        ) from error
