"""Environments that repeat a recording: what the hand does is fixed, an action changes nothing.

Shapes: J joints, P patches. Of a hand that moves as a whole they tell in `info["root"]` where the frame in which it is
drawn lies in the object's, which is where its map belongs; the truth is then in the object's frame.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import gymnasium as gym
import mujoco
import numpy as np
from numpy.typing import NDArray

from haptic_env import scene, validate
from haptic_env.explore import ExploreEnv, Observation
from haptic_env.hand import Hand
from haptic_env.playback import FeltPlayback
from haptic_env.pose import Pose
from haptic_env.recordings import Recording, checks, resample
from haptic_env.shapes.base import Solid

UNEVEN = 0.01  # of a step: stamps are rounded


class KinematicReplay(ExploreEnv):
    """The hand follows a recording, and the object its own: contacts come from the physics, noise is added.

    Episodes begin at the first frame of the recording and last for `episode_seconds`, at most to its end. The other
    keyword arguments of the environment that concern the senses and the rendering are valid too.
    """

    def __init__(self, hand: str, recording: Recording, solid: Solid, **keywords: Any) -> None:
        """Match a recording to a hand.

        Args:
            hand: name of the hand.
            recording: joint angles of this hand, and the path of its root or of the object.
            solid: the object explored, at its place in the frame that the recording gives the path of.
            **keywords: of the environment, those that concern time, the senses and the rendering.

        Raises:
            ValueError: where the recording lacks joints of the hand, or the path of hand or object, or has angles that
                the hand cannot have; and for a `solid` that is no object for a hand.
        """
        super().__init__(hand, reveal_truth=True, **{"episode_seconds": recording.seconds, **keywords})
        solid.shape.check_size(solid.size)
        validate.array("place of the object in the frame of its path", solid.position, (3,), "m", bound=checks.APART)
        recording.angles_of(self.hand)  # before it has other frames, which no error should tell of
        self.recording = resample(recording, self.control_hz)
        self._angles = self.recording.angles_of(self.hand)
        self._hand_in_object = roots(self.recording, self.hand)
        self._explored = solid
        self.episode_steps = min(self.episode_steps, len(self.recording) - 1)

    @property
    def simulation(self) -> tuple[mujoco.MjModel, mujoco.MjData]:
        """For pictures: the hand where its model is drawn, the object as it lies in that frame.

        Raises:
            ResetNeeded: before the first reset.
        """
        if self._model is None:
            raise gym.error.ResetNeeded("call reset() before drawing")
        scene.light(self._model, self.hand, self._touched)
        return self._model, self._data

    @property
    def touched(self) -> NDArray[np.bool_]:
        """(P,): the patches that really touch the object."""
        return self._touched.copy()

    def step(self, action: NDArray[np.float32]) -> tuple[Observation, float, bool, bool, dict[str, Any]]:
        """Go to the next frame.

        Args:
            action: (J,), of no effect, but checked.

        Returns:
            As every environment: observation, reward 0, never terminated, whether truncated, info.

        Raises:
            ValueError: for an action that no environment takes.
            ResetNeeded: before the first reset.
        """
        if self._model is None:
            raise gym.error.ResetNeeded("call reset() before step()")
        self._command = self._checked(action)
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


class Playback(FeltPlayback):
    """What was felt in an exploration, once more, bit for bit; nothing is simulated."""

    def __init__(self, hand: Hand, recording: Recording, solid: Solid, seconds: float | None = None) -> None:
        """Check that the recording tells all that was felt.

        Args:
            hand: the hand that explored.
            recording: one with `felt`.
            solid: the object that was explored.
            seconds: s, after which it ends; None: with the recording.

        Raises:
            ValueError: where the recording does not tell what was felt, or with other joints or patches, or not at a
                steady rate.
        """
        self._felt = recording.felt_of(hand)
        super().__init__(hand, steady_rate(recording), len(recording))
        if seconds is not None:
            wanted = validate.number("seconds", seconds, 0.0, above=0.0, unit="s")
            self.episode_steps = min(self.episode_steps, max(1, round(wanted * self.control_hz)))
        self.solid = solid
        self._angles = recording.angles_of(hand)
        self._roots = roots(recording, hand) if recording.root is not None else None

    @property
    def commanded(self) -> NDArray[np.float64]:
        """(J,) fractions: what was commanded on the way to this frame, whatever an action was."""
        return self._felt.torques[self._steps].copy()

    def _observe(self) -> Observation:
        felt = self._felt.joint_angles[self._steps].astype(np.float32)
        return {"joint_angles": felt, "contacts": self._felt.contacts[self._steps].astype(np.int8)}

    def _info(self) -> dict[str, Any]:
        truth = {
            "joint_angles": self._angles[self._steps].copy(),
            "shape": self.solid.name,
            "object_position": np.array(self.solid.position),
            "object_quaternion": np.array(self.solid.quaternion),
            "object_size": np.array(self.solid.size),
        }
        return {"truth": truth} | ({} if self._roots is None else {"root": self._roots[self._steps]})


def steady_rate(recording: Recording) -> float:
    """Tell how often frames come.

    Args:
        recording: any.

    Returns:
        Hz.

    Raises:
        ValueError: where they do not come at a steady rate, or one of no exploration.
    """
    rate = round((len(recording) - 1) / recording.seconds, 6)  # stamps are rounded
    validate.number(f"{recording.source}: frames a second", rate, 1.0, 1.0 / scene.PHYSICS_SECONDS, unit="Hz")
    steps = np.diff(recording.time)
    usual = np.median(steps)
    uneven = np.abs(steps / usual - 1.0) > UNEVEN
    if uneven.any():
        frame = int(np.argmax(uneven))
        raise ValueError(
            f"{recording.source}: what was felt must be told at a steady rate, but frame {frame + 1} comes "
            f"{steps[frame]:g} s after frame {frame}, not {usual:g} s"
        )
    return rate


def roots(recording: Recording, hand: Hand) -> list[Pose]:
    """Find where the frame in which `hand` is drawn lies in the object's, at each frame of a recording.

    Args:
        recording: with the path of a root.
        hand: whose model fixes the root's body.

    Returns:
        (T,) poses.

    Raises:
        ValueError: where the recording does not tell, or its body is none of those that the hand's model fixes.
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
