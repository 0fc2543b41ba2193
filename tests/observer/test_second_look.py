"""A second look: `HapticSLAM` while a trial lasts, and another map of it at any moment that it is asked for."""

from __future__ import annotations

import warnings

import numpy as np
import pytest

from observer import HapticSLAM, SecondLook, ShapePosterior

STEPS = 60


@pytest.fixture(scope="module")
def trial(explore):
    """Two fingers about a cube, which they touch."""
    return explore("cube", STEPS, seed=3)


def _watched(kind, trial):
    slam = kind(trial.hand, 3.0, 4)
    beliefs = [slam.reset(seed=0)]
    return slam, beliefs + [slam.step(*each) for each in zip(trial.torque, trial.felt, trial.contacts, strict=True)]


def test_the_last_belief_alone_has_another_map(trial):
    (once, first), (twice, second) = (_watched(kind, trial) for kind in (HapticSLAM, SecondLook))
    assert first[1:] == second[1:]
    now = twice.map_now()
    assert (now != once.map_now()).any()
    ends = [each.flush() for each in (once, twice)]
    assert ends[0][:-1] == ends[1][:-1]
    np.testing.assert_array_equal(ends[1][-1].occupancy, now)
    for name in ("joint_angles", "lagged_joint_angles", "log_evidence"):
        np.testing.assert_array_equal(getattr(ends[0][-1], name), getattr(ends[1][-1], name))


def test_without_a_touch_there_is_nothing_to_look_at(trial):
    once, twice = kinds = HapticSLAM(trial.hand, 3.0, 1), SecondLook(trial.hand, 3.0, 1)
    for slam in kinds:
        slam.reset(seed=0)
        for torque, felt, contacts in zip(trial.torque[:20], trial.felt, trial.contacts, strict=False):
            slam.step(torque, felt, np.zeros_like(contacts))
    np.testing.assert_array_equal(once.flush()[-1].occupancy, twice.flush()[-1].occupancy)
    twice.reset(seed=0)
    assert twice.flush() == []


def test_what_is_odd_is_said_once(trial):
    slam = SecondLook(trial.hand, 3.0, 1)
    slam.reset(seed=0)
    with warnings.catch_warnings(record=True) as said:
        warnings.simplefilter("always")
        for step, (torque, felt, contacts) in enumerate(zip(trial.torque, trial.felt, trial.contacts, strict=True)):
            slam.step(torque, felt + (1.7 if step == STEPS // 2 else 0.0), contacts)
        slam.map_now()
        assert len(slam.flush()[-1].snapshot.touches)
    (odd,) = said
    assert "was felt at" in str(odd.message)


def test_what_has_no_map_in_hindsight_has_no_second_one(two_finger):
    for told in ({"in_hindsight": False}, {"matching": "sample"}):
        with pytest.raises(ValueError, match="needs in_hindsight=True"):
            SecondLook(two_finger, 3.0, 1, **told)
    with pytest.raises(ValueError, match="solids are what a second look finds out itself"):
        SecondLook(two_finger, 3.0, 1, solids=ShapePosterior(two_finger))


def test_a_motion_that_no_solid_teaches_has_no_second_look(two_finger):
    for motion in ("kinematic", "delta_pose", "raw_angles"):
        with pytest.raises(ValueError, match=f"motion for a second look {motion!r}; choose from forward_model"):
            SecondLook(two_finger, 3.0, 1, motion=motion)


def test_noise_that_is_told_later_counts_in_both(trial):
    maps = []
    for first in (3.0, 5.0):
        slam = SecondLook(trial.hand, first, 1)
        slam.sigma_deg = 5.0
        slam.reset(seed=0)
        for each in zip(trial.torque, trial.felt, trial.contacts, strict=True):
            slam.step(*each)
        maps.append(slam.map_now())
    np.testing.assert_array_equal(*maps)


def test_it_is_not_kept_in_a_file(two_finger, tmp_path):
    slam = SecondLook(two_finger, 3.0, 1)
    with pytest.raises(ValueError, match="no file keeps"):
        slam.save(tmp_path / "state.npz")
    HapticSLAM(two_finger, 3.0, 1).save(tmp_path / "state.npz")
    with pytest.raises(ValueError, match="no file keeps"):
        SecondLook.load(tmp_path / "state.npz")
