"""A policy is trained, and goes on being trained after a kill."""

from __future__ import annotations

import functools
import json
import os
import shutil
import signal
import subprocess
import sys
import time
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import gymnasium as gym
import numpy as np
import pytest

pytest.importorskip("stable_baselines3")
pytest.importorskip("sb3_contrib")

import agents
from haptic_lab.commands import train
from haptic_lab.learning import checkpoints, presets, training
from haptic_lab.learning.environments import make_env
from haptic_lab.learning.presets import TrainingWorld
from observer import HapticSLAM, ObserverWrapper, ShapePosterior
from observer.wrappers.belief_observation import CLOCKS_HZ

SCRIPT = Path(__file__).parents[2] / "scripts" / "train.py"
TINY = """
algorithm = "{algorithm}"
steps = {steps}
envs = 2
evaluate_every = 100
checkpoint_every = 100
episodes = 2
[world]
seconds = 0.4
observation = {observation}
variants = 4
samples = 2
[learner]
"""
LEARNERS = {
    "PPO": 'policy = "MlpPolicy"\nn_steps = 8\nbatch_size = 16\nn_epochs = 1\npolicy_kwargs = {net_arch = [8]}',
    "SAC": 'policy = "MlpPolicy"\nlearning_starts = 10\nbatch_size = 16\nbuffer_size = 200\n'
    "policy_kwargs = {net_arch = [8]}",
    "RecurrentPPO": 'policy = "MultiInputLstmPolicy"\nn_steps = 8\nbatch_size = 16\nn_epochs = 1\n'
    "policy_kwargs = {lstm_hidden_size = 8, net_arch = [8]}",
}


def preset(folder: Path, algorithm: str = "PPO", steps: int = 300) -> Path:
    """A run of seconds, as a TOML file."""
    observation = ["raw"] if algorithm == "RecurrentPPO" else ["pose", "names", "time"]
    path = folder / f"{algorithm}_{steps}.toml"
    path.write_text(TINY.format(algorithm=algorithm, steps=steps, observation=observation) + LEARNERS[algorithm])
    return path


def run(path: Path, out: Path, *more: str) -> int:
    """Train in this process."""
    return train.main(["--preset", str(path), "--out", str(out), "--jobs", "1", *more])


@pytest.fixture(scope="module")
def finished(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The folder of a whole run of PPO."""
    folder = tmp_path_factory.mktemp("ppo")
    assert run(preset(folder), folder / "out") == 0
    return folder / "out"


def test_a_run_leaves_what_it_says(finished):
    assert {each.name for each in finished.iterdir()} == {
        "best_model.npz",
        "best_model.zip",
        "checkpoints",
        "config.json",
        "evaluations.npz",
        "learning_curve.png",
        "model.npz",
        "model.zip",
        "tensorboard",
        "training.json",
    }
    told = json.loads((finished / "training.json").read_text())
    assert told["environment_steps"] >= 300
    assert told["seed"] == 0
    assert told["seconds"] >= 0
    assert list((finished / "tensorboard").rglob("events.*"))


@pytest.fixture(scope="module")
def trained(finished: Path, tmp_path_factory: pytest.TempPathFactory) -> Callable[[str], Path]:
    """The folder of a run by the name of its algorithm, made once."""

    @functools.cache
    def of(algorithm: str) -> Path:
        if algorithm == "PPO":
            return finished
        folder = tmp_path_factory.mktemp(algorithm)
        assert run(preset(folder, algorithm, 200), folder / "out") == 0
        return folder / "out"

    return of


@pytest.mark.parametrize("algorithm", ["SAC", "RecurrentPPO"])
def test_other_algorithms_train_and_go_on(algorithm, tmp_path, trained):
    shutil.copytree(trained(algorithm), tmp_path / "out")
    before = checkpoints.newest(tmp_path / "out" / "checkpoints")[0]
    assert run(preset(tmp_path, algorithm, 300), tmp_path / "out") == 0
    after = checkpoints.newest(tmp_path / "out" / "checkpoints")[0]
    assert int(after.folder.name) > int(before.folder.name)


@pytest.mark.parametrize("algorithm", list(LEARNERS))
def test_what_was_trained_is_a_policy(algorithm, trained):
    out = trained(algorithm)
    env = gym.make("HapticSLAM/TwoFinger-v0", shape="cube", episode_seconds=0.4)
    hand = env.unwrapped.hand
    env = ObserverWrapper(env, HapticSLAM(hand, particles=1), ShapePosterior(hand, samples=4))
    policy, state = agents.make("sb3", env, seed=0, path=out / "model.npz"), None
    observation, _ = env.reset(seed=0)
    actions = []
    for _ in range(20):
        action, state = agents.act(policy, observation, state)
        assert action in env.action_space
        actions.append(action)
        observation = env.step(action)[0]
    changed = np.flatnonzero(np.any(np.diff(actions, axis=0) != 0, axis=1)) + 1
    np.testing.assert_array_equal(changed, [5, 10, 15]), "it holds its actions as it was trained to"


def test_the_same_seed_learns_the_same(tmp_path):
    weights = []
    for name in ("a", "b"):
        assert run(preset(tmp_path, steps=100), tmp_path / name) == 0
        model = training.ALGORITHMS["PPO"].load(tmp_path / name / "model.zip")
        weights.append(np.concatenate([each.detach().numpy().ravel() for each in model.policy.parameters()]))
    np.testing.assert_array_equal(*weights)


def test_a_killed_run_goes_on_from_its_last_checkpoint(tmp_path, capsys):
    path, out = preset(tmp_path, steps=100_000), tmp_path / "out"
    command = [sys.executable, str(SCRIPT), "--preset", str(path), "--out", str(out), "--jobs", "1"]
    process = subprocess.Popen(command, stdout=subprocess.DEVNULL, env=os.environ | {"MUJOCO_GL": "egl"})
    try:
        deadline = time.monotonic() + 120
        while len(list(out.glob("checkpoints/*/checkpoint.json"))) < 2:
            assert process.poll() is None
            assert time.monotonic() < deadline
            time.sleep(0.05)
    finally:
        process.send_signal(signal.SIGKILL)
        process.wait()
    reached = int(checkpoints.newest(out / "checkpoints")[0].folder.name)  # decisions, of five steps each
    steps = 5 * reached + 200
    assert run(preset(tmp_path, steps=100_000), out, "--steps", str(steps)) == 0
    assert f"Going on after {5 * reached} steps" in capsys.readouterr().out, "it did not begin anew"
    told = json.loads((out / "training.json").read_text())
    assert steps <= told["environment_steps"] < steps + 200
    with np.load(out / "evaluations.npz") as kept:
        assert (np.diff(kept["timesteps"]) > 0).all()
        assert kept["timesteps"][0] < reached, "what was evaluated before is kept"


@pytest.mark.parametrize("damage", ["shorter", "missing", "unlisted", "garbled"])
def test_a_checkpoint_cut_short_is_recognised(finished, tmp_path, damage, capsys):
    out = tmp_path / "out"
    shutil.copytree(finished, out)
    whole, broken = sorted((out / "checkpoints").iterdir())
    model = broken / "model.zip"
    match damage:
        case "shorter":
            model.write_bytes(model.read_bytes()[:-100])
        case "missing":
            model.unlink()
        case "unlisted":
            (broken / "checkpoint.json").unlink()
        case "garbled":
            (broken / "checkpoint.json").write_text('{"files": {"model')
    found, left_out = checkpoints.newest(out / "checkpoints")
    assert (found.folder, left_out) == (whole, [broken])
    if damage != "garbled":  # what is left out is removed, whatever its damage
        return
    assert run(preset(tmp_path), out) == 0
    assert "was cut short and is removed" in capsys.readouterr().out.replace("\n", " ")
    assert not broken.exists()


def test_any_hand_is_trained(tmp_path, capsys):
    hand = str(Path(__file__).parents[2] / "examples" / "gripper" / "gripper.toml")
    assert run(preset(tmp_path, steps=20), tmp_path / "out", "--hand", hand) == 0
    env = gym.make("HapticSLAM/Explore-v0", hand=hand, episode_seconds=0.2)
    believed = ObserverWrapper(env, HapticSLAM(env.unwrapped.hand, particles=1), ShapePosterior(env.unwrapped.hand))
    policy = agents.make("sb3", believed, seed=0, path=str(tmp_path / "out" / "model.npz"))
    observation, _ = believed.reset(seed=0)
    assert agents.act(policy, observation, None)[0].shape == (9,)
    with pytest.raises(SystemExit):
        train.main(["--hand", "paw"])
    assert "unknown --hand or --env 'paw'" in capsys.readouterr().err


def test_a_folder_holds_one_run(finished, tmp_path, capsys):
    with pytest.raises(SystemExit) as error:
        run(preset(tmp_path), finished, "--seed", "4")
    assert error.value.code == 2
    assert "holds a run with seed = 0, not 4; choose another --out" in capsys.readouterr().err


@pytest.mark.parametrize("name", presets.names())
def test_presets_make_sense(name):
    preset = presets.read(name)
    assert preset.algorithm in presets.ALGORITHMS
    env = make_env(preset.world)
    env.reset(seed=0)
    env.close()


@pytest.mark.parametrize(
    ("content", "said"),
    [
        ('algorithm = "DQN"\n[learner]', "unknown algorithm 'DQN'; choose from CMA-ES, PPO, RecurrentPPO, SAC"),
        ("seed = 3", "must set algorithm"),
        ('algorithm = "PPO"\nstep = 3\n[learner]', "did you mean 'steps'"),
        ('algorithm = "PPO"\n[learner]\n[world]\nprices = 3', "did you mean 'price'"),
        ('algorithm = "PPO"\n[learner]\n[world]\nobservation = ["poses"]', "did you mean 'pose'"),
        ('algorithm = "PPO"\n[learner]\n[world]\nsigma_deg = [5, 2]', "least and the largest"),
        ('algorithm = "PPO"\nenvs = 0\n[learner]', "envs must be an integer in [1, 1024], got 0"),
        ("algorithm =", "Invalid value"),
    ],
)
def test_a_preset_that_makes_no_sense_is_told_in_a_line(tmp_path, capsys, content, said):
    path = tmp_path / "mine.toml"
    path.write_text(content)
    with pytest.raises(SystemExit) as error:
        run(path, tmp_path / "out")
    assert error.value.code == 2
    assert said in capsys.readouterr().err


WORLD = "seconds, sigma_deg, size_jitter, yaw_jitter, position_jitter, hold, price, least, threshold, sure_seconds"
NUMBERS = {
    "": "seed steps envs evaluate_every checkpoint_every episodes",
    "world": f"{WORLD} variants samples stride temper".replace(",", ""),
    "sweep": "flexion opening sideways curl noise decisions epochs",
    "learner": "learning_rate n_steps batch_size n_epochs gamma gae_lambda clip_range ent_coef vf_coef max_grad_norm "
    "target_kl use_sde sde_sample_freq normalize_advantage policy_kwargs",
}


@pytest.mark.parametrize(("table", "key"), [(table, key) for table, keys in NUMBERS.items() for key in keys.split()])
def test_every_number_of_a_preset_has_a_range(tmp_path, table, key):
    path = tmp_path / "mine.toml"
    fine = {("use_sde", "true"), ("normalize_advantage", "true"), ("policy_kwargs", "{}")}
    for value in ("-1e300", "nan", "true", '"many"', "[]", "{}"):
        if (key, value) in fine:
            continue
        tables = dict.fromkeys(NUMBERS, "") | {"learner": 'policy = "MlpPolicy"', table: f"{key} = {value}"}
        rows = [f"[{name}]\n{row}" if name else row for name, row in tables.items()]
        path.write_text("\n".join(['algorithm = "PPO"', *rows]))
        with pytest.raises(ValueError, match=rf"mine.toml: .*{key}.* must be"):
            presets.read(str(path))


@pytest.mark.parametrize(
    ("algorithm", "world", "learner", "said"),
    [
        ("PPO", "hold = -1", "", r"hold must be an integer in \[1, 1000\], got -1"),
        ("PPO", "sigma_deg = [3]", "", r"sigma_deg must be two numbers, the least and the largest, got \(3,\)"),
        ("PPO", "observation = []", "", "observation must be a list of pose, .*, raw, got"),
        ("PPO", 'observation = ["raw", "pose"]', "", "observation raw is what is felt, and stands alone, got"),
        ("PPO", 'observation = ["posse"]', "", "unknown entry of observation 'posse'.*; choose from .*raw"),
        ("PPO", 'observation = ["raw"]', 'policy = "MlpPolicy"', "'MlpPolicy'.*; choose from MultiInputPolicy"),
        ("PPO", "", 'policy = "MultiInputPolicy"', "'MultiInputPolicy'.*; choose from MlpPolicy"),
        ("PPO", "", "", r"\[learner\] must set policy = \"MlpPolicy\""),
        ("RecurrentPPO", 'observation = ["raw"]', "", 'must set policy = "MultiInputLstmPolicy"'),
        ("PPO", "", "n_step = 3", r"unknown key of \[learner\] 'n_step' .did you mean 'n_steps'"),
        ("SAC", "", "n_epochs = 3", r"unknown key of \[learner\] 'n_epochs'"),
        ("PPO", "", "batch_size = 1", r"batch_size of \[learner\] must be an integer in \[2, "),
        ("SAC", "", 'ent_coef = "auto_x"', r"what follows auto_ in ent_coef of \[learner\] must be .*, got 'x'"),
        (
            "PPO",
            "",
            "policy_kwargs = {net_arch = [0]}",
            r"width in net_arch .* must be .* in \[1, 4096\], got 0",
        ),
        ("PPO", "", "policy_kwargs = {net_arch = {q = [8]}}", "unknown network of net_arch .* 'q'"),
        ("PPO", "", "policy_kwargs = {net_arc = [8]}", "'net_arc' .did you mean 'net_arch'"),
    ],
)
def test_what_a_preset_may_say(tmp_path, algorithm, world, learner, said):
    path = tmp_path / "mine.toml"
    path.write_text(f'algorithm = "{algorithm}"\n[world]\n{world}\n[learner]\n{learner}')
    with pytest.raises(ValueError, match=said):
        presets.read(str(path))


@pytest.mark.parametrize("text", ["world = 3", "sweep = []", 'learner = "PPO"'])
def test_tables_of_a_preset_are_tables(tmp_path, text):
    path = tmp_path / "mine.toml"
    path.write_text('algorithm = "PPO"\n' + text + ("" if text.startswith("learner") else "\n[learner]"))
    with pytest.raises(ValueError, match="must be a table, got"):
        presets.read(str(path))


def test_a_learner_that_cannot_be_made_leaves_no_run(tmp_path, capsys):
    path = preset(tmp_path, "SAC")
    path.write_text(path.read_text().replace("net_arch = [8]", "net_arch = {pi = [8]}"))  # it wants qf as well
    assert run(path, tmp_path / "out") == 2
    assert "error: [learner] makes no SAC: " in capsys.readouterr().err
    assert not (tmp_path / "out").exists()


@pytest.mark.parametrize("algorithm", ["PPO", "SAC"])
def test_a_learner_begins_with_a_copy_of_a_sweep(algorithm, tmp_path):
    path = preset(tmp_path, algorithm, 10)
    text = path.read_text().replace("['pose', 'names', 'time']", "['rhythm']").replace("[8]", "[32]")
    path.write_text(text + "\n[sweep]\ndecisions = 100\nepochs = 500\nsideways = 0.8\nflexion = 0.4\nopening = 0.3\n")
    assert run(path, tmp_path / "out") == 0
    model = training.ALGORITHMS[algorithm].load(tmp_path / "out" / "best_model.zip")
    sweep, hand = presets.read(str(path)).sweep, gym.make("HapticSLAM/TwoFinger-v0").unwrapped.hand
    seconds = np.arange(0.0, 0.4, 0.1)  # of an episode, which is as far as it has seen
    turns = 2 * np.pi * np.array(CLOCKS_HZ) * seconds[:, None]
    seen = np.stack([np.sin(turns), np.cos(turns)], axis=2).reshape(len(seconds), -1).astype(np.float32)
    copied, _ = model.predict(seen, deterministic=True)
    np.testing.assert_allclose(copied, sweep.torques(seconds, hand), atol=0.1)
    thumb, index = sweep.torques(seconds, hand)[:, :4], sweep.torques(seconds, hand)[:, 4:]
    np.testing.assert_array_equal(thumb[:, 0], -index[:, 0])
    np.testing.assert_array_equal(thumb[0, 1:], index[0, 1:])
    assert (thumb[1:, 1] > thumb[1:, 2]).all(), "it drifts: its first flexor closes, and its others open"


def test_sizes_of_evaluation_are_not_trained_with():
    world = TrainingWorld(seconds=0.1, observation=("time",), variants=2, samples=1)
    scales: dict[bool, set[float]] = {True: set(), False: set()}
    for held_out, found in scales.items():
        env = make_env(world, held_out)
        env.reset(seed=0)
        for _ in range(30):
            env.reset()
            solid = env.unwrapped.solid
            found.add(round(solid.size[0] / solid.shape.default_size[0], 4))
        env.close()
    assert not scales[True] & scales[False]
    assert 0.8 <= min(scales[False]) < min(scales[True]) < max(scales[True]) < max(scales[False]) <= 1.2


def test_sigma_is_drawn_for_each_episode_and_told_to_the_observer():
    env = make_env(TrainingWorld(seconds=0.1, observation=("time",), variants=2, samples=1, sigma_deg=(1.0, 5.0)))
    env.reset(seed=0)
    drawn = set()
    for _ in range(10):
        env.reset()
        (white,) = env.unwrapped.felt_angles.proprioception.noises
        assert env.get_wrapper_attr("observer").sigma_deg == pytest.approx(np.rad2deg(white.sigma))
        assert 1.0 <= np.rad2deg(white.sigma) <= 5.0
        drawn.add(white.sigma)
    assert len(drawn) == 10
    env.close()


def test_other_shapes_than_the_four_are_drawn_and_named():
    names = ("cube", "torus(0.4)", "prism(3, size=0.06)")
    world = TrainingWorld(seconds=0.1, observation=("names",), variants=2, samples=1, shapes=names)
    env = make_env(world)
    assert env.observation_space.shape == (3,)
    env.reset(seed=0)
    drawn = set()
    for _ in range(12):
        env.reset()
        drawn.add(env.unwrapped.solid.name)
    assert drawn == set(names)
    env.close()
    usual = presets.configuration(presets.read("trained"))
    assert "shapes" not in usual["world"], "runs from before go on"
    other = replace(presets.read("trained"), world=replace(presets.read("trained").world, shapes=names))
    assert presets.configuration(other)["world"]["shapes"] == list(names)
