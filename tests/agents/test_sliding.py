"""Sliding over an object: fingers like claws, ways to where little is known, and what is done where it is held up."""

from __future__ import annotations

import gymnasium as gym
import numpy as np
import pytest
from scipy.spatial.transform import Rotation

import agents
from agents import sliding
from agents.clawed_fingers import ClawedFingers
from agents.touch_record import DIRECTIONS, PLACES, Record
from haptic_env import hands
from observer import HapticSLAM, ObserverWrapper, PoseOnly

ARM = "HapticSLAM/TwoFingerArm-v0"


def _watched(env_id: str = ARM, seconds: float = 10.0, sigma_deg: float = 1.0, **keywords):
    env = gym.make(env_id, shape="cube", sigma_deg=sigma_deg, reveal_truth=True, episode_seconds=seconds, **keywords)
    return ObserverWrapper(env, HapticSLAM(env.unwrapped.hand, sigma_deg, particles=1))


@pytest.fixture
def policy():
    env = _watched()
    env.reset(seed=0)
    yield agents.make("sliding", env, seed=0)
    env.close()


@pytest.mark.parametrize("name", ["two_finger", "two_finger_arm", "adroit", "myo"])
def test_fingers_close_and_open_with_what_presses_and_curl_with_what_holds(name):
    hand = hands.make(name)
    fingers = ClawedFingers(hand)
    count, still = fingers.kinematics.fingers, np.zeros(hand.joints)
    some = np.full(count, 0.5)
    closed = fingers.closed(hand.rest_pose)
    assert closed.shape == (count,)
    assert ((closed >= 0) & (closed <= 1)).all()
    base = fingers.torque(hand.rest_pose, still, some, 0 * some, 0 * some)
    pressed = fingers.torque(hand.rest_pose, still, some, 0 * some, some) - base
    assert np.isfinite(base).all()
    moved = hand.rest_pose + 0.05 * pressed
    assert (fingers.closed(moved) > closed).all(), "it presses inwards"
    straight, bent = (fingers.torque(hand.rest_pose, still, c + 0 * some, 0 * some, 0 * some) for c in (0.0, 1.0))
    curled = bent - straight
    assert not (np.abs(curled) > 1e-12)[np.abs(pressed) > 1e-12].any(), "what presses is not what curls"
    assert (np.abs(curled) > 0).sum() >= count
    assert not base[~fingers.kinematics.alone.any(axis=0)].any(), "the wrist is left to others"


def test_a_held_posture_is_where_no_torque_but_that_against_the_springs_is_left():
    hand = hands.make("two_finger")
    fingers = ClawedFingers(hand)
    low, high = hand.joint_limits.T
    pose = hand.rest_pose.copy()
    outer = [name.endswith(("pip_flexion", "dip_flexion")) for name in hand.joint_names]
    sideways = [name.endswith("abduction") for name in hand.joint_names]
    pose[outer] = (low + 0.75 * (high - low))[outer]
    pose[sideways] = (0.5 * (low + high) + 0.5 * 0.5 * (high - low))[sideways]
    torque = fingers.torque(pose, np.zeros(8), np.full(2, 0.75), np.full(2, 0.5), np.zeros(2))
    springs = hand.model.jnt_stiffness * (pose - hand.model.qpos_spring) / hand.torque_limits
    np.testing.assert_allclose(torque, springs, atol=1e-12)


def test_a_way_ends_where_the_next_begins_and_goes_there_evenly():
    start, rotated = Rotation.from_rotvec([0.1, 0.2, 0.3]), np.array([0.0, 0.5, 0.0])
    way = sliding.Way(np.array([10, 0, 20]), start.as_quat(), np.zeros(3), rotated, np.array([0.01, 0.0, 0.0]))
    turn, shift = way.now
    assert (Rotation.from_rotvec(0.5 * rotated) * start).approx_equal(turn, atol=1e-9)
    np.testing.assert_allclose(shift, [0.005, 0.0, 0.0])
    after = way._replace(times=np.array([25, 0, 20])).now
    assert after[0].approx_equal(way.at(1.0)[0], atol=1e-12)
    at_once = way._replace(times=np.array([0, 5, 20])).now
    assert at_once[0].approx_equal(way.at(1.0)[0], atol=1e-12), "an open hand goes there at once"


def test_ways_lead_to_where_nothing_was_felt_and_nothing_is_mapped(policy):
    directions = policy._recorder.directions
    places = np.tile([0.03, 0.0, 0.0], (PLACES, 1))  # the skin lies in the direction of +x of the hand
    felt = np.where(directions[:, 1] > 0.2, 0.0, 100.0)  # and all was touched but what lies towards +y
    record = Record(felt, places, np.array(PLACES))
    begun = sliding.Way(np.array([5, 0, 5]), Rotation.identity().as_quat(), *np.zeros((3, 3)))
    ends = np.array([policy._chosen(begun, record).at(1.0)[0].apply([1.0, 0.0, 0.0]) for _ in range(10)])
    assert ends[:, 1].mean() > 0.5
    other = Record(felt[:] * 0.0 + np.where(directions[:, 1] < -0.2, 0.0, 100.0), places, np.array(PLACES))
    ends = np.array([policy._chosen(begun, other).at(1.0)[0].apply([1.0, 0.0, 0.0]) for _ in range(10)])
    assert ends[:, 1].mean() < -0.5


def test_what_is_mapped_is_known(policy, monkeypatch):
    grid, centre = policy.belief.grid, policy.hand.grasp_centre
    occupancy = np.full(grid.shape, 0.03)
    occupancy[grid.centres()[..., 0] > centre[0] + 0.02] = 0.9
    monkeypatch.setattr(policy, "map_now", lambda: occupancy)
    unknown = policy._unknown(Record.empty())
    ahead = policy._recorder.directions[:, 0]
    assert unknown[ahead > 0.9].max() < unknown[ahead < -0.9].min()
    assert unknown.shape == (DIRECTIONS,)


def test_a_hand_that_is_held_up_opens_and_goes_on(policy):
    rest = policy.hand.rest_pose
    there = Rotation.from_rotvec([0.0, 0.0, 1.0])
    way = sliding.Way(np.array([1, 0, 500]), there.as_quat(), *np.zeros((3, 3)))
    held_up, opened = 0.0, None
    for step in range(1, 40):
        after, held_up = policy._next(way, Record.empty(), rest, held_up)
        if after is not way:
            opened = step
            break
    assert opened == int(sliding.FOR * 50) + 1
    assert after.times[1] > 0
    assert after.at(1.0)[0].approx_equal(there, atol=1e-9), "the way is not given up"
    near, held_up = policy._next(way._replace(turn=Rotation.identity().as_quat()), Record.empty(), rest, 10.0)
    assert held_up == 0.0
    assert near.times[1] == 0


def test_a_finger_that_misses_the_object_opens_again(policy):
    hand = policy.hand
    shut = np.where(["mcp_flexion" in name for name in hand.joint_names], hand.joint_limits[:, 1], hand.rest_pose)
    way = sliding.Way(np.array([1, 0, 500]), Rotation.identity().as_quat(), *np.zeros((3, 3)))
    contacts, lost, opened = np.zeros(len(hand.patches)), np.zeros((2, 2)), []
    contacts[[patch.startswith("thumb_distal_tip") for patch in hand.patches.names]] = 1
    for _ in range(30):
        press, lost = policy._presses(way, lost, shut, contacts)
        opened.append(press[1] < 0)
        assert press[0] == sliding.LIGHT, "the other one is where it is to be"
    assert not any(opened[: int(sliding.LOST * 50)])
    assert any(opened)


def test_it_is_in_touch_far_more_than_coverage_and_slides_slowly():
    shares, speeds = {}, {}
    for name in ("sliding", "coverage"):
        env = _watched(seconds=16.0)
        explorer, state = agents.make(name, env, seed=0), None
        observation, _ = env.reset(seed=0)
        true, felt = [], []
        for _ in range(env.unwrapped.episode_steps):
            torque, state = agents.act(explorer, observation, state)
            observation, *_, info = env.step(torque)
            true.append(info["truth"]["joint_angles"])
            felt.append(observation["contacts"].any())
        shares[name] = np.mean(felt[200:])
        speeds[name] = np.abs(np.diff(np.array(true)[200:, :6], axis=0)).mean()
        env.close()
    assert shares["sliding"] > shares["coverage"] + 0.1
    assert speeds["sliding"] < 0.6 * speeds["coverage"]


@pytest.mark.parametrize(("env_id", "wrist"), [("HapticSLAM/MyoHand-v0", "free"), ("HapticSLAM/TwoFinger-v0", "fixed")])
def test_other_hands_slide_too_and_one_without_a_map(env_id, wrist):
    env = gym.make(env_id, shape="cube", wrist=wrist, episode_seconds=4.0)
    watched = ObserverWrapper(env, PoseOnly(env.unwrapped.hand))
    explorer, state = agents.make("sliding", watched, seed=0), None
    observation, _ = watched.reset(seed=0)
    felt = []
    for _ in range(env.unwrapped.episode_steps):
        torque, state = agents.act(explorer, observation, state)
        observation, *_ = watched.step(torque)
        felt.append(observation["contacts"].any())
    assert np.mean(felt[50:]) > 0.3
    env.close()


@pytest.mark.parametrize("speed", [0.0, -1.0, 11.0, float("nan")])
def test_a_speed_that_makes_no_sense_is_refused(speed):
    env = _watched()
    with pytest.raises(ValueError, match=r"speed must be a finite number in \(0, 10\] rad/s"):
        agents.make("sliding", env, speed=speed)
    env.close()
