"""The registered tasks: what `gym.make` makes of them, and who can use it."""

from __future__ import annotations

import re
import subprocess
import sys
from pathlib import Path

import gymnasium as gym
import numpy as np
import pytest
from gymnasium.utils.env_checker import check_env

import agents
import haptic_env
from haptic_env.registration import TASKS
from haptic_env.shapes import default_size
from haptic_lab.tasks import registry
from observer.wrappers.belief_observation import features_of

DOCUMENT = Path(__file__).parents[3] / "docs" / "tasks.md"
IDS = tuple(TASKS)
SHORT = {"seconds": 0.5}  # of an episode


def played(env: gym.Env, seed: int, decisions: int) -> list[np.ndarray]:
    """What is seen in a world, with torques that are always the same."""
    seen = [env.reset(seed=seed)[0]]
    for decision in range(decisions):
        action = np.sin(0.7 * decision + np.arange(*env.action_space.shape)).astype(np.float32)
        observation, reward, terminated, truncated, _ = env.step(action)
        seen.append(np.append(observation, reward))
        if terminated or truncated:
            break
    return seen


@pytest.mark.parametrize("mode", list(gym.vector.AutoresetMode))
def test_a_vector_resets_as_it_is_told(mode):
    for told in (mode, mode.value):
        both = gym.make_vec("HapticSLAM/Name-v0", 2, autoreset_mode=told, **SHORT)
        assert both.metadata["autoreset_mode"] is mode
        both.close()


@pytest.mark.parametrize("mode", ["same_step", "", None, 3])
def test_a_mode_of_resets_is_one_of_three(mode):
    with pytest.raises(ValueError, match=r"autoreset_mode .*NextStep"):
        gym.make_vec("HapticSLAM/Name-v0", 2, autoreset_mode=mode)


@pytest.mark.parametrize("told", ["four", ["four"], ["cube", "sphere", "pyramid", "cylinder"]])
def test_shapes_are_named_one_by_one_or_by_their_set(told):
    env = gym.make("HapticSLAM/Name-v0", **{**SHORT, "shapes": told}).unwrapped
    assert env.world.shapes == ("cube", "sphere", "pyramid", "cylinder")
    env.close()


def test_an_unknown_set_or_entry_is_told_with_what_is_valid():
    with pytest.raises(ValueError, match=r"unknown shape of shapes 'fourty'.*choose from cube"):
        gym.make("HapticSLAM/Name-v0", shapes="fourty")
    with pytest.raises(ValueError, match=r"unknown entry of observation 'posse'.*; choose from .*raw"):
        gym.make("HapticSLAM/Name-v0", observation=["posse"])


def test_every_registered_task_has_a_world():
    assert set(TASKS.values()) == set(registry.TASKS)
    assert all(gym.spec(each).kwargs == {"task": task} for each, task in TASKS.items())


@pytest.mark.parametrize("env_id", IDS)
def test_gymnasium_accepts_a_task(env_id):
    env = gym.make(env_id, **SHORT)
    check_env(env.unwrapped, skip_render_check=True)  # it would open a window
    env.close()


@pytest.mark.parametrize("env_id", IDS)
def test_stable_baselines3_accepts_a_task(env_id):
    checker = pytest.importorskip("stable_baselines3.common.env_checker", reason="needs Stable-Baselines3")
    env = gym.make(env_id, **SHORT)
    checker.check_env(env.unwrapped)
    env.close()


@pytest.mark.parametrize("env_id", IDS)
def test_a_seed_is_a_world_and_a_belief(env_id):
    first, second = (played(gym.make(env_id, **SHORT), 900_003, 4) for _ in range(2))
    assert all((a == b).all() for a, b in zip(first, second, strict=True))
    other = played(gym.make(env_id, **SHORT), 900_004, 4)
    assert not all((a == b).all() for a, b in zip(first[1:], other[1:], strict=True))


@pytest.mark.parametrize("name", ["cube", "torus", "superquadric(0.3, 1)", "noise(2, 0.2)"])
def test_an_object_that_is_told_has_a_size_of_its_own(name):
    env = gym.make("HapticSLAM/Map-v0", **SHORT)
    scales = []
    for seed in range(900_000, 900_006):
        env.reset(seed=seed, options={"shape": name, "quaternion": None})
        solid = env.get_wrapper_attr("solid")
        scale = np.asarray(solid.size) / default_size(name)
        assert np.ptp(scale) < 1e-9
        scales.append(scale[0])
    assert min(scales) >= 0.8
    assert max(scales) <= 1.2
    assert len(set(scales)) > 1


@pytest.mark.parametrize("mode", [None, "sync", "vector_entry_point"])
def test_environments_side_by_side_are_those_alone(mode):
    both = gym.make_vec("HapticSLAM/Name-v0", 2, vectorization_mode=mode, **SHORT)
    alone = [gym.make("HapticSLAM/Name-v0", **SHORT) for _ in range(2)]
    seen, _ = both.reset(seed=[900_001, 900_002])
    assert all((a == env.reset(seed=900_001 + i)[0]).all() for i, (a, env) in enumerate(zip(seen, alone, strict=True)))
    action = np.full((2, 8), 0.5, np.float32)
    seen, reward, *_ = both.step(action)
    for index, env in enumerate(alone):
        observation, mine, *_ = env.step(action[index])
        assert (observation == seen[index]).all()
        assert mine == reward[index]
    both.close()


def test_hands_are_named_and_others_refused():
    assert gym.make("HapticSLAM/Map-v0", hand="two_finger_arm").get_wrapper_attr("hand").name == "two_finger_arm"
    with pytest.raises(ValueError, match=r"choose from.*two_finger") as told:
        gym.make("HapticSLAM/Name-v0", hand="claw")
    assert "claw" in str(told.value)
    own = DOCUMENT.parents[1] / "examples" / "gripper" / "gripper.toml"
    assert gym.make("HapticSLAM/Map-v0", hand=own).get_wrapper_attr("hand").name == "gripper"
    with pytest.raises(ValueError, match=r"reset options must be a dictionary of position, .*got 3"):
        gym.make("HapticSLAM/Map-v0").reset(options=3)
    with pytest.raises(ValueError, match="sigma_degs") as told:
        gym.make("HapticSLAM/Name-v0", sigma_degs=3.0)
    assert "sigma_deg" in str(told.value)


def test_no_info_tells_the_truth():
    env = gym.make("HapticSLAM/Name-v0", **SHORT)
    _, info = env.reset(seed=900_000)
    assert set(info) == {"posterior"}
    over = False
    while not over:
        *_, terminated, truncated, info = env.step(env.action_space.sample())
        over = terminated or truncated
    assert set(info) <= {"posterior", "decision", "is_success"}


def test_what_is_told_at_the_reset_wins_and_the_observer_hears_of_its_noise():
    env = gym.make("HapticSLAM/Name-v0", **SHORT)
    env.reset(seed=900_000, options={"shape": "pyramid", "sigma_deg": 1.25})
    assert env.unwrapped._explored.unwrapped.solid.name == "pyramid"
    assert env.get_wrapper_attr("observer").sigma_deg == 1.25


def test_a_picture_shows_scene_and_belief():
    env = gym.make("HapticSLAM/Name-v0", render_mode="rgb_array", **SHORT)
    env.reset(seed=900_000)
    first = env.render()
    for _ in range(3):
        env.step(np.full(8, 0.6, np.float32))
    second = env.render()
    env.close()
    assert first.shape == second.shape == (480, 1120, 3)
    assert first.dtype == np.uint8
    for part in (slice(0, 640), slice(640, 1120)):
        assert (first[:, part] != second[:, part]).any()


def test_importing_environments_imports_no_task_and_tasks_import_no_learner():
    told = (
        "import sys, haptic_env; print('haptic_lab' in sys.modules)\n"
        "import haptic_lab.tasks.environment; print('stable_baselines3' in sys.modules, 'torch' in sys.modules)"
    )
    ran = subprocess.run([sys.executable, "-c", told], capture_output=True, encoding="utf-8", check=True)
    assert ran.stdout.split() == ["False"] * 3


@pytest.mark.parametrize(("env_id", "task"), TASKS.items())
def test_the_document_tells_each_observation(env_id, task):
    section = DOCUMENT.read_text(encoding="utf-8").split(f"## `{env_id}`")[1].split("\n## ")[0]
    rows = re.findall(r"^\| `(\w+)` \| (\d+)[–-](\d+) \| (.+) \|$", section, re.MULTILINE)
    env = gym.make(env_id)
    features = env.get_wrapper_attr("features")
    assert tuple(name for name, *_ in rows) == features.entries == registry.TASKS[task].observation
    start = 0
    for name, first, last, meaning in rows:
        alone = features_of(env, [name]).space.shape[0]
        assert (int(first), int(last)) == (start, start + alone - 1)
        assert meaning
        start += alone
    assert env.observation_space.shape == (start,)


def test_a_task_is_used_by_policies_made_by_hand():
    env = gym.make("HapticSLAM/Name-v0", observation=["raw"], hold=1, **SHORT)
    policy = agents.make("enclosure", env, seed=0)
    observation, _ = env.reset(seed=900_000)
    action, _ = agents.act(policy, observation)
    env.step(action)
    assert haptic_env.hand_of(env).name == "two_finger"
