"""Tables of the documents say what the result files beside them do."""

from __future__ import annotations

import re

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
