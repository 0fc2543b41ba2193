"""The environment: a hand that explores an object it cannot see.

Shapes: J joints, P patches. Angles in radians, lengths in metres, world frame.
"""

from __future__ import annotations

import copy
import inspect
from collections.abc import Iterable, Mapping, Sequence
from pathlib import Path
from typing import Any

import gymnasium as gym
import mujoco
import numpy as np
from numpy.typing import NDArray

from haptic_env import hands, rendering, scene, sensors, shapes, validate
from haptic_env.shapes.base import Solid
from haptic_env.touch import Touch

Observation = dict[str, NDArray[Any]]
DRAWS = 100  # of an object that varies, before it is said to lie where the hand rests
RESET_OPTIONS = ("position", "quaternion", "shape", "sigma_deg", "size")


class ExploreEnv(gym.Env[Observation, NDArray[np.float32]]):
    """Explore one object for `episode_seconds`: torques in, noisy joint angles and binary contacts out.

    The reward is always 0: this is a perception problem, and a reward belongs to the belief.
    All keyword arguments are described in docs/environment.md; a wrong one raises `ValueError`.
    """

    metadata: dict[str, Any] = {"render_modes": ["human", "rgb_array"]}  # noqa: RUF012 - as gymnasium declares it

    def __init__(
        self,
        hand: str = "two_finger",
        *,
        shape: str | Path | Sequence[str | Path] | None = None,
        scale: float = 1.0,
        sigma_deg: float = 3.0,
        bias_deg: float = 0.0,
        drift_deg: float = 0.0,
        drift_seconds: float = 10.0,
        proportional: float = 0.0,
        motor_noise: float = 0.1,
        contact_miss: float = 0.0,
        contact_false_alarm: float = 0.0,
        size_jitter: float = 0.0,
        position_jitter: float = 0.0,
        yaw_jitter: float = 0.0,
        episode_seconds: float = 10.0,
        control_hz: float = 50.0,
        render_mode: str | None = None,
        reveal_truth: bool = False,
        **hand_keywords: Any,
    ) -> None:
        validate.keywords("environment", hand_keywords, (*_KEYWORDS, *hands.keywords_of(hand)))
        self.scale = validate.number("scale", scale, above=0.0, unit="m")
        self.shape_names = _shape_names(shape, self.scale)
        self.size_jitter = validate.number("size_jitter", size_jitter, 0.0, 0.5)
        self.position_jitter = validate.number("position_jitter", position_jitter, 0.0, 0.05, unit="m")
        self.yaw_jitter = validate.number("yaw_jitter", yaw_jitter, 0.0, 180.0, unit="degrees")
        self.episode_seconds = validate.seconds("episode_seconds", episode_seconds)
        self.control_hz = validate.number("control_hz", control_hz, 1.0, 1.0 / scene.PHYSICS_SECONDS, unit="Hz")
        self.substeps = round(1.0 / (self.control_hz * scene.PHYSICS_SECONDS))
        if not np.isclose(self.substeps * scene.PHYSICS_SECONDS * self.control_hz, 1.0):
            valid = [f"{1 / (n * scene.PHYSICS_SECONDS):g}" for n in (1, 2, 4, 5, 8, 10, 20, 25, 50)]
            raise ValueError(
                f"control_hz must divide {1 / scene.PHYSICS_SECONDS:g} Hz, got {control_hz!r}; e.g. {', '.join(valid)}"
            )
        if render_mode is not None:
            validate.choice("render_mode", render_mode, self.metadata["render_modes"])
        self.render_mode = render_mode
        self.reveal_truth = validate.boolean("reveal_truth", reveal_truth)
        self.hand = hands.make(hand, **hand_keywords)
        step_seconds = self.substeps * scene.PHYSICS_SECONDS
        self.metadata = {**type(self).metadata, "render_fps": round(1 / step_seconds)}
        self.episode_steps = max(1, round(self.episode_seconds / step_seconds))

        self.sigma_deg = validate.number("sigma_deg", sigma_deg, 0.0, 90.0, unit="degrees")
        self._other_noises = (
            sensors.Bias(bias_deg),
            sensors.Drift(drift_deg, drift_seconds, step_seconds),
            sensors.Proportional(proportional),
        )
        self.contact_detection = sensors.ContactDetection(contact_miss, contact_false_alarm)
        self.motor_noise = sensors.MotorNoise(motor_noise)

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
        self._renderer: Any = None
        self._steps = 0
        self._command = np.zeros(joints)

    def __getstate__(self) -> dict[str, Any]:
        """A copy, here or in another process, goes on as this one would; its window is another."""
        return {**vars(self), "_renderer": None, "_touch": None}  # the latter sees the memory of this one

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
        """Start an episode at the rest pose. `options` may set `shape`, `position` (3,) m, `quaternion` (4,) wxyz and
        `size` (3,) m of the object; what it leaves open is drawn. `sigma_deg` in it is the noise of this episode.

        Raises `ValueError` for an unknown option, or an object that is out of reach or where the hand rests.
        """
        super().reset(seed=seed)
        self._model = None  # until the new episode is known to be possible
        # One stream for each source of chance: the same seed is the same exploration whatever the noise.
        streams = self.np_random.spawn(4)
        world_rng, self._motor_rng, proprioception_rng, self._contact_rng = streams
        self._proprioception_seed: Any = proprioception_rng.bit_generator.seed_seq
        if options is not None and not isinstance(options, Mapping):
            valid = f"a dictionary of {', '.join(RESET_OPTIONS)}"
            raise ValueError(f"reset options must be {valid}, got {validate.shown(options)}")
        model = self._place_solid(world_rng, options or {})
        sigma = (options or {}).get("sigma_deg")
        self.felt_angles = self.felt_at(self.sigma_deg if sigma is None else sigma)
        self._steps, self._command = 0, np.zeros(self.hand.joints)
        self._model = model
        observation = self._observe()
        if self.render_mode == "human":
            self.render()
        return observation, self._info()

    def step(self, action: NDArray[np.float32]) -> tuple[Observation, float, bool, bool, dict[str, Any]]:
        """Apply `action` (J,), torques as fractions of their limits, for one control step.

        Raises `ValueError` for an action of the wrong shape, not finite, or outside [-1, 1], and
        `gymnasium.error.ResetNeeded` before the first reset.
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

    def felt_at(self, sigma_deg: float) -> sensors.FeltAngles:
        """How the angles of this episode are felt at `sigma_deg`, to be asked from the reset on: what an episode of the
        same seed and torques would give, bit for bit."""
        noises = [sensors.White(sigma_deg), *copy.deepcopy(self._other_noises)]
        rng = np.random.default_rng(self._proprioception_seed)
        return sensors.FeltAngles(sensors.Proprioception(noises), rng, self.hand.joints)

    def render(self) -> NDArray[np.uint8] | None:
        """Show the scene with active patches lit; an (H, W, 3) picture in mode "rgb_array".

        Raises `RuntimeError` where there is no OpenGL, or no display for a window.
        """
        if self.render_mode is None:
            gym.logger.warn('render() needs a render_mode: gym.make(..., render_mode="rgb_array")')
            return None
        if self._model is None:
            raise gym.error.ResetNeeded("call reset() before render()")
        if self._renderer is None:
            self._renderer = rendering.renderer_of(self._model, self._data, self.render_mode)
        elif self._renderer.viewer is not None:
            self._renderer.viewer.make_context_current()  # another environment may have drawn since
        scene.light(self._model, self.hand, self._touched)
        try:
            return rendering.draw(self._renderer, self.render_mode)
        except RuntimeError:
            self._close_renderer()  # what is left of it draws nothing
            raise

    def close(self) -> None:
        """Close the window, if any."""
        self._close_renderer()

    def _close_renderer(self) -> None:
        if self._renderer is not None:
            self._renderer.close()
            self._renderer = None

    def _place_solid(self, rng: np.random.Generator, options: Mapping[str, Any]) -> mujoco.MjModel:
        """Draw the object, anew while what was drawn of it by chance would put it where the hand rests."""
        for _ in range(DRAWS if self.size_jitter or self.position_jitter or self.yaw_jitter else 1):
            self.solid = self._draw_solid(rng, options)
            self._place = tuple(
                np.array(each) for each in (self.solid.position, self.solid.quaternion, self.solid.size)
            )
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

    def _draw_solid(self, rng: np.random.Generator, options: Mapping[str, Any]) -> Solid:
        """The object of an episode; always takes the same draws from `rng`, whatever the options."""
        for option in options:
            validate.choice("reset option", option, RESET_OPTIONS)
        drawn = self.shape_names[rng.integers(len(self.shape_names))]
        jitter = 1 + self.size_jitter * rng.uniform(-1, 1)
        shift = self.position_jitter * rng.uniform(-1, 1, 3)
        yaw = np.deg2rad(self.yaw_jitter) * rng.uniform(-1, 1)
        name = options.get("shape")
        name = drawn if name is None else shapes.check("shape", name)
        size = options.get("size")
        position = options.get("position")
        quaternion = options.get("quaternion")
        usual = shapes.default_size(name, self.scale)
        told = shapes.find(name).check_size(usual if size is None else size)
        solid = shapes.make(
            name,
            jitter * told if size is None else told,
            self.hand.place(told) + shift if position is None else position,
            (np.cos(yaw / 2), 0.0, 0.0, np.sin(yaw / 2)) if quaternion is None else quaternion,
        )
        offset = np.abs(np.asarray(solid.position) - self.hand.grasp_centre)
        reach = self.hand.workspace / 2
        if (offset > reach).any():
            low, high = self.hand.grasp_centre - reach, self.hand.grasp_centre + reach
            raise ValueError(
                f"object position {solid.position} m is out of reach; choose it between {low.tolist()} and "
                f"{high.tolist()} m"
            )
        return solid

    def _bind(self, model: mujoco.MjModel) -> None:
        """Start `model` afresh; a new one also gets its own data, renderer and sense of touch."""
        if self._data is not None and self._data.model is model:
            mujoco.mj_resetData(model, self._data)
            return
        self._close_renderer()
        self._data = mujoco.MjData(model)
        self._touch = Touch(self.hand, model, self._data)

    def _feel(self) -> NDArray[np.bool_]:
        """(P,): the patches that really touch the object."""
        assert self._touch is not None
        return self._touch.feel()

    def _observe(self) -> Observation:
        contacts = self.contact_detection.sample(self._contact_rng, self._touched)
        return {
            "joint_angles": self.felt_angles(self._data.qpos),
            "contacts": contacts.view(np.int8),
        }

    def _info(self) -> dict[str, Any]:
        if not self.reveal_truth:
            return {}
        return {
            "truth": {
                "joint_angles": self._data.qpos.copy(),
                "joint_velocities": self._data.qvel.copy(),
                "shape": self.solid.name,
                "object_position": self._place[0].copy(),
                "object_quaternion": self._place[1].copy(),
                "object_size": self._place[2].copy(),
            }
        }


def _shape_names(shape: str | Path | Sequence[str | Path] | None, scale: float) -> tuple[str, ...]:
    """The shapes to draw from; raises `ValueError` for an unknown one, a mesh of impossible size or an empty list."""
    if shape is None:
        return tuple(shapes.SHAPES)
    single = isinstance(shape, str) or not isinstance(shape, Iterable) or getattr(shape, "ndim", 1) == 0
    given: tuple[Any, ...] = (shape,) if single else tuple(shape)  # type: ignore[arg-type]
    names = tuple(shapes.check("shape", name) for name in given)
    if not names:
        raise ValueError(f"shape must name at least one of {', '.join(shapes.SHAPES)}, got an empty list")
    for name in names:
        shapes.default_size(name, scale)
    if len(names) == 1:  # each reset needs it; of several, those that are drawn
        shapes.find(names[0]).prepare()
    return names


# Read from the signature, so that the error for an unknown keyword can list them all.
_KEYWORDS = [
    each.name
    for each in inspect.signature(ExploreEnv).parameters.values()
    if each.kind is inspect.Parameter.KEYWORD_ONLY
]
