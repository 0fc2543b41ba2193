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
