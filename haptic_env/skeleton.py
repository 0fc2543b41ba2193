"""A hand made of somebody else's MuJoCo model: its joints, with torque motors, and its bones as capsules with skin.

Bodies without a joint of their own are fused with what they are fixed to, so that little is left to compute. Lengths
in metres, angles in radians; every frame is taken with all joints at zero.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import mujoco
import numpy as np
from numpy.typing import ArrayLike, NDArray

from haptic_env.composer import mjcf
from haptic_env.hand import Hand
from haptic_env.hands.drives import Drive, add_joint
from haptic_env.patches import Link, Patches

Array = NDArray[np.float64]
DENSITY = 1160.0  # kg/m³: hand; Winter 2009, Biomechanics and Motor Control of Human Movement, table 4.1


@dataclass(frozen=True)
class Bone:
    """One capsule: `radius` m from `start` to `end` (3,) m in the frame of the model's body `body`; `palmar` (3,):
    roughly where its palmar side faces, in the same frame. `tip`: whether it ends in a fingertip."""

    name: str
    body: str
    start: ArrayLike
    end: ArrayLike
    radius: float
    palmar: ArrayLike
    tip: bool = False


def bone_of_geom(
    model: mujoco.MjModel, name: str, geom: str, *, distal: ArrayLike, palmar: ArrayLike, tip: bool = False
) -> Bone:
    """The capsule `geom` of `model` as a bone; `distal` (3,) and `palmar` (3,): roughly where its end and its palmar
    side are, in its body's frame."""
    capsule = model.geom(geom)
    axis = np.empty(9)
    mujoco.mju_quat2Mat(axis, capsule.quat)
    half = axis.reshape(3, 3)[:, 2] * capsule.size[1]
    start, end = sorted((capsule.pos - half, capsule.pos + half), key=lambda each: float(each @ distal))
    body = model.body(capsule.bodyid[0]).name
    return Bone(name, body, start, end, float(capsule.size[0]), palmar, tip)


def hand_of(
    model: mujoco.MjModel,
    name: str,
    *,
    root: str,
    joints: Mapping[str, tuple[Drive, float]],
    bones: Sequence[Bone],
    position: ArrayLike,
    quaternion: ArrayLike,
    grasp_centre: ArrayLike,
    workspace: ArrayLike,
    opening: ArrayLike,
    patches_along: int,
    patches_around: int,
    suffix: str = "",
) -> Hand:
    """The hand of `model`: all joints below the body `root`, which is fixed at `position` (3,) m and `quaternion`
    (4,) wxyz in the world. `joints`: what drives each one, and the degrees at which an episode starts; its name is
    the model's without `suffix`."""
    data = mujoco.MjData(model)
    data.qpos[:] = 0.0
    mujoco.mj_kinematics(model, data)
    mujoco.mj_comPos(model, data)
    base = model.body(root).id
    moving = [b for b in range(base + 1, model.nbody) if model.body_jntnum[b] and _below(model, b, base)]
    moved_by = {b: _first_up(model, b, {base, *moving}) for b in range(base, model.nbody) if _below(model, b, base)}
    of_body: dict[int, list[Bone]] = {b: [] for b in (base, *moving)}
    for bone in bones:
        of_body[moved_by[model.body(bone.body).id]].append(bone)

    tree = mjcf.RootElement(model=name)
    tree.option.gravity = (0, 0, 0)
    tree.compiler.angle = "radian"
    frames = {base: (data.xpos[base], data.xmat[base].reshape(3, 3))}
    made = {base: tree.worldbody.add("body", name=model.body(base).name, pos=position, quat=quaternion)}
    rest, links = [], []
    for body in (base, *moving):
        mine = of_body[body]
        if body != base:
            # A body with one bone has its frame, so that skin and joints share one body.
            frame = _frame(data, model, mine[0]) if len(mine) == 1 else (data.xpos[body], data.xmat[body].reshape(3, 3))
            frames[body] = frame
            above = _first_up(model, model.body_parentid[body], frames)
            made[body] = _add_body(made[above], frames[above], frame, model.body(body).name)
            if not mine:
                _add_inertia(made[body], model, body)
            for joint in range(model.body_jntadr[body], model.body_jntadr[body] + model.body_jntnum[body]):
                joint_name = model.joint(joint).name.removesuffix(suffix)
                drive, start = joints[joint_name]
                add_joint(
                    tree,
                    made[body],
                    joint_name,
                    drive,
                    axis=frame[1].T @ data.xaxis[joint],
                    pos=frame[1].T @ (data.xanchor[joint] - frame[0]),
                    range=model.jnt_range[joint],
                )
                rest.append(start)
        for bone in mine:
            shared = body != base and len(mine) == 1
            owner = (
                made[body]
                if shared
                else _add_body(made[body], frames[body], _frame(data, model, bone), f"{bone.name}_bone")
            )
            length = float(np.linalg.norm(np.subtract(bone.end, bone.start)))
            owner.add(
                "geom",
                name=bone.name,
                type="capsule",
                fromto=(0, 0, 0, 0, 0, length),
                size=[bone.radius],
                density=DENSITY,
            )
            links.append(Link(bone.name, owner.name, bone.radius, length, tip=bone.tip))
    return Hand(
        name=name,
        xml=tree.to_xml_string(),
        links=tuple(links),
        patches=Patches(tuple(links), patches_along, patches_around),
        rest_pose=np.deg2rad(rest),
        grasp_centre=np.asarray(grasp_centre, dtype=np.float64),
        workspace=np.asarray(workspace, dtype=np.float64),
        opening=np.asarray(opening, dtype=np.float64),
    )


def _below(model: mujoco.MjModel, body: int, top: int) -> bool:
    while body > top:
        body = int(model.body_parentid[body])
    return body == top


def _first_up(model: mujoco.MjModel, body: int, among: Any) -> int:
    while body not in among:
        body = int(model.body_parentid[body])
    return int(body)


def _frame(data: mujoco.MjData, model: mujoco.MjModel, bone: Bone) -> tuple[Array, Array]:
    """Position (3,) and rotation (3, 3) of a bone in the model's world: z along it, x dorsal."""
    body = model.body(bone.body).id
    turn = data.xmat[body].reshape(3, 3)
    along = np.subtract(bone.end, bone.start)
    z = along / np.linalg.norm(along)
    x = -np.asarray(bone.palmar, dtype=np.float64)
    x = x - (x @ z) * z
    x /= np.linalg.norm(x)
    return data.xpos[body] + turn @ np.asarray(bone.start), turn @ np.stack([x, np.cross(z, x), z], axis=1)


def _add_body(parent: Any, above: tuple[Array, Array], frame: tuple[Array, Array], name: str) -> Any:
    quaternion = np.empty(4)
    mujoco.mju_mat2Quat(quaternion, (above[1].T @ frame[1]).ravel())
    return parent.add("body", name=name, pos=above[1].T @ (frame[0] - above[0]), quat=quaternion)


def _add_inertia(body: Any, model: mujoco.MjModel, source: int) -> None:
    """The model's own mass, for a body without a bone."""
    body.add(
        "inertial",
        mass=model.body_mass[source],
        pos=model.body_ipos[source],
        quat=model.body_iquat[source],
        diaginertia=model.body_inertia[source],
    )
