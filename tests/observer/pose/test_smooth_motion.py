"""The smooth motion model: its covariances, its filter against brute force, and how honest it is."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.integrate import quad_vec
from scipy.linalg import expm

from haptic_env import hands
from observer import HapticSLAM
from observer.pose.joint_pairs import JointPairs
from observer.pose.lagged_moments import LaggedMoments
from observer.pose.smooth_motion import ANYWHERE, KinematicPose, SmoothMotion

STEP = 0.02
ONE = SmoothMotion(speeds=(1.5,), seconds=0.05, together=0.0)


@pytest.fixture(scope="module")
def hand():
    """Without limits, of which the process that paths are drawn from knows nothing."""
    made = hands.make("two_finger")
    made.model.jnt_limited[:] = 0
    return made


def velocity_covariance(lag: float, model: SmoothMotion) -> float:
    """Of a Matérn process of smoothness 3/2, in units of its variance."""
    return (1.0 + lag / model.seconds) * np.exp(-lag / model.seconds)


def felt_path(
    hand, steps: int, sigma: float, seed: int = 0, along: np.ndarray | None = None
) -> tuple[np.ndarray, np.ndarray]:
    """Angles drawn from the model `ONE`, about the rest pose, and the same with noise; `along` (J, J): the joints'
    share in each independent path, by column (None: each joint has one of its own)."""
    rng = np.random.default_rng(seed)
    transition, noise = ONE.transition(STEP), np.linalg.cholesky(1.5**2 * ONE.noise(STEP) + 1e-15 * np.eye(3))
    spread = 1.5 * np.array([0.0, 1.0, 1.0 / ONE.seconds])
    state = spread[:, None] * rng.standard_normal((3, hand.joints))
    state[0] = hand.rest_pose
    true = []
    for _ in range(steps):
        state = transition @ state + noise @ rng.standard_normal(state.shape)
        true.append(state[0])
    path = np.array(true)
    if along is not None:
        path = hand.rest_pose + (path - hand.rest_pose) @ along.T
    return path, path + sigma * rng.standard_normal((steps, hand.joints))


def test_one_step_is_the_integral_of_the_equation() -> None:
    drift = np.array([[0, 1, 0], [0, 0, 1], [0, -1 / 0.05**2, -2 / 0.05]])
    kick = np.array([0, 0, 1.0])
    power = 4.0 / 0.05**3
    expected, _ = quad_vec(lambda t: power * np.outer(expm(drift * t) @ kick, expm(drift * t) @ kick), 0, STEP)
    np.testing.assert_allclose(ONE.noise(STEP), expected, rtol=1e-8, atol=1e-14)
    np.testing.assert_allclose(ONE.transition(STEP), expm(STEP * drift))


def test_velocities_have_the_covariance_of_the_process() -> None:
    stationary = np.diag([1.0, 1.0 / ONE.seconds**2])  # of velocity and acceleration
    transition, noise = ONE.transition(STEP)[1:, 1:], ONE.noise(STEP)[1:, 1:]
    np.testing.assert_allclose(transition @ stationary @ transition.T + noise, stationary, atol=1e-9)
    for steps in (1, 3, 10):
        after = (np.linalg.matrix_power(transition, steps) @ stationary)[0, 0]
        assert after == pytest.approx(velocity_covariance(steps * STEP, ONE), abs=1e-9)


def test_levels_change_to_their_neighbours() -> None:
    chain = SmoothMotion(speeds=(1, 2, 4), dwell=0.2).switching(STEP)
    np.testing.assert_allclose(chain.sum(axis=1), 1.0)
    np.testing.assert_allclose(np.diag(chain), np.exp(-STEP / 0.2))
    assert chain[0, 2] == chain[2, 0] == 0.0
    assert SmoothMotion(speeds=(1,)).switching(STEP).tolist() == [[1.0]]


def test_with_one_level_it_is_the_exact_posterior(hand) -> None:
    steps, lag, sigma = 9, 4, 0.05
    _, felt = felt_path(hand, steps, sigma)
    pose = KinematicPose(hand, sigma=sigma, control_hz=1 / STEP, lag=lag, smooth=ONE)
    for each in felt:
        pose.step(np.zeros(hand.joints), each, np.zeros(len(hand.patches), dtype=bool))
    # The joint Gaussian over all steps of one joint, by brute force.
    maps = [np.linalg.matrix_power(ONE.transition(STEP), k) for k in range(steps + 1)]
    start = np.diag([ANYWHERE**2, 1.5**2, 1.5**2 / ONE.seconds**2])
    noise = 1.5**2 * ONE.noise(STEP)
    prior = np.empty((steps, steps))
    for i in range(1, steps + 1):
        for j in range(1, steps + 1):
            common = sum((maps[i - k] @ noise @ maps[j - k].T for k in range(1, min(i, j) + 1)), np.zeros((3, 3)))
            prior[i - 1, j - 1] = (maps[i] @ start @ maps[j].T + common)[0, 0]
    total = prior + sigma**2 * np.eye(steps)
    gain = prior @ np.linalg.inv(total)
    mean = hand.rest_pose + gain @ (felt - hand.rest_pose)
    spread = prior - gain @ prior
    for ago in range(lag + 1):
        where = pose.lagged(ago)
        np.testing.assert_allclose(pose.mean[where], mean[steps - 1 - ago], atol=1e-8)
        of_lag = pose.covariance[where, pose.lagged(0)]
        np.testing.assert_allclose(of_lag, spread[steps - 1 - ago, steps - 1] * np.eye(hand.joints), atol=1e-8)
    residual = felt - hand.rest_pose
    expected = -0.5 * (
        np.sum(residual * np.linalg.solve(total, residual)) + hand.joints * np.linalg.slogdet(2 * np.pi * total)[1]
    )
    assert pose.log_evidence == pytest.approx(expected, abs=1e-6)


def test_angles_felt_at_the_reset_are_one_step_more(hand) -> None:
    sigma = 0.05
    _, felt = felt_path(hand, 12, sigma)
    quick, slow = (KinematicPose(hand, sigma=sigma, control_hz=1 / STEP, lag=4, smooth=ONE) for _ in range(2))
    nothing = np.zeros(hand.joints), np.zeros(len(hand.patches), dtype=bool)
    quick.reset(felt[0])
    for each in felt[1:]:
        quick.step(nothing[0], each, nothing[1])
    for each in felt:
        slow.step(nothing[0], each, nothing[1])
    np.testing.assert_allclose(quick.mean, slow.mean, atol=0.01 * sigma)
    told, blind = (HapticSLAM(hand, 3.0, particles=1, motion="kinematic") for _ in range(2))
    at_reset = told.reset(0, felt[0])
    np.testing.assert_allclose(at_reset.joint_angles, felt[0])
    assert (at_reset.joint_std < blind.reset(0).joint_std).all()
    sure = HapticSLAM(hand, 3.0, particles=1)  # its motion knows where the hand begins
    assert sure.reset(0, felt[0]) == sure.reset(0)
    with pytest.raises(ValueError, match="joint_angles"):
        told.reset(0, np.full(hand.joints, np.nan))


def test_the_level_follows_what_a_joint_does(hand) -> None:
    smooth = SmoothMotion(speeds=(0.1, 3.0), seconds=0.05, dwell=2.0)
    pose = KinematicPose(hand, sigma=0.02, control_hz=50.0, lag=2, smooth=smooth)
    rng, contacts = np.random.default_rng(0), np.zeros(len(hand.patches), dtype=bool)
    for step in range(60):
        angles = hand.rest_pose + 0.02 * rng.standard_normal(hand.joints)
        angles[3] += 0.5 * np.sin(2 * np.pi * 0.02 * step)
        pose.step(np.zeros(hand.joints), angles, contacts)
    deviation = np.sqrt(np.diag(pose.covariance)[: hand.joints])
    assert deviation[3] > 1.3 * np.median(deviation)


def test_the_belief_of_a_smooth_movement_is_honest_and_beats_what_is_felt(hand) -> None:
    sigma_deg = 3.0
    true, felt = felt_path(hand, 200, np.deg2rad(sigma_deg), seed=1)
    slam = HapticSLAM(hand, sigma_deg, particles=1, motion="kinematic")
    slam.reset(seed=0)
    beliefs = [slam.step(np.zeros(hand.joints), each, np.zeros(len(hand.patches))) for each in felt]
    lagged = [
        (b.lagged_joint_angles, b.lagged_joint_std, true[k - b.lag_steps]) for k, b in enumerate(beliefs[20:], 20)
    ]
    mean, std, truth = (np.array(each) for each in zip(*lagged, strict=True))
    error = np.sqrt(np.mean((mean - truth) ** 2))
    assert error < 0.6 * np.deg2rad(sigma_deg)
    inside = np.mean(np.abs(mean - truth) < 1.645 * std)
    assert 0.8 < inside < 0.97


def lagged_errors(hand, true, felt, sigma, smooth: SmoothMotion, lag: int = 10) -> tuple[np.ndarray, np.ndarray]:
    """Errors (T - lag, J) of the lagged angles in units of `sigma`, and of their SD."""
    pose = KinematicPose(hand, sigma=sigma, control_hz=1 / STEP, lag=lag, smooth=smooth)
    errors, spreads = [], []
    for step, each in enumerate(felt):
        pose.step(np.zeros(hand.joints), each, np.zeros(len(hand.patches), dtype=bool))
        if step >= lag:
            where = pose.lagged(lag)
            errors.append(pose.mean[where] - true[step - lag])
            spreads.append(np.sqrt(np.diag(pose.covariance)[where]))
    return np.array(errors) / sigma, np.array(errors) / np.array(spreads)


def test_joints_that_move_together_are_found_and_help(hand) -> None:
    sigma = np.deg2rad(3.0)
    along = np.zeros((hand.joints, hand.joints))
    along[0, 0] = along[1, 0] = 1.0  # the first two together, the last two against each other, the rest at rest
    along[-1, -1], along[-2, -1] = 1.0, -1.0
    true, felt = felt_path(hand, 300, sigma, seed=2, along=along)
    alone, _ = lagged_errors(hand, true, felt, sigma, SmoothMotion(together=0.0))
    together, in_spreads = lagged_errors(hand, true, felt, sigma, SmoothMotion())
    moving = [0, 1, -2, -1]
    assert np.mean(together[:, moving] ** 2) < 0.75 * np.mean(alone[:, moving] ** 2)
    assert np.mean(together**2) < np.mean(alone**2)
    assert 0.85 < np.mean(np.abs(in_spreads) < 1.645) < 0.97
    partners = JointPairs(hand.joints, together=0.8, temper=0.4)
    assert partners.weights()[0] == pytest.approx([0.2, *[0.8 / (hand.joints - 1)] * (hand.joints - 1)])


def test_joints_that_move_each_for_itself_lose_little_by_looking_for_partners(hand) -> None:
    sigma = np.deg2rad(3.0)
    true, felt = felt_path(hand, 300, sigma, seed=3)
    alone, _ = lagged_errors(hand, true, felt, sigma, SmoothMotion(together=0.0))
    together, in_spreads = lagged_errors(hand, true, felt, sigma, SmoothMotion())
    assert np.mean(together**2) < 1.05 * np.mean(alone**2)
    assert 0.85 < np.mean(np.abs(in_spreads) < 1.645) < 0.97


def test_the_weight_of_a_partner_is_bayes_rule_for_two_joints() -> None:
    partners = JointPairs(2, together=0.5, temper=1.0)
    np.testing.assert_allclose(partners.along(np.array([1.0, 3.0])), [1.0, 3.0, 4.0 / np.sqrt(2), -2.0 / np.sqrt(2)])
    partners.learn(np.log([0.2, 0.5, 0.3, 0.8]))
    paired = 0.3 * 0.8 / (0.3 * 0.8 + 0.2 * 0.5)
    np.testing.assert_allclose(partners.weights(), [[1 - paired, paired], [paired, 1 - paired]])
    directions = LaggedMoments.zero((4,), 2, 1)
    directions.mean[:, -1], directions.bands[:, 0, -1] = [1.0, 3.0, 4.0, 0.0], [1.0, 2.0, 3.0, 5.0]
    joints = partners.of_joints(directions)
    of_pair = 4.0 / np.sqrt(2)
    expected = (1 - paired) * 1.0 + paired * of_pair
    assert joints.mean[0, -1] == pytest.approx(expected)
    second_moment = (1 - paired) * (1.0 + 1.0**2) + paired * (4.0 + of_pair**2)
    assert joints.bands[0, 0, -1] == pytest.approx(second_moment - expected**2)
    partners.reset()
    np.testing.assert_allclose(partners.weights(), 0.5)


@pytest.mark.parametrize(("joints", "together"), [(1, 0.8), (4, 0.0)])
def test_without_partners_joints_are_what_they_are(joints: int, together: float) -> None:
    partners = JointPairs(joints, together, temper=0.4)
    assert partners.count == joints
    moments = LaggedMoments.zero((joints,), 2, 1)
    moments.mean[:] = np.arange(5.0 * joints).reshape(joints, 5)
    partners.learn(np.zeros(joints))
    for found, given in zip(partners.of_joints(moments), moments, strict=True):
        np.testing.assert_array_equal(found, given)
    np.testing.assert_array_equal(partners.weights(), np.eye(joints))


def test_exact_angles_are_taken_at_their_word(hand) -> None:
    true, _ = felt_path(hand, 30, 0.0)
    pose = KinematicPose(hand, sigma=0.0, control_hz=50.0, lag=3)
    for each in true:
        pose.step(np.zeros(hand.joints), each, np.zeros(len(hand.patches), dtype=bool))
    np.testing.assert_allclose(pose.mean[: hand.joints], true[-1], atol=1e-6)
    np.testing.assert_allclose(pose.mean[pose.lagged(3)], true[-4], atol=1e-6)


@pytest.mark.parametrize(
    ("keywords", "told"),
    [
        ({"speeds": ()}, "speeds must be rising"),
        ({"speeds": (2.0, 1.0)}, "speeds must be rising"),
        ({"speeds": (0.0, 1.0)}, "speeds must be a finite number"),
        ({"speeds": (0.1, 1e300)}, "speeds must be a finite number in .* got 1e\\+300"),
        ({"speeds": 3.0}, "speeds must be several numbers, rising, got 3.0"),
        ({"seconds": 1e-300}, "seconds must be a finite number in .* got 1e-300"),
        ({"seconds": 0.0}, "seconds must be"),
        ({"dwell": -1.0}, "dwell must be"),
        ({"together": 1.0}, "together must be"),
        ({"temper": 1.5}, "temper must be"),
    ],
)
def test_a_motion_that_makes_no_sense_is_told(keywords: dict, told: str) -> None:
    with pytest.raises(ValueError, match=told):
        SmoothMotion(**keywords)
