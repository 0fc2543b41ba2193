"""A saved model becomes numbers and a JSON; it is opened where it is trusted, and nowhere else."""

from __future__ import annotations

import base64
import hashlib
import json
import pickle
import zipfile
from pathlib import Path

import gymnasium as gym
import numpy as np
import pytest

import agents
from agents.exporting import export_saved
from haptic_lab.commands import export

sb3 = pytest.importorskip("stable_baselines3", reason="needs Stable-Baselines3")


@pytest.fixture(scope="module")
def saved(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """An untrained model of a task, as its algorithm saves it."""
    path = tmp_path_factory.mktemp("model") / "model.zip"
    sb3.PPO("MlpPolicy", gym.make("HapticSLAM/Name-v0"), n_steps=8, batch_size=8, seed=0).save(path)
    return path


def test_what_is_written_acts_as_the_model_and_says_what_it_is_for(saved, tmp_path):
    out = tmp_path / "mine.npz"
    assert export.main([str(saved), "--trust", "--out", str(out)]) == 0
    said = json.loads((tmp_path / "mine.json").read_text(encoding="utf-8"))
    env = gym.make("HapticSLAM/Name-v0")
    assert said["told"] == {"entries": list(env.get_wrapper_attr("features").entries), "hold": 5}
    assert said["sha256"] == hashlib.sha256(out.read_bytes()).hexdigest()
    assert said["observation"]["shape"] == [85]
    with zipfile.ZipFile(out) as file:
        assert all(name.endswith(".npy") for name in file.namelist())
    observation, _ = env.reset(seed=900_000)
    expected, _ = sb3.PPO.load(saved).predict(observation, deterministic=True)
    found, _ = agents.make(out, env).predict(observation, deterministic=True)
    np.testing.assert_allclose(found, expected, atol=1e-5)


def test_the_statistics_of_its_training_go_with_it(tmp_path):
    venv = sb3.common.vec_env.VecNormalize(
        sb3.common.vec_env.DummyVecEnv([lambda: gym.make("HapticSLAM/Name-v0", seconds=0.2)])
    )
    model = sb3.PPO("MlpPolicy", venv, n_steps=8, batch_size=8, seed=0)
    model.learn(8)
    model.save(tmp_path / "model.zip")
    venv.save(str(tmp_path / "normalize.pkl"))
    said = export_saved(tmp_path / "model.zip", tmp_path / "model.npz", tmp_path / "normalize.pkl", trust=True)
    assert said["normalization"]["epsilon"] == venv.epsilon
    env = gym.make("HapticSLAM/Name-v0", seconds=0.2)
    observation, _ = env.reset(seed=900_000)
    expected, _ = model.predict(venv.normalize_obs(observation), deterministic=True)
    found, _ = agents.make(tmp_path / "model.npz", env).predict(observation, deterministic=True)
    np.testing.assert_allclose(found, expected, atol=1e-4)


@pytest.mark.parametrize(
    ("arguments", "told"),
    [
        (("model.zip",), "--trust"),
        (("missing.zip", "--trust"), "missing.zip' must be a file that exists"),
        (("model.npz", "--trust"), "a .zip is made an .npz"),
        (("model.zip", "--trust", "--out", "model.zip"), "a .zip is made an .npz"),
        (("model.zip", "--trust", "--hold", "0"), "hold must be an integer"),
        (("model.zip", "--trust", "--entries", "pose"), "entries must be pose, spread"),
        (("broken.zip", "--trust"), "is no whole model"),
        (("broken.zip", "--trust", "--out", "nowhere/a.npz"), "must be a file in a folder that can be written to"),
    ],
)
def test_what_cannot_be_made_is_refused_in_a_line_and_leaves_nothing(
    saved, tmp_path, monkeypatch, capsys, arguments, told
):
    (tmp_path / "model.zip").write_bytes(saved.read_bytes())
    (tmp_path / "broken.zip").write_bytes(saved.read_bytes()[:100])
    monkeypatch.chdir(tmp_path)
    with pytest.raises(SystemExit) as ended:
        export.main(list(arguments))
    assert ended.value.code == 2
    line = capsys.readouterr().err
    assert told in line
    assert line.count("\n") == 1
    assert sorted(each.name for each in tmp_path.iterdir()) == ["broken.zip", "model.zip"]


@pytest.mark.parametrize("name", ["nowhere/a.npz", "folder.npz", "a.npz/a.npz"])
def test_a_place_that_cannot_be_written_is_told_before_the_model_is_looked_at(tmp_path, name):
    (tmp_path / "folder.npz").mkdir()
    (tmp_path / "a.npz").touch()
    with pytest.raises(ValueError, match=r"path (must be a file|cannot be written)"):
        agents.export(None, tmp_path / name)


def test_nothing_in_a_zip_runs_that_is_not_trusted(tmp_path):
    """A zip whose pickle would leave a file."""

    class Bomb:
        def __reduce__(self):
            return Path.touch, (tmp_path / "ran",)

    data = {"policy_class": {":type:": "x", ":serialized:": base64.b64encode(pickle.dumps(Bomb())).decode()}}
    with zipfile.ZipFile(tmp_path / "bomb.zip", "w") as file:
        file.writestr("data", json.dumps(data))
    with pytest.raises(SystemExit):
        export.main([str(tmp_path / "bomb.zip")])
    assert not (tmp_path / "ran").exists()
    with pytest.raises(SystemExit):  # where it is trusted it does run
        export.main([str(tmp_path / "bomb.zip"), "--trust"])
    assert (tmp_path / "ran").exists()
