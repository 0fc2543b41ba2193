"""What learns in a registered task by the documents' own recipe is a policy, however it was saved."""

from __future__ import annotations

from pathlib import Path

import gymnasium as gym
import numpy as np
import pytest
import yaml

import agents
from haptic_env.registration import TASKS
from haptic_lab.trial import check_model, guided
from observer import ShapePosterior

sb3 = pytest.importorskip("stable_baselines3", reason="needs Stable-Baselines3")
contrib = pytest.importorskip("sb3_contrib", reason="needs sb3-contrib")
ZOO = Path(__file__).parents[3] / "examples" / "rl_zoo"
ALGORITHMS = {
    "crossq": contrib.CrossQ,
    "ppo": sb3.PPO,
    "ppo_lstm": contrib.RecurrentPPO,
    "sac": sb3.SAC,
    "tqc": contrib.TQC,
}
OF_THE_ZOO = ("n_envs", "n_timesteps", "normalize")  # what it does not hand to the algorithm


@pytest.fixture(scope="module")
def saved(tmp_path_factory: pytest.TempPathFactory) -> dict[str, Path]:
    """What a few steps of the recipe leave: exported, exported without its environment, and saved."""
    folder = tmp_path_factory.mktemp("models")
    model = sb3.PPO("MlpPolicy", gym.make("HapticSLAM/Name-v0", seconds=0.5), n_steps=8, batch_size=8, seed=0)
    model.learn(8)
    found = {"exported": folder / "exported.npz", "loaded": folder / "loaded.npz", "saved": folder / "saved.zip"}
    agents.export(model, found["exported"])
    model.save(found["saved"])
    agents.export(sb3.PPO.load(found["saved"]), found["loaded"])
    return found


@pytest.mark.parametrize("how", ["exported", "loaded", "saved"])
def test_a_model_of_the_recipe_is_a_policy_wherever_the_hand_is_observed(saved, how):
    env = gym.make("HapticSLAM/TwoFinger-v0", sigma_deg=3.0)
    namer = ShapePosterior(env.unwrapped.hand, variants=8)
    watched = guided(env, str(saved[how]), 3.0, namer)
    policy = agents.make(saved[how], watched, trust=how == "saved")
    assert policy._hold == 5
    observation, _ = watched.reset(seed=900_000)
    action, state = agents.act(policy, observation)
    observation, *_ = watched.step(action)
    again, _ = agents.act(policy, observation, state)
    assert (again == action).all(), "an action is held"


def test_the_three_files_act_alike(saved):
    env = gym.make("HapticSLAM/Name-v0", seconds=0.5)
    policies = [agents.make(path, env, trust=True) for path in saved.values()]
    observation, _ = env.reset(seed=900_000)
    first, *others = [policy.predict(observation, deterministic=True)[0] for policy in policies]
    for other in others:
        np.testing.assert_allclose(other, first, atol=1e-5)


def test_a_model_that_does_not_fit_is_refused_in_a_line(saved):
    env = gym.make("HapticSLAM/TwoFinger-v0")
    namer = ShapePosterior(env.unwrapped.hand, ["cube", "sphere", "torus(0.4)"], variants=8)
    with pytest.raises(
        ValueError, match=r"another hand or observation: observation Box\(85,\).*here Box\(84,\)"
    ) as told:
        check_model(env, str(saved["exported"]), namer, trust=False)
    assert "\n" not in str(told.value)


@pytest.mark.parametrize("path", sorted(ZOO.glob("*.yml")), ids=lambda path: path.stem)
def test_hyper_parameters_make_their_algorithm(path):
    told = yaml.safe_load(path.read_text(encoding="utf-8"))
    assert set(told) == set(TASKS)
    for env_id, found in told.items():
        keywords = {name: value for name, value in found.items() if name not in OF_THE_ZOO}
        model = ALGORITHMS[path.stem](env=gym.make(env_id), **keywords)
        assert model.policy is not None
        assert found["n_envs"] * found.get("n_steps", 1) % found["batch_size"] == 0 or "n_steps" not in found


def test_every_algorithm_has_its_file():
    assert {path.stem for path in ZOO.glob("*.yml")} == set(ALGORITHMS)
