"""What an exploration finds of patches that lie is told, drawn and kept."""

from __future__ import annotations

import json
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from matplotlib.figure import Figure
from rich.console import Console

from haptic_env import hands, reading, recordings
from haptic_lab.commands import explore
from haptic_lab.exploration import patches
from observer import HapticSLAM

pytestmark = pytest.mark.usefixtures("coarse")
STUCK, TIP = 21, "thumb_distal_tip"
SHORT = ["--shape", "cube", "--seconds", "1.5", "--particles", "2", "--seed", "3", "--sigma", "1"]
LYING = ["--patches-stuck", f"{STUCK},", "--patches-dead", TIP, "--contact-false-alarm", "0.01", "--bias-deg", "2"]
TOLD = ["--believed-patches-stuck", "0.002", "--believed-patches-dead", "0.002"]
NAMES = hands.make("two_finger").patches.names


@pytest.fixture(scope="module")
def explored(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The folder of an exploration with patches that lie."""
    folder = tmp_path_factory.mktemp("lying")
    save = ["--save-offsets", str(folder / "offsets.toml")]
    assert explore.main([*SHORT, *LYING, *TOLD, "--out", str(folder), *save]) == 0
    return folder


def test_what_is_found_stands_beside_the_truth(explored: Path) -> None:
    told = json.loads((explored / "explore.json").read_text())["patches"]
    assert tuple(told) == NAMES
    stuck = told[NAMES[STUCK]]
    assert stuck["believed"] == stuck["in_truth"] == "stuck"
    assert stuck["reliability"] < 0.01
    assert stuck["contacts"] == 75
    assert stuck["false_alarms"] > 60
    assert (told[TIP]["in_truth"], told[TIP]["contacts"]) == ("dead", 0)
    assert all(each["believed"] == "works" for name, each in told.items() if name != NAMES[STUCK])
    with np.load(explored / "explore.npz") as trace:
        assert tuple(trace["patches"]) == NAMES
        np.testing.assert_array_equal(trace["patch_reliability"][-1], [each["reliability"] for each in told.values()])
        reported, touched = trace["contacts"], trace["touched"]
        assert touched.shape == reported.shape == trace["patch_reliability"].shape
        for name, lied in (("false_alarms", reported & ~touched), ("misses", touched & ~reported)):
            assert lied.sum(axis=0).tolist() == [each[name] for each in told.values()]


def test_it_is_kept_with_the_offsets_in_words_that_flags_take(explored: Path) -> None:
    assert recordings.read_calibration(explored / "offsets.toml").joint_names
    kept = reading.toml(explored / "offsets.toml")["patches"]
    assert (kept["stuck"], kept["dead"]) == ([NAMES[STUCK]], [])
    assert tuple(kept["reliability"]) == NAMES
    flag = ["--believed-patches-stuck", ",".join(kept["stuck"])]
    settings, _ = explore.parse([*SHORT, *flag])
    assert settings.believed_noise["patches_stuck"] == (NAMES[STUCK],)


def test_a_recording_of_it_finds_the_same_and_knows_no_truth(
    explored: Path, tmp_path: Path, capsys: pytest.CaptureFixture
) -> None:
    again = ["--recording", str(explored / "recording.npz"), "--out", str(tmp_path)]
    assert explore.main(again) == 0
    assert "Patches that lie, found by touch: 1 stuck, 0 dead of 50" in capsys.readouterr().out
    first, second = (json.loads((each / "explore.json").read_text())["patches"] for each in (explored, tmp_path))
    assert all(each["in_truth"] is None for each in second.values())
    assert [{**each, "in_truth": None} for each in first.values()] == [*second.values()]
    honest = [f"--believed-{name}" for name in ("patches-stuck", "patches-dead", "contact-false-alarm")]
    assert explore.main([*again, *(word for flag in honest for word in (flag, "0"))]) == 0
    assert "Patches that lie" not in capsys.readouterr().out
    assert "patches" not in json.loads((tmp_path / "explore.json").read_text())


@pytest.mark.parametrize(
    ("told", "rings", "fault"),
    [
        ({"patches_stuck": 0.1}, [True, False], ["stuck", "stuck"]),
        ({"patches_dead": 0.1}, [True, False], ["dead", "dead"]),
        ({"patches_stuck": 0.1, "patches_dead": 0.1}, [True, False], ["stuck", "dead"]),
        ({"patches_stuck": (0,), "patches_dead": (1,)}, [False, True], ["stuck", "dead"]),
    ],
)
def test_a_fault_is_what_it_is_told_to_be_or_what_is_reported(
    told: dict[str, Any], rings: list[bool], fault: list[str]
) -> None:
    hand = hands.make("two_finger")
    contacts = np.zeros((3, len(hand.patches)), dtype=bool)
    contacts[-1, :2] = rings
    reliability = np.ones((3, len(hand.patches)))
    reliability[-1, :2] = 0.2
    trace: Any = SimpleNamespace(patch_reliability=reliability, touched=contacts)
    world: Any = SimpleNamespace(hand=hand, contacts=contacts, faults=None)
    found = [*patches.found(world, trace, told).values()]
    assert [each["believed"] for each in found[:3]] == [*fault, "works"]
    assert patches.found(world, trace, {"sigma_deg": 3.0, "patches_stuck": 0.0}) == {}


@pytest.mark.parametrize("name", ["two_finger", "myo"])
@pytest.mark.parametrize("known", [True, False])
def test_table_and_panel_have_what_lies(name: str, known: bool) -> None:
    hand = hands.make(name)
    usual = {"reliability": 1.0, "believed": "works", "contacts": 3, "false_alarms": 0, "misses": 0}
    some: dict[str, dict[str, Any]] = {
        each: {**usual, "in_truth": "works" if known else None} for each in hand.patches.names
    }
    first, second, third = list(some)[:3]
    some[first] |= {"reliability": 0.1, "believed": "stuck"}
    some[second] |= {"false_alarms": 2, "misses": 1}
    some[third] |= {"in_truth": "dead" if known else None}
    console = Console(width=80, record=True, quiet=False)
    with console.capture() as shown:
        console.print(patches.table(some))
    for each in (first, second, *([third] if known else [])):
        assert each in shown.get()
    assert list(some)[4] not in shown.get()
    axes = Figure().subplots()
    patches.draw(axes, some, hand.patches)
    assert len(axes.get_yticklabels()) == len(hand.patches.links)
    assert len(axes.get_legend().get_texts()) == 4 + known
    cells = axes.collections[0].get_array()
    assert cells.count() == len(hand.patches)
    assert cells.max() == pytest.approx(0.9)


def test_doubt_of_a_trial_is_that_of_its_beliefs(explored: Path) -> None:
    with np.load(explored / "explore.npz") as trace:
        slam = HapticSLAM(
            hands.make("two_finger"),
            1.0,
            2,
            bias_deg=2.0,
            contact_false_alarm=0.01,
            patches_stuck=0.002,
            patches_dead=0.002,
        )
        slam.reset(seed=0, joint_angles=trace["felt_angles"][0])
        steps = zip(trace["torques"], trace["felt_angles"], trace["contacts"], strict=True)
        doubts = [slam.step(*each).patch_reliability for each in steps]
        np.testing.assert_array_equal(trace["patch_reliability"], doubts)


@pytest.mark.parametrize("patches_", ["3", "[1]"])
def test_what_a_calibration_says_of_patches_is_a_table(explored: Path, tmp_path: Path, patches_: str) -> None:
    text = (explored / "offsets.toml").read_text().partition("# Patches")[0]
    (tmp_path / "a.toml").write_text(f"patches = {patches_}\n{text}")
    with pytest.raises(ValueError, match="patches must be a table, got"):
        recordings.read_calibration(tmp_path / "a.toml")
