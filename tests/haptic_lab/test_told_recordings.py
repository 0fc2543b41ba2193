"""Tables of recordings and of hands of one's own say what the result files beside the documents do."""

from __future__ import annotations

import re

import pandas as pd
import pytest

from tests.scripts import documents
from tests.scripts.documents import ROOT

FOLDER = ROOT / "docs" / "results"
RECORDINGS = {"cube": "cubemedium", "sphere": "spheremedium", "cylinder": "cylinderlarge"}


class Told:
    """Lines of a result file, by what they are of."""

    def __init__(self, name: str, *keys: str) -> None:
        self.lines = pd.read_csv(FOLDER / f"{name}.csv").set_index([*keys, "observer", "measure"])

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
