"""Every variant runs, and is not the full observer under another name."""

from __future__ import annotations

import re

import numpy as np
import pytest

from observer.variants import ABLATION, NAMES, VARIANTS, WITHOUT_MAP, check, make_observer


@pytest.fixture
def trial(explore):
    """Two fingers about a cube, which they touch."""
    return explore("cube", 60, seed=3)


@pytest.mark.parametrize("name", VARIANTS)
def test_each_variant_changes_the_belief(trial, name):
    full, changed = (trial.beliefs(make_observer(each, trial.hand, 3.0, 8))[-1] for each in ("haptic_slam", name))
    assert np.isfinite(changed.joint_angles).all()
    assert (
        np.abs(changed.lagged_joint_angles - full.lagged_joint_angles).max() > 0
        or (changed.occupancy != full.occupancy).any()
    )


def test_a_variant_may_fix_the_number_of_particles(two_finger):
    count = {name: make_observer(name, two_finger, 3.0, 7).n_particles for name in {*NAMES} - {*WITHOUT_MAP}}
    assert count.pop("one_particle") == 1
    several = {*ABLATION, "white", "second_look"} & {*NAMES} - {"one_particle"}
    assert {name for name, number in count.items() if number == 7} == several


def test_the_smoother_without_a_map_has_the_poses_of_both_brackets(trial):
    kalman, smoother, fast = (
        trial.beliefs(make_observer(name, trial.hand, 3.0, 1)) for name in ("kalman", "smoother", "smoother_pose")
    )
    for mine, its in zip(fast, smoother, strict=True):
        np.testing.assert_array_equal(mine.lagged_joint_angles, its.lagged_joint_angles)
        np.testing.assert_array_equal(mine.joint_angles, its.joint_angles)
    for mine, its in zip(fast, kalman, strict=False):  # which has no lag to flush
        np.testing.assert_allclose(mine.joint_angles, its.lagged_joint_angles, atol=1e-9)


def test_variants_and_observers_have_names_of_their_own():
    assert len(set(NAMES)) == len(NAMES)
    assert {part for name in ABLATION for part in name.split("+")} <= set(NAMES)


def test_changes_add_up(two_finger):
    both = make_observer("paper+no_scan_matching+one_particle", two_finger, 3.0, 7)
    assert (both.matching, both.n_candidates, both.n_particles) == ("sample", 1, 1)
    assert make_observer("no_lag+no_scan_matching", two_finger, 3.0, 7).lag == 0


@pytest.mark.parametrize(
    ("name", "told"),
    [
        ("no_lagg", "unknown --observers 'no_lagg'"),
        ("no_lag+paper", "unknown --observers 'paper'"),
        ("floor+no_lag", "unknown --observers 'floor'"),
    ],
)
def test_what_does_not_add_up_is_refused(name, told):
    with pytest.raises(ValueError, match=re.escape(told)):
        check("--observers", name)
