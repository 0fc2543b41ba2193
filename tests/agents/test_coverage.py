"""Hands on a wrist that moves: goals of the wrist, an enclosure that turns, and coverage."""

from __future__ import annotations

import gymnasium as gym
import numpy as np
import pytest
from scipy.spatial.transform import Rotation

import agents
from agents import coverage
from agents.wrist_motion import FARTHEST_TILT, WristMotion
from haptic_env import hands
from observer import HapticSLAM, ObserverWrapper
from observer.kinematics import link_frames, tree_of
from observer.surface_metrics import surface_places, touched_places

IDS = ("HapticSLAM/TwoFingerArm-v0", "HapticSLAM/AdroitHand-v0", "HapticSLAM/MyoHand-v0")


@pytest.fixture(params=["two_finger_arm", "adroit", "myo"])
def hand(request: pytest.FixtureRequest):
    """Each hand with a free wrist."""
    return hands.make(request.param, wrist="free")


def _at(hand, goal):
    angles = hand.rest_pose.copy()
    angles[hand.wrist] = goal
    return link_frames(tree_of(hand), angles)


def test_a_goal_turns_the_hand_about_the_grasp_centre_and_shifts_it(hand):
    wrist, rng = WristMotion(hand), np.random.default_rng(0)
    rest, turned_at_rest = link_frames(tree_of(hand), hand.rest_pose)
    for _ in range(20):
        turn, shift = wrist.draw(rng), rng.uniform(-0.02, 0.02, 3)
        place, turned = _at(hand, wrist.goal(turn, shift))
        centre = hand.grasp_centre
        np.testing.assert_allclose(place, centre + turn.apply(rest - centre) + shift, atol=1e-9)
        np.testing.assert_allclose(turned, turn.as_matrix() @ turned_at_rest, atol=1e-9)


def test_turns_that_are_drawn_can_be_reached_and_are_of_all_sides(hand):
    wrist, rng = WristMotion(hand), np.random.default_rng(0)
    turns = [wrist.draw(rng) for _ in range(300)]
    low, high = hand.joint_limits[hand.wrist].T
    goals = np.array([wrist.goal(turn, np.zeros(3)) for turn in turns])
    assert ((goals > low) & (goals < high)).all()
    tilt = np.arccos([np.clip(turn.apply(wrist.axis) @ wrist.axis, -1, 1) for turn in turns])
    assert tilt.max() <= FARTHEST_TILT + 1e-9
    assert tilt.max() > np.deg2rad(80.0)
    assert np.linalg.norm(np.mean([turn.apply(np.eye(3)[0]) for turn in turns], axis=0)) < 0.6


def test_a_wrist_that_is_fixed_has_no_goals():
    wrist = WristMotion(hands.make("two_finger"))
    assert not wrist.free
    assert wrist.goal(wrist.draw(np.random.default_rng(0)), np.zeros(3)).size == 0


def _explored(env_id: str, policy: str, seconds: float, sigma_deg: float = 1.0, **keywords):
    """Environment, policy, true angles (T, J) rad and contacts (T, P) of an exploration guided by one particle."""
    env = gym.make(env_id, shape="sphere", sigma_deg=sigma_deg, reveal_truth=True, episode_seconds=seconds, **keywords)
    watched = ObserverWrapper(env, HapticSLAM(env.unwrapped.hand, sigma_deg, particles=1))
    explorer, state = agents.make(policy, watched, seed=0), None
    observation, _ = watched.reset(seed=0)
    true, felt = [], []
    for _ in range(env.unwrapped.episode_steps):
        torque, state = agents.act(explorer, observation, state)
        observation, *_, info = watched.step(torque)
        true.append(info["truth"]["joint_angles"])
        felt.append(observation["contacts"])
    return env, explorer, np.array(true), np.array(felt, dtype=bool), state


def _covered(env, true, felt) -> float:
    """Share of the surface's voxels of 4 mm that were touched, or their neighbours were."""
    world = env.unwrapped
    grid = HapticSLAM(world.hand, particles=1).grid
    places = surface_places(world.solid, grid)
    touched = touched_places(world.hand, true, felt, world.solid)
    return float((np.linalg.norm(places[:, None] - touched, axis=2).min(axis=1) <= 1.001 * grid.resolution).mean())


@pytest.mark.parametrize("env_id", IDS)
def test_an_enclosure_turns_the_hand_around_the_object(env_id):
    env, _, true, felt, _ = _explored(env_id, "enclosure", 8.0, wrist="free")
    turned = Rotation.from_euler("XYZ", true[:, 3:6])
    sides = turned.apply(WristMotion(env.unwrapped.hand).axis)
    assert (sides @ sides.T).min() < 0.5, "it came from sides that are 60 degrees apart"
    assert felt.any(axis=1).mean() > 0.15
    env.close()


def test_coverage_touches_far_more_of_the_surface_than_what_a_fixed_wrist_reaches():
    shares = {}
    for env_id, policy in (
        ("HapticSLAM/TwoFingerArm-v0", "coverage"),
        ("HapticSLAM/TwoFingerArm-v0", "random_torque"),
        ("HapticSLAM/TwoFinger-v0", "coverage"),
    ):
        env, _, true, felt, _ = _explored(env_id, policy, 20.0)
        shares[env_id, policy] = _covered(env, true, felt)
        env.close()
    most, *others = shares.values()
    assert most > 0.5
    assert most > 1.5 * max(others)


def test_the_next_side_is_one_of_which_little_is_known():
    env = gym.make("HapticSLAM/TwoFingerArm-v0", shape="cube")
    policy = agents.make("coverage", ObserverWrapper(env, HapticSLAM(env.unwrapped.hand, particles=1)), seed=0)
    directions = policy._directions.data
    # All was touched but what lies towards +y, by a skin that lies in the direction of +x of the hand.
    felt = np.where(directions[:, 1] > 0.7, 0.0, 100.0)
    places = np.tile([0.03, 0.0, 0.0], (coverage.PLACES, 1))
    record = coverage.Record(felt, places, np.array(coverage.PLACES))
    chosen = np.array([policy._side(record, env.unwrapped.hand.rest_pose)[0].apply([1.0, 0.0, 0.0]) for _ in range(10)])
    assert chosen[:, 1].mean() > 0.6
    env.close()


def test_what_was_felt_is_noted_in_its_direction():
    env = gym.make("HapticSLAM/TwoFingerArm-v0", shape="cube")
    hand = env.unwrapped.hand
    policy = agents.make("coverage", ObserverWrapper(env, HapticSLAM(hand, particles=1)), seed=0)
    nothing = coverage.Record(
        np.zeros(coverage.DIRECTIONS), np.zeros((coverage.PLACES, 3)), np.array(coverage.PLACES - 1)
    )
    patches = np.array([hand.patches.names.index("index_distal_tip"), hand.patches.names.index("thumb_distal_tip")])
    side = Rotation.identity(), np.array([0.0, 0.0, 0.01])
    after = policy._noted(nothing, side, hand.rest_pose, patches)
    place, turn = link_frames(tree_of(hand), hand.rest_pose)
    link = hand.patches.link[patches]
    skin = place[link] + np.einsum("kij,kj->ki", turn[link], hand.patches.position[patches])
    assert after.felt.sum() == 2
    for each in skin / np.linalg.norm(skin, axis=1, keepdims=True):
        assert after.felt[np.argmax(policy._directions.data @ each)] == 1
    np.testing.assert_allclose(after.places[[-1, 0]], skin - [0.0, 0.0, 0.01], atol=1e-12)
    assert not nothing.felt.any(), "what was handed out is not changed"
    assert policy._noted(nothing, side, hand.rest_pose, patches[:0]) is nothing
    env.close()
