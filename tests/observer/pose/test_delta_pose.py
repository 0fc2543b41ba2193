"""The paper's motion model and recursion: against plain linear algebra, and whether it knows how wrong it is."""

from __future__ import annotations

import numpy as np
import pytest

from haptic_env import hands
from observer import ContactDynamics, HapticSLAM
from observer.pose.delta_pose import DeltaPose, babble
from tests.observer.hands import pointer

SIGMA = np.deg2rad(3.0)


def _pose(hand, *, lag=1, sigma=SIGMA, motor_noise=0.1) -> DeltaPose:
    return DeltaPose(hand, sigma=sigma, motor_noise=motor_noise, control_hz=50.0, lag=lag, dynamics=ContactDynamics())


@pytest.mark.parametrize("rate", [25.0, 50.0])
def test_babbling_finds_the_speed_of_a_damped_joint(rate):
    """The pointer's speed is torque over damping, 0.01 / 0.006 rad/s, 10 ms late at the start of a hold of 200 ms."""
    motion = babble(pointer(), rate)
    np.testing.assert_allclose(motion.gain, [[(1 - 0.05) * 0.01 / 0.006 / rate]], rtol=0.02)
    assert np.sqrt(motion.noise[0, 0]) < motion.gain[0, 0]


def test_babbling_is_the_same_every_time(two_finger):
    first, second = babble(two_finger, 50.0), babble(two_finger, 50.0)
    np.testing.assert_array_equal(first.gain, second.gain)
    np.testing.assert_array_equal(first.noise, second.noise)
    np.testing.assert_array_equal(first.noise, first.noise.T)
    assert np.linalg.eigvalsh(first.noise).min() > 0


def test_torques_move_their_own_joints_most(two_finger):
    gain = babble(two_finger, 50.0).gain
    assert (np.diag(gain) > 0).all()
    assert (np.abs(gain - np.diag(np.diag(gain))).max(axis=1) < 0.2 * np.diag(gain)).all()


def test_a_path_without_contact_is_one_gaussian(two_finger):
    """All steps at once: q = A w with independent w, conditioned on the felt angles; mean, covariance, evidence."""
    hand, lag, steps = two_finger, 4, 5
    pose, rng, joints = _pose(hand, lag=lag), np.random.default_rng(0), two_finger.joints
    torques = rng.uniform(-0.3, 0.3, (steps, joints))
    felt = hand.rest_pose + 0.02 * rng.standard_normal((steps, joints)) + 0.05
    prior, covariance = [], np.zeros((steps * joints, steps * joints))
    at = hand.rest_pose
    for k in range(steps):
        pose.step(torques[k], felt[k], np.zeros(len(hand.patches), dtype=bool))
        at = at + pose.motion.gain @ torques[k]
        prior.append(at)
        effort = pose.motion.gain * (0.1 * np.abs(torques[k]))
        covariance[k * joints :, k * joints :] += np.kron(
            np.ones((steps - k, steps - k)), pose.motion.noise + effort @ effort.T
        )
    total = covariance + SIGMA**2 * np.eye(steps * joints)
    residual = (felt - prior).ravel()
    mean = np.ravel(prior) + covariance @ np.linalg.solve(total, residual)
    rest = covariance - covariance @ np.linalg.solve(total, covariance)
    for ago in range(lag + 1):
        there = slice((steps - 1 - ago) * joints, (steps - ago) * joints)
        np.testing.assert_allclose(pose.mean[pose.lagged(ago)], mean[there], atol=1e-6)
        for other in range(lag + 1):
            where = slice((steps - 1 - other) * joints, (steps - other) * joints)
            block = pose.covariance[pose.lagged(ago), pose.lagged(other)]
            np.testing.assert_allclose(block, rest[there, where], atol=1e-6 * SIGMA**2 + 1e-9)
    evidence = -0.5 * (residual @ np.linalg.solve(total, residual) + np.linalg.slogdet(2 * np.pi * total)[1])
    assert pose.log_evidence == pytest.approx(evidence, abs=1e-3)


def test_the_proposal_fuses_the_motion_with_the_felt_angles(two_finger):
    """p(q_k | q_{k-1}, u, q̃_k) as the module's docstring has it, whatever was felt before."""
    hand = two_finger
    slam, rng = HapticSLAM.paper(hand, 3.0, 2), np.random.default_rng(1)
    slam.reset(seed=0)
    for _ in range(4):
        torque = rng.uniform(-0.3, 0.3, 8)
        felt = hand.rest_pose + 0.05 + 0.02 * rng.standard_normal(8)
        proposal = slam.step(torque, felt, np.zeros(len(hand.patches))).transition
    motion = slam.pose.motion
    effort = motion.gain * (0.1 * np.abs(torque))
    noise = motion.noise + effort @ effort.T
    gain = noise @ np.linalg.inv(noise + SIGMA**2 * np.eye(8))
    before = hand.rest_pose + rng.standard_normal(8)
    expected = before + motion.gain @ torque
    expected = expected + gain @ (felt - expected)
    np.testing.assert_allclose(proposal.mean + proposal.follow @ (before - proposal.before), expected, atol=1e-6)
    np.testing.assert_allclose(proposal.rest, (np.eye(8) - gain) @ noise, atol=1e-5 * SIGMA**2)


def test_a_finger_in_contact_may_not_have_moved(two_finger):
    hand = two_finger
    contacts = np.zeros(len(hand.patches), dtype=bool)
    contacts[hand.patches.link == 1] = True
    touching = hand.joint_group == hand.link_group[1]
    free, held = _pose(hand, sigma=1e3), _pose(hand, sigma=1e3)
    free.step(np.full(8, 0.5), hand.rest_pose, np.zeros_like(contacts))
    held.step(np.full(8, 0.5), hand.rest_pose, contacts)
    np.testing.assert_allclose(held.mean[:8][touching], hand.rest_pose[touching], atol=1e-6)
    np.testing.assert_allclose(held.mean[:8][~touching], free.mean[:8][~touching], atol=1e-6)
    wider = np.diag(held.covariance)[:8] - np.diag(free.covariance)[:8]
    np.testing.assert_allclose(wider[touching], ((free.mean[:8] - hand.rest_pose) ** 2)[touching], rtol=1e-3)
    np.testing.assert_allclose(wider[~touching], 0, atol=1e-9)


def test_no_torque_moves_a_joint_beyond_its_limit(two_finger):
    pose = _pose(two_finger, sigma=1e3)
    for _ in range(100):
        pose.step(np.ones(8), two_finger.rest_pose, np.zeros(len(two_finger.patches), dtype=bool))
    np.testing.assert_allclose(pose.mean[:8], two_finger.joint_limits[:, 1], atol=1e-3)


@pytest.mark.parametrize("sigma", [3.0, 5.0])
def test_it_knows_how_wrong_it_is_and_beats_the_raw_angles(explore, sigma):
    inside, square = [], []
    for shape in ("cube", "sphere"):
        trial = explore(shape, 300, seed=5, sigma_deg=sigma)
        pose = _pose(trial.hand, sigma=np.deg2rad(sigma))
        for torque, felt, contacts, true in zip(trial.torque, trial.felt, trial.contacts, trial.true, strict=True):
            pose.step(torque, felt.astype(np.float64), contacts.astype(bool))
            error = (pose.mean[:8] - true) / np.deg2rad(sigma)
            square.append(error**2)
            inside.append(np.abs(pose.mean[:8] - true) < 1.645 * np.sqrt(np.diag(pose.covariance)[:8]))
    assert 0.86 < np.mean(inside) < 0.98
    assert np.sqrt(np.mean(square)) < 0.85


def test_the_paper_s_particles_each_have_a_pose_of_their_own(explore):
    trial = explore("cube", 40, seed=3)
    slam = HapticSLAM.paper(trial.hand, 3.0, 16)
    beliefs = trial.beliefs(slam)
    assert slam.lag == 0
    assert all(belief.lag_steps == 0 for belief in beliefs)
    spread = np.std(beliefs[-1].particles, axis=0)
    assert (spread > 0.1 * beliefs[-1].joint_std).all()
    assert len(np.unique(beliefs[-1].particles[:, 0])) > 4


def test_keywords_change_single_parts_of_the_paper_s_configuration(two_finger):
    slam = HapticSLAM.paper(two_finger, lag=3, motion="forward_model")
    assert (slam.lag, slam.matching, slam.contact_model.temper) == (3, "sample", 1.0)
    assert not isinstance(slam.pose, DeltaPose)


@pytest.mark.parametrize("name", hands.HANDS)
def test_any_hand_can_babble(name):
    motion = babble(hands.make(name), 50.0)
    assert np.isfinite(motion.gain).all()
    assert np.isfinite(motion.noise).all()
