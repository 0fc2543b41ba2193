"""Joints that slide, told in radians as all joints are: by the angle of a pulley that the way turns.

Sensors, noises and observers know joints by their angles, in radians and with one σ for all. A slide of a hand names
its lever arm, the metres that it goes in one radian, as `user` in its XML; all its other numbers are those of the
pulley: range in radians, damping in N·m·s/rad, torque in N·m, whose force is torque / lever arm.
"""

from __future__ import annotations

from collections.abc import Mapping

import mujoco
import numpy as np

from haptic_env.arrays import Array


def compile_model(xml: str, assets: Mapping[str, bytes] | None = None) -> mujoco.MjModel:
    """Compile a model whose slides are told in radians.

    MuJoCo makes every axis one of unit length, so that slides would be in metres: they are made as long as the lever
    arms after it.

    Args:
        xml: MJCF.
        assets: files that it names.

    Returns:
        The model.
    """
    model = mujoco.MjModel.from_xml_string(xml, dict(assets or {}))
    arms = lever_arms(model)
    if arms.any():
        slides = arms > 0
        model.jnt_axis[slides] *= arms[slides, None]
        mujoco.mj_setConst(model, mujoco.MjData(model))  # what follows from axes
    return model


def lever_arms(model: mujoco.MjModel) -> Array:
    """Tell how far joints slide.

    Args:
        model: with J joints.

    Returns:
        (J,) m in one radian: 0 for what turns, and for slides that do not say.
    """
    arms = np.zeros(model.njnt)
    if model.nuser_jnt:
        slides = model.jnt_type == mujoco.mjtJoint.mjJNT_SLIDE
        arms[slides] = model.jnt_user[slides, 0]
    return arms
