"""Poses: what is none is refused when it is made."""

from __future__ import annotations

import copy
import pickle

import numpy as np
import pytest

from haptic_env.pose import Pose

EYE = np.eye(3)


@pytest.mark.parametrize(
    ("position", "rotation", "told"),
    [
        ([np.nan, 0, 0], EYE, "position of a pose must be finite .*nan at index 0"),
        ([0, np.inf, 0], EYE, "position of a pose must be finite .*inf at index 1"),
        ([0, 0, 100.1], EYE, r"position of a pose must lie in \[-100, 100\] m, got .*100\.1"),
        ([1e300] * 3, EYE, r"position of a pose must lie in \[-100, 100\] m, got .*1e\+300"),
        ([0, 0], EYE, r"position of a pose must be .* got shape \(2,\)"),
        (["a", 0, 0], EYE, "position of a pose must be .*'a'"),
        ([0, 0, 0], 2 * EYE, "rotation of a pose must be a rotation matrix"),
        ([0, 0, 0], 1e300 * EYE, "rotation of a pose must lie in"),
        ([0, 0, 0], np.diag([1.0, 1.0, -1.0]), "rotation of a pose must be a rotation matrix"),
        ([0, 0, 0], np.full((3, 3), np.nan), "rotation of a pose must be finite"),
        ([0, 0, 0], 1j * EYE, "rotation of a pose must be finite"),
    ],
)
def test_what_is_no_pose_is_refused(position, rotation, told):
    with pytest.raises(ValueError, match=told):
        Pose(position, rotation)


@pytest.mark.parametrize(
    ("quaternion", "told"),
    [
        ([0.0] * 4, "must not be zero"),
        ([1e-300] * 4, "must not be zero"),
        ([1e300] * 4, "must lie in"),
        ([np.nan, 0, 0, 0], "must be finite"),
        ([1.0, 0, 0], r"got shape \(3,\)"),
    ],
)
def test_what_is_no_quaternion_is_refused(quaternion, told):
    with pytest.raises(ValueError, match=f"quaternion of a pose .*{told}"):
        Pose.of([0, 0, 0], quaternion)


@pytest.mark.parametrize("length", [1e-3, 1.0, 1e5])
def test_a_quaternion_may_have_any_length(length):
    np.testing.assert_allclose(Pose.of([0, 0, 0], length * np.array([0.6, 0, 0, 0.8])).rotation[2], [0, 0, 1])


def test_an_infinite_path_ends_where_no_pose_is():
    far = Pose([60.0, 0, 0], EYE)
    with pytest.raises(ValueError, match="position of a pose must lie in"):
        far @ far


def test_a_copy_and_a_pickled_pose_are_the_same():
    pose = Pose.of([0.1, 0.2, 0.3], [0.5, 0.5, -0.5, 0.5])
    for other in (copy.copy(pose), copy.deepcopy(pose), pickle.loads(pickle.dumps(pose)), pose.checked("it")):
        assert isinstance(other, Pose)
        np.testing.assert_array_equal(other.position, pose.position)
        np.testing.assert_array_equal(other.rotation, pose.rotation)
