"""What observers believe is what is so, unless a command says otherwise."""

from __future__ import annotations

import json
import re
from pathlib import Path
from typing import Any

import gymnasium as gym
import numpy as np
import pytest

from haptic_env import hand_of, hands
from haptic_lab.believed import BELIEVED, TOLD, UNKNOWN, Believed
from haptic_lab.commands import explore, train
from haptic_lab.conditions import DEFAULTS, Condition
from haptic_lab.exploration.run import begin, make_trial
from haptic_lab.learning import presets
from haptic_lab.learning.environments import make_env
from haptic_lab.learning.presets import TrainingWorld
from haptic_lab.sweeps import options, rows, tasks, worker
from haptic_lab.trial import make_observers
from observer import HapticSLAM
from observer.pose import noise_presets
from observer.pose.noise_presets import NOISES

SO = {"sigma_deg": 3.0, **DEFAULTS, "bias_deg": 2.0, "drift_deg": 1.0}
GIVEN: dict[str, Any] = {
    "sigma_deg": 4.0,
    "bias_deg": 5.0,
    "drift_deg": 0.5,
    "drift_seconds": 7.0,
    "proportional": 0.2,
    "motor_noise": 0.3,
    "start_std_deg": 1.5,
    "contact_miss": 0.2,
    "contact_false_alarm": 0.01,
    "contact_confusion": 0.3,
    "patches_stuck": 0.02,
    "patches_dead": (3, "index_distal_tip"),
}


def test_by_default_all_that_is_so_is_believed() -> None:
    assert Believed().told(SO) == {name: SO[name] for name in TOLD}


@pytest.mark.parametrize("name", GIVEN)
def test_each_may_be_believed_to_be_something_else(name: str) -> None:
    given = ",".join(map(str, GIVEN[name])) if isinstance(GIVEN[name], tuple) else GIVEN[name]
    told = Believed(**{f"believed_{name}": given}).told(SO)
    assert told == {**Believed().told(SO), name: GIVEN[name]}


def test_sigma_may_be_unknown() -> None:
    assert Believed(believed_sigma_deg=UNKNOWN).told(SO)["sigma_deg"] is None


@pytest.mark.parametrize("name", NOISES)
def test_a_preset_is_all_of_the_felt_angles_and_single_flags_win_over_it(name: str) -> None:
    told = Believed(believed=name).told(SO)
    assert told == {**Believed().told(SO), "start_std_deg": 0.0, "drift_deg": 0.0, **NOISES[name]}
    assert Believed(believed=name, believed_bias_deg=0.5).told(SO) == {**told, "bias_deg": 0.5}


def test_a_preset_is_of_each_joint_where_the_hand_is_known(tmp_path: Path) -> None:
    wanted = noise_presets.of("human", hands.make("adroit"))
    given = ["--hand", "adroit", "--shape", "cube", "--particles", "2", "--believed", "human", "--out", str(tmp_path)]
    settings, recording = explore.parse(given)
    trial = make_trial(settings, begin(settings, recording))
    task = task_of({"policy": "enclosure"}, env="HapticSLAM/AdroitHand-v0", believed="human")
    swept = worker.make_trial(task, naming=False)
    guide = swept.env.get_wrapper_attr("observer")
    small: dict[str, Any] = {"seconds": 0.1, "observation": ("time",), "variants": 2, "samples": 1}
    learning = make_env(TrainingWorld(env="HapticSLAM/AdroitHand-v0", believed="human", **small))
    observers: list[Any] = [each.observer_runs["haptic_slam"].observer for each in (trial, swept)]
    for each in (*observers, guide, learning.get_wrapper_attr("observer")):
        for error, name in zip(each.pose.noise.lasting, ("bias_deg", "drift_deg"), strict=True):
            np.testing.assert_allclose(np.rad2deg(error.sd), wanted[name])
    for each in (trial.env, swept.env, learning):
        each.close()


@pytest.mark.parametrize("name", NOISES)
def test_a_preset_is_of_observer_and_environment(name: str) -> None:
    env = gym.make("HapticSLAM/TwoFinger-v0", shape="cube", **NOISES[name])
    slam = HapticSLAM(hand_of(env), particles=1, **NOISES[name])
    observation, _ = env.reset(seed=0)
    belief = slam.reset(seed=0, joint_angles=observation["joint_angles"])
    assert (belief.joint_offset_std > 0).all()


@pytest.mark.parametrize(
    ("name", "value", "told"),
    [
        ("believed", "robot", "unknown --believed 'robot'; choose from human, uncalibrated_glove"),
        ("believed_sigma_deg", "found", "--believed-sigma-deg must be a number or 'unknown', got 'found'"),
        ("believed_sigma_deg", -1.0, "--believed-sigma-deg must be a finite number in [0, 90] degrees, got -1"),
        ("believed_bias_deg", float("nan"), "--believed-bias-deg must be a finite number in [0, 90] degrees, got nan"),
        ("believed_drift_deg", 91.0, "--believed-drift-deg must be a finite number in [0, 90] degrees, got 91"),
        ("believed_drift_seconds", 0.0, "--believed-drift-seconds must be a finite number in (0, 1e+09] s, got 0"),
        ("believed_proportional", 2.0, "--believed-proportional must be a finite number in [0, 1], got 2"),
        ("believed_motor_noise", -0.1, "--believed-motor-noise must be a finite number in [0, 1], got -0.1"),
        ("believed_start_std_deg", -1.0, "--believed-start-std-deg must be a finite number in [0, 90] degrees, got -1"),
        ("believed_contact_miss", 1.5, "--believed-contact-miss must be a finite number in [0, 1], got 1.5"),
        ("believed_contact_false_alarm", -0.5, "--believed-contact-false-alarm must be a finite number in [0, 1], got"),
        ("believed_contact_confusion", 2.0, "--believed-contact-confusion must be a finite number in [0, 1], got 2"),
        ("believed_patches_stuck", 3.0, "--believed-patches-stuck must be a finite number in [0, 1], got 3"),
        ("believed_patches_dead", float("nan"), "--believed-patches-dead must be a finite number in [0, 1], got nan"),
    ],
)
def test_what_nobody_can_believe_is_refused_wherever_it_is_said(
    name: str, value: Any, told: str, tmp_path: Path, capsys: pytest.CaptureFixture
) -> None:
    with pytest.raises(ValueError, match=re.escape(told)):
        Believed(**{name: value}).check_believed()
    flags = [f"--{name.replace('_', '-')}={value}", "--out", str(tmp_path / "out")]
    for parse in (explore.parse, lambda arguments: options.check(None, arguments)):
        with pytest.raises(SystemExit) as ended:
            parse(flags)
        error = capsys.readouterr().err
        assert ended.value.code == 2
        assert error.count("\n") == 1
        assert told.replace("'unknown'", "unknown").partition(" must")[0] in error.replace("argument ", "")
        assert repr(value).strip("'") in error
    with pytest.raises(ValueError, match=name):
        TrainingWorld(**{name: value})


def task_of(condition: dict[str, Any], **changed: Any) -> tasks.SweepTask:
    given: dict[str, Any] = {"env": "HapticSLAM/TwoFinger-v0", "particles": 2, "shapes": ("cube",), "exemplars": 1}
    given |= {"observers": ("floor", "white", "haptic_slam", "ceiling"), "first_seed": 0, "classifiers": ()}
    noise = Condition(**{"sigma_deg": 2.0, "seconds": 0.2, **condition})
    return tasks.SweepTask(tasks.SweepSettings(**given | changed), noise, "cube", 3)


def test_in_a_sweep_each_observer_believes_what_it_should() -> None:
    task = task_of({"bias_deg": 3.0, "drift_deg": 1.0, "motor_noise": 0.2})
    _, traces = worker.explore([task], naming=False)
    found = {name: np.rad2deg(trace.joint_offset_std[-1]) for name, trace in traces[task].items()}
    assert not found["white"].any()
    assert not found["ceiling"].any()
    np.testing.assert_allclose(found["floor"], np.hypot(3.0, 1.0))
    assert (found["haptic_slam"] > 0).all()
    assert (found["haptic_slam"] < np.hypot(3.0, 1.0)).all()
    assert not traces[task]["ceiling"].joint_std.any()


@pytest.mark.parametrize("policy", ["enclosure"])
def test_a_guide_believes_what_observers_do(policy: str) -> None:
    trial = worker.make_trial(task_of({"bias_deg": 3.0, "policy": policy}), naming=False)
    guide = trial.env.get_wrapper_attr("observer")
    np.testing.assert_allclose(np.rad2deg(guide.pose.noise.sd), 3.0)


@pytest.mark.parametrize("name", ["bias_deg", "drift_deg", "proportional", "sigma_deg", "start_std_deg"])
def test_what_a_sweep_is_told_to_believe_reaches_its_observers(name: str) -> None:
    usual, other = task_of({}), task_of({}, **{f"believed_{name}": GIVEN[name]})
    (first, told), (second, misled) = (worker.explore([task], naming=False) for task in (usual, other))
    np.testing.assert_array_equal(first.felt_angles, second.felt_angles)
    assert (told[usual]["haptic_slam"].joint_std != misled[other]["haptic_slam"].joint_std).any()


def test_where_sigma_alone_is_so_beliefs_are_those_of_an_observer_that_is_told_nothing_else() -> None:
    task = task_of({})
    exploration, traces = worker.explore([task], naming=False)
    for name in ("floor", "white", "haptic_slam"):
        (slam,) = make_observers((name,), exploration.hand, 2.0, 2).values()
        slam.reset(0, exploration.start.felt_angles)
        steps = zip(exploration.torques, exploration.felt_angles, exploration.contacts, strict=True)
        means = np.array([slam.step(*each).joint_angles for each in steps])
        np.testing.assert_array_equal(traces[task][name].joint_angles, means)


def test_a_table_tells_what_was_believed_only_where_it_is_not_what_is_so() -> None:
    usual, other = task_of({}), task_of({}, believed="human", believed_sigma_deg=UNKNOWN, believed_bias_deg=1.5)
    before, after = (rows.columns(task.settings)[0] for task in (usual, other))
    assert not {*BELIEVED} & {*before}
    assert {*after} - {*before} == {"believed", "believed_sigma_deg", "believed_bias_deg"}
    kept = rows.constants(other.settings)
    assert [kept[name] for name in ("believed", "believed_sigma_deg", "believed_bias_deg")] == ["human", UNKNOWN, "1.5"]


def test_a_folder_from_before_there_were_beliefs_goes_on_and_another_belief_is_told(
    tmp_path: Path, capsys: pytest.CaptureFixture
) -> None:
    given = ["--shapes", "cube", "--observers", "floor", "--classifiers", "--out", str(tmp_path)]
    options.parse(None, given)
    config = json.loads((tmp_path / "config.json").read_text())
    assert BELIEVED[0] in config
    (tmp_path / "config.json").write_text(json.dumps({k: v for k, v in config.items() if k not in BELIEVED}))
    options.parse(None, given)
    with pytest.raises(SystemExit):
        options.parse(None, [*given, "--believed-bias-deg", "3"])
    assert "believed_bias_deg is absent there and 3.0 here" in capsys.readouterr().err


def test_a_file_says_it_too(tmp_path: Path, capsys: pytest.CaptureFixture) -> None:
    file = tmp_path / "sweep.toml"
    for text, found in (("2", 2.0), ("'unknown'", UNKNOWN), ("2.5", 2.5)):
        file.write_text(f"believed_sigma_deg = {text}\nbelieved = 'human'")
        settings = options.check(None, ["--config", str(file)]).settings
        assert (settings.believed, settings.believed_sigma_deg) == ("human", found)
    for text, told in (
        ("believed_sigma_deg = 'found'", "believed_sigma_deg must be a number or 'unknown', got 'found'"),
        ("believed_sigma_deg = true", "believed_sigma_deg must be a number or 'unknown', got True"),
        ("believed_bias_deg = -1", "believed_bias_deg must be a finite number in [0, 90] degrees, got -1"),
        ("believed = 'human'\nbelieved_sigma = 2", "believed_sigma multiplies what is so: not with believed or"),
    ):
        file.write_text(text)
        with pytest.raises(SystemExit):
            options.check(None, ["--config", str(file)])
        assert told in capsys.readouterr().err


def test_explore_tells_its_observers(tmp_path: Path) -> None:
    flags = ["--bias-deg", "3", "--believed-drift-deg", "2", "--believed-sigma-deg", UNKNOWN, "--out", str(tmp_path)]
    settings, recording = explore.parse([*flags, "--shape", "cube", "--particles", "2", "--policy", "enclosure"])
    session = begin(settings, recording)
    trial = make_trial(settings, session)
    guide = trial.env.get_wrapper_attr("observer")
    for each in (trial.observer_runs["haptic_slam"].observer, guide):
        assert each.pose.noise.finds_sigma
        np.testing.assert_allclose(np.rad2deg([noise.sd for noise in each.pose.noise.lasting]), [3.0, 2.0])
    trial.env.close()


@pytest.mark.parametrize("observation", [("time",), ("occupancy",)])
def test_a_learner_s_observer_believes_what_is_so_or_what_it_is_told(observation: tuple[str, ...]) -> None:
    small: dict[str, Any] = {"seconds": 0.1, "observation": observation, "variants": 2, "samples": 1}
    env = make_env(TrainingWorld(**small, bias_deg=3.0, sigma_deg=(2.0, 2.0)))
    env.reset(seed=0)
    pose = env.get_wrapper_attr("observer").pose
    np.testing.assert_allclose(np.rad2deg([pose.noise.sd, pose.sigma]), [3.0, 2.0])
    assert np.abs(env.unwrapped.felt_angles.offset).min() > 0
    env = make_env(TrainingWorld(**small, bias_deg=3.0, believed_bias_deg=0.0, believed_sigma_deg=5.0))
    env.reset(seed=0)
    pose = env.get_wrapper_attr("observer").pose
    np.testing.assert_allclose(np.rad2deg([pose.noise.sd, pose.sigma]), [0.0, 5.0])


def test_a_training_run_from_before_goes_on_and_one_of_other_noise_is_refused(tmp_path: Path) -> None:
    usual = presets.read("trained")
    kept = presets.configuration(usual)
    assert not {*DEFAULTS, *BELIEVED} & {*kept["world"]}
    (tmp_path / "config.json").write_text(json.dumps(kept))
    train.check_configuration(tmp_path / "config.json", usual)
    text = (presets.FOLDER / "trained.toml").read_text().replace("[world]", "[world]\nbias_deg = 3")
    (tmp_path / "biased.toml").write_text(text)
    biased = presets.read(str(tmp_path / "biased.toml"))
    assert biased.world.bias_deg == 3
    with pytest.raises(SystemExit):
        train.check_configuration(tmp_path / "config.json", biased)


def test_all_noise_of_felt_angles_and_torques_is_told() -> None:
    assert {*GIVEN} - {"start_std_deg"} <= {*TOLD}
    assert [f"believed_{name}" for name in GIVEN] == [*BELIEVED[1:]], "each is tried above"
