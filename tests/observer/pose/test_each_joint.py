"""Each joint may have its own noise, in the environment and in whoever believes in it."""

from __future__ import annotations

import re
from typing import Any

import gymnasium as gym
import numpy as np
import pytest

import haptic_env  # noqa: F401 - registers the environments
from haptic_env import hand_of, hands, sensors
from observer import OBSERVERS, HapticSLAM, PoseOnly
from observer.pose import noise_presets
from observer.pose.angle_noise import AngleNoise
from observer.pose.delta_pose import DeltaMotion, DeltaPose
from observer.pose.noise_presets import NOISES
from tests.observer.hands import pointer

HAND = hands.make("two_finger")
J = HAND.joints
SPREADS = np.linspace(0.5, 4.0, J)
SIGMA, STEP = 0.05, 0.02
KEYWORDS = ("sigma_deg", "bias_deg", "drift_deg")


def env_of(**noise: Any) -> Any:
    return gym.make("HapticSLAM/TwoFinger-v0", shape="cube", reveal_truth=True, **noise)


def errors_of(steps: int = 30, **noise: Any) -> np.ndarray:
    """(1 + T, J) felt less true angles of a hand at rest, in one episode."""
    env = env_of(**noise)
    observation, info = env.reset(seed=5)
    errors = [observation["joint_angles"] - info["truth"]["joint_angles"]]
    for _ in range(steps):
        observation, *_, info = env.step(np.zeros(J, np.float32))
        errors.append(observation["joint_angles"] - info["truth"]["joint_angles"])
    return np.array(errors)


def turns(steps: int = 40) -> list[tuple[np.ndarray, ...]]:
    env, rng = env_of(sigma_deg=2.0, bias_deg=2.0), np.random.default_rng(2)
    env.reset(seed=3)
    seen = []
    for _ in range(steps):
        torque = rng.uniform(-1, 1, J).astype(np.float32)
        observation, *_ = env.step(torque)
        seen.append((torque, observation["joint_angles"], observation["contacts"]))
    return seen


@pytest.mark.parametrize("name", KEYWORDS)
def test_the_environment_draws_each_joint_s_errors_at_its_own_size(name: str) -> None:
    nothing = dict.fromkeys(KEYWORDS, 0.0)
    one, each = (errors_of(**nothing | {name: spread}) for spread in (1.0, SPREADS))
    np.testing.assert_allclose(each, one * SPREADS, rtol=1e-3, atol=1e-6)
    some = np.where(np.arange(J) == 2, 3.0, 0.0)
    of_some = errors_of(**nothing | {name: list(some)})
    assert np.abs(of_some[:, 2]).min() > 0
    np.testing.assert_allclose(of_some[:, some == 0.0], 0.0, atol=1e-6)


@pytest.mark.parametrize("name", KEYWORDS)
def test_what_is_said_of_each_joint_alike_is_said_of_all(name: str) -> None:
    told = {"sigma_deg": 2.0, "bias_deg": 3.0, "drift_deg": 1.0}
    same = told | {name: [told[name]] * J}
    np.testing.assert_array_equal(errors_of(5, **told), errors_of(5, **same))
    seen = turns()
    for kind in ("haptic_slam", "floor", "paper", "smoother"):
        few = {"particles": 2} if kind in ("haptic_slam", "paper") else {}
        means = []
        for noise in (told, same):
            slam = OBSERVERS[kind](HAND, **few, **noise)
            slam.reset(seed=0, joint_angles=seen[0][1])
            beliefs = [slam.step(*turn) for turn in seen]
            means.append(
                [(each.joint_angles, each.joint_std, each.joint_offset, each.joint_offset_std) for each in beliefs]
            )
        np.testing.assert_allclose(*means, rtol=1e-6, atol=1e-9)


@pytest.mark.parametrize("kind", ["haptic_slam", "paper", "pose_only"])
def test_an_observer_keeps_for_sure_what_it_is_told_is_exact(kind: str) -> None:
    bias = np.where(np.arange(J) % 2 == 0, 4.0, 0.0)
    sigma = np.where(np.arange(J) < 4, 1.0, 4.0)
    told = {"sigma_deg": sigma, "bias_deg": bias, "motor_noise": 0.1}
    slam: Any = PoseOnly(HAND, **told) if kind == "pose_only" else OBSERVERS[kind](HAND, particles=2, **told)
    np.testing.assert_allclose(slam.sigma_deg, sigma)
    seen = turns()
    slam.reset(seed=0, joint_angles=seen[0][1])
    belief = [slam.step(*turn) for turn in seen][-1]
    assert not belief.joint_offset[bias == 0.0].any()
    assert not belief.joint_offset_std[bias == 0.0].any()
    assert (belief.joint_offset[bias > 0.0] != 0.0).all()
    assert belief.joint_std[:4].mean() < belief.joint_std[4:].mean(), "what is felt better is known better"
    slam.sigma_deg = 2.0
    assert slam.sigma_deg == 2.0


def test_the_floor_and_who_follows_have_the_spread_of_each_joint() -> None:
    told = {"bias_deg": SPREADS, "drift_deg": 1.0}
    for slam in (OBSERVERS["floor"](HAND, 1.0, **told), HapticSLAM(HAND, 1.0, 2, motion="kinematic", **told)):
        slam.reset(seed=0, joint_angles=HAND.rest_pose)
        for _ in range(15):
            belief = slam.step(np.zeros(J), HAND.rest_pose, np.zeros(len(HAND.patches), bool))
        np.testing.assert_allclose(np.rad2deg(belief.joint_offset_std), np.hypot(SPREADS, 1.0))
        assert (np.diff(belief.joint_std) > 0).all()
        assert (belief.joint_std > np.deg2rad(np.hypot(SPREADS, 1.0))).all()
    floor = OBSERVERS["floor"](HAND, SPREADS)
    floor.reset(seed=0)
    belief = floor.step(np.zeros(J), HAND.rest_pose, np.zeros(len(HAND.patches), bool))
    np.testing.assert_allclose(np.rad2deg(belief.joint_std), SPREADS)


@pytest.mark.parametrize("drift", [0.0, (2.0, 0.5, 0.0)])
def test_the_filter_is_exact_for_joints_that_differ(drift: Any) -> None:
    """One Gaussian over all steps, joint by joint, solved at once."""
    joints, steps, bias, sigma = 3, 12, (1.0, 4.0, 0.0), np.array([0.02, 0.05, 0.1])
    hand = pointer(joints)
    told = [np.broadcast_to(each, joints) for each in (bias, drift)]
    noise = AngleNoise(joints, STEP, bias_deg=bias, drift_deg=drift)
    pose = DeltaPose(hand, sigma=sigma, motor_noise=0.0, control_hz=1 / STEP, lag=steps, noise=noise)
    wander = np.deg2rad(0.7) ** 2
    pose.motion = DeltaMotion(np.zeros((joints, joints)), wander * np.eye(joints))
    felt = np.random.default_rng(3).normal(0.0, 0.05, (steps + 1, joints))
    pose.reset(felt[0])
    for each in felt[1:]:
        pose.step(np.zeros(joints), each, np.zeros(len(hand.patches), bool))
    time = np.arange(steps + 1)
    angles = wander * np.minimum.outer(time, time) + 1e-10 * np.eye(steps + 1)
    over_time = noise.over_time(steps + 1)
    for joint in range(joints):
        own = AngleNoise(1, STEP, bias_deg=float(told[0][joint]), drift_deg=float(told[1][joint])).over_time(steps + 1)
        np.testing.assert_allclose(over_time[joint::joints, joint::joints], own, atol=1e-18)
        gain = np.linalg.inv(angles + own + sigma[joint] ** 2 * np.eye(steps + 1))
        q, o = angles @ gain @ felt[:, joint], own @ gain @ felt[:, joint]
        for ago in (0, 1, steps):
            assert pose.mean[pose.lagged(ago)][joint] == pytest.approx(q[steps - ago], abs=1e-6)
        assert pose.offset.mean[joint] == pytest.approx(o[-1], abs=1e-6)


WRONG: dict[str, Any] = {
    "too few": [1.0, 2.0],
    "too many": [1.0] * (J + 1),
    "none": [],
    "negative": [*[1.0] * (J - 1), -1.0],
    "too large": [91.0, *[1.0] * (J - 1)],
    "no number": [float("nan"), *[1.0] * (J - 1)],
    "in a row": [[1.0] * J],
    "text": ["1"] * J,
    "nothing": [None] * J,
}


@pytest.mark.parametrize("name", KEYWORDS)
@pytest.mark.parametrize("wrong", WRONG)
def test_what_is_no_spread_of_each_joint_is_refused(name: str, wrong: str) -> None:
    told = re.escape(f"{name} must be a finite number in [0, 90] degrees, or {J}, one for each joint, got ")
    for value in (WRONG[wrong], tuple(WRONG[wrong])):
        for make in (env_of, lambda **noise: HapticSLAM(HAND, **noise), lambda **noise: PoseOnly(HAND, **noise)):
            with pytest.raises(ValueError, match=told):
                make(**{name: value})


def test_who_takes_joints_together_needs_one_sigma() -> None:
    with pytest.raises(ValueError, match="sigma_deg must be one number for all joints with motion='kinematic', got"):
        HapticSLAM(HAND, SPREADS, motion="kinematic")


def test_what_is_told_is_the_caller_s_own() -> None:
    told = SPREADS.copy()
    env, slam = env_of(sigma_deg=told, bias_deg=told), HapticSLAM(HAND, told, 2, bias_deg=told)
    before = slam.sigma_deg.copy(), np.array(env.unwrapped.sigma_deg)
    told[:] = 90.0
    np.testing.assert_array_equal(slam.sigma_deg, before[0])
    np.testing.assert_array_equal(env.unwrapped.sigma_deg, before[1])
    np.testing.assert_allclose(np.rad2deg(slam.pose.noise.sd), SPREADS)


@pytest.mark.parametrize("hand", ["two_finger", "two_finger_arm", "myo", "adroit"])
@pytest.mark.parametrize("name", NOISES)
def test_a_preset_knows_the_joints_of_each_hand(name: str, hand: str) -> None:
    made = hands.make(hand)
    told = noise_presets.of(name, made)
    assert told.keys() == NOISES[name].keys()
    noise = AngleNoise(made.joints, STEP, **{each: told[each] for each in told if each != "sigma_deg"})
    spread = {each: np.broadcast_to(told[each], made.joints) for each in ("bias_deg", "drift_deg") if each in told}
    wrists = np.isin(made.joint_names, list(noise_presets.WRIST))
    wrists[made.wrist] = True
    assert wrists.sum() == {"two_finger": 0, "two_finger_arm": 6, "myo": 3, "adroit": 2}[hand]
    for each, values in spread.items():
        np.testing.assert_array_equal(values[~wrists], NOISES[name][each])
        assert (name == "human" and hand != "two_finger") == (len(set(values)) > 1)
    np.testing.assert_allclose(np.rad2deg(noise.sd), np.sqrt(sum(values**2 for values in spread.values())))


def test_abduction_of_the_wrist_is_felt_best() -> None:
    """Cappello & al. 2015, Marini & al. 2016: see the module."""
    for hand, abduction, flexion in (("myo", "deviation", "flexion"), ("adroit", "WRJ1", "WRJ0")):
        made = hands.make(hand)
        told = noise_presets.of("human", made)["bias_deg"]
        low, high = np.rad2deg(made.joint_limits[made.joint_names.index(abduction)])
        assert high - low < 45.0, "the wrist turns sideways by less than it bends"
        of = {name: told[made.joint_names.index(name)] for name in (abduction, flexion)}
        assert of == {abduction: 3.6, flexion: 5.1}


def test_an_environment_says_it_to_its_observer() -> None:
    env = env_of(**noise_presets.of("human", HAND) | {"bias_deg": SPREADS})
    slam = HapticSLAM.for_env(env, particles=2)
    np.testing.assert_allclose(np.rad2deg(slam.pose.noise.lasting[0].sd), SPREADS)
    assert isinstance(slam.pose.noise.lasting[0], sensors.Bias)
    assert hand_of(env).joints == J
