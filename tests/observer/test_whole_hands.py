"""Hands whose fingers share a wrist: their parts, each with a copy of it, and the observer that feels with them."""

from __future__ import annotations

import gymnasium as gym
import numpy as np
import pytest

import agents
import haptic_env
from haptic_env import hands
from haptic_env.composer import mjcf
from haptic_env.hand import Hand
from haptic_env.patches import Link, Patches
from observer import HapticSLAM, ShapePosterior
from observer.shape.subchains import parts_of

WHOLE = [name for name in hands.HANDS if name != "two_finger"]


def _fork() -> Hand:
    """A base that nothing moves, a stalk that turns on it, and two prongs that turn on the stalk."""
    root = mjcf.RootElement(model="fork")
    base = root.worldbody.add("body", name="base")
    stalk = base.add("body", name="stalk", pos=(0, 0, 0.05))
    bodies = [base, stalk, *(stalk.add("body", name=f"prong{i}", pos=(0.02 * i, 0, 0.05)) for i in range(2))]
    for body in bodies:
        body.add("geom", type="capsule", fromto=(0, 0, 0, 0, 0, 0.03), size=[0.005], density=1000)
        if body is not base:
            hinge = body.add("joint", name=body.name, axis=(0, 1, 0), range=(-90, 90), damping=0.01)
            root.actuator.add("motor", name=body.name, joint=hinge, gear=[0.01])
    links = tuple(Link(body.name, body.name, 0.005, 0.03) for body in bodies)
    zero = np.zeros(3)
    return Hand("fork", root.to_xml_string(), links, Patches(links), zero, zero, np.full(3, 0.2))


def test_parts_of_a_fork():
    hand = _fork()
    np.testing.assert_array_equal(hand.joint_group, [0, 1, 2])
    np.testing.assert_array_equal(hand.link_group, [3, 0, 1, 2])
    np.testing.assert_array_equal(hand.stopped_by, [[0, 0, 0], [1, 0, 0], [1, 1, 0], [1, 0, 1]])
    parts = parts_of(hand)
    np.testing.assert_array_equal(parts.joint, [0, 0, 1, 0, 2])
    np.testing.assert_array_equal(parts.part, [0, 1, 1, 2, 2])
    np.testing.assert_array_equal(parts.column, [[0, 2, 4], [1, 2, 4], [3, 2, 4], [0, 2, 4]])


def test_fingers_that_share_nothing_have_no_copies():
    hand, matrix = hands.make("two_finger"), np.random.default_rng(0).standard_normal((8, 8))
    parts = parts_of(hand)
    np.testing.assert_array_equal(parts.joint, np.arange(8))
    np.testing.assert_array_equal(parts.column, [np.arange(8)] * 2)
    np.testing.assert_array_equal(parts.follow(matrix), matrix)


@pytest.mark.parametrize("name", WHOLE)
def test_samples_of_a_part_follow_as_the_joints_do(name):
    """Where all copies agree they go on as one pose does."""
    hand = hands.make(name)
    parts, rng = parts_of(hand), np.random.default_rng(0)
    pose, matrix = rng.standard_normal(hand.joints), rng.standard_normal((hand.joints, hand.joints))
    np.testing.assert_allclose(parts.follow(matrix) @ pose[parts.joint], (matrix @ pose)[parts.joint])
    for link, part in enumerate(hand.link_group):
        own = parts.column[part][hand.moves[link]]
        assert (parts.part[own] == part).all(), "whatever moves a link is its part's own copy"


@pytest.mark.parametrize("env_id", [each for each, hand in haptic_env.ENVIRONMENTS.items() if hand in WHOLE])
def test_a_whole_hand_knows_its_pose_and_names_what_it_feels(env_id):
    env = gym.make(env_id, shape="sphere", sigma_deg=3.0, reveal_truth=True)
    hand = env.unwrapped.hand
    slam, shape = HapticSLAM(hand, 3.0, particles=3), ShapePosterior(hand)
    observation, _ = env.reset(seed=0)
    policy, state = agents.make("random_torque", env, seed=0), None
    slam.reset(seed=0)
    true, errors = [], []
    for _ in range(125):
        torque, state = policy.predict(observation, state)
        observation, *_, info = env.step(torque)
        true.append(info["truth"]["joint_angles"])
        belief = slam.step(torque, observation["joint_angles"], observation["contacts"])
        shape.update(belief)
        if belief.lagged_contacts is not None:
            errors.append(belief.lagged_joint_angles - true[-1 - belief.lag_steps])
    env.close()
    assert np.sqrt(np.mean(np.square(errors))) < 0.5 * np.deg2rad(3.0)
    assert 0.0 < belief.occupancy.min() < 0.03 < 0.06 < belief.occupancy[belief.occupancy != 0.5].max()
    assert shape.labels[int(shape.posterior.argmax())] == "sphere"
