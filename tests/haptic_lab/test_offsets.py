"""What an exploration finds of the offsets of felt angles is told, drawn and kept."""

from __future__ import annotations

import json
import re
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
import pytest
from matplotlib.figure import Figure

from haptic_env import recordings
from haptic_lab.commands import explore
from haptic_lab.conditions import FACTORS, Condition
from haptic_lab.exploration import offsets
from haptic_lab.figures import offsets as figure
from haptic_lab.files import UNFINISHED
from tests.haptic_env.movements import closing

pytestmark = pytest.mark.usefixtures("coarse")
SHORT = ["--shape", "cube", "--seconds", "1.5", "--particles", "2", "--seed", "3", "--sigma", "1"]


@pytest.fixture(scope="module")
def biased(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The folder of an exploration with offsets, which are kept."""
    folder = tmp_path_factory.mktemp("biased")
    save = ["--save-offsets", str(folder / "offsets.toml")]
    noise = ["--bias-deg", "4", "--believed-proportional", "0.02"]
    assert explore.main([*SHORT, *noise, "--out", str(folder), *save]) == 0
    return folder


def test_offsets_are_found_and_told_beside_the_truth(biased: Path) -> None:
    summary = json.loads((biased / "explore.json").read_text())
    assert summary["settings"]["bias_deg"] == 4.0
    found = pd.DataFrame(summary["joint_offset"]).T
    assert (found["std_degrees"] > 0).all()
    assert np.abs(found["degrees"] - found["true_degrees"]).mean() < 0.5 * found["true_degrees"].abs().mean()
    with np.load(biased / "explore.npz") as trace:
        assert trace["joint_offset"].shape == trace["joint_offset_std"].shape == trace["joint_angles"].shape
        np.testing.assert_allclose(np.rad2deg(trace["joint_offset"][-1]), found["degrees"])
        np.testing.assert_allclose(np.rad2deg(trace["joint_offset_std"][-1]), found["std_degrees"])
        error = trace["felt_angles"] - trace["true_angles"]
        np.testing.assert_allclose(np.rad2deg(error.mean(axis=0)), found["true_degrees"].astype(float), atol=0.6)


def test_what_was_saved_is_a_calibration_that_takes_the_offsets_away(biased: Path) -> None:
    calibration = recordings.read_calibration(biased / "offsets.toml")
    with np.load(biased / "explore.npz") as trace:
        felt, offset, true = (trace[name] for name in ("felt_angles", "joint_offset", "true_angles"))
    mended = calibration.joint_angles(felt)
    np.testing.assert_allclose(mended, felt - offset[-1], atol=np.deg2rad(1e-4))
    assert np.abs((mended - true).mean(axis=0)).mean() < 0.5 * np.abs((felt - true).mean(axis=0)).mean()
    assert not list(biased.glob(f"{UNFINISHED}*"))


def test_a_recording_of_it_finds_the_same_and_knows_no_truth(
    biased: Path, tmp_path: Path, capsys: pytest.CaptureFixture
) -> None:
    arguments = ["--recording", str(biased / "recording.npz"), "--out", str(tmp_path)]
    assert explore.main(arguments) == 0
    told = capsys.readouterr().out
    assert "Offsets of felt angles" in told
    assert "in truth │" not in told
    with np.load(biased / "explore.npz") as first, np.load(tmp_path / "explore.npz") as second:
        for name in first.files:
            assert first[name].tobytes() == second[name].tobytes(), name
    assert explore.main([*arguments, "--believed-bias-deg", "0"]) == 0
    assert "Offsets of felt angles" not in capsys.readouterr().out
    assert "joint_offset" not in json.loads((tmp_path / "explore.json").read_text())


@pytest.mark.parametrize(
    ("flags", "told"),
    [
        (["--save-offsets", "a.toml"], "--save-offsets needs an observer that believes in offsets"),
        (["--save-offsets", "a.toml", "--bias-deg", "3", "--believed-bias-deg", "0"], "that believes in offsets"),
        (
            ["--save-offsets", "a.csv", "--bias-deg", "3"],
            "--save-offsets must be the path of a .toml file, got 'a.csv'",
        ),
        (["--save-offsets", "no/a.toml", "--bias-deg", "3"], "a folder that can be written to, got 'no/a.toml'"),
        (["--save-offsets", "/proc/a.toml", "--bias-deg", "3"], "a folder that can be written to, got '/proc/a.toml'"),
        (["--save-offsets", "a" * 300 + ".toml", "--bias-deg", "3"], "--save-offsets cannot be written: "),
        (["--save-offsets", "/", "--bias-deg", "3"], "--save-offsets must be the path of a .toml file, got '/'"),
        (["--save-offsets", "a.toml", "--bias-deg", "1e-200"], "--save-offsets needs an observer that believes in"),
        (
            ["--save-offsets", "a.toml", "--believed-drift-deg", "9e-5"],
            "--save-offsets needs an observer that believes",
        ),
        (["--bias-deg", "-3"], "bias_deg must be a finite number in [0, 90] degrees, got -3"),
        (["--drift-seconds", "0"], "drift_seconds must be a finite number in (0, 1e+09] s, got 0"),
        (["--contact-miss", "2"], "contact_miss must be a finite number in [0, 1], got 2"),
    ],
)
def test_what_cannot_be_is_one_clear_line_and_leaves_nothing(
    flags: list[str], told: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture
) -> None:
    monkeypatch.chdir(tmp_path)
    with pytest.raises(SystemExit) as ended:
        explore.main([*SHORT, *flags])
    error = capsys.readouterr().err
    assert ended.value.code == 2
    assert told in error
    assert error.count("\n") == 1
    assert not list(tmp_path.iterdir())


def test_the_least_offsets_that_can_be_told_are_kept(tmp_path: Path) -> None:
    least = ["--bias-deg", str(offsets.LEAST), "--save-offsets", str(tmp_path / "a.toml"), "--out", str(tmp_path)]
    assert explore.main([*SHORT, *least]) == 0
    assert recordings.read_calibration(tmp_path / "a.toml")


def test_a_preset_takes_the_place_of_all_that_was_believed(biased: Path) -> None:
    replayed = ["--recording", str(biased / "recording.npz")]
    before, recording = explore.parse(replayed)
    assert recording is not None
    assert before.believed_proportional == 0.02
    after, _ = explore.parse([*replayed, "--believed", "human", "--believed-drift-deg", "1"])
    assert after.believed_noise["proportional"] == 0.0
    assert after.believed_noise["drift_deg"] == 1.0
    assert after.bias_deg == before.bias_deg == 4.0, "what was so stays so"


def test_noise_is_not_added_to_what_was_felt(biased: Path, tmp_path: Path, capsys: pytest.CaptureFixture) -> None:
    with pytest.raises(SystemExit):
        explore.main(["--recording", str(biased / "recording.npz"), "--drift-deg", "1", "--out", str(tmp_path)])
    assert "--drift-deg is for angles and contacts that are simulated, and this recording" in capsys.readouterr().err


def test_of_a_hand_without_torques_no_offset_is_found(tmp_path: Path, capsys: pytest.CaptureFixture) -> None:
    recordings.write(tmp_path / "captured.npz", closing())
    captured = ["--recording", str(tmp_path / "captured.npz"), "--shape", "cube", "--particles", "2"]
    captured += ["--bias-deg", "3", "--out", str(tmp_path / "out")]
    assert explore.main([*captured, "--save-offsets", str(tmp_path / "a.toml")]) == 2
    assert "--save-offsets: a recording without torques and what was felt tells nothing" in capsys.readouterr().err
    assert not (tmp_path / "a.toml").exists()
    assert explore.main(captured) == 0
    assert "Offsets of felt angles: nothing tells of them here" in capsys.readouterr().out
    found = pd.DataFrame(json.loads((tmp_path / "out" / "explore.json").read_text())["joint_offset"]).T
    assert not found["degrees"].any()
    np.testing.assert_allclose(found["std_degrees"].astype(float), 3.0)
    assert found["true_degrees"].abs().min() > 0


@pytest.mark.parametrize("count", [1, 8, 24])
@pytest.mark.parametrize("known", [True, False])
def test_the_panel_has_each_joint(count: int, known: bool) -> None:
    some: dict[str, Any] = {
        f"joint {k}": {"degrees": 0.1 * k, "std_degrees": 0.2, "true_degrees": 0.1 if known else None}
        for k in range(count)
    }
    axes = Figure().subplots()
    offsets.draw(axes, some)
    assert [each.get_text() for each in axes.get_yticklabels()] == list(some)
    assert len(axes.get_legend().get_texts()) == 1 + known
    assert len(offsets.table(some).columns) == 3 + known


# The figure


def test_bias_and_drift_are_explored_each_by_itself_and_their_absence_once() -> None:
    usual = Condition(sigma_deg=9.0, seconds=2.0, bias_deg=7.0)
    found = figure.conditions(usual, (1.0, 3.0), (0.0, 3.0, 5.0))
    told = [(each.sigma_deg, each.bias_deg, each.drift_deg) for each in found]
    assert len(set(told)) == len(told) == 2 * 5
    assert {each[1:] for each in told} == {(0, 0), (3, 0), (5, 0), (0, 3), (0, 5)}
    assert {each.seconds for each in found} == {2.0}
    with pytest.raises(ValueError, match=re.escape("bias_deg must be a finite number in [0, 90] degrees, got 91")):
        figure.conditions(usual, (1.0,), (91.0,))


def table(kinds: tuple[str, ...]) -> pd.DataFrame:
    """Trials whose measures tell which they are."""
    rows = []
    usual = {**dict.fromkeys(FACTORS, 0.0), "policy": "random_torque", "seconds": 1.0, "drift_seconds": 10.0}
    for kind in kinds:
        for amount in (0.0, 3.0):
            if amount == 0 and kind != kinds[0]:
                continue
            for sigma in (1.0, 3.0):
                for nth, observer in enumerate(figure.OBSERVERS):
                    value = 0.1 * nth + 0.01 * amount + (0.001 if kind == "drift_deg" else 0.0)
                    told = {**usual, kind: amount, "sigma_deg": sigma, "observer": observer, "shape": "cube"}
                    rows += [{**told, **dict.fromkeys(figure.MEASURES, value), "seed": seed} for seed in range(2)]
    return pd.DataFrame(rows).assign(shape_posterior_correct=1.0)


@pytest.mark.parametrize("kinds", [("bias_deg",), ("drift_deg",), ("bias_deg", "drift_deg")])
def test_means_are_those_of_the_trials(kinds: tuple[str, ...]) -> None:
    rows = table(kinds)
    drawn = figure.draw(rows)
    assert len(drawn.figure.axes) == 4 * len(kinds)
    titles = [axes.get_title() for axes in drawn.figure.axes]
    assert titles == [title for title, *_ in figure.MEASURES.values()] + [""] * 4 * (len(kinds) - 1)
    assert set(drawn.data["kind"]) == set(kinds)
    for kind in kinds:
        mine = drawn.data[drawn.data["kind"] == kind]
        assert set(mine["amount"]) == {0.0, 3.0}, "what has none of both is in both rows"
        for _, line in mine[mine["measure"] == "pose_error_lagged_deg"].iterrows():
            same = rows[(rows["observer"] == line["observer"]) & (rows["sigma_deg"] == line["sigma_deg"])]
            other = next(each for each in figure.KINDS if each != kind)
            same = same[(same[kind] == line["amount"]) & (same[other] == 0)]
            assert line["mean"] == pytest.approx(same["pose_error_lagged_deg"].mean())
            assert line["trials"] == 2


def test_a_drift_that_is_worse_than_any_bias_is_seen_whole() -> None:
    rows = table(("bias_deg", "drift_deg"))
    rows.loc[rows["drift_deg"] > 0, "pose_error_lagged_deg"] += 5.0
    axes = figure.draw(rows).figure.axes[4]
    assert max(line.get_ydata().max() for line in axes.lines) > 5.0
    assert axes.get_ylim()[0] == 0.0
    assert all(line.get_ydata().max() <= axes.get_ylim()[1] for line in axes.lines)


def test_trials_of_one_noise_are_refused() -> None:
    rows = table(("bias_deg",))
    with pytest.raises(ValueError, match="trials with several of bias_deg or drift_deg, and these have one"):
        figure.draw(rows[rows["bias_deg"] == 0])


def test_the_folder_that_is_made_yet_may_be_said_in_two_ways(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    offsets.check(str(tmp_path / "new" / "a.toml"), "new", {"bias_deg": 3.0})
    with pytest.raises(ValueError, match="in a folder that can be written to"):
        offsets.check(str(tmp_path / "other" / "a.toml"), "new", {"bias_deg": 3.0})
