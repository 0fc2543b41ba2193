"""Objects that lie any way: turns are uniform among those that are allowed."""

from __future__ import annotations

import gymnasium as gym
import numpy as np
import pytest
from scipy import stats
from scipy.spatial.transform import Rotation

from haptic_env import rotation


def test_turns_are_uniform_over_all_rotations():
    turns = rotation.drawn(np.random.default_rng(0), np.pi, 4000)
    away = Rotation.from_euler("xyz", [0.3, 1.0, -2.0])
    for turn in (turns, away * turns):  # the same seen from anywhere else
        assert stats.kstest(turn.magnitude(), lambda angle: (angle - np.sin(angle)) / np.pi).pvalue > 0.001
        for axis in np.eye(3):  # where an axis points is uniform on the sphere: each coordinate is uniform
            assert stats.kstest(turn.apply(axis)[:, 2], stats.uniform(-1, 2).cdf).pvalue > 0.001


@pytest.mark.parametrize("most", [0.1, 1.5])
def test_turns_go_no_further_than_is_said_in_every_direction(most):
    turns = rotation.drawn(np.random.default_rng(1), most, 4000)
    angle = turns.magnitude()
    assert angle.max() <= most
    assert stats.kstest(angle, lambda x: (x - np.sin(x)) / (most - np.sin(most))).pvalue > 0.001
    axis = turns.as_rotvec() / angle[:, None]
    assert np.abs(axis.mean(axis=0)).max() < 0.05


def test_environment_turns_its_object_any_way_and_says_how():
    with gym.make("HapticSLAM/TwoFinger-v0", shape="cube", rotation_jitter=180.0, reveal_truth=True) as env:
        turns = [env.reset(seed=seed)[1]["truth"]["object_quaternion"] for seed in range(60)]
        again = env.reset(seed=3)[1]["truth"]["object_quaternion"]
    np.testing.assert_array_equal(turns[3], again)
    up = Rotation.from_quat(np.roll(turns, -1, axis=1)).apply([0.0, 0.0, 1.0])[:, 2]
    assert up.min() < -0.7
    assert up.max() > 0.7


def test_without_it_nothing_else_is_drawn():
    with gym.make("HapticSLAM/TwoFinger-v0", yaw_jitter=30.0, size_jitter=0.1, reveal_truth=True) as env:
        _, told = env.reset(seed=5)
        quaternion = told["truth"]["object_quaternion"]
    np.testing.assert_array_equal(quaternion[1:3], 0.0)


@pytest.mark.parametrize(
    ("told", "why"),
    [
        ({"rotation_jitter": -1.0}, r"rotation_jitter must .*-1"),
        ({"rotation_jitter": 181.0}, r"rotation_jitter must .*180"),
        ({"rotation_jitter": float("nan")}, "rotation_jitter must"),
        ({"rotation_jitter": 10.0, "yaw_jitter": 20.0}, r"rotation_jitter=10 .* needs yaw_jitter=0, got 20"),
    ],
    ids=str,
)
def test_turns_that_cannot_be_are_refused(told, why):
    with pytest.raises(ValueError, match=why):
        gym.make("HapticSLAM/TwoFinger-v0", **told)
