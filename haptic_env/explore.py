"""The environment: a hand that explores an object it cannot see.

Shapes: J joints, P patches. Angles in radians, lengths in metres, world frame.
"""

from __future__ import annotations

import copy
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import gymnasium as gym
import mujoco
import numpy as np
from numpy.typing import NDArray

from haptic_env import hands, readable, rendering, scene, sensors, validate
from haptic_env.objects import ObjectPrior, reset_options
from haptic_env.touch import Touch

Observation = dict[str, NDArray[Any]]
DRAWS = 100  # of an object that varies, before it is said to lie where the hand rests


class ExploreEnv(gym.Env[Observation, NDArray[np.float32]]):
    """Explore one object for `episode_seconds`: torques in, noisy joint angles and binary contacts out.

    The reward is always 0: this is a perception problem, and a reward belongs to the belief.
    """

    metadata: dict[str, Any] = {"render_modes": list(rendering.MODES)}  # noqa: RUF012 - as gymnasium declares it
    __repr__ = readable.environment

    def __init__(
        self,
        hand: str = "two_finger",
        *,
        shape: str | Path | Sequence[str | Path] | None = None,
        scale: float = 1.0,
        sigma_deg: sensors.Spread = 3.0,
        bias_deg: sensors.Spread = 0.0,
        drift_deg: sensors.Spread = 0.0,
        drift_seconds: float = 10.0,
        proportional: float = 0.0,
        motor_noise: float = 0.1,
        contact_miss: float = 0.0,
        contact_false_alarm: float = 0.0,
        contact_confusion: float = 0.0,
        patches_stuck: sensors.Faults = 0.0,
        patches_dead: sensors.Faults = 0.0,
        size_jitter: float = 0.0,
        position_jitter: float = 0.0,
        yaw_jitter: float = 0.0,
        rotation_jitter: float = 0.0,
        episode_seconds: float = 10.0,
        control_hz: float = 50.0,
        render_mode: str | None = None,
        reveal_truth: bool = False,
        **hand_keywords: Any,
    ) -> None:
        """Check all arguments; the object is drawn at the reset.

        Args:
            hand: one of `haptic_env.hands.HANDS`, or the path of a TOML file that describes one's own.
            shape: a name or a mesh's path, several to draw from at each reset, or None for all named shapes.
            scale: metres that the unit of mesh files is long; 0.001 for millimetres.
            sigma_deg: degrees, SD of the white noise of each step: for all joints or (J,), as the next two.
            bias_deg: degrees, SD of the constant error of each joint and episode.
            drift_deg: degrees, SD of the slow error of each joint.
            drift_seconds: s, time constant of the drift.
            proportional: SD of white noise as a fraction of the angle.
            motor_noise: SD as a fraction of the commanded torque; 0 is the paper's.
            contact_miss: probability that a touched patch stays silent, at each step.
            contact_false_alarm: probability that an untouched patch reports a contact, at each step.
            contact_confusion: probability that a touch is felt at a neighbouring patch instead, at each step.
            patches_stuck: the patches that always report a contact, by index or name, or the probability of each.
            patches_dead: the patches that never do, likewise.
            size_jitter: fraction by which the object's size varies, drawn at reset.
            position_jitter: m by which its place varies along each axis, drawn at reset.
            yaw_jitter: degrees by which its turn about z varies, drawn at reset.
            rotation_jitter: or its turn about any axis; 180: it lies any way.
            episode_seconds: s until an episode is truncated.
            control_hz: Hz, of the steps; it divides the rate of the physics.
            render_mode: "human", "rgb_array" or None.
            reveal_truth: whether `info["truth"]` holds the true pose and object.
            **hand_keywords: of the hand: `patches_along`, `patches_around` and `wrist`.

        Raises:
            ValueError: for an unknown keyword or a value out of range; it lists what is valid.
        """
        validate.keywords("environment", hand_keywords, (*_KEYWORDS, *hands.keywords_of(hand)))
        self.objects = ObjectPrior.checked(shape, scale, size_jitter, position_jitter, yaw_jitter, rotation_jitter)
        self.episode_seconds = validate.seconds("episode_seconds", episode_seconds)
        self.control_hz = validate.number("control_hz", control_hz, 1.0, 1.0 / scene.PHYSICS_SECONDS, unit="Hz")
        self.substeps = scene.substeps_of(self.control_hz)
        self._window, self.render_mode = rendering.Window(render_mode), render_mode
        self.reveal_truth = validate.boolean("reveal_truth", reveal_truth)
        self.hand = hands.make(hand, **hand_keywords)
        step_seconds = self.substeps * scene.PHYSICS_SECONDS
        self.metadata = {**type(self).metadata, "render_fps": round(1 / step_seconds)}
        self.episode_steps = max(1, round(self.episode_seconds / step_seconds))
        self.sigma_deg = validate.one_or_each("sigma_deg", sigma_deg, self.hand.joints, 0.0, 90.0, unit="degrees")
        self._other_noises = (
            sensors.Bias(bias_deg, self.hand.joints),
            sensors.Drift(drift_deg, drift_seconds, step_seconds, self.hand.joints),
            sensors.Proportional(proportional),
        )
        faults = patches_stuck, patches_dead, self.hand.patches
        self.contact_detection = sensors.ContactDetection(contact_miss, contact_false_alarm, contact_confusion, *faults)
        self.motor_noise = sensors.MotorNoise(motor_noise)
        self.noise = {name: copy.copy(told) for name, told in locals().items() if name in sensors.KEYWORDS}

        joints, bound = self.hand.joints, sensors.FeltAngles.BOUND
        self._joints = (joints,)
        self.action_space = gym.spaces.Box(-1.0, 1.0, (joints,), np.float32)
        self.observation_space = gym.spaces.Dict(  # type: ignore[assignment]
            joint_angles=gym.spaces.Box(-bound, bound, (joints,), np.float32),
            contacts=gym.spaces.MultiBinary(len(self.hand.patches)),
        )
        self._model: mujoco.MjModel | None = None
        self._data: Any = None
        self._touch: Touch | None = None
        self._steps, self._command = 0, np.zeros(joints)

    def __getstate__(self) -> dict[str, Any]:
        """A copy, here or in another process, goes on as this one would; its window is another."""
        return {
            **vars(self),
            "_window": rendering.Window(self.render_mode),
            "_touch": None,
        }  # the latter sees the memory of this one

    def __setstate__(self, state: dict[str, Any]) -> None:
        vars(self).update(state)
        if self._data is not None:
            self._model = None if self._model is None else self._data.model
            self._touch = Touch(self.hand, self._data.model, self._data)

    @property
    def steps(self) -> int:
        """Control steps since the reset."""
        return self._steps

    @property
    def commanded(self) -> NDArray[np.float64]:
        """(J,) fractions: the torques that the last step commanded, zero after a reset. What an observer hears of them
        (the efference copy), whatever wrappers made of an action; motor noise is no part of it."""
        return self._command.copy()

    def reset(
        self, *, seed: int | None = None, options: Mapping[str, Any] | None = None
    ) -> tuple[Observation, dict[str, Any]]:
        """Start an episode at the rest pose.

        Args:
            seed: of the chance of this episode and those after it; None goes on with the present one.
            options: `shape`, `position` (3,) m, `quaternion` (4,) wxyz and `size` (3,) m of the object, of which what
                is left open is drawn; `sigma_deg` is the noise of this episode.

        Returns:
            The observation: `joint_angles` (J,) rad and `contacts` (P,). The info: with `reveal_truth`, the `truth`.

        Raises:
            ValueError: for an unknown option, or an object that is out of reach or where the hand rests.
        """
        super().reset(seed=seed)
        self._model = None  # until the new episode is known to be possible
        # One stream for each source of chance: the same seed is the same exploration whatever the noise.
        streams = self.np_random.spawn(4)
        world_rng, self._motor_rng, proprioception_rng, self._contact_rng = streams
        self._proprioception_seed: Any = proprioception_rng.bit_generator.seed_seq
        self.contact_detection.reset(self._contact_rng.spawn(1)[0])
        told = reset_options(options)
        model, sigma = self._place_solid(world_rng, told), told.get("sigma_deg")
        self.felt_angles = self.felt_at(self.sigma_deg if sigma is None else sigma)
        self._steps, self._command = 0, np.zeros(self.hand.joints)
        self._model = model
        observation = self._observe()
        if self.render_mode == "human":
            self.render()
        return observation, self._info()

    def step(self, action: NDArray[np.float32]) -> tuple[Observation, float, bool, bool, dict[str, Any]]:
        """Apply torques for one control step.

        Args:
            action: (J,), torques as fractions of their limits, in [-1, 1].

        Returns:
            The observation, the reward 0, False for never terminated, whether truncated, and the info, as `reset`'s.

        Raises:
            ValueError: for an action of the wrong shape, not finite, or outside [-1, 1].
            gymnasium.error.ResetNeeded: before the first reset.
        """
        if self._model is None:
            raise gym.error.ResetNeeded("call reset() before step()")
        self._command = self._checked(action)
        self._data.ctrl[:] = self.motor_noise.sample(self._motor_rng, self._command)
        # `substeps` of mj_step, cut where the torques enter: what comes before them was computed at the end of the
        # last step, so that contacts and frames are those of the state that is observed.
        mujoco.mj_step2(self._model, self._data)
        mujoco.mj_step(self._model, self._data, self.substeps - 1)
        mujoco.mj_step1(self._model, self._data)
        self._touched = self._feel()
        self._steps += 1
        observation = self._observe()
        if self.render_mode == "human":
            self.render()
        return observation, 0.0, False, self._steps >= self.episode_steps, self._info()

    def _checked(self, action: NDArray[np.float32]) -> NDArray[np.float64]:
        """A copy of the torques (J,) of `action`."""
        return validate.array("action", action, self._joints, bound=1.0, names=self.hand.joint_names).copy()

    def felt_at(self, sigma_deg: sensors.Spread) -> sensors.FeltAngles:
        """Make what feels the angles of this episode at another noise, to be asked from the reset on.

        It gives what an episode of the same seed and torques would give, bit for bit.

        Args:
            sigma_deg: degrees, SD of the white noise.

        Returns:
            To be called with the true angles (J,) rad of each step.

        Raises:
            ValueError: for a noise out of range.
        """
        noises = [sensors.White(sigma_deg, self.hand.joints), *copy.deepcopy(self._other_noises)]
        rng = np.random.default_rng(self._proprioception_seed)
        return sensors.FeltAngles(sensors.Proprioception(noises), rng, self.hand.joints)

    def render(self) -> NDArray[np.uint8] | None:
        """Show the scene with active patches lit.

        Returns:
            An (H, W, 3) picture in mode "rgb_array", else None.

        Raises:
            gymnasium.error.ResetNeeded: before the first reset.
            RuntimeError: where there is no OpenGL, or no display for a window.
        """
        if self.render_mode is None:
            gym.logger.warn('render() needs a render_mode: gym.make(..., render_mode="rgb_array")')
            return None
        if self._model is None:
            raise gym.error.ResetNeeded("call reset() before render()")
        scene.light(self._model, self.hand, self._touched)
        return self._window.draw(self._model, self._data)

    def close(self) -> None:
        """Close the window, if any."""
        self._window.close()

    def _place_solid(self, rng: np.random.Generator, options: Mapping[str, Any]) -> mujoco.MjModel:
        """Draw the object, anew while what was drawn of it by chance would put it where the hand rests."""
        for _ in range(DRAWS if self.objects.varies else 1):
            self.solid = self.objects.draw(rng, self.hand, options)
            self._place = tuple(map(np.array, (self.solid.position, self.solid.quaternion, self.solid.size)))
            model = scene.compose(self.hand, self.solid, show_patches=self.render_mode is not None)
            self._bind(model)
            scene.place(model, self._data, self.solid)
            self._data.qpos[:] = self.hand.rest_pose
            mujoco.mj_forward(model, self._data)
            self._touched = self._feel()
            if not self._touched.any():
                return model
        touching = [self.hand.patches.names[p] for p in np.flatnonzero(self._touched)]
        raise ValueError(
            f"the object at {self.solid.position} m of size {self.solid.size} m lies where the hand rests "
            f"(it touches {', '.join(touching)}); place it closer to the grasp centre or make it smaller"
        )

    def _bind(self, model: mujoco.MjModel) -> None:
        """Start `model` afresh; a new one also gets its own data, renderer and sense of touch."""
        if self._data is not None and self._data.model is model:
            mujoco.mj_resetData(model, self._data)
            return
        self._window.close()
        self._data = mujoco.MjData(model)
        self._touch = Touch(self.hand, model, self._data)

    def _feel(self) -> NDArray[np.bool_]:
        """(P,): the patches that really touch the object."""
        assert self._touch is not None
        return self._touch.feel()

    def _observe(self) -> Observation:
        contacts = self.contact_detection.sample(self._contact_rng, self._touched)
        return {"joint_angles": self.felt_angles(self._data.qpos), "contacts": contacts.view(np.int8)}

    def _info(self) -> dict[str, Any]:
        if not self.reveal_truth:
            return {}
        return {"truth": scene.truth(self._data, self.solid, self._place, self.felt_angles.offset)}


_KEYWORDS = validate.keywords_of(ExploreEnv)  # so that the error for an unknown one can list them all
