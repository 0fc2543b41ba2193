"""Policies side by side: how soon the object is known."""

from __future__ import annotations

from pathlib import Path

import gymnasium as gym
import numpy as np
import pandas as pd
import pytest
from scipy import stats

import agents
import haptic_env  # noqa: F401 - registers the environments
from agents.sb3 import FOLDER
from haptic_lab.analysis import policy_comparison, statistics
from haptic_lab.commands import evaluate
from haptic_lab.conditions import FACTORS, Condition
from haptic_lab.trial import GUIDE, Trial, guided, make_observers
from observer import ObserverWrapper, ShapePosterior


@pytest.fixture
def rows() -> pd.DataFrame:
    """Forty trials of two policies; the slow one is decided in half of them."""
    condition = {name: getattr(Condition(sigma_deg=3.0), name) for name in FACTORS}
    told = [
        {
            **condition,
            "policy": policy,
            "shape": "cube",
            "seed": trial,
            "observer": "haptic_slam",
            "time_to_decision": np.nan if policy == "slow" and trial % 2 else 1.0 + 0.1 * trial,
            "step_accuracy_5s": 0.9 if policy == "quick" else 0.3,
            "correct_10s": 1.0,
        }
        for policy in ("slow", "quick")
        for trial in range(40)
    ]
    return pd.DataFrame(told)


def test_a_median_counts_the_undecided_as_late() -> None:
    assert statistics.median(np.array([1.0, 2.0, 3.0, np.inf, np.inf]))[0] == 3.0
    value, low, high, count = statistics.median(np.array([1.0] * 10 + [np.inf] * 30))
    assert (low, count) == (np.inf, 40)
    assert value == high == np.inf


def test_the_interval_of_a_median_holds_it_as_often_as_it_says() -> None:
    rng = np.random.default_rng(0)
    held = [
        low <= np.log(2) <= high
        for _, low, high, _ in (statistics.median(rng.exponential(size=41)) for _ in range(2000))
    ]
    assert 0.945 < np.mean(held) < 0.985
    low, high = statistics.median(np.arange(100.0))[1:3]
    assert stats.binom.cdf(low, 100, 0.5) < 0.025 < stats.binom.cdf(low + 1, 100, 0.5)
    assert low + high == 99.0


def test_the_quick_one_is_known_to_be_quick(rows: pd.DataFrame, tmp_path: Path) -> None:
    assert policy_comparison.save(rows, tmp_path) == ["policies.csv", "policies.png"]
    assert (tmp_path / "policies.png").stat().st_size > 10_000
    lines = pd.read_csv(tmp_path / "policies.csv").set_index(["policy", "measure"])
    assert lines.loc[("quick", "time_to_decision"), "value"] == pytest.approx(2.95)
    assert lines.loc[("slow", "time_to_decision"), "high"] == np.inf
    assert lines.loc[("slow", "time_to_decision"), "decided"] == 0.5
    assert lines.loc[("quick", "step_accuracy_5s"), "value"] == pytest.approx(0.9)
    assert set(lines["trials"]) == {40}


def test_over_several_noises_the_worlds_are_what_is_uncertain(rows: pd.DataFrame) -> None:
    """Explored again at another noise with the same outcome they tell nothing new; one noise alone needs no summary."""
    assert policy_comparison.together(rows).empty
    again = rows.assign(sigma_deg=5.0)
    for measure, column in (
        ("step_accuracy_5s", np.linspace(0, 1, 80)),
        ("time_to_decision", np.arange(80) % 40 + 1.0),
    ):
        rows, again = rows.assign(**{measure: column}), again.assign(**{measure: column})
    lines = policy_comparison.together(pd.concat([rows, again])).set_index(["policy", "measure"])
    slow = np.linspace(0, 1, 80)[:40]
    cell = lines.loc[("slow", "step_accuracy_5s")]
    assert cell["value"] == pytest.approx(slow.mean())
    assert cell["high"] - cell["low"] == pytest.approx(2 * 1.96 * slow.std() / np.sqrt(40), rel=0.1)
    assert cell["trials"] == 80
    assert lines.loc[("quick", "time_to_decision"), "value"] == 20.5
    missing = policy_comparison.together(pd.concat([rows, again[again["seed"] < 30]])).set_index(["policy", "measure"])
    assert set(missing["trials"]) == {60}, "only worlds that were explored at each noise"


def test_a_policy_without_a_trial_at_one_noise_is_left_out_there(rows: pd.DataFrame, tmp_path: Path) -> None:
    more = rows[rows["policy"] == "quick"].assign(sigma_deg=5.0)
    policy_comparison.save(pd.concat([rows, more]), tmp_path)
    lines = pd.read_csv(tmp_path / "policies.csv")
    assert set(lines[lines["sigma_deg"] == 5.0]["policy"]) == {"quick"}


class _Breaking(agents.Policy):
    """Commands nothing, then what no motor can do."""

    def predict(self, observation, state=None, episode_start=None, deterministic=False):
        step = 0 if state is None else int(state[0])
        return np.full(self.joints, 0.0 if step < 3 else np.inf, np.float32), (np.array(step + 1),)


def test_what_no_motor_can_do_stops_the_episode_with_the_policys_name(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(agents.POLICIES, "breaking", _Breaking)
    env = gym.make("HapticSLAM/TwoFinger-v0", reveal_truth=True)
    trial = Trial(env, "breaking", {}, ShapePosterior(env.unwrapped.hand), seed=0)
    steps = []
    with pytest.raises(ValueError, match="policy 'breaking' commands torques that are not finite"):
        steps.extend(trial)
    assert steps == [1, 2, 3]


def test_only_policies_that_ask_have_an_observer_of_their_own() -> None:
    env = gym.make("HapticSLAM/TwoFinger-v0")
    shape = ShapePosterior(env.unwrapped.hand)
    assert guided(env, "random_torque", 3.0, shape) is env
    followed = guided(env, "enclosure", 3.0, shape)
    asked = guided(env, "information_gain", 3.0, shape)
    assert isinstance(followed, ObserverWrapper)
    assert followed.shape is None
    assert isinstance(asked, ObserverWrapper)
    assert asked.shape is not shape


@pytest.mark.parametrize(("name", "beliefs", "names"), [("trained", 1, 1), ("searched", 1, 0), ("reflexes", 0, 0)])
def test_a_model_is_given_what_it_was_shown_by_its_name_and_as_a_file(name: str, beliefs: bool, names: bool) -> None:
    env = gym.make("HapticSLAM/TwoFinger-v0")
    shape = ShapePosterior(env.unwrapped.hand, variants=8)
    for policy in (name, str(FOLDER / f"{name}.npz")):
        given = guided(env, policy, 3.0, shape)
        assert isinstance(given, ObserverWrapper) == beliefs
        assert (beliefs and given.shape is not None) == names
        observation, _ = given.reset(seed=0)
        assert np.isfinite(agents.act(agents.make(policy, given), observation)[0]).all()


def test_an_exploration_does_not_depend_on_who_watches_it() -> None:
    torques = []
    for names in ((GUIDE,), ("floor", GUIDE)):
        env = gym.make("HapticSLAM/TwoFinger-v0", shape="cube", reveal_truth=True, episode_seconds=0.5)
        hand = env.unwrapped.hand
        shape = ShapePosterior(hand)
        trial = Trial(
            guided(env, "information_gain", 3.0, shape),
            "information_gain",
            make_observers(names, hand, 3.0, 1),
            shape,
            5,
        )
        for _ in trial:
            pass
        torques.append(trial.finish()[0].torques)
    np.testing.assert_array_equal(*torques)


@pytest.mark.usefixtures("serially")
def test_a_sweep_of_several_policies_compares_them(tmp_path: Path, capsys: pytest.CaptureFixture) -> None:
    tiny = ["--shapes", "cube", "sphere", "--sigmas", "3", "--trials", "1", "--seconds", "0.2", "--jobs", "1"]
    tiny += ["--observers", "floor", "--classifiers"]
    several = ["--bias-deg", "0", "4", "--policy", "random_torque", "enclosure", "--out", str(tmp_path)]
    assert evaluate.main([*tiny, *several]) == 0
    rows = pd.read_csv(tmp_path / "trials.csv")
    assert rows.groupby("policy").size().to_dict() == {"enclosure": 4, "random_torque": 4}
    for part in ("bias_deg=0.0", "bias_deg=4.0"):
        lines = pd.read_csv(tmp_path / part / "policies.csv")
        assert set(lines["policy"]) == {"enclosure", "random_torque"}
        assert (tmp_path / part / "policies.png").exists()
    assert "Policies, judged by floor" in capsys.readouterr().out
