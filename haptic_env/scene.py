"""Compose a hand and an object into one MuJoCo model."""

from __future__ import annotations

from functools import lru_cache
from typing import Any

import mujoco
import numpy as np
from numpy.typing import NDArray

from haptic_env.hand import Hand, parse
from haptic_env.shapes.base import RGBA, Shape, Solid
from haptic_env.sliding import compile_model

PHYSICS_SECONDS = 0.002
OBJECT = "object"
# Contacts stiff enough that a finger pushed with all its torque sinks in by less than a millimetre.
SOLREF = (0.004, 1.0)
SOLIMP = (0.95, 0.99, 0.0005, 0.5, 2.0)
FRICTION = (0.6, 0.005, 0.0001)
SKIN_RGBA = (0.87, 0.68, 0.60, 1.0)
PATCH_RGBA = (0.55, 0.40, 0.36, 1.0)
LIT_RGBA = (0.95, 0.10, 0.10, 1.0)
PATCH_SIZE, LIT_SIZE = 0.10, 0.22  # radius of a drawn patch as a fraction of the square root of its area
CAMERA = "explore"
WORKSPACE = 0.128  # metres: what the camera shows from its usual distance


def substeps_of(control_hz: float) -> int:
    """Count the steps of the physics in one of the control loop.

    Args:
        control_hz: Hz, of the control loop.

    Returns:
        The count.

    Raises:
        ValueError: for a rate that does not divide that of the physics.
    """
    substeps = round(1.0 / (control_hz * PHYSICS_SECONDS))
    if not np.isclose(substeps * PHYSICS_SECONDS * control_hz, 1.0):
        valid = [f"{1 / (n * PHYSICS_SECONDS):g}" for n in (1, 2, 4, 5, 8, 10, 20, 25, 50)]
        raise ValueError(
            f"control_hz must divide {1 / PHYSICS_SECONDS:g} Hz, got {control_hz!r}; e.g. {', '.join(valid)}"
        )
    return substeps


def compose(hand: Hand, solid: Solid, *, show_patches: bool = False) -> mujoco.MjModel:
    """Make the model of a hand and an object, which is a mocap body, so that its pose is data and not model.

    Links touch the object and nothing else.

    Args:
        hand: in the world frame.
        solid: the object.
        show_patches: whether each patch is a site, in the patches' order.

    Returns:
        The compiled model.
    """
    view = float(hand.workspace.max()) / WORKSPACE
    return _compiled(hand.xml, view, _key(hand) if show_patches else None, solid.shape, solid.size)


def place(model: mujoco.MjModel, data: mujoco.MjData, solid: Solid) -> None:
    """Put the object where it lies.

    Args:
        model: of `compose`.
        data: of the model; changed.
        solid: the object, with its pose.
    """
    body = model.body_mocapid[model.body(OBJECT).id]
    data.mocap_pos[body] = solid.position
    data.mocap_quat[body] = solid.quaternion


def light(model: mujoco.MjModel, hand: Hand, touched: NDArray[np.bool_]) -> None:
    """Draw patches red and large.

    Args:
        model: of `compose`, one that shows patches; changed.
        hand: whose patches they are.
        touched: (P,) which patches to light.
    """
    size = np.where(touched, LIT_SIZE, PATCH_SIZE)
    model.site_size[:, 0] = size * np.sqrt(hand.patches.area)
    model.site_rgba[:] = np.where(touched[:, None], LIT_RGBA, PATCH_RGBA)


def truth(
    data: mujoco.MjData, solid: Solid, place: tuple[NDArray[np.float64], ...], offset: NDArray[np.float64]
) -> dict[str, Any]:
    """Tell what an observer is to find out.

    Args:
        data: of the hand's and the object's model.
        solid: the object.
        place: its position (3,) m, quaternion (4,) wxyz and size (3,) m.
        offset: (J,) rad, of the felt angles.

    Returns:
        What `info["truth"]` holds.
    """
    return {
        "joint_angles": data.qpos.copy(),
        "joint_velocities": data.qvel.copy(),
        "joint_offset": offset,
        "shape": solid.name,
        **{f"object_{name}": each.copy() for name, each in zip(("position", "quaternion", "size"), place, strict=True)},
    }


def _key(hand: Hand) -> tuple:
    sites = zip(hand.patches.link, map(tuple, hand.patches.position), hand.patches.area, strict=True)
    return tuple((hand.links[link].body, position, float(area)) for link, position, area in sites)


@lru_cache(maxsize=256)  # a set of twenty shapes in the ten sizes of training: to compile one takes 20 ms
def _compiled(
    hand_xml: str, view: float, sites: tuple | None, shape: Shape, size: tuple[float, float, float]
) -> mujoco.MjModel:
    root = parse(hand_xml)
    root.option.timestep = PHYSICS_SECONDS
    root.option.integrator = "implicitfast"
    root.option.cone = "elliptic"
    # Several contact points per pair may leave out the deepest one: a pyramid's apex went 2 mm into a fingertip.
    root.option.flag.multiccd = "disable"
    for geom in root.find_all("geom"):
        geom.set_attributes(contype=1, conaffinity=2, rgba=SKIN_RGBA, solref=SOLREF, solimp=SOLIMP, friction=FRICTION)
    body = root.worldbody.add("body", name=OBJECT, mocap=True)
    for attributes in shape.geoms(root, np.asarray(size)):
        body.add(
            "geom",
            contype=2,
            conaffinity=1,
            rgba=RGBA,
            solref=SOLREF,
            solimp=SOLIMP,
            friction=FRICTION,
            **attributes,
        )
    for index, (link, position, area) in enumerate(sites or ()):
        root.find("body", link).add(
            "site", name=f"patch{index}", pos=position, size=[PATCH_SIZE * area**0.5], rgba=PATCH_RGBA
        )
    root.worldbody.add("light", pos=(0.1, -0.4, 0.6), dir=(-0.15, 0.55, -0.8), diffuse=(0.7, 0.7, 0.7))
    root.visual.headlight.set_attributes(ambient=(0.45, 0.45, 0.45), diffuse=(0.4, 0.4, 0.4))
    root.visual.rgba.haze = (1, 1, 1, 1)
    root.asset.add("texture", type="skybox", builtin="flat", rgb1=(1, 1, 1), rgb2=(1, 1, 1), width=16, height=16)
    near = view * np.array([0.02, -0.26, 0.11])
    root.worldbody.add("camera", name=CAMERA, fovy=32, pos=near, xyaxes=(1, 0.08, 0, -0.03, 0.35, 0.93))
    return compile_model(root.to_xml_string(), root.get_assets())
