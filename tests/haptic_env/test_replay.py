"""Environments that repeat recordings: the hand and the object where the recording says, contacts from the physics."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import gymnasium as gym
import mujoco
import numpy as np
import pytest

import agents
from agents.follow_recording import LEAD_SECONDS, FollowRecording
from agents.repeat_torques import RepeatTorques
from haptic_env import hands, recordings, shapes
from haptic_env.pose import Pose
from haptic_env.recordings import ObserverInputs, Recording, Track
from haptic_env.replay import KinematicReplay, Playback, roots
from tests.haptic_env.movements import closing

SHARED = Path(__file__).resolve().parents[3] / "shared"
CAPTURED = {"cubemedium": ("cube", 0.08), "spheremedium": ("sphere", 0.08), "cylinderlarge": ("cylinder", 0.12)}
people = pytest.mark.skipif(not SHARED.exists(), reason="the shared recordings are not here")


@pytest.fixture(scope="module")
def hand():
    return hands.make("two_finger")


def replayed(env: Any, seed: int = 0) -> list[tuple]:
    observation, info = env.reset(seed=seed)
    result = [(observation, 0.0, False, False, info)]
    while not result[-1][3]:
        result.append(env.step(np.zeros(env.action_space.shape)))
    return result


def test_hand_and_object_follow_the_recording(hand: Any) -> None:
    recording = closing()
    env = KinematicReplay("two_finger", recording, shapes.make("cube", (0.04,) * 3), sigma_deg=0.0)
    steps = replayed(env)
    assert len(steps) == 40
    for (observation, *_, info), angles in zip(steps, recording.joint_angles, strict=True):
        np.testing.assert_allclose(observation["joint_angles"], angles, atol=1e-6)
        np.testing.assert_array_equal(info["truth"]["joint_angles"], angles)
        np.testing.assert_allclose(info["root"].position, 0.0, atol=1e-12)  # both move together
        np.testing.assert_allclose(info["root"].rotation, np.eye(3), atol=1e-12)
    assert not steps[0][0]["contacts"].any()
    assert steps[-1][0]["contacts"].any()


def test_contacts_are_those_of_a_fixed_object_where_both_are_carried_about(hand: Any) -> None:
    cube = shapes.make("cube", (0.05,) * 3)
    carried = replayed(KinematicReplay("two_finger", closing(), cube, sigma_deg=0.0))
    still = Track(np.zeros((40, 3)), np.tile([1.0, 0, 0, 0], (40, 1)))
    fixed = replayed(KinematicReplay("two_finger", closing(root=still, object=still), cube, sigma_deg=0.0))
    for a, b in zip(carried, fixed, strict=True):
        np.testing.assert_array_equal(a[0]["contacts"], b[0]["contacts"])


def test_the_root_is_that_of_the_named_body(hand: Any) -> None:
    data = mujoco.MjData(hand.model)
    mujoco.mj_kinematics(hand.model, data)
    body = hand.model.body("index_base").id
    place = Track(np.tile(data.xpos[body], (3, 1)), np.tile(data.xquat[body], (3, 1)))
    there = Track(np.tile([0.1, 0.0, 0.2], (3, 1)), np.tile([0.5, 0.5, 0.5, 0.5], (3, 1)))
    recording = closing(3, root=place, root_body="index_base", object=there)
    for root in roots(recording, hand):  # the hand is where it is drawn: the root is the object's pose undone
        expected = Pose.of(*(each[0] for each in there)).inverse()
        np.testing.assert_allclose(root.position, expected.position, atol=1e-12)
        np.testing.assert_allclose(root.rotation, expected.rotation, atol=1e-12)
    with pytest.raises(
        ValueError, match="'tail' is no body by which hand 'two_finger' is held; choose from thumb_base"
    ):
        roots(closing(root_body="tail"), hand)
    with pytest.raises(ValueError, match="does not say where the hand and the object were"):
        roots(closing(object=None), hand)


def test_noise_is_added_and_fixed_by_the_seed(hand: Any) -> None:
    env = KinematicReplay("two_finger", closing(), shapes.make("cube", (0.04,) * 3), sigma_deg=3.0)
    first, again, other = (replayed(env, seed) for seed in (1, 1, 2))
    error = np.array([step[0]["joint_angles"] - step[4]["truth"]["joint_angles"] for step in first])
    assert np.rad2deg(error.std()) == pytest.approx(3.0, rel=0.15)
    for a, b, c in zip(first, again, other, strict=True):
        np.testing.assert_array_equal(a[0]["joint_angles"], b[0]["joint_angles"])
        assert (a[0]["joint_angles"] != c[0]["joint_angles"]).all()


def test_a_replay_may_be_shorter_and_at_another_rate(hand: Any) -> None:
    cube = shapes.make("cube", (0.04,) * 3)
    assert len(replayed(KinematicReplay("two_finger", closing(), cube, episode_seconds=0.2))) == 11
    assert len(replayed(KinematicReplay("two_finger", closing(), cube, control_hz=100.0))) == 79
    with pytest.raises(gym.error.ResetNeeded):
        KinematicReplay("two_finger", closing(), cube).step(np.zeros(8))


def test_playback_repeats_what_was_felt(hand: Any) -> None:
    rng = np.random.default_rng(0)
    shape = (40, hand.joints)
    contacts = rng.random((40, len(hand.patches))) < 0.1
    felt = ObserverInputs(
        rng.uniform(-1, 1, shape), rng.standard_normal(shape).astype(np.float32).astype(float), contacts
    )
    recording = closing(felt=felt)
    env = Playback(hand, recording, shapes.make("cube"))
    assert env.control_hz == pytest.approx(50.0)
    for (observation, *_, info), q, z, angles in zip(
        replayed(env), felt.joint_angles, contacts, recording.joint_angles, strict=True
    ):
        np.testing.assert_array_equal(observation["joint_angles"], q)
        np.testing.assert_array_equal(observation["contacts"], z)
        np.testing.assert_array_equal(info["truth"]["joint_angles"], angles)
    policy, state = RepeatTorques(env, felt.torques), None
    for torque in felt.torques.astype(np.float32):
        action, state = policy.predict({}, state)
        np.testing.assert_array_equal(action, torque)
    assert not policy.predict({}, state)[0].any()
    with pytest.raises(ValueError, match="does not tell what was felt"):
        Playback(hand, closing(), shapes.make("cube"))
    few = felt._replace(contacts=contacts[:, :3])
    with pytest.raises(ValueError, match="contacts of 3 patches; hand 'two_finger' has 50"):
        Playback(hand, closing(felt=few), shapes.make("cube"))


def test_servos_repeat_a_recording_in_free_air(hand: Any) -> None:
    env = gym.make("HapticSLAM/TwoFinger-v0", shape="sphere", sigma_deg=3.0, motor_noise=0.0, reveal_truth=True)
    time = 0.02 * np.arange(100)
    sway = np.deg2rad(8.0) * np.sin(2 * np.pi * time)[:, None] * [0.2, 1, 1, 1] * 2
    recording = closing(100, time=time, joint_angles=hand.rest_pose - np.deg2rad(10) + np.tile(sway, 2)[:, :8])
    policy, state = FollowRecording(env, recording), None
    assert policy.steps == 99 + round(50 * LEAD_SECONDS)
    observation, info = env.reset(seed=0, options={"size": (0.01,) * 3})
    error = []
    for step in range(policy.steps):
        action, state = policy.predict(observation, state)
        observation, *_, info = env.step(action)
        error.append(info["truth"]["joint_angles"] - policy.reference[step + 1])
    assert np.rad2deg(np.sqrt(np.mean(np.square(error)))) < 2.0


def test_servos_do_not_pierce_an_object(hand: Any) -> None:
    env = gym.make("HapticSLAM/TwoFinger-v0", shape="cube", sigma_deg=3.0, reveal_truth=True)
    policy, state = FollowRecording(env, closing(100, time=0.02 * np.arange(100))), None
    observation, _ = env.reset(seed=0)
    base: Any = env.unwrapped
    touched, deepest = 0, 0.0
    for _ in range(policy.steps):
        action, state = policy.predict(observation, state)
        assert np.abs(action).max() <= 1.0
        observation, *_ = env.step(action)
        touched += observation["contacts"].any()
        deepest = min([deepest, *base._data.contact.dist])
    assert touched > 30
    assert deepest > -0.002
    env.close()


def test_servos_need_the_joints_of_the_hand(hand: Any) -> None:
    env = gym.make("HapticSLAM/TwoFinger-v0")
    with pytest.raises(ValueError, match="misses thumb_mcp_abduction"):
        FollowRecording(env, closing(joint_names=(*hand.joint_names[1:], "tail")))
    assert "follow_recording" not in agents.POLICIES  # it needs a recording


# Recordings of people


@people
@pytest.mark.parametrize(("name", "touching"), [("cubemedium", 80), ("spheremedium", 83), ("cylinderlarge", 90)])
def test_people_touch_what_they_inspect(name: str, touching: int) -> None:
    shape, size = CAPTURED[name]
    recording = recordings.read(SHARED / "recordings" / f"{name}_inspect.npz")
    steps = replayed(KinematicReplay("myo", recording, shapes.make(shape, (size,) * 3), sigma_deg=0.0))
    assert sum(step[0]["contacts"].any() for step in steps) == pytest.approx(touching, abs=2)


@people
@pytest.mark.parametrize("hand", ["AdroitHand", "MyoHand"])
@pytest.mark.parametrize("name", ["cyberglove_ball_grasp", "cyberglove_pen_interaction"])
def test_gloves_drive_hands_that_touch_what_is_in_their_grasp(hand: str, name: str) -> None:
    env = gym.make(f"HapticSLAM/{hand}-v0", shape="sphere")
    calibration = recordings.calibration_for(env.unwrapped.hand.name)  # type: ignore[attr-defined]
    recording = recordings.read(SHARED / "recordings" / f"{name}.txt", calibration=calibration)
    assert touches(env, recording, 300) > 10


@people
@pytest.mark.parametrize("part", ["demo_a", "demo_b"])
def test_demonstrations_drive_the_adroit_hand(part: str) -> None:
    env = gym.make("HapticSLAM/AdroitHand-v0", shape="sphere")
    recording = recordings.read(SHARED / "recordings" / "adroit_door_demos.npz", part=part)
    assert touches(env, recording, 300) > 10


def touches(env: Any, recording: Recording, most: int) -> int:
    policy, state = FollowRecording(env, recording), None
    observation, _ = env.reset(seed=0)
    count = 0
    for _ in range(min(policy.steps, most)):
        action, state = policy.predict(observation, state)
        observation, *_ = env.step(action)
        assert np.isfinite(observation["joint_angles"]).all()
        count += bool(observation["contacts"].any())
    env.close()
    return count
