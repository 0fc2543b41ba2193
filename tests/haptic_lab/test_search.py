"""A population search: what its candidates share, and that a run which was stopped goes on with the same bits."""

from __future__ import annotations

import json
import shutil
import subprocess
import sys
from dataclasses import replace
from pathlib import Path

import gymnasium as gym
import numpy as np
import pandas as pd
import pytest
from scipy.spatial import cKDTree

pytest.importorskip("cmaes")
pytest.importorskip("stable_baselines3")

import agents
from agents.gains import GAINS, OF_PLACES, OF_REFLEXES, gains_of
from agents.sb3 import read_model
from agents.sweep import SweepingMotion
from haptic_env import hand_env
from haptic_lab.commands import train
from haptic_lab.learning import candidates, presets, search, several_runs
from haptic_lab.learning.candidates import Outcome, doubts
from haptic_lab.learning.covering import Covering
from haptic_lab.learning.evaluation import OF_EVALUATIONS
from haptic_lab.learning.explored import explored as explored_as_usual
from haptic_lab.learning.finger_weights import FingerWeights
from haptic_lab.learning.presets import TrainingWorld
from haptic_lab.learning.rhythm_gains import RhythmGains
from observer import BeliefFeatures, HapticSLAM, ObserverWrapper, ShapePosterior, metrics
from observer.wrappers.belief_observation import CLOCKS_HZ

TINY = """
algorithm = "CMA-ES"
steps = {steps}
evaluate_every = 150
episodes = 2
[world]
seconds = 0.3
observation = ["rhythm", "names", "contacts", "pose"]
variants = 4
hold = 2
[sweep]
[learner]
population = 4
worlds = 1
step = 0.15
"""
LABELS = ("a", "b", "c")


@pytest.fixture(scope="module")
def hand():
    return gym.make("HapticSLAM/TwoFinger-v0").unwrapped.hand


def weights(hand, *entries: str, sweep: SweepingMotion | None = None) -> FingerWeights:
    return FingerWeights(hand, BeliefFeatures(hand, LABELS, 10.0, 50.0, entries), len(LABELS), sweep)


@pytest.mark.parametrize("before", [(), ("names",), ("contacts", "time", "pose")])
def test_weights_of_zero_are_the_sweep(hand, before):
    sweep = SweepingMotion(flexion=0.4, sideways=0.7)
    made = weights(hand, *before, "rhythm", sweep=sweep)
    told = BeliefFeatures(hand, LABELS, 10.0, 50.0, [*before, "rhythm"]).space.shape[0]
    assert made.candidate(np.zeros(made.size)).shape[1] == 1 + told
    for seconds in (0.0, 0.3, 2.9, 7.7):
        turns = [2 * np.pi * hz * seconds for hz in CLOCKS_HZ]
        clocks = [wave(turn) for turn in turns for wave in (np.sin, np.cos)]
        matrix = made.candidate(np.zeros(made.size))
        shown = np.concatenate([np.full(matrix.shape[1] - 1 - len(clocks), 0.5), clocks])
        expected = sweep.torques(np.array([seconds]), hand)[0]
        np.testing.assert_allclose(matrix[:, 0] + matrix[:, 1:] @ shown, expected, atol=1e-6)
    with pytest.raises(ValueError, match=r'\[sweep\] needs the entry "rhythm" in observation, got pose'):
        weights(hand, "pose", sweep=sweep)


def test_fingers_share_their_weights_and_are_mirrored(hand):
    """What the thumb does about what it feels, the index does about the same, its abductor the other way."""
    made = weights(hand, "contacts")
    matrix = made.candidate(np.random.default_rng(0).standard_normal(made.size))
    patch = {name: 1 + column for column, name in enumerate(hand.patches.names)}
    mirrored = {"left": "right", "right": "left"}
    for name in hand.patches.names:
        if not name.startswith("thumb"):
            continue
        end = name.rsplit("_", 1)[1]
        twin = name.replace("thumb", "index").removesuffix(end) + mirrored.get(end, end)
        thumb, index = matrix[:4, patch[name]], matrix[4:, patch[twin]]
        np.testing.assert_array_equal(thumb * [-1, 1, 1, 1], index)
        assert not matrix[4:, patch[name]].any(), "a finger does nothing about what the other one feels"
        assert thumb.all()


def test_shapes_are_explored_in_turn(monkeypatch):
    explored = []

    class Reset(gym.Wrapper):
        def reset(self, *, seed=None, options=None):
            explored.append((seed, options["shape"]))
            return self.env.reset(seed=seed, options=options)

    world = TrainingWorld(observation=("rhythm",), seconds=0.04, hold=2, variants=4)
    monkeypatch.setattr(candidates, "explored", lambda *given: Reset(explored_as_usual(*given)))
    judge = candidates.Judge(world, jobs=1)
    judge.judge((np.zeros((8, 7)), seed) for seed in range(4, 10))
    assert explored == [(4 + i, world.shapes[i % 4]) for i in range(6)]


def test_what_was_decided_rightly_is_in_doubt_no_more():
    """Where any probability is enough to decide, an exploration ends at once; a wrong end is in doubt for all of it."""
    world = TrainingWorld(observation=("rhythm",), seconds=1.0, hold=2, variants=4, threshold=0.0)
    outcomes = candidates.Judge(world, jobs=1).judge((np.zeros((8, 7)), seed) for seed in range(8))
    assert {each.decisions for each in outcomes} == {1}
    assert {each.right for each in outcomes} == {True, False}
    for each in outcomes:
        assert each.doubt < 0.04 if each.right else each.doubt > 0.8


def test_time_in_doubt_is_the_mean_of_outcomes():
    outcomes = [Outcome(doubt, 0.0, 1, True) for doubt in (1.0, 2.0, 3.0, 4.0)]
    np.testing.assert_array_equal(doubts(outcomes, (2, 2)).mean(axis=0), [2.0, 3.0])


def test_processes_in_which_candidates_explore_import_no_learner():
    told = (
        "import sys, haptic_lab.learning.candidates; print('stable_baselines3' in sys.modules, 'torch' in sys.modules)"
    )
    ran = subprocess.run([sys.executable, "-c", told], capture_output=True, encoding="utf-8", check=True)
    assert ran.stdout.split() == ["False"] * 2


def run(folder: Path, out: Path, steps: int) -> int:
    path = folder / f"{steps}.toml"
    path.write_text(TINY.format(steps=steps))
    return train.main(["--preset", str(path), "--out", str(out), "--jobs", "1"])


@pytest.fixture(scope="module")
def finished(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The folder of a whole search."""
    folder = tmp_path_factory.mktemp("search")
    assert run(folder, folder / "out", 250) == 0
    return folder / "out"


def test_a_search_leaves_a_policy(finished):
    assert {each.name for each in finished.iterdir()} == {
        "best_model.npz",
        "config.json",
        "evaluations.npz",
        "learning_curve.png",
        "model.npz",
        "search.npz",
        "training.json",
    }
    env = gym.make("HapticSLAM/TwoFinger-v0", shape="cube", episode_seconds=0.3)
    env = ObserverWrapper(env, HapticSLAM(env.unwrapped.hand, particles=1), ShapePosterior(env.unwrapped.hand))
    observation, _ = env.reset(seed=0)
    policy = agents.make(finished / "model.npz", env)
    assert policy.predict(observation)[0] in env.action_space
    with np.load(finished / "search.npz") as kept:
        assert kept["costs"].shape[1] == 4
        assert (kept["costs"] > 0.0).all()
        assert (kept["costs"] <= 0.3 + 1e-9).all(), "no longer than an exploration is it in doubt"


def test_a_search_that_was_stopped_goes_on_with_the_same_bits(finished, tmp_path, capsys):
    assert run(tmp_path, tmp_path / "out", 100) == 0
    assert run(tmp_path, tmp_path / "out", 250) == 0
    told = capsys.readouterr().out
    assert "Going on after" in told
    assert "\nsteps: " in told, "away from a terminal there are lines"
    with np.load(finished / "search.npz") as whole, np.load(tmp_path / "out" / "search.npz") as parts:
        np.testing.assert_array_equal(whole["costs"], parts["costs"])
    with np.load(finished / "model.npz") as whole, np.load(tmp_path / "out" / "model.npz") as parts:
        np.testing.assert_array_equal(whole["mean.weight"], parts["mean.weight"])


def test_a_search_that_was_stopped_before_its_first_generation_goes_on(tmp_path):
    search.History(
        table={name: [row] for name, row in zip(OF_EVALUATIONS, (0, (1.0,), (2,), (True,)), strict=True)}
    ).write(tmp_path)
    found = search.read_history(tmp_path, 4, 2)
    assert (found.costs, found.steps, found.best) == ([], 0, np.inf)


@pytest.mark.parametrize("hold", [1, 2, 5])
def test_an_evaluation_whose_generation_was_not_kept_is_forgotten(tmp_path, hold):
    """Killed after the table of evaluations was written, and before the history."""
    kept, lost = (40, (1.0,), (2,), (True,)), (41, (1.0,), (2,), (True,))
    table = {name: list(rows) for name, *rows in zip(OF_EVALUATIONS, kept, lost, strict=True)}
    search.History(costs=[np.ones(4)], steps=40 * hold, table=table).write(tmp_path)
    found = search.read_history(tmp_path, 4, hold)
    assert found.table["timesteps"] == [40]
    assert [len(rows) for rows in found.table.values()] == [1] * len(OF_EVALUATIONS)


@pytest.mark.parametrize("content", [b"", b"no archive", None])
def test_a_history_that_is_none_is_refused(finished, tmp_path, content):
    out = tmp_path / "out"
    out.mkdir()
    (out / search.HISTORY).write_bytes((finished / "model.npz").read_bytes() if content is None else content)
    with pytest.raises(ValueError, match=r"search.npz is no search of 4 candidates: .*; choose another --out"):
        search.read_history(out, 4, 2)


@pytest.mark.parametrize(
    ("change", "said"),
    [
        ("population = 4", "population of [learner] must be an integer in [4, 10000], got 3"),
        ("step = 0.15", "step of [learner] must be"),
        ("worlds = 1", "[learner] must set worlds"),
        ('"pose"]', "unknown entry of observation, for CMA-ES, 'occupancy'"),
    ],
)
def test_what_a_search_may_say(tmp_path, change, said):
    wrong = {"population = 4": "population = 3", "step = 0.15": "step = 0", "worlds = 1": "", '"pose"]': '"occupancy"]'}
    path = tmp_path / "mine.toml"
    path.write_text(TINY.format(steps=100).replace(change, wrong[change]))
    with pytest.raises(ValueError, match=r"mine\.toml: ") as error:
        presets.read(str(path))
    assert said in str(error.value)


@pytest.fixture
def guided():
    """About a cube, for a moment."""
    env = gym.make("HapticSLAM/TwoFinger-v0", shape="cube", episode_seconds=0.2)
    yield ObserverWrapper(env, HapticSLAM(env.unwrapped.hand, particles=1), ShapePosterior(env.unwrapped.hand))
    env.close()


@pytest.mark.parametrize("episodes", [0, 2])
def test_a_model_made_blind_acts_on_what_it_is_shown_instead(guided, finished, tmp_path, episodes):
    agents.ablate(guided, finished / "model.npz", tmp_path / "blind.npz", ["contacts"], episodes=episodes, seed=900000)
    seeing, blind = (agents.make(path, guided, seed=0) for path in (finished / "model.npz", tmp_path / "blind.npz"))
    observation, _ = guided.reset(seed=0)
    touched = {**observation, "contacts": np.ones_like(observation["contacts"])}
    assert (seeing.predict(observation)[0] != seeing.predict(touched)[0]).any()
    np.testing.assert_array_equal(blind.predict(observation)[0], blind.predict(touched)[0])
    if not episodes:
        np.testing.assert_array_equal(blind.predict(observation)[0], seeing.predict(observation)[0])


def test_what_cannot_be_made_blind_is_told(guided, finished, tmp_path):
    for entries, to, said in (
        (["spread"], "blind.npz", "unknown entry that the model sees 'spread'"),
        (["pose"], "blind.zip", "to must end in .npz"),
    ):
        with pytest.raises(ValueError, match=said):
            agents.ablate(guided, finished / "model.npz", tmp_path / to, entries)
    assert not list(tmp_path.iterdir())


MAP = """
algorithm = "CMA-ES"
steps = {steps}
evaluate_every = 300
episodes = 2
[world]
task = "map"
seconds = 0.6
observation = ["contacts"]
hold = 2
[rhythm]
curl_touch = 0.5
[learner]
population = 4
worlds = 1
step = 0.15
"""


def search_for_maps(folder: Path, out: Path, steps: int) -> int:
    path = folder / f"map_{steps}.toml"
    path.write_text(MAP.format(steps=steps))
    return train.main(["--preset", str(path), "--out", str(out), "--jobs", "1"])


def test_a_rhythm_is_searched_and_goes_on_with_the_same_bits(tmp_path, capsys):
    assert search_for_maps(tmp_path, tmp_path / "whole", 360) == 0
    assert "of the surface touched in 0.6 s, of 2 explorations" in " ".join(capsys.readouterr().out.split())
    assert search_for_maps(tmp_path, tmp_path / "parts", 100) == 0
    assert search_for_maps(tmp_path, tmp_path / "parts", 360) == 0
    with np.load(tmp_path / "whole/search.npz") as whole, np.load(tmp_path / "parts/search.npz") as parts:
        np.testing.assert_array_equal(whole["costs"], parts["costs"])
        assert len(whole["costs"]) == 3, "120 steps each"
        assert (whole["costs"] >= 0.0).all()
        assert (whole["costs"] <= 1.0).all()
    models = [read_model(tmp_path / name / "model.npz") for name in ("whole", "parts")]
    assert models[0].gains == models[1].gains
    assert models[0].gains != gains_of({"curl_touch": 0.5})
    assert models[0].told == {"env": "HapticSLAM/TwoFinger-v0", "entries": ["contacts"], "hold": 2}


def test_weights_of_zero_are_the_rhythm_that_a_preset_begins_with(hand):
    features = BeliefFeatures(hand, (), 10.0, 50.0, ["contacts"])
    gains = RhythmGains(hand, features, gains_of({"turn": 0.4}), 0.04, {"hold": 2})
    assert gains.candidate(np.zeros(gains.size)).gains == gains_of({"turn": 0.4})
    most = {name: each.high for name, each in GAINS.items()}
    far = gains.candidate(np.full(gains.size, 1e6)).gains
    assert far == most | {name: OF_PLACES[name].usual for name in OF_PLACES}, "no further than they may be"
    recalls = RhythmGains(hand, features, gains_of({"enough": 0.3}), 0.04, {"hold": 2})
    assert recalls.size == gains.size + len(OF_PLACES)
    assert recalls.candidate(np.full(recalls.size, 1e6)).gains == most


def test_what_is_touched_is_counted_where_it_is_touched():
    """Against the places of `metrics.touched_places`; a hand that stays open touches less."""
    world = replace(presets.read("reflexes").world, seconds=1.5)
    covering = Covering(world, held_out=False)
    env, touched, given = hand_env(covering._env), covering._touched, []
    take = touched.take
    touched.take = lambda *each: given.append(each) or take(*each)
    made = RhythmGains(env.hand, features_of_contacts(env.hand), gains_of({}), 0.04, {})
    rhythm = made.candidate(np.zeros(made.size))
    share, decisions = covering.play(rhythm, 900_000)
    assert 0.0 < share < 1.0
    assert decisions == len(given) == 38
    places, solid = np.concatenate(touched.places), env.solid
    assert np.abs(solid.signed_distance(places)).max() <= metrics.TOUCH_TOLERANCE
    angles, contacts = ([each[index] for each in given] for index in (0, 1))
    expected = metrics.touched_places(env.hand, angles, contacts, solid, spacing=0.004)
    assert cKDTree(places).query(expected)[0].max() < 1e-9
    touched.places = 8 * [metrics.surface_places(solid, touched._grid)]
    assert touched.share(solid) == 1.0
    touched.places = 4 * [metrics.surface_places(solid, touched._grid)[:1]]
    assert 0.0 < touched.share(solid) < 0.05
    assert Covering(world, held_out=False).play(rhythm, 900_000) == (share, decisions)
    still = replace(rhythm, gains=gains_of({"flexion": -1.0, "opening": 0.0, "sideways": 0.0, "curl_drift": 0.0}))
    assert covering.play(still, 900_000)[0] < share


def test_how_soon_a_surface_is_touched_is_a_mean_through_time():
    """Of the share by each decision, which grows to that in the end; a pose filter tells what a candidate reads."""
    preset = replace(presets.read("anywhere"), world=replace(presets.read("anywhere").world, seconds=1.0))
    covering = Covering(preset.world, held_out=False)
    weights = search._weights(explored_as_usual(preset.world), preset)
    candidate = weights.candidate(np.zeros(weights.size))
    soon, decisions = covering.play(candidate, 900_002)
    touched, solid = covering._touched, hand_env(covering._env).solid
    shares = touched.shares(solid)
    assert len(shares) == decisions == 25
    assert (np.diff(shares) >= 0.0).all()
    assert 0.0 < soon < shares[-1] == touched.share(solid)
    assert soon == pytest.approx(np.prod(np.maximum(shares, 1e-3)) ** (1.0 / 25))
    judge = candidates.Judge(preset.world, jobs=1)
    (outcome,) = judge.judge([(candidate, 900_002)])
    assert outcome == (pytest.approx(-np.log(soon)), soon, 25, False)
    blind = candidate.copy()
    blind[:, 1 + 6 + 50 :] = 0.0  # the believed pose
    assert covering.play(blind, 900_002)[0] != soon


def test_a_search_goes_on_with_the_weights_of_a_policy():
    preset = presets.read("anywhere")
    weights = search._weights(explored_as_usual(preset.world), preset)
    shipped = read_model(agents.POLICIES["searched"].shipped)
    made = weights.network(np.zeros(weights.size), {})
    np.testing.assert_array_equal(made.mean.weight, shipped.mean.weight)
    np.testing.assert_array_equal(made.mean.bias, shipped.mean.bias)
    moved = weights.network(np.full(weights.size, 0.1), {})
    assert not np.allclose(moved.mean.weight, shipped.mean.weight)


ANYWHERE = presets.read("anywhere").world


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"begin": "sweeped"}, "unknown begin 'sweeped' .*choose from"),
        ({"begin": "sweep"}, "begin must be a policy of linear weights, got 'sweep'"),
        ({"begin": "reflexes"}, "begin must be a policy of linear weights, got 'reflexes'"),
        ({"begin": "trained"}, "a search begins with a model that is shown rhythm, contacts, pose, got"),
        ({"begin": 5}, "begin must be the name of a policy or a file, got 5"),
        (
            {"world": replace(ANYWHERE, env="HapticSLAM/MyoHand-v0")},
            "begins with a model of its own hand, with weights",
        ),
        ({"world": replace(ANYWHERE, hold=5)}, "hold must be that of begin, 2, got 5"),
        ({"begin": None}, r"task, for CMA-ES without \[rhythm\],"),
        ({"rhythm": {}}, r"\[rhythm\] tells itself how it begins"),
        ({"sweep": SweepingMotion()}, r"begin .* stands without \[sweep\]"),
        ({"algorithm": "PPO"}, "begin is for CMA-ES, not for PPO"),
    ],
)
def test_a_search_that_begins_with_no_such_policy_is_refused(change, message):
    preset = presets.read("anywhere")
    if "algorithm" in change:
        change = {**change, "learner": {"policy": "MlpPolicy"}}

    def begun() -> None:
        changed = replace(preset, **change)
        search._weights(explored_as_usual(changed.world), changed)

    with pytest.raises(ValueError, match=message):
        begun()


def test_only_what_is_touched_may_be_paid_the_more_the_sooner():
    with pytest.raises(ValueError, match=r"task, where soon is true,.*'name'"):
        TrainingWorld(soon=True)
    with pytest.raises(ValueError, match="soon must be"):
        TrainingWorld(soon=1)
    preset, learner = presets.read("anywhere"), {"policy": "MlpPolicy"}
    with pytest.raises(ValueError, match="soon is for CMA-ES, not for PPO"):
        replace(preset, begin=None, algorithm="PPO", learner=learner)
    with pytest.raises(ValueError, match="'soon'"):
        gym.make("HapticSLAM/Map-v0", soon=True)  # which pays bits


def features_of_contacts(hand) -> BeliefFeatures:
    return BeliefFeatures(hand, (), 10.0, 50.0, ["contacts"])


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ("[rhythm]\nspeed = 1.0", r"unknown key of \[rhythm\] .*'speed'; choose from"),
        ("[rhythm]\nbeat = 9.0", r"key of \[rhythm\] beat must be"),
        ("[rhythm]\n[sweep]", r"\[rhythm\] begins as the sweep by itself"),
        ('[world]\nobservation = ["contacts", "pose"]\n[rhythm]', r"observation must be contacts, for \[rhythm\], got"),
        ('[world]\ntask = "map"\nobservation = ["contacts"]', r"task, for CMA-ES without \[rhythm\],"),
    ],
)
def test_a_preset_of_a_rhythm_that_makes_no_sense_is_refused(tmp_path, change, message):
    path = tmp_path / "preset.toml"
    world = "" if "[world]" in change else '[world]\nobservation = ["contacts"]\n'
    learner = "[learner]\npopulation = 4\nworlds = 1\nstep = 0.1\n"
    path.write_text(f'algorithm = "CMA-ES"\n{world}{learner}{change}\n')
    with pytest.raises(ValueError, match=message):
        presets.read(str(path))


def test_a_rhythm_is_for_a_search(tmp_path):
    path = tmp_path / "preset.toml"
    path.write_text(
        'algorithm = "PPO"\n[world]\nobservation = ["contacts"]\n[learner]\npolicy = "MlpPolicy"\n[rhythm]\n'
    )
    with pytest.raises(ValueError, match=r"\[rhythm\] is for CMA-ES, not for PPO"):
        presets.read(str(path))


def test_the_wrist_of_a_whole_hand_is_searched_too():
    env = explored_as_usual(presets.read("whole_hand").world)
    hand, features = hand_env(env).hand, env.get_wrapper_attr("features")
    gains = RhythmGains(hand, features, gains_of({}), 0.04, {})
    assert gains.size == len(OF_REFLEXES) + 5 * 3
    given = np.arange(gains.size) / 100.0
    shared = gains.candidate(given).shared
    np.testing.assert_allclose(shared[:, :3].ravel(), given[len(OF_REFLEXES) :])
    assert not shared[:, 3:].any()
    assert not gains.candidate(np.zeros(gains.size)).shared.any()


def test_angles_may_be_taken_at_their_word_where_only_names_are_asked():
    env = explored_as_usual(replace(presets.read("whole_hand").world, seconds=0.8, sigma_deg=(0.5, 0.5), stride=1))
    env.reset(seed=900_000)
    for _ in range(10):
        *_, info = env.step(env.action_space.sample())
    belief = env.get_wrapper_attr("belief")
    np.testing.assert_allclose(np.rad2deg(belief.joint_std), 0.5)
    off = np.rad2deg(belief.joint_angles - info["truth"]["joint_angles"])
    assert 0.25 < off.std() < 0.8
    for change in ({"task": "map"}, {"observation": ("occupancy",)}):
        with pytest.raises(ValueError, match="filtered must be true where there is a map"):
            TrainingWorld(**{"filtered": False, "observation": ("contacts",), **change})
    with pytest.raises(ValueError, match="filtered must be"):
        TrainingWorld(filtered=1)


def as_seed(finished: Path, folder: Path, seed: int, better: float) -> Path:
    """The same run, as if another seed had come to other rewards."""
    shutil.copytree(finished, folder)
    told = json.loads((folder / "training.json").read_text())
    (folder / "training.json").write_text(json.dumps(told | {"seed": seed}))
    with np.load(folder / "evaluations.npz") as kept:
        table = dict(kept)
    np.savez(folder / "evaluations.npz", **table | {"results": table["results"] + better})
    return folder


def test_runs_of_several_seeds_are_held_against_each_other(finished, tmp_path):
    runs = [as_seed(finished, tmp_path / str(seed), seed, better) for seed, better in enumerate((0.0, 0.5, 0.7))]
    table = several_runs.compare(runs, tmp_path / "out")
    assert (tmp_path / "out" / "runs.png").stat().st_size > 5000
    pd.testing.assert_frame_equal(pd.read_csv(tmp_path / "out" / "runs.csv").astype({"seed": "Int64"}), table)
    with np.load(finished / "evaluations.npz") as kept:
        rewards, decisions = kept["results"].mean(axis=1), kept["timesteps"]
    mine = table[table["measure"] == "reward"]
    of_all = mine[mine["seed"].isna()]
    assert of_all["environment_steps"].tolist() == (2 * decisions).tolist()
    np.testing.assert_allclose(of_all["value"], rewards + 0.4)
    half = 4.302653 * np.std((0.0, 0.5, 0.7), ddof=1) / np.sqrt(3)  # Student's t of two degrees of freedom
    np.testing.assert_allclose(of_all["high"] - of_all["value"], half, rtol=1e-6)
    np.testing.assert_allclose(mine[mine["seed"] == 1]["value"], rewards + 0.5)
    seconds = table[(table["measure"] == "median_seconds") & (table["seed"] == 2)]["value"]
    assert seconds.between(0.04, 0.3).all(), "a decision at least, and no longer than an exploration"


def test_runs_that_are_not_of_one_preset_are_not_compared(finished, tmp_path):
    first, second = (as_seed(finished, tmp_path / str(seed), seed, 0.0) for seed in range(2))
    with pytest.raises(ValueError, match="two runs or more, got 1"):
        several_runs.compare([first], tmp_path / "out")
    for odd in (str(first), [5, 6], None):
        with pytest.raises(ValueError, match="folders must be a list of the folders of two runs or more, got"):
            several_runs.compare(odd, tmp_path / "out")
    with pytest.raises(ValueError, match="a seed each, got 0, 0"):
        several_runs.compare([first, first], tmp_path / "out")
    with pytest.raises(ValueError, match="nothing holds no run of training that has ended"):
        several_runs.compare([first, tmp_path / "nothing"], tmp_path / "out")
    told = json.loads((second / "training.json").read_text())
    (second / "training.json").write_text(json.dumps(told | {"learner": {**told["learner"], "step": 0.3}}))
    with pytest.raises(ValueError, match="1 has another learner"):
        several_runs.compare([first, second], tmp_path / "out")
    assert not (tmp_path / "out").exists()
