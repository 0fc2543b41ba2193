"""The brackets are what they are called, and the observer lies between them."""

from __future__ import annotations

import numpy as np
import pytest

from haptic_env import shapes
from observer import DeadReckoning, HapticSLAM, Kalman, Smoother, TruePose, White

PARTICLES = 100


@pytest.fixture
def trial(explore):
    """Two fingers about a cube."""
    return explore("cube", 100, seed=1, sigma_deg=3.0)


def test_the_floors_pose_is_what_was_felt(trial):
    slam = DeadReckoning(trial.hand, 3.0)
    slam.reset(seed=0)
    for each in zip(trial.torque, trial.felt, trial.contacts, strict=True):
        belief = slam.step(*each)
        np.testing.assert_array_equal(belief.joint_angles, each[1])
        np.testing.assert_array_equal(belief.lagged_joint_angles, each[1])
        np.testing.assert_allclose(belief.joint_std, np.deg2rad(3.0))


def test_the_ceilings_pose_is_the_true_one(trial):
    slam = TruePose(trial.hand)
    slam.reset(seed=0)
    for each in zip(trial.torque, trial.true, trial.contacts, strict=True):
        belief = slam.step(*each)
        np.testing.assert_array_equal(belief.joint_angles, each[1])
        np.testing.assert_array_equal(belief.joint_std, 0.0)


OTHER_NOISE = {"bias_deg": 3.0, "drift_deg": 2.0, "proportional": 0.1, "start_std_deg": 1.0}
LYING = {"contact_miss": 0.2, "contact_false_alarm": 0.002, "patches_stuck": 0.01}


@pytest.mark.parametrize("build", [White, TruePose])
def test_who_believes_in_no_other_noise_is_told_of_it_in_vain(trial, build):
    plainly, in_vain = (trial.beliefs(build(trial.hand, 3.0, **told)) for told in ({}, OTHER_NOISE))
    for plain, told in zip(plainly, in_vain, strict=True):
        assert plain == told
        assert not told.joint_offset_std.any()


def test_white_is_the_observer_that_is_told_of_sigma_alone(trial):
    white = White(trial.hand, 3.0, 4, **OTHER_NOISE, **LYING)
    full = HapticSLAM(trial.hand, 3.0, 4)
    assert all(mine == its for mine, its in zip(trial.beliefs(white), trial.beliefs(full), strict=True))


@pytest.mark.parametrize("build", [DeadReckoning, TruePose])
def test_raw_angles_need_no_physics(trial, build, monkeypatch):
    def refuse(*_, **__):
        raise AssertionError("a forward model was built, to be thrown away")

    monkeypatch.setattr("observer.pose.kalman.ForwardModel.__init__", refuse)
    build(trial.hand)
    with pytest.raises(AssertionError, match="forward model"):
        Kalman(trial.hand)


@pytest.mark.parametrize("lag", [0, 1, 4])
def test_raw_angles_may_wait_too(trial, lag):
    slam = HapticSLAM(trial.hand, 3.0, particles=1, motion="raw_angles", lag=lag)
    slam.reset(seed=0)
    for k, each in enumerate(zip(trial.torque, trial.felt, trial.contacts, strict=True)):
        slam.step(*each)
        if k >= lag:
            mean = slam.pose.mean[slam.pose.lagged(lag)]
            np.testing.assert_array_equal(mean, trial.felt[k - lag])


def test_what_lies_between_knows_more_the_longer_it_waits(trial):
    errors = [trial.lagged_rmse(trial.beliefs(build(trial.hand, 3.0))) for build in (DeadReckoning, Kalman, Smoother)]
    assert errors[0] > errors[1] > errors[2]
    assert errors[0] == pytest.approx(np.deg2rad(3.0), rel=0.1)


@pytest.mark.parametrize("build", [DeadReckoning, TruePose, Kalman, Smoother])
def test_brackets_hold_one_map_at_their_mean(trial, build):
    slam = build(trial.hand)
    assert slam.n_particles == 1
    for belief in trial.beliefs(slam):
        assert belief.n_eff == 1.0
        if belief.lagged_contacts is not None:
            np.testing.assert_allclose(belief.particles[0], belief.lagged_joint_angles, atol=1e-12)


def _errors(explore, shape: str, sigma: float, seeds: range, steps: int) -> np.ndarray:
    """Mean square lagged error (trials, 3) of the observer, the floor and the Kalman filter."""
    rows = []
    for seed in seeds:
        trial = explore(shape, steps, seed=seed, sigma_deg=sigma)
        observers = (
            HapticSLAM(trial.hand, sigma, PARTICLES),
            DeadReckoning(trial.hand, sigma),
            Kalman(trial.hand, sigma),
        )
        rows.append([trial.lagged_rmse(trial.beliefs(slam)) ** 2 for slam in observers])
    return np.array(rows)


@pytest.mark.parametrize(("shape", "sigma"), [("cube", 3.0), ("pyramid", 3.0), ("cylinder", 5.0), ("sphere", 5.0)])
def test_the_observer_beats_floor_and_kalman(explore, shape, sigma):
    slam, floor, kalman = np.sqrt(_errors(explore, shape, sigma, range(900, 902), 150).mean(axis=0))
    assert slam < 0.9 * kalman
    assert slam < 0.7 * floor


@pytest.mark.statistical
@pytest.mark.parametrize("sigma", [3.0, 5.0])
@pytest.mark.parametrize("shape", shapes.SHAPES)
def test_the_observer_beats_floor_and_kalman_over_twenty_trials(explore, shape, sigma):
    errors = _errors(explore, shape, sigma, range(1000, 1020), 500)
    slam, floor, kalman = np.sqrt(errors.mean(axis=0))
    print(f"{shape}, {sigma}°: {np.round(np.rad2deg([slam, floor, kalman]) / sigma, 3)} σ")
    assert slam < 0.9 * kalman
    assert slam < 0.7 * floor
    assert (errors[:, 0] < errors[:, 2]).mean() >= 0.9, "not on average alone"
