"""Models of Stable-Baselines3 and sb3-contrib as policies: whatever was saved, wherever it fits."""

from __future__ import annotations

import builtins
from pathlib import Path

import gymnasium as gym
import numpy as np
import pytest

import agents
from agents.hold_action import HoldAction
from agents.sb3 import SHIPPED
from observer import BeliefObservation, HapticSLAM, ObserverWrapper, ShapePosterior

sb3 = pytest.importorskip("stable_baselines3")
contrib = pytest.importorskip("sb3_contrib")
ENTRIES = ["pose", "names", "time"]
MODELS = {
    "PPO": (sb3.PPO, "MlpPolicy", {"n_steps": 8, "batch_size": 8}),
    "PPO with lasting noise": (sb3.PPO, "MlpPolicy", {"n_steps": 8, "batch_size": 8, "use_sde": True}),
    "A2C": (sb3.A2C, "MlpPolicy", {}),
    "SAC": (sb3.SAC, "MlpPolicy", {"buffer_size": 10}),
    "TD3": (sb3.TD3, "MlpPolicy", {"buffer_size": 10}),
    "TQC": (contrib.TQC, "MlpPolicy", {"buffer_size": 10}),
    "RecurrentPPO": (contrib.RecurrentPPO, "MlpLstmPolicy", {"n_steps": 8, "batch_size": 8}),
    "PPO on what is felt": (sb3.PPO, "MultiInputPolicy", {"n_steps": 8, "batch_size": 8}),
}


def watched(**keywords) -> gym.Env:
    """The two-finger hand about a cube, with an observer."""
    env = gym.make("HapticSLAM/TwoFinger-v0", shape="cube", **keywords)
    hand = env.unwrapped.hand
    return ObserverWrapper(env, HapticSLAM(hand, particles=1), ShapePosterior(hand, samples=4))


@pytest.fixture
def env():
    """The two-finger hand, watched."""
    made = watched()
    yield made
    made.close()


def saved(folder: Path, name: str = "PPO", told: dict | None = None, **keywords) -> tuple[Path, object]:
    """A model as it is before it learns anything, at its path."""
    algorithm, kind, more = MODELS[name]
    env = watched() if kind == "MultiInputPolicy" else BeliefObservation(watched(), ENTRIES)
    model = algorithm(kind, env, seed=0, device="cpu", **more, **keywords)
    if told is not None:
        model.exploration = told
    model.save(folder / "model.zip")
    return folder / "model.zip", model


@pytest.mark.parametrize("name", MODELS)
def test_any_algorithms_model_predicts_as_it_does_itself(name, tmp_path):
    path, model = saved(tmp_path, name)
    env = watched() if MODELS[name][1] == "MultiInputPolicy" else BeliefObservation(watched(), ENTRIES)
    policy, state, own_state = agents.make("sb3", env, path=path), None, None
    observation, _ = env.reset(seed=0)
    for step in range(5):
        action, state = policy.predict(observation, state, deterministic=True)
        expected, own_state = model.predict(observation, own_state, np.array([step == 0]), deterministic=True)
        np.testing.assert_allclose(action, expected, atol=1e-6)
        observation = env.step(action)[0]
    env.close()


def test_a_model_that_was_shown_beliefs_is_shown_them_again(env, tmp_path):
    """What it is shown is what `BeliefObservation` shows, and its actions are held."""
    path, model = saved(tmp_path, told={"entries": ENTRIES, "hold": 3})
    policy, state = agents.make("sb3", env, path=path), None
    twin = HoldAction(BeliefObservation(watched(), ENTRIES), 3)
    observation, _ = env.reset(seed=0)
    seen, _ = twin.reset(seed=0)
    for step in range(9):
        action, state = policy.predict(observation, state, deterministic=True)
        if step % 3 == 0:
            expected, _ = model.predict(seen, deterministic=True)
            seen = twin.step(expected)[0]
        np.testing.assert_allclose(action, expected, atol=1e-6)
        observation = env.step(action)[0]
    twin.close()


def test_where_the_environment_holds_actions_the_policy_does_not(tmp_path):
    path, model = saved(tmp_path, told={"entries": ENTRIES, "hold": 3})
    env = HoldAction(BeliefObservation(watched(), ENTRIES), 3)
    policy, state = agents.make("sb3", env, path=path), None
    observation, _ = env.reset(seed=0)
    for _ in range(3):
        action, state = policy.predict(observation, state, deterministic=True)
        np.testing.assert_allclose(action, model.predict(observation, deterministic=True)[0], atol=1e-6)
        observation = env.step(action)[0]
    env.close()


@pytest.mark.parametrize("name", ["PPO", "PPO with lasting noise", "SAC"])
def test_chance_is_seeded_and_disturbs_no_other(name, tmp_path):
    import torch

    path, _ = saved(tmp_path, name)
    env = BeliefObservation(watched(), ENTRIES)
    observation, _ = env.reset(seed=0)
    before = torch.random.get_rng_state()
    first, second, other = (agents.make("sb3", env, seed=seed, path=path).predict(observation)[0] for seed in (1, 1, 2))
    np.testing.assert_array_equal(first, second)
    assert (first != other).any()
    assert torch.equal(before, torch.random.get_rng_state())
    env.close()


def test_a_model_for_another_hand_or_observation_says_which_spaces_differ(env, tmp_path):
    path, _ = saved(tmp_path, told={"entries": ENTRIES, "hold": 5})
    hand = env.unwrapped.hand
    few = ObserverWrapper(
        env.unwrapped,
        HapticSLAM(hand, particles=1),
        ShapePosterior(hand, dict(list(_candidates(hand).items())[:2]), samples=4),
    )
    with pytest.raises(ValueError, match=r"another hand or observation: observation Box.*\(13,\).*here.*\(11,\)"):
        agents.make("sb3", few, path=path)
    plain, _ = saved(tmp_path)
    with pytest.raises(ValueError, match=r"observation Box.*, and here the observation is Dict"):
        agents.make("sb3", env, path=plain)
    env.action_space = gym.spaces.Box(-1, 1, (24,), np.float32)
    with pytest.raises(ValueError, match=r"action Box.*\(8,\).*, and here the action is Box.*\(24,\)"):
        agents.make("sb3", env, path=path)


def _candidates(hand) -> dict:
    from haptic_env import shapes

    return {name: [shapes.make(name, position=hand.grasp_centre)] for name in shapes.SHAPES}


def test_a_file_that_is_no_model_is_told(env, tmp_path):
    path, _ = saved(tmp_path)
    whole = path.read_bytes()
    path.write_bytes(whole[: len(whole) // 2])
    for wrong in (path, tmp_path / "nothing.zip", Path(__file__)):
        with pytest.raises(ValueError, match="is no whole model of Stable-Baselines3 or sb3-contrib"):
            agents.make("sb3", env, path=wrong)


def test_without_stable_baselines3_it_says_what_to_install(env, monkeypatch):
    real = builtins.__import__

    def missing(name, *rest, **keywords):
        if name.startswith("stable_baselines3"):
            raise ImportError(name)
        return real(name, *rest, **keywords)

    monkeypatch.setattr(builtins, "__import__", missing)
    with pytest.raises(ImportError, match=r"pip install 'haptic-slam\[train\]'"):
        agents.make("trained", env)


def test_not_a_number_stops_with_the_policys_name(env, tmp_path):
    import torch

    _, model = saved(tmp_path, told={"entries": ENTRIES, "hold": 5})
    with torch.no_grad():
        model.policy.action_net.bias[:] = torch.nan
    model.save(tmp_path / "nan.zip")
    observation, _ = env.reset(seed=0)
    policy = agents.make("sb3", env, path=tmp_path / "nan.zip")
    with pytest.raises(ValueError, match="policy 'sb3' has no finite torques"):
        agents.act(policy, observation)


def test_the_shipped_model_is_small_and_the_default(env):
    assert SHIPPED.stat().st_size < 2e6
    observation, _ = env.reset(seed=0)
    first, second = (
        agents.make("trained", env, seed=0).predict(observation)[0],
        agents.make("sb3", env, seed=1, path=SHIPPED).predict(observation, deterministic=True)[0],
    )
    np.testing.assert_array_equal(first, second)
