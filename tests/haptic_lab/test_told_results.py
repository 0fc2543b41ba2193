"""Tables of the documents say what the result files beside them do."""

from __future__ import annotations

import re

import numpy as np
import pandas as pd
import pytest

from haptic_env.shapes import sets
from haptic_lab.tasks import report
from tests.scripts import documents
from tests.scripts.documents import ROOT

RESULTS = ROOT / "docs" / "results"
FILE = RESULTS / "against_floor.csv"
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


MAPPED = {  # of the table of what a minute maps: what a row is called, and the measure
    "surface mapped": "surface_coverage",
    "surface touched": "touched_coverage",
    "occupied voxels that are at the surface": "surface_precision_1",
    "intersection over union of the mesh": "mesh_iou",
    "Chamfer distance of the whole, mm": "mesh_chamfer_mm",
    "F-score of the mesh at 5 mm": "mesh_f_score",
    "steps in touch": "touching_share",
}


def _told(row: pd.Series, share: bool) -> str:
    if share:
        return f"{100 * row['mean']:.0f} % [{100 * row['low']:.0f}–{100 * row['high']:.0f}]"
    return f"{row['mean']:.2f} [{row['low']:.2f}–{row['high']:.2f}]"


def test_what_a_minute_maps_of_twelve_objects_is_that_of_its_file() -> None:
    file = pd.read_csv(RESULTS / "coverage.csv")
    text = (ROOT / "docs" / "policies.md").read_text()
    (command,) = re.findall(r"    haptic-slam evaluate (.*--out out/coverage)", text)
    assert "--policy coverage --sigmas 3 --seconds 60 --trials 1 --first-seed 77000 " in command
    assert "--objects twelve" in command
    assert set(file["shape"]) == {"all", *sets.SETS["twelve"]}
    whole = file[file["shape"] == "all"].set_index(["measure", "observer"])
    rows = documents.rows("policies.md", "what is measured | floor: raw angles")
    assert [name for name, *_ in rows] == list(MAPPED)
    for name, *cells in rows:
        measure = MAPPED[name]
        share = "coverage" in measure or "precision" in measure or "share" in measure
        lines = [whole.loc[measure, each] for each in ("floor", "haptic_slam", "ceiling")]
        found = [_told(line, share) for line in lines]
        if measure in ("touched_coverage", "touching_share"):
            assert len(set(found)) == 1, "it is nobody's belief"
            found = ["", found[0], ""]
        assert cells == found, name
        assert {line["trials"] for line in lines} == {12}


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
    told = pd.read_csv(RESULTS / f"{study}.csv", keep_default_na=False)
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


def test_names_from_one_map_are_those_of_the_points_of_figure_6() -> None:
    file = pd.read_csv(RESULTS / "figure6.csv").set_index(["measure", "observer", "shape", "sigma_deg"])
    told = documents.table("results.md", "named right from one map, all shapes")
    observers = {
        "raw angles": "floor",
        "the paper's recursion": "paper",
        "this one": "haptic_slam",
        "true pose": "ceiling",
    }
    assert told.keys() == observers.keys()
    for name, cells in told.items():
        lines = [file.loc["nearest_neighbour_correct", observers[name], "all", sigma] for sigma in (1.0, 3.0, 5.0)]
        found = [f"{100 * each['mean']:.0f} % [{100 * each['low']:.0f}, {100 * each['high']:.0f}]" for each in lines]
        assert cells == found, name
        assert {each["trials"] for each in lines} == {20 if name == "the paper's recursion" else 64}


def test_what_is_said_of_the_time_of_a_step_is_in_its_file() -> None:
    told = pd.read_csv(RESULTS / "scaling.csv")
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


LESS = "haptic_slam less floor"  # in the same explorations, of `against_floor.csv`
OBSERVERS = ("floor", "kalman", "smoother", "haptic_slam", "ceiling")
MEASURES = {  # what the tables of brackets call them
    "lagged pose error, σ": "pose_error_lagged_deg",
    "online pose error, σ": "pose_error_online_deg",
    "named right after 2 s": "correct_2s",
    "after 5 s": "correct_5s",
    "after 10 s": "correct_10s",
    "by one map, overlap": "overlap_nearest_neighbour_correct",
    "by one map, the paper's": "nearest_neighbour_correct",
    "surface F-score at one voxel": "surface_f_score_1",
    "at two voxels": "surface_f_score_2",
    "90 % intervals of joints hold the truth": "coverage_90",
    "voxels at the skin, calibration error": "skin_ece",
    "voxels at the skin, Brier score": "skin_brier",
    "voxels at the skin, log loss": "skin_log_loss",
}


@pytest.fixture(scope="module")
def brackets() -> pd.DataFrame:
    """What the documents tell of `summary.csv` and `against_floor.csv`, by shape, σ, observer and measure."""
    told = pd.read_csv(RESULTS / "brackets.csv")
    assert set(told["trials"]) == {16, 64}
    return told.set_index(["shape", "sigma_deg", "observer", "measure"])


def cell_of(row: pd.Series, measure: str, sigma: float) -> str:
    """What a table says of a mean with its interval."""
    mean, low, high = row[["mean", "low", "high"]]
    sign = "+" if LESS in row.name else ""
    if "correct" in measure:  # of Wilson, and lopsided
        return f"{100 * mean:.0f} % [{100 * low:.0f}, {100 * high:.0f}]"
    if measure.startswith("pose_error"):
        return f"{mean / sigma:.3f} ± {(high - low) / 2 / sigma:.3f}"
    if measure.startswith("coverage"):
        return f"{100 * mean:.1f} ± {50 * (high - low):.1f} %"
    if "skin" in measure:
        return f"{mean:{sign}.4f} ± {(high - low) / 2:.4f}"
    return f"{mean:.3f} ± {(high - low) / 2:.3f}"


SHOWN = {  # by the document and the heading of its table: the columns
    ("results.md", "σ | measure | floor | kalman | smoother | haptic_slam | ceiling"): OBSERVERS,
    ("notes/calibration.md", "σ | measure | floor | observer | true pose | observer less floor"): (
        *("floor", "haptic_slam", "ceiling"),
        LESS,
    ),
}


@pytest.mark.parametrize(("document", "heading"), SHOWN)
def test_brackets_are_those_of_the_file(document: str, heading: str, brackets: pd.DataFrame) -> None:
    rows = documents.rows(document, heading)
    assert len(rows) > 5
    sigma = 0.0
    for noise, name, *cells in rows:
        sigma = float(noise.strip("°")) if noise else sigma
        measure = MEASURES[name.strip("`")]
        keys = [("all", sigma, observer, measure) for observer in SHOWN[document, heading]]
        found = [cell_of(brackets.loc[key], measure, sigma) if key in brackets.index else "–" for key in keys]
        assert cells == found, (sigma, name)


def test_pose_errors_of_shapes_are_those_of_the_file(brackets: pd.DataFrame) -> None:
    rows = documents.rows("results.md", "shape | floor | kalman | smoother | haptic_slam, lagged | haptic_slam, online")
    assert {shape for shape, *_ in rows} == {"cube", "cylinder", "pyramid", "sphere"}
    lagged = [(observer, "pose_error_lagged_deg") for observer in OBSERVERS[:4]]
    for shape, *cells in rows:
        columns = [*lagged, ("haptic_slam", "pose_error_online_deg")]
        assert cells == [cell_of(brackets.loc[shape, 5.0, *each], each[1], 5.0) for each in columns], shape


def test_at_little_noise_all_name_all(brackets: pd.DataFrame) -> None:
    told = brackets.xs(("all", 1.0), level=("shape", "sigma_deg")).reset_index()
    names = told[told["measure"].isin([*(f"correct_{n}s" for n in (2, 5, 10)), "overlap_nearest_neighbour_correct"])]
    assert set(names["observer"]) == set(OBSERVERS)
    assert set(names["mean"]) == {1.0}
    assert "64 of 64 after 2, 5 and 10 s and by the overlap" in (ROOT / "docs" / "results.md").read_text()


def test_the_front_door_says_what_the_file_does(brackets: pd.DataFrame) -> None:
    text = (ROOT / "README.md").read_text()
    ((error, share),) = re.findall(r"at σ = 5° a pose error of ([\d.]+) σ and (\d+) % of names after 10 s", text)
    pose, names = (brackets.loc["all", 5.0, "haptic_slam", each] for each in ("pose_error_lagged_deg", "correct_10s"))
    assert float(error) == round(pose["mean"] / 5.0, 2)
    assert float(share) == round(100 * names["mean"])


def test_what_is_said_of_calibration_is_in_its_file() -> None:
    told = pd.read_csv(RESULTS / "calibration.csv").set_index(["what", "sigma_deg"])
    text = (ROOT / "docs" / "notes" / "calibration.md").read_text()

    def found(what: str, sigma: float, said: float) -> pd.Series:
        lines = told.loc[what, sigma]
        return lines.iloc[(lines["said"] - said).abs().argmin()]

    ((*shares_held, width),) = re.findall(
        r"intervals hold the truth (\d+), (\d+) and (\d+) % of the time at σ = 1, 3 and 5° \(± ([\d.]+)\)", text
    )
    for sigma, share in zip((1.0, 3.0, 5.0), shares_held, strict=True):
        row = found("angles, lagged", sigma, 0.9)
        assert float(share) == round(100 * row["found"])
        assert 50 * (row["high"] - row["low"]) <= float(width)
    (modest,) = re.findall(r"narrower ones are too modest, by (\d+)\s+points at most", text)
    gaps = told.loc["angles, lagged"]
    assert float(modest) == round(100 * float((gaps["found"] - gaps["said"]).max()))
    (sure,) = re.findall(r"solid at ([\d.]+), ([\d.]+) and ([\d.]+) the object\s+reaches at σ = 5° into (.*) %", text)
    shares = [float(each) for each in re.findall(r"\d+", sure[3])][:3]
    pairs = [*zip(map(float, sure[:3]), shares, strict=True)]
    pairs += [(float(said) / 100, float(share)) for share, said in re.findall(r"(\d+) % where (\d+) %", text)]
    assert len(pairs) == 5
    for said, share in pairs:
        row = found("occupancy", 5.0, said)
        assert abs(row["said"] - said) < 0.0075
        assert share == round(100 * row["found"])


def test_the_command_of_the_brackets_is_that_of_the_file(brackets: pd.DataFrame) -> None:
    text = (ROOT / "docs" / "results.md").read_text()
    (evaluate,) = re.findall(r"    haptic-slam evaluate (.*--out out/results/trials)", text)
    for flag in ("--sigmas 1 3 5", "--first-seed 59000", f"--observers {' '.join(OBSERVERS)}"):
        assert flag in evaluate
    assert "--trials 16" in evaluate
    assert set(brackets.index.get_level_values("sigma_deg")) == {1.0, 3.0, 5.0}


TASKS = {  # of a file of docs/results: the flags of the command that wrote it
    "benchmark_name": "--tasks Name --worlds 8 --steps 4000 --out out/name",
    "benchmark_unknown": "--tasks NameUnknown --worlds 3 --steps 4000 --policies random_torque enclosure "
    "contour_following --out out/unknown",
}


@pytest.mark.parametrize("name", TASKS)
def test_tables_of_the_benchmark_are_those_of_their_files(name: str) -> None:
    told = pd.read_csv(RESULTS / f"{name}.csv")
    command = f"haptic-slam benchmark {TASKS[name]}"
    text = (ROOT / "docs" / "benchmark.md").read_text()
    assert f"    {command}\n" in text
    page = report.page(told, command, int(TASKS[name].split("--steps ")[1].split()[0]), {})
    lines = [line for line in page.splitlines() if line.startswith("| ")]
    assert len(lines) == 1 + told["policy"].nunique()
    assert "\n".join([lines[0], f"|{'---|' * lines[0].count(' | ')}---|", *lines[1:]]) in text
