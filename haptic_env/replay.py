"""Environments that repeat a recording: what the hand does is fixed, an action changes nothing.

Shapes: J joints, P patches. Both tell in `info["root"]` where the frame in which the hand is drawn lies in the
object's, which is where maps of a hand that moves as a whole belong; and the truth is in the object's frame.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import mujoco
import numpy as np
from numpy.typing import NDArray

from haptic_env import scene
from haptic_env.explore import ExploreEnv, Observation
from haptic_env.hand import Hand
from haptic_env.pose import Pose
from haptic_env.recordings import Recording, resample
from haptic_env.shapes.base import Solid


class Replay(ExploreEnv):
    """The hand follows a recording, and the object its own: contacts come from the physics, noise is added.

    Episodes begin at the first frame of the recording and end at its last. All keyword arguments of the environment
    that concern the senses and the rendering are valid.
    """

    def __init__(self, hand: str, recording: Recording, solid: Solid, **keywords: Any) -> None:
        """`solid` explored, at its place in the frame that the recording gives the path of.

        Raises `ValueError` where the recording lacks joints of the hand, or the path of hand or object.
        """
        super().__init__(hand, reveal_truth=True, **keywords)
        at_rate = resample(recording, self.control_hz)
        self._angles = at_rate.joint_angles[:, at_rate.columns_of(self.hand)]
        self._hand_in_object = roots(at_rate, self.hand)
        self._explored = solid
        self.episode_steps = len(at_rate) - 1

    def step(self, action: NDArray[np.float32]) -> tuple[Observation, float, bool, bool, dict[str, Any]]:
        """Go to the next frame, whatever the `action`."""
        if self._model is None:
            raise RuntimeError("call reset() before step()")
        self._steps += 1
        self._follow()
        observation = self._observe()
        if self.render_mode == "human":
            self.render()
        return observation, 0.0, False, self._steps >= self.episode_steps, self._info()

    def _place_solid(self, rng: np.random.Generator, options: Mapping[str, Any]) -> mujoco.MjModel:
        self.solid = self._explored
        self._place = tuple(np.array(each) for each in (self.solid.position, self.solid.quaternion, self.solid.size))
        model = scene.compose(self.hand, self.solid, show_patches=self.render_mode is not None)
        self._bind(model)
        self._steps = 0
        self._follow()
        return model

    def _follow(self) -> None:
        """Hand and object to the frame of this step: the hand stays where its model is drawn, the object moves."""
        in_hand = self._hand_in_object[self._steps].inverse() @ Pose.of(self.solid.position, self.solid.quaternion)
        body = self._data.model.body_mocapid[self._data.model.body(scene.OBJECT).id]
        self._data.mocap_pos[body] = in_hand.position
        mujoco.mju_mat2Quat(self._data.mocap_quat[body], in_hand.rotation.ravel())
        self._data.qpos[:] = self._angles[self._steps]
        mujoco.mj_fwdPosition(self._data.model, self._data)
        self._touched = self._feel()

    def _info(self) -> dict[str, Any]:
        return {**super()._info(), "root": self._hand_in_object[self._steps]}


def roots(recording: Recording, hand: Hand) -> list[Pose]:
    """At each frame, where the frame in which `hand` is drawn lies in the object's.

    Raises `ValueError` where the recording does not tell, or its body is none of those that the hand's model fixes.
    """
    if recording.root is None or recording.object is None:
        raise ValueError(f"{recording.source}: the recording does not say where the hand and the object were")
    drawn = Pose(np.zeros(3), np.eye(3))
    if recording.root_body:
        fixed = {hand.model.body(b).name: b for b in range(1, hand.model.nbody) if hand.model.body_weldid[b] == 0}
        if recording.root_body not in fixed:
            raise ValueError(
                f"{recording.source}: {recording.root_body!r} is no body by which hand {hand.name!r} is held; "
                f"choose from {', '.join(fixed)}"
            )
        data = mujoco.MjData(hand.model)
        mujoco.mj_kinematics(hand.model, data)
        body = fixed[recording.root_body]
        drawn = Pose(data.xpos[body].copy(), data.xmat[body].reshape(3, 3).copy()).inverse()
    tracks = zip(*recording.root, *recording.object, strict=True)
    return [Pose.of(*o).inverse() @ Pose.of(*r) @ drawn for r, o in (((a, b), (c, d)) for a, b, c, d in tracks)]
