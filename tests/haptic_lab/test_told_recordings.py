"""What is said of hands of one's own is what the result file beside the documents has, and its commands are told."""

from __future__ import annotations

import re

import pandas as pd
import pytest

from tests.scripts import documents
from tests.scripts.documents import ROOT

FOLDER = ROOT / "docs" / "results"


class Told:
    """Lines of a result file, by what they are of."""

    def __init__(self, name: str, *keys: str) -> None:
        self.lines = pd.read_csv(FOLDER / f"{name}.csv").set_index([*keys, "observer", "measure"])

    def mean(self, *what: str) -> float:
        return float(self.lines.loc[what, "mean"])

    def named(self, *what: str) -> str:
        line = self.lines.loc[(*what, "shape_posterior_correct")]
        return f"{round(line['mean'] * line['trials'])} of {line['trials']:.0f}"


@pytest.fixture(scope="module")
def replayed() -> Told:
    return Told("recordings", "table", "recording")


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
