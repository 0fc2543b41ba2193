"""Models of Stable-Baselines3 and sb3-contrib as policies: whatever was saved, wherever it fits, if it is trusted."""

from __future__ import annotations

import base64
import builtins
import json
import os
import pickle
import zipfile
from pathlib import Path

import gymnasium as gym
import numpy as np
import pytest

import agents
from agents import network
from agents.hold_action import HoldAction
from agents.sb3 import SHIPPED
from haptic_lab.learning import presets
from observer import BeliefObservation, HapticSLAM, ObserverWrapper, ShapePosterior
from observer.wrappers.belief_observation import CLOCKS_HZ

sb3 = pytest.importorskip("stable_baselines3")
contrib = pytest.importorskip("sb3_contrib")
ENTRIES = ["pose", "names", "time"]
MODELS = {
    "PPO": (sb3.PPO, "MlpPolicy", {"n_steps": 8, "batch_size": 8}),
    "PPO with lasting noise": (sb3.PPO, "MlpPolicy", {"n_steps": 8, "batch_size": 8, "use_sde": True}),
    "A2C": (sb3.A2C, "MlpPolicy", {}),
    "SAC": (sb3.SAC, "MlpPolicy", {"buffer_size": 10}),
    "TD3": (sb3.TD3, "MlpPolicy", {"buffer_size": 10}),
    "DDPG": (sb3.DDPG, "MlpPolicy", {"buffer_size": 10}),
    "ARS": (contrib.ARS, "MlpPolicy", {}),
    "ARS, linear": (contrib.ARS, "LinearPolicy", {}),
    "CrossQ": (contrib.CrossQ, "MlpPolicy", {"buffer_size": 10}),
    "SAC with lasting noise": (sb3.SAC, "MlpPolicy", {"buffer_size": 10, "use_sde": True}),
    "TRPO": (contrib.TRPO, "MlpPolicy", {"n_steps": 8, "batch_size": 8}),
    "TQC": (contrib.TQC, "MlpPolicy", {"buffer_size": 10}),
    "RecurrentPPO": (contrib.RecurrentPPO, "MlpLstmPolicy", {"n_steps": 8, "batch_size": 8}),
    "PPO on what is felt": (sb3.PPO, "MultiInputPolicy", {"n_steps": 8, "batch_size": 8}),
    "RecurrentPPO on what is felt": (contrib.RecurrentPPO, "MultiInputLstmPolicy", {"n_steps": 8, "batch_size": 8}),
}
TRAINED = [0.58765674, 1.0, 0.84677136, 0.84628415, -0.58767247, 1.0, 0.83293653, 0.83181846]
ON_FELT = [name for name, (_, kind, _) in MODELS.items() if kind.startswith("MultiInput")]
NOT_PLAIN = ["CrossQ"]  # it normalises batches


class Payload:
    """Whoever unpickles it makes an empty folder at `mark`."""

    def __init__(self, mark: Path) -> None:
        self.mark = str(mark)

    def __reduce__(self):
        return os.mkdir, (self.mark,)


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
    env = watched() if name in ON_FELT else BeliefObservation(watched(), ENTRIES)
    model = algorithm(kind, env, seed=0, device="cpu", **more, **keywords)
    if told is not None:
        model.exploration = told
    model.save(folder / "model.zip")
    return folder / "model.zip", model


@pytest.mark.parametrize("name", MODELS)
def test_any_algorithms_model_predicts_as_it_does_itself(name, tmp_path):
    path, model = saved(tmp_path, name)
    if name in NOT_PLAIN:
        with pytest.raises(ValueError, match="layers must be linear, each before one of ELU"):
            agents.export(model, tmp_path / "model.npz")
    else:
        agents.export(model, tmp_path / "model.npz")
    env = watched() if name in ON_FELT else BeliefObservation(watched(), ENTRIES)
    for suffix in (".zip",) if name in NOT_PLAIN else (".zip", ".npz"):
        keywords = {"trust": True} if suffix == ".zip" else {}
        policy, state, own_state = agents.make("sb3", env, path=path.with_suffix(suffix), **keywords), None, None
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
    policy, state = agents.make("sb3", env, path=path, trust=True), None
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


@pytest.mark.parametrize("name", ["PPO", "RecurrentPPO", "SAC"])
@pytest.mark.parametrize("hold", [1, 3])
def test_an_export_tells_what_its_environment_showed_it(env, name, hold, tmp_path):
    """A model of one's own is then shown the same again, wherever something observes the hand."""
    algorithm, kind, more = MODELS[name]
    shown = BeliefObservation(watched(), ENTRIES)
    model = algorithm(kind, HoldAction(shown, hold) if hold > 1 else shown, seed=0, device="cpu", **more)
    agents.export(model, tmp_path / "own.npz")
    model.save(tmp_path / "model.zip")
    loaded = algorithm.load(tmp_path / "model.zip", device="cpu")
    agents.export(loaded, tmp_path / "told.npz", entries=ENTRIES, hold=hold)
    twin = HoldAction(BeliefObservation(watched(), ENTRIES), hold)
    for path in (tmp_path / "own.npz", tmp_path / "told.npz"):
        told = agents.load_model(path).told
        assert (told["entries"], told.get("hold", 1)) == (ENTRIES, hold)
        policy, state, own_state = agents.make(path, env), None, None
        observation, _ = env.reset(seed=0)
        seen, _ = twin.reset(seed=0)
        for step in range(2 * hold):
            action, state = policy.predict(observation, state, deterministic=True)
            if step % hold == 0:
                expected, own_state = model.predict(seen, own_state, np.array([step == 0]), deterministic=True)
                seen = twin.step(expected)[0]
            np.testing.assert_allclose(action, expected, atol=1e-6)
            observation = env.step(action)[0]
    twin.close()


def test_an_export_tells_no_entries_of_which_it_was_not_shown_the_numbers(env, tmp_path):
    class Doubled(gym.ObservationWrapper):
        def observation(self, observation):
            return 2.0 * observation

    changed = Doubled(BeliefObservation(watched(), ENTRIES))
    changed.observation_space = gym.spaces.Box(-9.0, 9.0, (13,), np.float32)
    algorithm, kind, more = MODELS["PPO"]
    agents.export(algorithm(kind, changed, device="cpu", **more), tmp_path / "model.npz")
    with pytest.raises(ValueError, match=r"does not say which entries of a belief it was shown: agents\.export tells"):
        agents.make(tmp_path / "model.npz", env)


@pytest.mark.parametrize(
    ("name", "told", "error"),
    [
        ("PPO", {"entries": ["pose", "smell"]}, "unknown entry 'smell'; choose from contacts, covered, motion"),
        ("PPO", {"entries": "pose"}, "entries must be one name or more, got 'pose'"),
        ("PPO", {"entries": ["pose"]}, "entries must be pose, names, time, as it was shown, got pose"),
        ("PPO", {"hold": 0}, r"hold must be an integer in \[1, 10000\], got 0"),
        ("PPO on what is felt", {"entries": ENTRIES}, "entries are of a belief, one row of numbers; it was shown Dict"),
    ],
)
def test_entries_that_a_model_was_not_shown_are_refused(name, told, error, tmp_path):
    _, model = saved(tmp_path, name)
    with pytest.raises(ValueError, match=error):
        agents.export(model, tmp_path / "model.npz", **told)
    assert not (tmp_path / "model.npz").exists()


def test_what_an_environment_shows_can_be_asked_of_another_process():
    features = BeliefObservation(watched(), ENTRIES).features
    assert pickle.loads(pickle.dumps(features)).entries == features.entries


def test_where_the_environment_holds_actions_the_policy_does_not(tmp_path):
    path, model = saved(tmp_path, told={"entries": ENTRIES, "hold": 3})
    env = HoldAction(BeliefObservation(watched(), ENTRIES), 3)
    policy, state = agents.make("sb3", env, path=path, trust=True), None
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
    first, second, other = (
        agents.make("sb3", env, seed=seed, path=path, trust=True).predict(observation)[0] for seed in (1, 1, 2)
    )
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
    with pytest.raises(
        ValueError,
        match=r"hand or observation: observation Box\(13,\) .*, and here Box\(11,\) .* \(of pose, names, time\)$",
    ):
        agents.make("sb3", few, path=path, trust=True)
    plain, model = saved(tmp_path)
    model.observation_space = gym.spaces.Box(-9.0, 9.0, (13,), np.float32)  # which knows no entries
    model.save(plain)
    with pytest.raises(ValueError, match=r"observation Box\(13,\) float32, and here Dict\(joint_angles: Box.*entries="):
        agents.make("sb3", env, path=plain, trust=True)
    env.action_space = gym.spaces.Box(-1, 1, (24,), np.float32)
    with pytest.raises(ValueError, match=r"action Box\(8,\) .*, and here Box\(24,\) .*; observation Box.*\)$"):
        agents.make("sb3", env, path=path, trust=True)


def _candidates(hand) -> dict:
    from haptic_env import shapes

    return {name: [shapes.make(name, position=hand.grasp_centre)] for name in shapes.SHAPES}


def test_a_file_that_is_no_model_is_told(env, tmp_path):
    path, _ = saved(tmp_path)
    path.write_bytes(path.read_bytes()[: path.stat().st_size // 2])
    with pytest.raises(ValueError, match="is no whole model of Stable-Baselines3 or sb3-contrib"):
        agents.make("sb3", env, path=path, trust=True)
    for wrong in (tmp_path / "nothing.zip", tmp_path / "nothing.npz"):
        with pytest.raises(ValueError, match=f"must be a file that exists, got '.*{wrong.name}'"):
            agents.make("sb3", env, path=wrong)
    for odd in (Path(__file__), tmp_path, 3, np.array(["a.zip"])):
        with pytest.raises(ValueError, match=r"must end in .npz or .zip, got"):
            agents.make("sb3", env, path=odd)
    with pytest.raises(ValueError, match="trust must be True or False, got 'yes'"):
        agents.make("sb3", env, path=path, trust="yes")


@pytest.mark.parametrize("whole", [True, False])
def test_a_strangers_model_runs_nothing(env, tmp_path, whole):
    """Whether it is a model with one more entry, or no model at all: it is not even opened."""
    cloudpickle = pytest.importorskip("cloudpickle")
    mark, path = tmp_path / "mark", tmp_path / "model.zip"
    poison = {":type:": "x", ":serialized:": base64.b64encode(cloudpickle.dumps(Payload(mark))).decode()}
    content = {"data": json.dumps({"note": poison}).encode()}
    if whole:
        with zipfile.ZipFile(saved(tmp_path, told={"entries": ENTRIES, "hold": 5})[0]) as file:
            content = {name: file.read(name) for name in file.namelist()}
        content["data"] = json.dumps(json.loads(content["data"]) | {"note": poison}).encode()
    with zipfile.ZipFile(path, "w") as file:
        for name, each in content.items():
            file.writestr(name, each)
    for name, keywords in (("sb3", {"path": path}), (str(path), {}), (path, {})):
        with pytest.raises(ValueError, match=r"holds pickles, which can run any code .* give trust=True"):
            agents.make(name, env, **keywords)
        assert not mark.exists()
    if whole:
        agents.make(path, env, trust=True)
        assert mark.exists(), "what this test is about"


def test_statistics_of_vec_normalize_are_handed_over(tmp_path):
    from stable_baselines3.common.vec_env import DummyVecEnv, VecNormalize

    felt = VecNormalize(DummyVecEnv([watched]), norm_obs_keys=["joint_angles"], clip_obs=2.0)
    shown = VecNormalize(DummyVecEnv([lambda: BeliefObservation(watched(), ENTRIES)]))
    for normal, name in ((felt, "PPO on what is felt"), (shown, "PPO")):
        path, model = saved(tmp_path, name)
        normal.reset()
        for _ in range(5):
            seen = normal.step(np.array([normal.action_space.sample()]))[0]
        normal.save(tmp_path / "normal.pkl")
        agents.export(model, tmp_path / "model.npz", normalize=normal)
        env = normal.venv.envs[0]
        plain = normal.get_original_obs()
        expected = model.predict(seen, deterministic=True)[0]
        other = model.predict(plain, deterministic=True)[0]
        assert np.abs(other - expected).max() > 1e-3, "it matters"
        for keywords in (
            {"path": path, "normalize": tmp_path / "normal.pkl", "trust": True},
            {"path": path, "normalize": normal, "trust": True},
            {"path": tmp_path / "model.npz"},
        ):
            action, _ = agents.make("sb3", env, seed=0, **keywords).predict(plain, deterministic=True)
            np.testing.assert_allclose(action, expected, atol=1e-6)
        with pytest.raises(ValueError, match="holds its own statistics"):
            agents.make("sb3", env, path=tmp_path / "model.npz", normalize=normal)
    with pytest.raises(
        ValueError, match=r"normalize has statistics of ''; the model was trained on 'joint_angles', 'contacts'"
    ):
        agents.make("sb3", watched(), path=saved(tmp_path, "PPO on what is felt")[0], normalize=shown, trust=True)
    normal.obs_rms.var[2] = -1.0
    with pytest.raises(ValueError, match=r"variance that normalize has of '' must be positive, got -1\.0"):
        agents.make("sb3", env, path=saved(tmp_path)[0], normalize=normal, trust=True)


def test_wrong_statistics_are_told(tmp_path):
    path, _ = saved(tmp_path)
    env = BeliefObservation(watched(), ENTRIES)
    (tmp_path / "odd.pkl").write_bytes(b"no pickle")
    for given, said in (
        ("nothing.pkl", "must be the path of a file that exists, got 'nothing.pkl'"),
        (tmp_path / "odd.pkl", "no whole file of VecNormalize"),
        (3, "must be a VecNormalize or the path of the file where one was saved, got 3"),
        ([1.0], r"must be a VecNormalize or the path"),
    ):
        with pytest.raises(ValueError, match=said):
            agents.make("sb3", env, path=path, normalize=given, trust=True)
    from agents.normalization import Normalization

    with pytest.raises(ValueError, match="is a pickle, which can run any code"):
        Normalization.of(tmp_path / "odd.pkl", env.observation_space, trust=False)


def test_without_stable_baselines3_it_says_what_to_install(env, monkeypatch, tmp_path):
    path, _ = saved(tmp_path)
    real = builtins.__import__

    def missing(name, *rest, **keywords):
        if name.startswith(("stable_baselines3", "torch")):
            raise ImportError(name)
        return real(name, *rest, **keywords)

    monkeypatch.setattr(builtins, "__import__", missing)
    with pytest.raises(ImportError, match=r"pip install .*\[train\]'"):
        agents.make(path, env, trust=True)
    agents.make("trained", env)  # needs neither


def test_not_a_number_stops_with_the_policys_name(env, tmp_path):
    import torch

    _, model = saved(tmp_path, told={"entries": ENTRIES, "hold": 5})
    with torch.no_grad():
        model.policy.action_net.bias[:] = torch.nan
    model.save(tmp_path / "nan.zip")
    observation, _ = env.reset(seed=0)
    policy = agents.make("sb3", env, path=tmp_path / "nan.zip", trust=True)
    for deterministic in (True, False):
        with pytest.raises(ValueError, match="policy 'sb3' has no finite torques"):
            policy.predict(observation, deterministic=deterministic)
    with pytest.raises(ValueError, match="weights of a model must be finite, got nan"):
        agents.export(model, tmp_path / "nan.npz")
    assert not (tmp_path / "nan.npz").exists()


def test_a_model_that_does_more_than_its_layers_say_is_not_exported(tmp_path):
    from stable_baselines3.common.policies import ActorCriticPolicy

    class Mirrored(ActorCriticPolicy):
        def _predict(self, observation, deterministic=False):
            return -super()._predict(observation, deterministic)

    env = BeliefObservation(watched(), ENTRIES)
    model = sb3.PPO(Mirrored, env, n_steps=8, batch_size=8, device="cpu", seed=0)
    with pytest.raises(ValueError, match="Mirrored does not act as its layers say"):
        agents.export(model, tmp_path / "model.npz")
    for wrong in (None, env, "model.zip"):
        with pytest.raises(ValueError, match="model must be one of Stable-Baselines3 whose actions are a Box, got"):
            agents.export(wrong, tmp_path / "model.npz")
    with pytest.raises(ValueError, match=r"path must end in \.npz, got"):
        agents.export(model, tmp_path / "model.zip")
    assert not list(tmp_path.iterdir())
    env.close()


def test_the_searched_model_is_small_and_that_of_its_preset(env):
    path, preset = SHIPPED.parent / "searched.npz", presets.read("searched")
    assert path.stat().st_size < 10_000
    world = preset.world
    assert network.read(path).told == {"env": world.env, "entries": list(world.observation), "hold": world.hold}
    observation, _ = env.reset(seed=0)
    first, second = (
        agents.make("searched", env, seed=0).predict(observation)[0],
        agents.make("sb3", env, seed=1, path=path).predict(observation)[0],
    )
    np.testing.assert_array_equal(first, second)


def test_the_shipped_model_is_small_and_the_default(env):
    assert SHIPPED.stat().st_size < 10_000
    observation, _ = env.reset(seed=0)
    first, second = (
        agents.make("trained", env, seed=0).predict(observation)[0],
        agents.make("sb3", env, seed=1, path=SHIPPED).predict(observation, deterministic=True)[0],
    )
    np.testing.assert_array_equal(first, second)


def test_the_shipped_model_acts_as_the_one_that_was_trained():
    """What torch computed of it, to the rounding of float32: a name, and the clocks after 0.3 s."""
    turns = 2 * np.pi * np.array(CLOCKS_HZ) * 0.3
    shown = np.concatenate([[0.1, 0.2, 0.3, 0.4], np.stack([np.sin(turns), np.cos(turns)], axis=1).ravel()])
    action, _ = network.read(SHIPPED).predict(shown, (), True, True, np.random.default_rng(0))
    np.testing.assert_allclose(action, TRAINED, rtol=0.0, atol=1e-6)
