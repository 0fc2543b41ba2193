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
from numpy.typing import ArrayLike

from haptic_env.arrays import Array
from haptic_env.composer import mjcf
from haptic_env.hand import Hand
from haptic_env.hands import wrist as wrists
from haptic_env.hands.drives import Drive, add_joint
from haptic_env.patches import Link, Patches

Frame = tuple[Array, Array]  # position (3,) m and rotation (3, 3) in the model's world
LIGHTEST, LIGHTEST_INERTIA = 1e-4, 1e-9  # kg and kg·m²: nothing that moves is without mass
DENSITY = 1160.0  # kg/m³: hand; Winter 2009, Biomechanics and Motor Control of Human Movement, table 4.1


@dataclass(frozen=True)
class Bone:
    """One capsule of skin.

    Attributes:
        name: of the link that it becomes.
        body: of the model, in whose frame the others are.
        start: (3,) m, centre of the proximal cap.
        end: (3,) m, centre of the distal cap.
        radius: m.
        palmar: (3,), roughly where its palmar side faces.
        tip: whether it ends in a fingertip.
    """

    name: str
    body: str
    start: ArrayLike
    end: ArrayLike
    radius: float
    palmar: ArrayLike
    tip: bool = False


def matrix_of(quaternion: Array) -> Array:
    """Make a rotation matrix as MuJoCo does.

    Args:
        quaternion: (4,) wxyz, of unit length.

    Returns:
        (3, 3).
    """
    matrix = np.empty(9)
    mujoco.mju_quat2Mat(matrix, quaternion)
    return matrix.reshape(3, 3)


def quaternion_of(matrix: Array) -> Array:
    """Make a quaternion as MuJoCo does.

    Args:
        matrix: (3, 3), a rotation.

    Returns:
        (4,) wxyz.
    """
    quaternion = np.empty(4)
    mujoco.mju_mat2Quat(quaternion, matrix.ravel())
    return quaternion


def bone_of_geom(
    model: mujoco.MjModel, name: str, geom: str, *, distal: ArrayLike, palmar: ArrayLike, tip: bool = False
) -> Bone:
    """Take a capsule of a model as a bone.

    Args:
        model: with the capsule.
        name: of the bone.
        geom: name of the capsule.
        distal: (3,), roughly where its end is, in its body's frame.
        palmar: (3,), roughly where its palmar side is, in its body's frame.
        tip: whether it ends in a fingertip.

    Returns:
        The bone.
    """
    capsule = model.geom(geom)
    half = matrix_of(capsule.quat)[:, 2] * capsule.size[1]
    start, end = sorted((capsule.pos - half, capsule.pos + half), key=lambda each: float(each @ distal))
    body = model.body(capsule.bodyid[0]).name
    return Bone(name, body, start, end, float(capsule.size[0]), palmar, tip)


def bodies_below(model: mujoco.MjModel, root: int) -> list[int]:
    """List the bodies that hang from another.

    Args:
        model: with the bodies.
        root: index of that one.

    Returns:
        Their indices, without its own.
    """
    below: list[int] = []
    for body in range(root + 1, model.nbody):  # whatever a body hangs from comes before it
        if int(model.body_parentid[body]) in (root, *below):
            below.append(body)
    return below


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
    wrist: ArrayLike | None = None,
    patches_along: int,
    patches_around: int,
    suffix: str = "",
    ranges: Mapping[str, tuple[float, float]] | None = None,
    lever_arms: Mapping[str, float] | None = None,
) -> Hand:
    """Make the hand of a model, of all joints below a body that is fixed in the world or moves as a wrist does.

    Args:
        model: with muscles or motors, which are left out.
        name: of the hand.
        root: that body.
        joints: by its name, what drives each joint, and the degrees at which an episode starts.
        bones: the capsules of skin.
        position: (3,) m, of the root in the world.
        quaternion: (4,) wxyz, of the root in the world.
        grasp_centre: (3,) m, as `Hand`'s.
        workspace: (3,) m, as `Hand`'s.
        opening: (3,), as `Hand`'s.
        wrist: (3,) m in the world, about which the root turns and with which it moves; None: it is fixed.
        patches_along: bins along each bone.
        patches_around: sectors around each bone.
        suffix: what the model's names of joints have more than those of `joints`.
        ranges: rad, of joints that have others than the model's.
        lever_arms: m in one radian, of joints that slide (`haptic_env.sliding`).

    Returns:
        The hand.

    Raises:
        ValueError: for a number of patches out of range.
    """
    skeleton = _Skeleton(model, name, root, position, quaternion)
    on: dict[int, list[Bone]] = {body: [] for body in skeleton.bodies}
    for bone in bones:
        on[skeleton.carrier(model.body(bone.body).id)].append(bone)
    rest, links = [0.0] * (0 if wrist is None else len(wrists.NAMES)), []
    for body, mine in on.items():
        # A body with one bone has its frame, so that skin and joints share one body.
        shared = len(mine) == 1 and body != skeleton.base
        skeleton.add_body(body, mine[0] if shared else None)
        if body == skeleton.base and wrist is not None:
            skeleton.add_wrist(wrist)
        if body != skeleton.base and not mine:
            skeleton.add_inertia(body)
        for joint in skeleton.joints_of(body):
            joint_name = model.joint(joint).name.removesuffix(suffix)
            drive, start = joints[joint_name]
            limits, arm = (ranges or {}).get(joint_name), (lever_arms or {}).get(joint_name, 0.0)
            skeleton.add_joint(body, joint, joint_name, drive, limits, arm)
            rest.append(start)
        links += [skeleton.add_bone(body, bone, shared) for bone in mine]
    return Hand(
        name=name,
        xml=skeleton.tree.to_xml_string(),
        links=tuple(links),
        patches=Patches(tuple(links), patches_along, patches_around),
        rest_pose=np.deg2rad(rest),
        grasp_centre=np.asarray(grasp_centre, dtype=np.float64),
        workspace=np.asarray(workspace, dtype=np.float64),
        opening=np.asarray(opening, dtype=np.float64),
    )


class _Skeleton:
    """The hand while it grows: for each body that moves, and the fixed one, its frame in the model's world and the body
    made for it."""

    def __init__(self, model: mujoco.MjModel, name: str, root: str, position: ArrayLike, quaternion: ArrayLike) -> None:
        self.model, self.data = model, mujoco.MjData(model)
        self.data.qpos[:] = 0.0
        mujoco.mj_kinematics(model, self.data)
        mujoco.mj_comPos(model, self.data)
        self.tree = mjcf.RootElement(model=name)
        self.tree.option.gravity = (0, 0, 0)
        self.tree.compiler.angle = "radian"
        self.base = int(model.body(root).id)
        self.bodies = [self.base, *(body for body in bodies_below(model, self.base) if model.body_jntnum[body])]
        self._frames: dict[int, Frame] = {}
        self._made: dict[int, Any] = {}
        self._place = {"pos": position, "quat": quaternion}

    def carrier(self, body: int) -> int:
        """The first of `bodies` on the way from `body` to the root: itself, or what it is fixed to."""
        while body not in self.bodies:
            body = int(self.model.body_parentid[body])
        return body

    def joints_of(self, body: int) -> range:
        """The model's joints of `body`; those that would move the root are left out."""
        first = int(self.model.body_jntadr[body])
        return range(0) if body == self.base else range(first, first + int(self.model.body_jntnum[body]))

    def add_body(self, body: int, bone: Bone | None) -> None:
        """Make `body`, with the frame of `bone` or its own."""
        name = self.model.body(body).name
        if body == self.base:
            self._frames[body] = self._frame(body)
            self._made[body] = self.tree.worldbody.add("body", name=name, **self._place)
        else:
            self._frames[body] = self._frame(body) if bone is None else self._bone_frame(bone)
            above = self.carrier(int(self.model.body_parentid[body]))
            self._made[body] = self._fix(above, self._frames[body], name)

    def add_wrist(self, place: ArrayLike) -> None:
        """Let the root move about `place` (3,) m in the world."""
        quaternion = np.array(self._place["quat"], dtype=np.float64)
        mujoco.mju_normalize4(quaternion)
        rotation = matrix_of(quaternion)
        at = rotation.T @ np.subtract(place, self._place["pos"])
        wrists.add(self.tree, self._made[self.base], at, rotation)

    def add_inertia(self, body: int) -> None:
        """The model's own mass, for a body without a bone."""
        model = self.model
        self._made[body].add(
            "inertial",
            mass=max(float(model.body_mass[body]), LIGHTEST),
            pos=model.body_ipos[body],
            quat=model.body_iquat[body],
            diaginertia=np.maximum(model.body_inertia[body], LIGHTEST_INERTIA),
        )

    def add_joint(
        self, body: int, joint: int, name: str, drive: Drive, limits: tuple[float, float] | None, arm: float
    ) -> None:
        """The hinge `joint` of the model and its motor, or the slide that goes `arm` m in one radian; `limits` (rad)
        in place of the model's."""
        place, turn = self._frames[body]
        axis = turn.T @ self.data.xaxis[joint]
        ends = self.model.jnt_range[joint] if limits is None else limits
        if arm:
            told: dict[str, Any] = {"type": "slide", "user": [arm], "range": ends, "limited": True}
        else:
            told = {"pos": turn.T @ (self.data.xanchor[joint] - place), "range": ends}
        add_joint(self.tree, self._made[body], name, drive, axis=axis, **told)

    def add_bone(self, body: int, bone: Bone, shared: bool) -> Link:
        """The capsule of `bone`; on a body of its own, fixed to `body`, unless that one's frame is `shared`."""
        owner = self._made[body] if shared else self._fix(body, self._bone_frame(bone), f"{bone.name}_bone")
        length = float(np.linalg.norm(np.subtract(bone.end, bone.start)))
        ends = (0, 0, 0, 0, 0, length)
        owner.add("geom", name=bone.name, type="capsule", fromto=ends, size=[bone.radius], density=DENSITY)
        return Link(bone.name, owner.name, bone.radius, length, tip=bone.tip)

    def _frame(self, body: int) -> Frame:
        return self.data.xpos[body], self.data.xmat[body].reshape(3, 3)

    def _bone_frame(self, bone: Bone) -> Frame:
        """z along the bone, x dorsal."""
        place, turn = self._frame(self.model.body(bone.body).id)
        along = np.subtract(bone.end, bone.start)
        z = along / np.linalg.norm(along)
        dorsal = -np.asarray(bone.palmar, dtype=np.float64)
        x = dorsal - (dorsal @ z) * z
        if np.linalg.norm(x) < 1e-9:  # the bone points where its palmar side faces
            x = np.cross(z, np.eye(3)[np.abs(z).argmin()])
        x /= np.linalg.norm(x)
        return place + turn @ np.asarray(bone.start), turn @ np.stack([x, np.cross(z, x), z], axis=1)

    def _fix(self, above: int, frame: Frame, name: str) -> Any:
        """A new body at `frame` on the one made for `above`."""
        place, turn = self._frames[above]
        turned = quaternion_of(turn.T @ frame[1])
        return self._made[above].add("body", name=name, pos=turn.T @ (frame[0] - place), quat=turned)
