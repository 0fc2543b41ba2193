"""The adapter to ap_gym, where that is installed: its own checks, and agents of either side on the other one."""

from __future__ import annotations

from dataclasses import replace

import gymnasium as gym
import numpy as np
import pytest
from gymnasium.utils.env_checker import check_env

from haptic_lab.tasks import judging, registry
from haptic_lab.tasks.worlds import evaluation_set

ap_gym = pytest.importorskip("ap_gym", reason="needs the extra ap_gym", exc_type=ImportError)
adapter = pytest.importorskip("haptic_lab.tasks.active_perception")

IDS = [f"HapticSLAM/Active{task}-v0" for task in adapter.NAMING]


@pytest.mark.parametrize("env_id", IDS)
def test_what_ap_gym_makes_of_it_is_its_interface(env_id):
    env = ap_gym.make(env_id, seconds=0.4)
    assert isinstance(env, ap_gym.BaseActivePerceptionEnv)
    assert isinstance(env.action_space, ap_gym.ActivePerceptionActionSpace)
    assert isinstance(env.prediction_space, ap_gym.LogitSpace)
    env.reset(seed=900_000)
    over, losses = False, []
    while not over:
        action = {"action": env.inner_action_space.sample(), "prediction": env.prediction_space.sample()}
        _, reward, terminated, truncated, info = env.step(action)
        over = terminated or truncated
        told = info["prediction"]
        assert env.prediction_target_space.contains(told["target"])
        assert told["loss"] == env.loss_fn.numpy(action["prediction"], told["target"])
        assert reward == pytest.approx(info["base_reward"] - told["loss"])
        losses.append(float(told["loss"]))
    assert len(losses) == 4
    assert "avg_accuracy" in info["stats"]["scalar"], "its log has what it logs of classification"


@pytest.mark.filterwarnings("ignore:.*Box action space")  # the logits of ap_gym have no bounds
def test_gymnasium_accepts_it():
    check_env(adapter.ActiveNaming("Name", seconds=0.4), skip_render_check=True)


def test_knowing_nothing_costs_one_and_the_truth_nothing():
    env = adapter.ActiveNaming("Name", seconds=0.4)
    env.reset(seed=900_000, options={"shape": "pyramid"})
    nothing = {"action": np.zeros(8, np.float32), "prediction": np.zeros(4, np.float32)}
    _, reward, _, _, info = env.step(nothing)
    assert reward == pytest.approx(-1.0)
    assert info["prediction"]["target"] == 2
    nothing["prediction"][2] = 50.0
    assert env.step(nothing)[1] == pytest.approx(0.0, abs=1e-6)


def test_our_policies_act_and_predict_there():
    env = ap_gym.make("HapticSLAM/ActiveName-v0", observed=True, observation=["raw"], hold=1, seconds=0.4)
    agent = adapter.predicting("enclosure", env, seed=0)
    for _ in range(2):
        observation, _ = env.reset(seed=900_000)
        first = agent(observation)
        assert np.exp(first["prediction"]).sum() == pytest.approx(1.0, abs=1e-5)
        _, reward, *_ = env.step(first)
        assert reward == pytest.approx(-1.0, abs=1e-4), "at first nothing is known"
    with pytest.raises(ValueError, match="ActiveNaming with observed=True"):
        adapter.predicting("enclosure", gym.make("HapticSLAM/TwoFinger-v0"))


def test_agents_of_ap_gym_are_judged_here(monkeypatch):
    monkeypatch.setitem(registry.TASKS, "Name", replace(registry.TASKS["Name"], seconds=0.4))
    logits = np.array([0.0, 9.0, 0.0, 0.0])  # always a sphere
    acts = adapter.acts_of(lambda observation: {"action": np.zeros(8, np.float32), "prediction": logits})
    row = judging.guessed(evaluation_set("Name"), 0, "two_finger", "spheres", acts)
    assert row["shape"] == "sphere"
    assert row[judging.ACCURACY] == row[judging.RIGHT] == 1.0
    assert row[judging.DECISION] == pytest.approx(0.02)


def test_learners_that_know_of_no_prediction_run_in_it():
    env = adapter.FlatActions(adapter.ActiveNaming("Name", seconds=0.4))
    assert env.action_space.shape == (12,)
    env.reset(seed=900_000)
    _, reward, _, _, info = env.step(np.zeros(12, np.float32))
    assert reward == pytest.approx(-1.0)
    assert info["prediction"]["loss"] == pytest.approx(1.0)
    with pytest.raises(ValueError, match="one of ap_gym"):
        adapter.FlatActions(gym.make("HapticSLAM/TwoFinger-v0"))
