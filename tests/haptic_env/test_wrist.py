"""A wrist that moves: six joints more, told in radians, which go as far and as fast as they are said to."""

from __future__ import annotations

import copy

import gymnasium as gym
import mujoco
import numpy as np
import pytest

import agents
from haptic_env import hands
from haptic_env.composer import mjcf
from haptic_env.hands import wrist
from haptic_env.sliding import compile_model
from observer.kinematics import link_frames, tree_of

FREE = ("two_finger_arm", "adroit", "myo")
FIXED = {"two_finger_arm": "two_finger", "adroit": "adroit", "myo": "myo"}
IDS = {"two_finger_arm": "TwoFingerArm", "adroit": "AdroitHand", "myo": "MyoHand"}


@pytest.fixture(params=FREE)
def name(request: pytest.FixtureRequest) -> str:
    """Each hand that may have a free wrist."""
    return str(request.param)


def _frames(hand, wrist_angles, fingers=None):
    q = hand.rest_pose.copy()
    q[hand.wrist] = wrist_angles
    if fingers is not None:
        q[hand.wrist[-1] + 1 :] = fingers
    return link_frames(tree_of(hand), q)


def test_a_free_wrist_is_six_joints_more_and_the_rest_is_as_it_was(name):
    free, fixed = hands.make(name, wrist="free"), hands.make(FIXED[name])
    assert free.joint_names == (*wrist.NAMES, *fixed.joint_names)
    np.testing.assert_array_equal(free.wrist, np.arange(6))
    assert fixed.wrist.size == 0
    np.testing.assert_array_equal(free.lever_arms, [wrist.LEVER_ARM] * 3 + [0.0] * (3 + fixed.joints))
    np.testing.assert_array_equal(free.rest_pose, [*np.zeros(6), *fixed.rest_pose])
    assert free.patches.names == fixed.patches.names
    np.testing.assert_allclose(free.joint_limits[6:], fixed.joint_limits)
    for mine, theirs in zip(_frames(free, 0.0), link_frames(tree_of(fixed), fixed.rest_pose), strict=True):
        np.testing.assert_allclose(mine, theirs, atol=1e-9)


def test_slides_go_along_the_axes_of_the_world_by_their_lever_arm(name):
    hand = hands.make(name, wrist="free")
    place, turn = _frames(hand, np.zeros(6))
    moved, turned = _frames(hand, [0.5, -0.3, 0.2, 0.0, 0.0, 0.0])
    np.testing.assert_allclose(moved - place, np.tile(wrist.LEVER_ARM * np.array([0.5, -0.3, 0.2]), (len(place), 1)))
    np.testing.assert_allclose(turned, turn, atol=1e-12)


def test_turns_are_roll_pitch_and_yaw_about_one_place(name):
    hand = hands.make(name, wrist="free")
    place, turn = _frames(hand, np.zeros(6))
    angles = np.array([0.4, -0.7, 1.1])
    moved, turned = _frames(hand, [0.0, 0.0, 0.0, *angles])
    axes = np.eye(3)
    rotation = np.eye(3)
    for axis, angle in zip(axes, angles, strict=True):
        quaternion, matrix = np.empty(4), np.empty(9)
        mujoco.mju_axisAngle2Quat(quaternion, axis, angle)
        mujoco.mju_quat2Mat(matrix, quaternion)
        rotation = rotation @ matrix.reshape(3, 3)
    np.testing.assert_allclose(turned, rotation @ turn, atol=1e-9)
    # moved = centre + R (place - centre) for all links, of one centre
    centre, *_ = np.linalg.lstsq(
        np.tile(np.eye(3) - rotation, (len(place), 1)), (moved - place @ rotation.T).ravel(), rcond=None
    )
    np.testing.assert_allclose(moved, centre + (place - centre) @ rotation.T, atol=1e-9)


def test_what_is_told_in_radians_moves_as_it_would_in_metres(name):
    """The same hand with slides as MuJoCo has them, its numbers turned into metres, under the same forces."""
    hand = hands.make(name, wrist="free")
    root = mjcf.from_xml_string(hand.xml, escape_separators=True)
    arm = wrist.LEVER_ARM
    for slide in wrist.NAMES[:3]:
        joint, motor = root.find("joint", slide), root.find("actuator", slide)
        joint.user, joint.range = None, np.array(joint.range) * arm
        joint.damping, joint.stiffness, joint.armature = (
            each / arm**2 for each in (joint.damping, joint.stiffness, joint.armature)
        )
        motor.gear = np.array(motor.gear) / arm
    in_metres = mujoco.MjModel.from_xml_string(root.to_xml_string())
    models = copy.copy(hand.model), in_metres
    scale = np.array([arm] * 3 + [1.0] * (hand.joints - 3))
    both = []
    for model in models:
        data = mujoco.MjData(model)
        data.qpos[:] = hand.rest_pose
        rng = np.random.default_rng(0)
        for _ in range(20):
            data.ctrl[:] = rng.uniform(-0.3, 0.3, hand.joints)
            mujoco.mj_step(model, data, 10)
        both.append(data.qpos.copy())
    np.testing.assert_allclose(both[0] * scale, both[1], atol=1e-7)
    np.testing.assert_allclose(models[0].dof_M0[:3], in_metres.dof_M0[:3] * arm**2)


def _path(hand, torque, steps: int, data: mujoco.MjData | None = None) -> tuple[np.ndarray, mujoco.MjData]:
    """(steps, J) rad of the hand alone, at steps of 20 ms."""
    data = mujoco.MjData(hand.model) if data is None else data
    if data.time == 0.0:
        data.qpos[:] = hand.rest_pose
    data.ctrl[:] = torque
    path = np.empty((steps, hand.joints))
    for step in range(steps):
        mujoco.mj_step(hand.model, data, 10)
        path[step] = data.qpos
    return path, data


def test_at_full_force_it_moves_at_the_speed_of_a_hand_and_stops_where_it_is_said_to(name):
    hand = hands.make(name, wrist="free")
    for joint in range(6):
        torque = np.zeros(hand.joints)
        torque[joint] = 1.0
        path = _path(hand, torque, 200)[0][:, joint]
        speed = 50.0 * np.diff(path).max() * (wrist.LEVER_ARM if joint < 3 else 1.0)
        assert (0.1 < speed < 0.3) if joint < 3 else (1.5 < speed < 3.0)
        assert path.max() < hand.joint_limits[joint, 1] + 0.1


def test_a_wrist_that_is_left_alone_comes_back_to_its_middle(name):
    hand = hands.make(name, wrist="free")
    torque = np.zeros(hand.joints)
    torque[:6] = 0.4
    away, data = _path(hand, torque, 250)
    assert (np.abs(away[-1, :6]) > 0.3).all()
    back, _ = _path(hand, np.zeros(hand.joints), 400, data)
    assert np.abs(back[-1, :6]).max() < 0.1


@pytest.mark.parametrize(
    ("hand", "asked", "told"),
    [
        ("two_finger", "free", "hand 'two_finger' has no wrist that moves: wrist must be 'fixed', got 'free'"),
        ("two_finger_arm", "fixed", "has a wrist that always moves: wrist must be 'free', got 'fixed'"),
        ("adroit", "loose", "unknown wrist 'loose'; choose from fixed, free"),
        ("myo", None, "unknown wrist None; choose from fixed, free"),
        ("two_finger", 1, "unknown wrist 1; choose from fixed, free"),
    ],
)
def test_a_wrist_that_there_is_not_is_refused(hand, asked, told):
    with pytest.raises(ValueError, match=told):
        hands.make(hand, wrist=asked)
    ids = {**IDS, "two_finger": "TwoFinger"}
    with pytest.raises(ValueError, match=told):
        gym.make(f"HapticSLAM/{ids[hand]}-v0", wrist=asked)


@pytest.mark.parametrize("name", ["two_finger", "adroit", "myo"])
def test_a_fixed_wrist_is_the_default(name):
    assert hands.make(name).xml == hands.make(name, wrist="fixed").xml
    assert not hands.make(name).lever_arms.any()


def test_a_slide_without_a_lever_arm_stays_in_metres():
    xml = """<mujoco><worldbody><body><joint name="s" type="slide" axis="0 0 2"{}/><geom size="0.01"/></body>
    </worldbody></mujoco>"""
    np.testing.assert_array_equal(compile_model(xml.format("")).jnt_axis, [[0.0, 0.0, 1.0]])
    np.testing.assert_array_equal(compile_model(xml.format(' user="0.2"')).jnt_axis, [[0.0, 0.0, 0.2]])


def test_random_torques_leave_the_hand_about_the_object():
    env = gym.make("HapticSLAM/TwoFingerArm-v0", shape="cube")
    observation, _ = env.reset(seed=1)
    policy, state = agents.make("random_torque", env, seed=1), None
    felt = 0
    for _ in range(500):
        torque, state = policy.predict(observation, state)
        observation = env.step(torque)[0]
        felt += int(observation["contacts"].sum())
    assert felt > 20
    env.close()
