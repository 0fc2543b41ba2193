"""Wrong input is refused with an error that quotes the value and lists what is valid."""

from __future__ import annotations

import re

import gymnasium as gym
import numpy as np
import pytest

import haptic_env
from haptic_env import shapes
from haptic_env.explore import ExploreEnv
from observer.kinematics import link_frames, tree_of

KEYWORDS = ("shape", "sigma_deg", "motor_noise", "size_jitter", "episode_seconds", "control_hz", "render_mode")


def _refused(message: str):
    return pytest.raises(ValueError, match=message)


def test_unknown_id_is_gymnasiums_own_error():
    with pytest.raises(gym.error.NameNotFound, match="ThreeFinger"):
        gym.make("HapticSLAM/ThreeFinger-v0")


@pytest.mark.parametrize("shape", ["cubee", ["cube", "cubee"], ("cubee",)])
def test_unknown_shape_lists_the_known(env_id, shape):
    with _refused("unknown shape 'cubee'") as error:
        gym.make(env_id, shape=shape)
    assert all(name in str(error.value) for name in shapes.SHAPES)


@pytest.mark.parametrize("shape", [3, 2.5, True, [None], [["cube"]], np.array(3.0), [np.zeros(3)]], ids=str)
def test_a_shape_that_is_no_name_is_refused(env_id, shape):
    with _refused("unknown shape .*; choose from"):
        gym.make(env_id, shape=shape)


def test_an_empty_list_of_shapes_is_refused(env_id):
    with _refused("shape must name at least one of cube, .* got an empty list"):
        gym.make(env_id, shape=[])


def test_unknown_keyword_lists_all_of_environment_and_hand(env_id):
    with _refused(r"unknown environment keyword 'sigma' \(did you mean") as error:
        gym.make(env_id, sigma=3.0)
    listed = str(error.value).split("choose from ")[1].split(", ")
    assert set(KEYWORDS) <= set(listed)
    assert {"patches_along", "patches_around"} <= set(listed)


def test_unknown_hand_lists_the_known(env_id):
    with _refused("unknown hand 'foot'; choose from .*two_finger"):
        gym.make(env_id, hand="foot")


NUMBERS = {
    "sigma_deg": [-1.0, np.nan, np.inf, "3", None, 91.0],
    "bias_deg": [-1.0, np.nan],
    "drift_deg": [-1.0, np.nan],
    "drift_seconds": [0.0, -1.0, np.nan],
    "proportional": [-0.1, np.nan, 1.1],
    "motor_noise": [-0.1, np.nan, 1.1, "0.1"],
    "contact_miss": [-0.1, 1.1, np.nan],
    "contact_false_alarm": [-0.1, 1.1, np.nan],
    "size_jitter": [-0.1, 0.6, np.nan],
    "position_jitter": [-0.001, 0.1, np.nan],
    "yaw_jitter": [-1.0, 181.0, np.nan],
    "episode_seconds": [0.0, -1.0, np.nan, np.inf],
    "control_hz": [0.0, -50.0, np.nan, 1000.0, "50"],
}


@pytest.mark.parametrize(
    ("env_id", "name", "value"),
    [
        (env_id, name, value)
        for hand, env_id in enumerate(haptic_env.ENVIRONMENTS)
        for name, values in NUMBERS.items()
        for value in (values if hand == 0 else values[:1])  # whatever the hand, they are checked in one place
    ],
)
def test_a_number_out_of_range_is_quoted_with_the_range(env_id, name, value):
    with _refused(rf"{name} must be a finite number in [\[(].*, got {re.escape(repr(value))}"):
        gym.make(env_id, **{name: value})


def test_a_control_rate_that_does_not_divide_the_physics_lists_some_that_do(env_id):
    with _refused(r"control_hz must divide 500 Hz, got 30\.0; e\.g\. 500, .*50"):
        gym.make(env_id, control_hz=30.0)


@pytest.mark.parametrize("value", [1, "yes", None])
def test_reveal_truth_is_a_switch(env_id, value):
    with _refused("reveal_truth must be True or False, got"):
        gym.make(env_id, reveal_truth=value)


def test_unknown_render_mode_lists_the_known(env_id):
    with _refused("unknown render_mode 'ascii'; choose from human, rgb_array"):
        ExploreEnv(render_mode="ascii")


def test_stepping_before_reset_is_gymnasiums_own_error(env_id, make):
    env = make(env_id)
    action = np.zeros(env.action_space.shape, np.float32)
    for each in (env, env.unwrapped):
        with pytest.raises(gym.error.ResetNeeded, match="reset"):
            each.step(action)


def test_rendering_before_reset_is_gymnasiums_own_error(env_id, make):
    env = make(env_id, render_mode="rgb_array")
    for each in (env, env.unwrapped):
        with pytest.raises(gym.error.ResetNeeded, match="reset"):
            each.render()


def test_stepping_after_a_refused_reset_needs_another(env_id, make):
    env = make(env_id).unwrapped
    env.reset(seed=0)
    with _refused("unknown shape"):
        env.reset(options={"shape": "cubee"})
    with pytest.raises(gym.error.ResetNeeded):
        env.step(np.zeros(env.hand.joints, np.float32))
    env.reset(seed=0)
    env.step(np.zeros(env.hand.joints, np.float32))


def test_actions_may_be_read_only_and_lie_anyhow_in_memory(env_id, make):
    env = make(env_id, shape="cube").unwrapped
    joints = env.hand.joints
    frozen, bytes_off = np.full(joints, 0.5), np.frombuffer(b"-" + np.full(joints, 0.5).tobytes(), np.uint8)[1:]
    frozen.flags.writeable = False
    given = frozen, bytes_off.view(np.float64), np.full(2 * joints, 0.5)[::2], [0.5] * joints
    felt = []
    for action in given:
        env.reset(seed=0)
        felt.append(env.step(action)[0]["joint_angles"])
    np.testing.assert_array_equal(felt, [felt[0]] * len(given))


@pytest.mark.parametrize(
    ("build", "message"),
    [
        (lambda joints: np.zeros(joints + 1), r"action must be finite numbers of shape \(\d+,\), got shape \(\d+,\)"),
        (lambda joints: np.zeros((1, joints)), r"action must be .* got shape \(1, \d+\)"),
        (lambda joints: 0.5, r"action must be .* got shape \(\)"),
        (lambda joints: np.full(joints, np.nan), "action must be finite numbers .*nan"),
        (lambda joints: np.full(joints, -np.inf), "action must be finite numbers .*inf"),
        (lambda joints: np.full(joints, 1.01), r"action must lie in \[-1, 1\], got 1\.01 at '\w+'"),
        (lambda joints: np.full(joints, 0.5j), "action must be finite numbers .*0.5j"),
        (lambda joints: np.ma.array(np.zeros(joints), mask=np.arange(joints) == 1), "action must be .*masked_array"),
        (lambda joints: np.full(joints, None), "action must be .*None"),
        (lambda joints: ["0.5"] * joints, "action must be .*'0.5'"),
        (lambda joints: np.full(joints, "2020", dtype="datetime64[Y]"), "action must be .*2020"),
        (lambda joints: [10**400] * joints, "action must be .*1000000"),
        (lambda joints: [[0.0] * n for n in range(joints)], "action must be"),
        (lambda joints: ["a"] * joints, "action must be finite numbers .*'a'"),
        (lambda joints: None, "action must be"),
    ],
)
def test_impossible_actions_are_refused(env_id, make, build, message):
    env = make(env_id).unwrapped
    env.reset(seed=0)
    before = env._data.qpos.copy()
    with _refused(message):
        env.step(build(env.hand.joints))
    np.testing.assert_array_equal(env._data.qpos, before)


@pytest.mark.parametrize(
    ("options", "message"),
    [
        ({"colour": "red"}, "unknown reset option 'colour'; choose from position, quaternion, shape, sigma_deg, size"),
        ({"shape": "cubee"}, "unknown shape 'cubee'"),
        ({"size": [0.05, 0.05]}, r"object size must be finite numbers of shape \(3,\) in m, got shape \(2,\)"),
        ({"size": [0.05, np.nan, 0.05]}, "object size must be finite numbers .*nan"),
        ({"size": [1.0, 1.0, 1.0]}, r"object size must lie in \[0\.005, 0\.3\] m, got \[1\.0"),
        ({"size": [-0.05] * 3}, r"object size must lie in .*got \[-0\.05"),
        ({"position": [0.0, 0.0, 1.0]}, r"object position \(0\.0, 0\.0, 1\.0\) m is out of reach; choose it between"),
        ({"position": [np.nan, 0.0, 0.0]}, "object position must be finite numbers .*nan"),
        ({"position": "here"}, "object position must be finite numbers .*'here'"),
        ({"quaternion": [0.0, 0.0, 0.0, 0.0]}, r"object quaternion \(wxyz\) must not be zero"),
        ({"quaternion": [1.0, 0.0, 0.0]}, r"object quaternion must be finite numbers of shape \(4,\)"),
        ({"quaternion": [1e300] * 4}, r"object quaternion must lie in \[-1e\+06, 1e\+06\], got \[1e\+300"),
        ({"quaternion": [1j, 0, 0, 0]}, "object quaternion must be finite numbers .*1j"),
        ({"position": [1e300, 0.0, 0.0]}, r"object position must lie in \[-100, 100\] m, got \[1e\+300"),
        ({"position": np.ma.array([0.0, 0.0, 0.0], mask=[1, 0, 0])}, "object position must be finite .*masked"),
        ({"sigma_deg": 1e300}, r"sigma_deg must be a finite number in \[0, 90\] degrees, got 1e\+300"),
        ({3: "red"}, "unknown reset option 3; choose from"),
    ],
)
def test_impossible_options_are_refused(env_id, make, options, message):
    with _refused(message):
        make(env_id).reset(seed=0, options={"shape": "cube", **options})


def test_an_object_where_the_hand_rests_is_refused(env_id, make):
    env = make(env_id)
    hand = env.unwrapped.hand
    ends = link_frames(tree_of(hand), hand.rest_pose)[0]
    nearest = ends[np.argmin(np.linalg.norm(ends - hand.grasp_centre, axis=1))]
    with _refused("lies where the hand rests .*it touches .*; place it closer"):
        env.reset(seed=0, options={"shape": "cube", "position": nearest})


@pytest.mark.parametrize("options", ["cube", ["shape", "cube"], 3])
def test_options_that_are_no_dictionary_are_refused(env_id, make, options):
    with _refused("reset options must be a dictionary of position, .*, got"):
        make(env_id).unwrapped.reset(seed=0, options=options)


def test_a_negative_seed_is_gymnasiums_own_error(env_id, make):
    with pytest.raises(gym.error.Error, match="-1"):
        make(env_id).reset(seed=-1)
