"""The contract of every registered environment (gymnasium, Stable-Baselines3 and our own)."""

from __future__ import annotations

import functools
from typing import Any

import gymnasium as gym
import numpy as np
import pytest
from gymnasium.utils.env_checker import check_env as gymnasium_check_env

import haptic_env
from haptic_env import shapes
from haptic_env.objects import ObjectPrior

TRUTH = {
    "joint_angles",
    "joint_velocities",
    "joint_offset",
    "shape",
    "object_position",
    "object_quaternion",
    "object_size",
}


def test_spaces_are_those_of_the_contract(env_id, make):
    env = make(env_id)
    hand = env.unwrapped.hand
    assert env.action_space == gym.spaces.Box(-1.0, 1.0, (hand.joints,), np.float32)
    assert set(env.observation_space.spaces) == {"joint_angles", "contacts"}
    angles = env.observation_space["joint_angles"]
    assert angles.shape == (hand.joints,)
    assert angles.dtype == np.float32
    assert env.observation_space["contacts"] == gym.spaces.MultiBinary(len(hand.patches))


def test_observations_lie_in_their_space_even_with_extreme_noise(env_id, make, play):
    env = make(env_id, sigma_deg=90.0, bias_deg=90.0, drift_deg=90.0, proportional=1.0, contact_false_alarm=0.5)
    for observation, *_ in play(env, seed=0, steps=200):
        assert observation in env.observation_space


def test_episode_is_truncated_at_its_length_and_never_terminated(env_id, make, play):
    record = play(make(env_id, episode_seconds=0.5, control_hz=50.0), seed=0, steps=25)
    assert [truncated for _, _, _, truncated, _ in record] == [False] * 25 + [True]
    assert not any(terminated for _, _, terminated, _, _ in record)
    assert all(reward == 0.0 and isinstance(reward, float) for _, reward, *_ in record)


def test_default_episode_is_ten_seconds_at_fifty_hertz(env_id, make):
    env = make(env_id)
    assert env.unwrapped.episode_steps == 500
    assert env.unwrapped.metadata["render_fps"] == 50


@pytest.mark.parametrize("control_hz", [10.0, 50.0, 500.0])
def test_episode_length_follows_the_control_rate(env_id, make, play, control_hz):
    env = make(env_id, episode_seconds=0.2, control_hz=control_hz)
    record = play(env, seed=0, steps=round(0.2 * control_hz))
    assert record[-1][3]
    assert not record[-2][3]


def test_truth_is_told_only_where_it_is_asked_for(env_id, make, play):
    for _, _, _, _, info in play(make(env_id), seed=0, steps=3):
        assert info == {}


def test_truth_has_the_keys_and_shapes_of_the_contract(env_id, make, play):
    env = make(env_id, reveal_truth=True)
    joints = env.unwrapped.hand.joints
    for _, _, _, _, info in play(env, seed=0, steps=3):
        truth = info["truth"]
        assert set(truth) == TRUTH
        assert truth["joint_angles"].shape == truth["joint_velocities"].shape == (joints,)
        assert truth["shape"] in shapes.SHAPES
        assert truth["object_position"].shape == truth["object_size"].shape == (3,)
        assert np.linalg.norm(truth["object_quaternion"]) == pytest.approx(1.0)


def test_observation_does_not_depend_on_whether_truth_is_told(env_id, make, play, same):
    blind, told = make(env_id), make(env_id, reveal_truth=True)
    assert same([step[:4] for step in play(blind, 0, 50)], [step[:4] for step in play(told, 0, 50)])


def test_corrupting_the_truth_changes_nothing(env_id, make, same):
    env = make(env_id, reveal_truth=True)
    actions = np.random.default_rng(0).uniform(-1, 1, (20, *env.action_space.shape)).astype(np.float32)

    def observe(corrupt: bool) -> list[Any]:
        observation, info = env.reset(seed=0)
        seen = [observation]
        for action in actions:
            if corrupt:
                for name in TRUTH - {"shape"}:
                    info["truth"][name][:] = 1e3
            observation, _, _, _, info = env.step(action)
            seen.append(observation)
        return seen

    assert same(observe(corrupt=False), observe(corrupt=True))


def test_without_noise_the_felt_angles_are_the_true_ones(env_id, make, play):
    for observation, _, _, _, info in play(make(env_id, sigma_deg=0.0, reveal_truth=True), 0, 20):
        np.testing.assert_allclose(observation["joint_angles"], info["truth"]["joint_angles"], atol=1e-6)


def test_every_episode_starts_at_the_rest_pose(env_id, make):
    env = make(env_id, reveal_truth=True)
    for seed in range(3):
        _, info = env.reset(seed=seed)
        np.testing.assert_array_equal(info["truth"]["joint_angles"], env.unwrapped.hand.rest_pose)
        np.testing.assert_array_equal(info["truth"]["joint_velocities"], 0.0)


NOISY = {
    "bias_deg": 1.0,
    "drift_deg": 1.0,
    "proportional": 0.1,
    "contact_miss": 0.1,
    "contact_false_alarm": 0.01,
    "size_jitter": 0.1,
    "position_jitter": 0.002,
    "yaw_jitter": 20.0,
    "reveal_truth": True,
}


@pytest.mark.parametrize("keywords", [{}, NOISY], ids=["default", "all noises"])
def test_two_seeded_runs_are_the_same_bits(env_id, make, play, same, keywords):
    first, second = make(env_id, **keywords), make(env_id, **keywords)
    assert same(play(first, 7, 100), play(second, 7, 100))
    assert same(play(first, 7, 100), play(second, 7, 100)), "a second episode must not remember the first"
    assert not same(play(first, 7, 10), play(second, 8, 10))


def test_unseeded_resets_go_on_from_the_seed(env_id, make, same):
    env = make(env_id)
    first = [env.reset(seed=3), env.reset(), env.reset()]
    second = [env.reset(seed=3), env.reset(), env.reset()]
    assert same(first, second)
    assert not same(first[0], first[1])


def _true_path(env_id: str, **noise: float) -> list[Any]:
    env = gym.make(env_id, **{"sigma_deg": 1.0, **noise}, reveal_truth=True, size_jitter=0.1, yaw_jitter=30.0)
    _, info = env.reset(seed=11)
    path = [info["truth"]]
    for action in np.random.default_rng(0).uniform(-1, 1, (60, *env.action_space.shape)).astype(np.float32):
        path.append(env.step(action)[4]["truth"])
    env.close()
    return [{name: each for name, each in truth.items() if name != "joint_offset"} for truth in path]  # of the senses


_usual_path = functools.cache(_true_path)


@pytest.mark.parametrize(
    "noise",
    [
        {"sigma_deg": 5.0},
        {"sigma_deg": 0.0},
        {"bias_deg": 3.0},
        {"drift_deg": 3.0},
        {"proportional": 0.2},
        {"contact_miss": 0.3, "contact_false_alarm": 0.1},
    ],
    ids=str,
)
def test_exploration_is_the_same_whatever_the_noise_of_the_sensors(env_id, same, noise):
    assert same(_usual_path(env_id), _true_path(env_id, **noise))


def test_observations_share_no_memory(env_id, make, play):
    record = play(make(env_id, reveal_truth=True), seed=0, steps=3)
    arrays = [array for step in record for array in (*step[0].values(), *step[4]["truth"].values())]
    arrays = [array for array in arrays if isinstance(array, np.ndarray)]
    for index, array in enumerate(arrays):
        assert array.base is None or array.base.base is None
        assert not any(np.shares_memory(array, other) for other in arrays[:index])


def test_changing_what_was_returned_or_given_changes_nothing(env_id, make, same):
    clean, dirty = make(env_id), make(env_id)
    actions = np.random.default_rng(0).uniform(-1, 1, (20, *clean.action_space.shape)).astype(np.float32)
    expected = [clean.reset(seed=0)[0]] + [clean.step(action)[0] for action in actions]
    observation, _ = dirty.reset(seed=0)
    seen = []
    for action in actions:
        seen.append({key: value.copy() for key, value in observation.items()})
        observation["joint_angles"][:], observation["contacts"][:] = 9.0, 1
        given = action.copy()
        observation = dirty.step(given)[0]
        given[:] = 1.0
    assert same(expected[:-1], seen)


def test_each_shape_of_a_list_is_drawn(env_id, make):
    env = make(env_id, shape=["cube", "sphere"], reveal_truth=True)
    drawn = {env.reset(seed=seed)[1]["truth"]["shape"] for seed in range(20)}
    assert drawn == {"cube", "sphere"}


def test_all_shapes_are_drawn_by_default(env_id, make):
    env = make(env_id, reveal_truth=True)
    drawn = [env.reset(seed=seed)[1]["truth"]["shape"] for seed in range(60)]
    assert set(drawn) == set(shapes.SHAPES)


def test_jitters_stay_within_their_bounds(env_id, make):
    env = make(env_id, shape="cube", size_jitter=0.1, position_jitter=0.003, yaw_jitter=30.0, reveal_truth=True)
    centre = env.unwrapped.hand.grasp_centre
    truths = [env.reset(seed=seed)[1]["truth"] for seed in range(20)]
    size = np.array([truth["object_size"] for truth in truths]) / shapes.SHAPES["cube"].default_size
    shift = np.array([truth["object_position"] for truth in truths]) - centre
    turn = np.array([truth["object_quaternion"] for truth in truths])
    yaw = np.rad2deg(2 * np.arctan2(turn[:, 3], turn[:, 0]))
    for value, bound in ((size - 1, 0.1), (shift, 0.003), (yaw, 30.0)):
        assert np.abs(value).max() <= bound * (1 + 1e-9)
        assert np.abs(value).max() > 0.8 * bound
    np.testing.assert_array_equal(turn[:, 1:3], 0.0)


def test_options_set_shape_pose_and_size(env_id, make):
    env = make(env_id, shape="cube", size_jitter=0.1, position_jitter=0.002, yaw_jitter=10.0, reveal_truth=True)
    centre = env.unwrapped.hand.grasp_centre
    options = {
        "shape": "cylinder",
        "position": centre + [0.001, 0.002, -0.003],
        "quaternion": [2.0, 0.0, 0.0, 2.0],
        "size": [0.04, 0.04, 0.05],
    }
    truth = env.reset(seed=0, options=options)[1]["truth"]
    assert truth["shape"] == "cylinder"
    np.testing.assert_allclose(truth["object_position"], options["position"])
    np.testing.assert_allclose(truth["object_quaternion"], np.sqrt([0.5, 0.0, 0.0, 0.5]))
    np.testing.assert_allclose(truth["object_size"], options["size"])


def test_fixing_one_option_leaves_the_other_draws_as_they_were(env_id, make):
    env = make(env_id, size_jitter=0.1, position_jitter=0.002, yaw_jitter=10.0, reveal_truth=True)
    free = env.reset(seed=5)[1]["truth"]
    fixed = env.reset(seed=5, options={"size": [0.045] * 3})[1]["truth"]
    assert fixed["shape"] == free["shape"]
    np.testing.assert_array_equal(fixed["object_position"], free["object_position"])
    np.testing.assert_array_equal(fixed["object_quaternion"], free["object_quaternion"])


def test_gymnasium_checks_pass_without_a_warning(env_id, make, display):
    # The checks of every render mode open a window.
    gymnasium_check_env(make(env_id).unwrapped, skip_render_check=not display)


def test_stable_baselines3_checks_pass_without_a_warning(env_id, make):
    checker = pytest.importorskip("stable_baselines3.common.env_checker")
    checker.check_env(make(env_id), warn=True, skip_render_check=True)


def test_id_with_the_module_needs_no_import(env_id, make):
    env = make(f"haptic_env:{env_id}")
    assert env.reset(seed=0)[0] in env.observation_space


def test_import_registers_once(env_id):
    assert gym.spec(env_id).entry_point == "haptic_env.explore:ExploreEnv"
    assert gym.spec(env_id).kwargs == {"hand": haptic_env.ENVIRONMENTS[env_id]}


@pytest.mark.parametrize("mode", ["sync", "async"])
def test_vector_environments_equal_single_ones(env_id, make, mode):
    keywords = {"shape": "cube", "episode_seconds": 0.2}
    single = make(env_id, **keywords)
    vector = gym.make_vec(f"haptic_env:{env_id}", num_envs=2, vectorization_mode=mode, **keywords)
    try:
        actions = np.random.default_rng(0).uniform(-1, 1, (10, 2, *single.action_space.shape)).astype(np.float32)
        many = [vector.reset(seed=[4, 5])[0]]
        truncated = []
        for action in actions:
            observation, reward, terminated, stopped, _ = vector.step(action)
            many.append({key: value.copy() for key, value in observation.items()})
            truncated.append(stopped)
            assert not reward.any()
            assert not terminated.any()
    finally:
        vector.close()
    np.testing.assert_array_equal(truncated, [[False, False]] * 9 + [[True, True]])
    for index, seed in enumerate((4, 5)):
        one = [single.reset(seed=seed)[0]] + [single.step(action)[0] for action in actions[:, index]]
        for alone, together in zip(one, many, strict=True):
            for key in alone:
                np.testing.assert_array_equal(alone[key], together[key][index])


def test_ppo_trains_unchanged(env_id, make):
    sb3 = pytest.importorskip("stable_baselines3")
    env = make(env_id)
    model = sb3.PPO("MultiInputPolicy", env, n_steps=100, batch_size=100, n_epochs=1, seed=0, device="cpu")
    model.learn(200)
    assert model.num_timesteps == 200
    action, _ = model.predict(env.reset(seed=0)[0])
    assert action in env.action_space


def test_an_object_that_varies_is_drawn_until_it_fits(env_id, make, monkeypatch):
    """Where the hand rests the object cannot lie; among many that vary much, some would."""
    env = make(env_id, shape="cube", size_jitter=0.3, yaw_jitter=45.0, position_jitter=0.01).unwrapped
    draw, draws = ObjectPrior.draw, []
    monkeypatch.setattr(ObjectPrior, "draw", lambda *given: draws.append(1) or draw(*given))

    def sizes() -> list[float]:
        found = []
        for seed in range(10):
            observation, _ = env.reset(seed=seed)
            assert not observation["contacts"].any()
            found.append(env.solid.size[0])
        return found

    first = sizes()
    assert len(draws) > 10, "none was drawn anew"
    assert np.ptp(first) > 0.01
    assert sizes() == first
