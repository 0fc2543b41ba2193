"""Beliefs whose arrays were replaced by others: `ShapePosterior` reads them right, or refuses them."""

from __future__ import annotations

import dataclasses

import numpy as np
import pytest

from observer import HapticSLAM, ShapePosterior


@pytest.mark.parametrize(
    ("what", "value"), [("mean", 1e6), ("before", -1e300), ("rest", 1e9), ("lagged_covariance", -1e9)]
)
def test_beliefs_beyond_all_angles_are_refused(two_finger, what, value):
    slam = HapticSLAM(two_finger, particles=1, lag=0)
    slam.reset(seed=0)
    belief = slam.step(np.zeros(two_finger.joints), two_finger.rest_pose, np.zeros(len(two_finger.patches)))
    if what == "lagged_covariance":
        changed = dataclasses.replace(belief, lagged_covariance=np.full_like(belief.lagged_covariance, value))
    else:
        array = np.full_like(getattr(belief.transition, what), value)
        changed = dataclasses.replace(belief, transition=belief.transition._replace(**{what: array}))
    with pytest.raises(ValueError, match=rf"{what} of belief.* must lie in \[-1.*, got"):
        ShapePosterior(two_finger).update(changed)


def test_beliefs_are_read_however_their_arrays_lie_in_memory(two_finger):
    slam = HapticSLAM(two_finger, particles=1, lag=0)
    one, other = (ShapePosterior(two_finger, stride=1, samples=3) for _ in range(2))
    slam.reset(seed=0)
    contacts = np.zeros(len(two_finger.patches))
    contacts[::7] = 1
    belief = slam.step(np.zeros(two_finger.joints), two_finger.rest_pose, contacts)
    changed = dataclasses.replace(
        belief,
        lagged_contacts=contacts,
        lagged_covariance=belief.lagged_covariance.astype(">f8"),
        transition=belief.transition._replace(mean=list(belief.transition.mean), rest=belief.transition.rest.tolist()),
    )
    for each in (one, other):
        each.reset(seed=0)
    assert np.array_equal(one.update(changed), other.update(belief))


@pytest.mark.parametrize("stride", [1, 2])
@pytest.mark.filterwarnings("ignore:.*encountered in.*:RuntimeWarning")
def test_a_belief_that_throws_samples_beyond_all_numbers_leaves_none_there(two_finger, stride):
    slam = HapticSLAM(two_finger, particles=1, lag=0)
    posterior = ShapePosterior(two_finger, stride=stride, samples=16)
    slam.reset(seed=0)
    belief = slam.step(np.zeros(two_finger.joints), two_finger.rest_pose, np.ones(len(two_finger.patches)))
    follow = np.full((two_finger.joints,) * 2, 1e308)
    for moved in (belief.transition, *4 * [belief.transition._replace(follow=follow)]):
        posterior.update(dataclasses.replace(belief, transition=moved))
    assert np.isfinite(posterior._poses).all()
    assert np.isfinite(posterior.posterior).all()
