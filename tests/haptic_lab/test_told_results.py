"""Tables of the documents say what the result files beside them do."""

from __future__ import annotations

import re

import numpy as np
import pandas as pd
import pytest

from tests.scripts import documents
from tests.scripts.documents import ROOT

FILE = ROOT / "docs" / "results" / "against_floor.csv"
NOTE = "notes/maps.md"


@pytest.fixture(scope="module")
def lines() -> pd.DataFrame:
    return pd.read_csv(FILE)


def test_cells_are_counted_as_the_file_has_them(lines: pd.DataFrame) -> None:
    cells = lines[lines["shape"] != "all"]
    told = documents.table(NOTE, "measure | better | undecided | worse")
    assert {name.strip("`") for name in told} == set(cells["measure"])
    for name, counts in told.items():
        mine = cells[cells["measure"] == name.strip("`")]
        found = [int((mine["verdict"] == verdict).sum()) for verdict in ("better", "undecided", "worse")]
        assert [int(count) for count in counts] == found, name
        assert sum(found) == 20


def test_closures_are_those_of_the_file(lines: pd.DataFrame) -> None:
    whole = lines[lines["shape"] == "all"].set_index(["measure", "sigma_deg"])
    for sigma, told in documents.table(NOTE, "σ | surface F-score at one voxel").items():
        for measure, cell in zip(("surface_f_score_1", "nearest_neighbour_correct"), told, strict=True):
            numbers = [float(each) for each in re.findall(r"[\d.]+", cell)]
            row = whole.loc[measure, float(sigma.strip("°"))]
            assert numbers == pytest.approx([row["closure"], row["closure_low"], row["closure_high"]], abs=0.00501)


def test_the_command_has_the_explorations_of_the_file(lines: pd.DataFrame) -> None:
    (command,) = re.findall(r"    haptic-slam evaluate (.*--out out/against)", (ROOT / "docs" / NOTE).read_text())
    sigmas = re.search(r"--sigmas ([\d ]+)", command)
    trials = re.search(r"--trials (\d+)", command)
    assert sigmas
    assert trials
    assert [float(each) for each in sigmas[1].split()] == sorted(set(lines["sigma_deg"]))
    assert set(lines[lines["shape"] != "all"]["trials"]) == {int(trials[1])}


STUDIES = {  # of the table of a document: its heading, the command, and the file that the command wrote
    "four_shapes": ("σ, after | raw angles | haptic SLAM | true pose", "haptic-slam study four_shapes --trials 20", 80),
    "sheaths": (
        "after | bare: raw angles | haptic SLAM | true pose | sheaths: raw angles | haptic SLAM | true pose",
        "haptic-slam study sheaths --trials 24",
        96,
    ),
}


@pytest.mark.parametrize("study", STUDIES)
def test_shares_of_a_study_are_those_of_its_file(study: str) -> None:
    heading, command, trials = STUDIES[study]
    told = pd.read_csv(FILE.parent / f"{study}.csv", keep_default_na=False)
    assert set(told["trials"]) == {trials}
    assert f"`{command}` ({trials} explorations" in (ROOT / "docs" / "people.md").read_text()
    rows = documents.rows("people.md", heading)
    assert rows
    for when, *cells in rows:
        *sigma, after = re.findall(r"[\d.]+", when)
        mine = told[told["after"] == float(after)]
        mine = mine[mine["sigma_deg"] == float(sigma[0])] if sigma else mine
        found = [
            f"{100 * row.mean:.0f} % [{100 * row.low:.0f}, {100 * row.high:.0f}]"
            for row in mine.itertuples(index=False)
        ]
        assert cells == found, when


def test_what_is_said_of_the_time_of_a_step_is_in_its_file() -> None:
    told = pd.read_csv(FILE.parent / "scaling.csv")
    text = (ROOT / "docs" / "performance.md").read_text()
    ms = {axis: rows.set_index("value")["ms"] for axis, rows in told.groupby("axis")}
    (times,) = re.findall(r"from 32³ to 128³ voxels, 64 times as many, a step takes\s+([\d.]+) times as long", text)
    assert float(times) == pytest.approx(ms["voxels"][128] / ms["voxels"][32], abs=0.051)
    particle, candidate = re.findall(r"([\d.]+) µs more for each\s+(?:particle|candidate)", text)
    for axis, slope in (("particles", particle), ("candidates", candidate)):
        grown = np.polyfit(ms[axis].index, ms[axis], 1)[0]
        assert float(slope) == pytest.approx(1e3 * grown, rel=0.05)
    (most,) = re.findall(r"no longer with more patches, up to\s+(\d+)", text)
    assert int(most) == ms["patches"].index.max()


RECORDINGS = {"cube": "cubemedium", "sphere": "spheremedium", "cylinder": "cylinderlarge"}


class Told:
    """Lines of a result file, by what they are of."""

    def __init__(self, name: str, *keys: str) -> None:
        self.lines = pd.read_csv(FILE.parent / f"{name}.csv").set_index([*keys, "observer", "measure"])

    def mean(self, *what: str) -> float:
        return float(self.lines.loc[what, "mean"])

    def shown(self, *what: str) -> str:
        """Mean ± 95 %, to two places."""
        line = self.lines.loc[what]
        return f"{line['mean']:.2f} ± {line['high'] - line['mean']:.2f}"

    def named(self, *what: str) -> str:
        line = self.lines.loc[(*what, "shape_posterior_correct")]
        return f"{round(line['mean'] * line['trials'])} of {line['trials']:.0f}"


@pytest.fixture(scope="module")
def replayed() -> Told:
    return Told("recordings", "table", "recording")


def test_recordings_are_told_as_their_file_has_them(replayed: Told) -> None:
    rows = documents.table("recordings.md", "object | raw angles | blind | haptic SLAM, lagged | online")
    assert set(rows) == set(RECORDINGS)
    for name, (raw, blind, lagged, online, *ratios, named, holds) in rows.items():
        of = "twenty", RECORDINGS[name]
        error, each = "pose_error_lagged_deg", ("smoother", "haptic_slam")
        assert float(raw) == pytest.approx(replayed.mean(*of, "floor", error), abs=0.00501)
        assert [blind, lagged] == [replayed.shown(*of, who, error) for who in each]
        assert float(online) == pytest.approx(replayed.mean(*of, "haptic_slam", "pose_error_online_deg"), abs=0.00501)
        found = [replayed.mean(*of, "floor", error) / replayed.mean(*of, who, error) for who in each]
        assert list(map(float, ratios)) == pytest.approx(found, abs=0.00501)
        assert named == replayed.named(*of, "haptic_slam") == replayed.named(*of, "floor")
        kept = [replayed.mean(*of, "haptic_slam", f"coverage_90{when}") for when in ("", "_lagged")]
        assert holds == "{:.0f}, {:.0f} %".format(*(100 * each for each in kept))


def test_small_objects_are_told_as_their_file_has_them(replayed: Told) -> None:
    rows = documents.table("recordings.md", "object | F, raw angles | F, haptic SLAM | F, true pose")
    assert [name.split()[0] for name in rows] == list(RECORDINGS)
    for name, (raw, slam, ceiling, *named) in rows.items():
        of, score = ("small", RECORDINGS[name.split()[0]]), "surface_f_score_2"
        assert [raw, slam] == [replayed.shown(*of, who, score) for who in ("floor", "haptic_slam")]
        assert float(ceiling) == pytest.approx(replayed.mean(*of, "ceiling", score), abs=0.00501)
        assert named == [replayed.named(*of, who) for who in ("floor", "haptic_slam")]


@pytest.mark.parametrize("folder", ["small", "eight", "twenty"])
def test_commands_of_recordings_have_the_draws_of_their_file(replayed: Told, folder: str) -> None:
    (command,) = re.findall(
        rf"    haptic-slam evaluate (.*--out out/{folder})\n", (ROOT / "docs/recordings.md").read_text()
    )
    (trials,) = re.findall(r"--trials (\d+)", command)
    assert set(replayed.lines.loc[folder]["trials"]) == {int(trials)}


def test_hands_of_ones_own_are_told_as_their_file_has_them() -> None:
    told = Told("own_hands", "hand", "sigma_deg")
    rows = {row[0]: row[1:] for row in documents.rows("results.md", "hand | named (floor, ceiling)")}
    text = (ROOT / "docs" / "results.md").read_text()
    for name, words in (("taxels", "nine taxels"), ("inspire", "Inspire hand")):
        (row,) = (cells for hand, cells in rows.items() if words in hand)
        of = name, 3.0
        named = [told.named(*of, who) for who in ("haptic_slam", "floor", "ceiling")]
        _, floor, ceiling = (each.split()[0] for each in named)
        assert row[0] == f"{named[0]} ({floor}, {ceiling})"
        assert float(row[1].split()[0]) == pytest.approx(
            told.mean(*of, "haptic_slam", "pose_error_lagged_deg") / 3.0, abs=0.00501
        )
        scores = [told.mean(*of, who, "surface_f_score_2") for who in ("haptic_slam", "floor", "ceiling")]
        assert [float(each) for each in re.findall(r"[\d.]+", row[2])] == pytest.approx(scores, abs=0.00501)
        (trials,) = re.findall(rf"--hand \S*{name}.toml .*--trials (\d+)", text)
        assert told.lines.loc[name]["trials"].max() == 4 * int(trials)
