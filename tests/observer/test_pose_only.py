"""The pose without a map: what `HapticSLAM` says of it, at every step or at every few."""

from __future__ import annotations

import itertools

import numpy as np
import pytest

from observer import HapticSLAM, PoseOnly, ShapePosterior


@pytest.fixture(scope="module")
def exploration(explore):
    """Sixty steps about a cube."""
    return explore("cube", 60)


def test_nothing_but_the_map_is_missing(exploration):
    fast = exploration.beliefs(PoseOnly(exploration.hand))
    full = exploration.beliefs(HapticSLAM(exploration.hand, particles=1, candidates=1))
    assert len(fast) == len(full)
    for one, other in zip(fast, full, strict=True):
        assert one.lag_steps == other.lag_steps
        for name in ("joint_std", "lagged_joint_std", "lagged_covariance"):
            np.testing.assert_array_equal(getattr(one, name), getattr(other, name))
        assert (one.transition is None) == (other.transition is None)
        if one.transition is not None:
            np.testing.assert_array_equal(one.lagged_contacts, other.lagged_contacts)
            for a, b in zip(one.transition, other.transition, strict=True):
                np.testing.assert_array_equal(a, b)
    assert (fast[-1].occupancy == 0.5).all()


@pytest.mark.parametrize("stride", [2, 5])
def test_strides_reach_from_one_step_to_the_next(exploration, stride):
    every, some = (exploration.beliefs(PoseOnly(exploration.hand, stride=n)) for n in (1, stride))
    assert PoseOnly(exploration.hand, stride=3).lag == 9, "the lag is whole strides"
    told = [belief for belief in some if belief.transition is not None]
    assert len(told) == 60 // stride
    for belief in told:
        (now,) = (k for k, each in enumerate(some) if each is belief)
        step = min(now, 60) - belief.lag_steps
        assert step % stride == 0
        np.testing.assert_array_equal(belief.lagged_contacts, exploration.contacts[step - 1])
    for one, other in zip(every[1:61], some[1:61], strict=True):
        if other.transition is not None:
            np.testing.assert_allclose(one.joint_angles, other.joint_angles, atol=1e-9)
            np.testing.assert_allclose(one.lagged_covariance, other.lagged_covariance, atol=1e-9)
    for before, after in itertools.pairwise(told):
        # The chain's marginal: what the transition makes of the pose before, as it is known by now.
        mean, follow, _, rest = after.transition
        spread = np.diag(after.lagged_covariance)
        assert (np.diag(rest) <= spread * (1 + 1e-6)).all()
        assert (np.abs(follow) < 10).all()
        np.testing.assert_array_equal(mean, after.lagged_joint_angles)
        assert before.lag_steps >= after.lag_steps


def test_names_are_inferred_from_either(exploration):
    shapes = []
    for observer, stride in ((PoseOnly(exploration.hand, stride=3), 1), (PoseOnly(exploration.hand), 3)):
        shape = ShapePosterior(exploration.hand, stride=stride)
        shape.reset(seed=0)
        for belief in exploration.beliefs(observer):
            shape.update(belief)
        shapes.append(shape.posterior)
    np.testing.assert_allclose(*shapes, atol=0.1)


def test_it_runs_between_reset_and_flush(two_finger):
    observer = PoseOnly(two_finger)
    felt = np.zeros(8), two_finger.rest_pose, np.zeros(50, bool)
    with pytest.raises(ValueError, match=r"call reset\(\)"):
        observer.step(*felt)
    observer.reset()
    observer.step(*felt)
    assert [belief.lag_steps for belief in observer.flush()] == [0]
    with pytest.raises(ValueError, match=r"call reset\(\)"):
        observer.flush()
    with pytest.raises(ValueError, match="stride must be an integer in"):
        PoseOnly(two_finger, stride=0)
