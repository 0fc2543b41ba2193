"""Observers of a hand on a wrist that moves: where it is, and the map of what it explores from all sides."""

from __future__ import annotations

import functools
from typing import Any

import gymnasium as gym
import numpy as np
import pytest

import agents
from haptic_env import hands
from observer import HapticSLAM, ObserverWrapper
from observer.brackets import DeadReckoning, TruePose
from observer.pose.contact_dynamics import ON_A_WRIST, WITH_OFFSETS, ContactDynamics
from observer.surface_metrics import surface_precision, surface_score, touched_places

SIGMA, SECONDS, LAG = 3.0, 8.0, 10
OBSERVERS = {"floor": DeadReckoning, "slam": HapticSLAM, "ceiling": TruePose}


@functools.cache
def explored() -> Any:
    """One exploration by `coverage`: hand, solid, torques, felt angles, contacts and true angles of each step."""
    env = gym.make(
        "HapticSLAM/TwoFingerArm-v0", shape="sphere", sigma_deg=SIGMA, reveal_truth=True, episode_seconds=SECONDS
    )
    watched = ObserverWrapper(env, HapticSLAM(env.unwrapped.hand, SIGMA, particles=1))
    policy, state = agents.make("coverage", watched, seed=1), None
    observation, _ = watched.reset(seed=1)
    rows = []
    for _ in range(env.unwrapped.episode_steps):
        torque, state = agents.act(policy, observation, state)
        observation, *_, info = watched.step(torque)
        rows.append((torque, observation["joint_angles"], observation["contacts"], info["truth"]["joint_angles"]))
    told = tuple(np.array(each) for each in zip(*rows, strict=True))
    world = env.unwrapped
    env.close()
    return world.hand, world.solid, *told


@functools.cache
def observed(name: str) -> tuple[Any, np.ndarray]:
    """The last belief of an observer, and its lagged angles (T, J) rad."""
    hand, _, torques, felt, contacts, true = explored()
    observer = OBSERVERS[name](hand, SIGMA, **({"particles": 1} if name == "slam" else {}))
    observer.reset(seed=0)
    lagged = {}
    angles = true if name == "ceiling" else felt
    for step, turn in enumerate(zip(torques, angles, contacts, strict=True)):
        belief = observer.step(*turn)
        lagged[step - belief.lag_steps] = belief.lagged_joint_angles
    for belief in observer.flush():
        lagged[step - belief.lag_steps] = belief.lagged_joint_angles
    return belief, np.array([lagged[step] for step in range(len(true))])


@pytest.mark.parametrize("part", ["wrist", "fingers"])
def test_the_pose_is_known_far_better_than_it_is_felt(part):
    hand, _, _, felt, _, true = explored()
    which = hand.wrist if part == "wrist" else np.setdiff1d(np.arange(hand.joints), hand.wrist)
    error, raw = (np.sqrt(np.mean((each - true)[:, which] ** 2)) for each in (observed("slam")[1], felt))
    assert np.rad2deg(raw) == pytest.approx(SIGMA, rel=0.1)
    assert error < 0.65 * raw


def test_forces_are_those_of_a_wrist_where_nothing_else_is_told():
    hand = explored()[0]
    assert HapticSLAM(hand, SIGMA).pose.dynamics == ON_A_WRIST
    assert HapticSLAM(hand, SIGMA, bias_deg=1.0).pose.dynamics == WITH_OFFSETS
    assert HapticSLAM(hand, SIGMA, dynamics=ContactDynamics()).pose.dynamics == ContactDynamics()
    assert HapticSLAM(hands.make("two_finger"), SIGMA).pose.dynamics == ContactDynamics()


def test_every_joint_of_the_wrist_is_felt_with_the_same_sigma():
    hand, _, _, felt, _, true = explored()
    sd = np.rad2deg(np.std(felt - true, axis=0))[hand.wrist]
    np.testing.assert_allclose(sd, SIGMA, rtol=0.15)


def test_the_map_lies_between_its_brackets():
    hand, solid, _, _, contacts, true = explored()
    touched = touched_places(hand, true, contacts.astype(bool), solid)
    scores = {}
    for name in OBSERVERS:
        belief = observed(name)[0]
        scores[name] = surface_score(belief.occupancy, belief.grid, solid, touched).f_score
    ceiling = observed("ceiling")[0]
    assert surface_precision(ceiling.occupancy, ceiling.grid, solid) > 0.8
    assert scores["floor"] + 0.1 < scores["slam"] < scores["ceiling"]


def test_a_fixed_hands_torques_are_refused():
    hand = explored()[0]
    observer = HapticSLAM(hand, SIGMA, particles=1)
    observer.reset(seed=0)
    with pytest.raises(ValueError, match=r"of shape \(14,\)"):
        observer.step(np.zeros(8), np.zeros(8), np.zeros(len(hand.patches)))
