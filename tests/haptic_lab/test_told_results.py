"""Tables of the documents say what the result files beside them do."""

from __future__ import annotations

import re
from collections.abc import Callable
from typing import Any, NamedTuple

import numpy as np
import pandas as pd
import pytest

from haptic_env.shapes import sets
from haptic_lab.tasks import report
from tests.scripts import documents
from tests.scripts.documents import ROOT

RESULTS = ROOT / "docs" / "results"
ENDS = ["mean", "low", "high"]
BRACKET = ["shape", "sigma_deg", "observer", "measure"]


def read(file: str) -> pd.DataFrame:
    return pd.read_csv(RESULTS / f"{file}.csv")


def share_of(line: Any) -> str:
    """A share in % with its interval."""
    return f"{100 * line.mean:.0f} % [{100 * line.low:.0f}, {100 * line.high:.0f}]"


def verdicts(lines: pd.DataFrame, name: str) -> list[str]:
    mine = lines[(lines["shape"] != "all") & (lines["measure"] == name.strip("`"))]
    assert len(mine) == 20
    return [str((mine["verdict"] == verdict).sum()) for verdict in ("better", "undecided", "worse")]


def closures(lines: pd.DataFrame, sigma: str) -> list[str]:
    whole = lines[lines["shape"] == "all"].set_index(["measure", "sigma_deg"])
    found = (whole.loc[each, float(sigma.strip("°"))] for each in ("surface_f_score_1", "nearest_neighbour_correct"))
    return [f"{line['closure']:.2f} ({line['closure_low']:.2f} to {line['closure_high']:.2f})" for line in found]


MAPPED = {  # of the table of what a minute maps: what a row is called, and the measure
    "surface mapped": "surface_coverage",
    "surface touched": "touched_coverage",
    "occupied voxels that are at the surface": "surface_precision_1",
    "intersection over union of the mesh": "mesh_iou",
    "Chamfer distance of the whole, mm": "mesh_chamfer_mm",
    "F-score of the mesh at 5 mm": "mesh_f_score",
    "Chamfer distance of what was felt, mm": "mesh_chamfer_felt_mm",
    "of what was felt, inside the mesh's 90 % band": "mesh_band_felt",
    "F-score of the map at one voxel": "surface_f_score_1",
    "steps in touch": "touching_share",
}


def mapped(lines: pd.DataFrame, name: str) -> list[str]:
    measure = MAPPED[name]
    mine = lines[(lines["shape"] == "all") & (lines["measure"] == measure)].set_index("observer")
    assert set(mine["trials"]) == {12}
    shown = "{:.2f} [{:.2f}–{:.2f}]"
    if any(each in measure for each in ("coverage", "precision", "share", "band")):
        shown, mine = "{:.0f} % [{:.0f}–{:.0f}]", mine.assign(**{each: 100 * mine[each] for each in ENDS})
    found = [shown.format(*mine.loc[each, ENDS]) for each in ("floor", "haptic_slam", "second_look", "ceiling")]
    return ["", *set(found), "", ""] if measure in ("touched_coverage", "touching_share") else found  # nobody's belief


def named_after(lines: pd.DataFrame, when: str) -> list[str]:
    *sigma, after = re.findall(r"[\d.]+", when)
    mine = lines[lines["after"] == float(after)]
    mine = mine[mine["sigma_deg"] == float(sigma[0])] if sigma else mine
    return [share_of(line) for line in mine.itertuples(index=False)]


def of_policy(lines: pd.DataFrame, policy: str) -> list[str]:
    page = report.page(lines, "", 4000, {})
    (row,) = re.findall(rf"^\| {re.escape(policy)} \| (.*) \|$", page, flags=re.MULTILINE)
    return row.split(" | ")


def seconds_of(value: float) -> str:
    return f"{value:.2f}" if np.isfinite(value) else "later"


def knows(lines: pd.DataFrame, noise: str, policy: str) -> list[str]:
    """How soon a policy knows, of `policies.csv`."""
    mine = lines[lines["policy"] == policy.strip("`")]
    of_all = mine["sigma_deg"].isna()
    mine = mine[of_all if noise == "all" else mine["sigma_deg"] == float(noise.strip("°"))].set_index("measure")
    time, *shares = (mine.loc[each] for each in ("time_to_decision", "step_accuracy_5s", "correct_10s"))
    low, high = seconds_of(time["low"]), seconds_of(time["high"])
    told = [f"{100 * each['value']:.0f} % [{100 * each['low']:.0f}–{100 * each['high']:.0f}]" for each in shares]
    return [
        str(int(time["trials"])),
        f"{seconds_of(time['value'])} [{low}–{high}]",
        *told,
        f"{100 * time['decided']:.0f} %",
    ]


def ended(lines: pd.DataFrame, seed: str) -> list[str]:
    """What a run of training came to, of `runs.csv`, or the mean over runs."""
    last = lines[lines["evaluation"] == lines["evaluation"].max()]
    mine = last[last["seed"].isna() if seed == "mean" else last["seed"] == float(seed)].set_index("measure")
    assert len(mine) == 2
    told = [str(int(mine["environment_steps"].iloc[0]))]
    for name in ("reward", "median_seconds"):
        value, low, high = mine.loc[name, ["value", "low", "high"]]
        told.append(f"{value:.2f}" + ("" if np.isnan(low) else f" [{low:.2f}, {high:.2f}]"))
    return told


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


def between(*observers: str) -> Callable[..., list[str]]:
    """What is said of observers, by σ and measure."""

    def found(lines: pd.DataFrame, noise: str, name: str) -> list[str]:
        lines, sigma, measure = lines.set_index(BRACKET), float(noise.strip("°")), MEASURES[name.strip("`")]
        keys = [("all", sigma, observer, measure) for observer in observers]
        return [cell_of(lines.loc[key], measure, sigma) if key in lines.index else "–" for key in keys]

    return found


def of_shape(lines: pd.DataFrame, shape: str) -> list[str]:
    columns = [*((each, "pose_error_lagged_deg") for each in OBSERVERS[:4]), ("haptic_slam", "pose_error_online_deg")]
    lines = lines.set_index(BRACKET)
    return [cell_of(lines.loc[shape, 5.0, *each], each[1], 5.0) for each in columns]


def less_than_whole(lines: pd.DataFrame, variant: str) -> list[str]:
    """What changing an idea does, bold where that is surely something, 0 where nothing is seen of it."""
    mine, found = lines[lines["observer"] == variant.strip("`")].set_index("measure"), []
    for measure, line in mine.iterrows():
        scale, digits = (1.0, 4 if "brier" in measure else 3)
        if "correct" in measure or "coverage" in measure:
            scale, digits = 100.0, 1
        shown = f"{scale * line['difference']:+.{digits}f} ± {scale * (line['high'] - line['low']) / 2:.{digits}f}"
        if not shown.strip("+-0. ±"):
            found.append("0")
        else:
            found.append(f"**{shown}**" if line["low"] > 0.0 or line["high"] < 0.0 else shown)
    return found


def from_one_map(lines: pd.DataFrame, name: str) -> list[str]:
    observers = {
        "raw angles": "floor",
        "the paper's recursion": "paper",
        "this one": "haptic_slam",
        "true pose": "ceiling",
    }
    lines = lines[(lines["measure"] == "nearest_neighbour_correct") & (lines["shape"] == "all")]
    return [share_of(line) for line in lines[lines["observer"] == observers[name]].itertuples(index=False)]


RECORDINGS = {"cube": "cubemedium", "sphere": "spheremedium", "cylinder": "cylinderlarge"}
ERROR, SCORE, NAMED = "pose_error_lagged_deg", "surface_f_score_2", "shape_posterior_correct"


def wide(line: pd.Series) -> str:
    return f"{line['mean']:.2f} ± {line['high'] - line['mean']:.2f}"


def count_of(line: pd.Series) -> str:
    return f"{round(line['mean'] * line['trials'])} of {line['trials']:.0f}"


def of_recording(lines: pd.DataFrame, table: str, name: str) -> pd.DataFrame:
    """The lines of the recording of an object, by observer and measure."""
    mine = lines[(lines["table"] == table) & (lines["recording"] == RECORDINGS[name.split()[0]])]
    return mine.set_index(["observer", "measure"]).sort_index()


def replayed(lines: pd.DataFrame, name: str) -> list[str]:
    of = of_recording(lines, "twenty", name)
    raw, blind, slam = (of.loc[who, ERROR] for who in ("floor", "smoother", "haptic_slam"))
    online, named = (of.loc["haptic_slam", each] for each in ("pose_error_online_deg", NAMED))
    assert count_of(named) == count_of(of.loc["floor", NAMED])
    holds = (f"{100 * of.loc['haptic_slam', f'coverage_90{when}']['mean']:.0f}" for when in ("", "_lagged"))
    ratios = (f"{raw['mean'] / each['mean']:.2f}" for each in (blind, slam))
    ends = count_of(named), f"{', '.join(holds)} %"
    return [f"{raw['mean']:.2f}", wide(blind), wide(slam), f"{online['mean']:.2f}", *ratios, *ends]


def small(lines: pd.DataFrame, name: str) -> list[str]:
    of = of_recording(lines, "small", name)
    each = ("floor", "haptic_slam")
    shown = [wide(of.loc[who, SCORE]) for who in each]
    return [*shown, f"{of.loc['ceiling', SCORE]['mean']:.2f}", *(count_of(of.loc[who, NAMED]) for who in each)]


class Held(NamedTuple):
    """A table, and what holds it.

    Attributes:
        document: of docs.
        heading: its first columns.
        file: of docs/results.
        told: of the file's lines and of what a row is of, what the row's other cells say.
        labels: how many cells say what a row is of; one that is empty is of what the one above it is of.
        nth: of the tables of the document with this heading.
    """

    document: str
    heading: str
    file: str
    told: Callable[..., list[str]]
    labels: int = 1
    nth: int = 0


OF_NAMES = "policy | steps learnt | worlds | median decision time"
MAPS = "policy | steps learnt | worlds | surface covered after 20 s"
HELD = [
    Held("benchmark.md", OF_NAMES, "benchmark_name", of_policy),
    Held("benchmark.md", OF_NAMES, "benchmark_unknown", of_policy, nth=1),
    Held("benchmark.md", MAPS, "benchmark_map", of_policy),
    Held("learning.md", "σ | policy", "searched", knows, 2),
    Held("learning.md", "σ | policy", "whole_hand", knows, 2, nth=2),
    Held("learning.md", "seed | steps", "whole_hand_runs", ended),
    Held("notes/ablation.md", "variant | lagged", "one_candidate", less_than_whole, nth=1),
    Held("notes/calibration.md", "σ | measure", "brackets", between("floor", "haptic_slam", "ceiling", LESS), 2),
    Held("notes/maps.md", "measure | better", "against_floor", verdicts),
    Held("notes/maps.md", "σ | surface F-score at one voxel", "against_floor", closures),
    Held("people.md", "after | free hand", "fingers", named_after),
    Held("people.md", "σ, after", "four_shapes", named_after),
    Held("people.md", "after | bare: raw angles", "sheaths", named_after),
    Held("policies.md", "what is measured", "coverage", mapped),
    Held("results.md", "named right from one map, all shapes", "figure6", from_one_map),
    Held("recordings.md", "object | F, raw angles", "recordings", small),
    Held("recordings.md", "object | raw angles | blind", "recordings", replayed),
    Held("results.md", "shape | floor", "brackets", of_shape),
    Held("results.md", "σ | measure", "brackets", between(*OBSERVERS), 2),
]


class Command(NamedTuple):
    """What wrote a file.

    Attributes:
        document: of docs, which tells of it.
        flags: of the command, as they stand there.
        trials: that lines of the file are of.
    """

    document: str
    flags: str
    trials: set[int]


COMMANDS = {
    "against_floor": Command("notes/maps.md", "evaluate --sigmas 1 2 3 4 5 --trials 9 --first-seed 59000 ", {9, 36}),
    "benchmark_map": Command(
        "benchmark.md",
        "    haptic-slam benchmark --tasks Map --worlds 6 --steps 4000 --policies random_torque synergy enclosure ",
        {6},
    ),
    "benchmark_name": Command("benchmark.md", "    haptic-slam benchmark --tasks Name --worlds 8 --steps 4000 ", {8}),
    "benchmark_unknown": Command(
        "benchmark.md",
        "    haptic-slam benchmark --tasks NameUnknown --worlds 14 "
        "--policies random_torque enclosure information_gain ",
        {14},
    ),
    "brackets": Command(
        "results.md",
        "evaluate --sigmas 1 3 5 --trials 16 --first-seed 59000 --exemplars 5 --classifiers nearest_neighbour "
        f"overlap_nearest_neighbour shape_likelihood --observers {' '.join(OBSERVERS)} ",
        {16, 64},
    ),
    "coverage": Command(
        "policies.md",
        "    haptic-slam evaluate --hand two_finger_arm --objects twelve --candidates cube --policy coverage "
        "--sigmas 3 --seconds 60 --trials 1 --first-seed 79000 ",
        {1, 12},
    ),
    "figure6": Command(
        "results.md",
        "    haptic-slam figures figure6 --sigmas 1 3 5 --trials 16 --paper-trials 5 --first-seed 59000",
        {5, 16, 20, 64},
    ),
    "example_accuracy": Command("tutorials/people.md", "    haptic-slam people example\n", {120, 144, 720}),
    "example_compare": Command(
        "tutorials/people.md",
        '    haptic-slam compare example --courses example --subjects "simulated 6" --models ideal lapse noise\n',
        {120},
    ),
    "example_fit": Command("tutorials/people.md", "    haptic-slam fit example --courses example\n", {120}),
    "fingers": Command("people.md", "`haptic-slam study fingers`: the human hand, σ = 3°, ", {72}),
    "four_shapes": Command("people.md", "`haptic-slam study four_shapes --trials 20` (80 explorations", {80}),
    "one_candidate": Command(
        "notes/ablation.md",
        "    haptic-slam evaluate --ablation --sigmas 5 --trials 5 --first-seed 52000 --particles 30 --classifiers ",
        {20},
    ),
    "searched": Command(
        "learning.md",
        "    haptic-slam evaluate --policy searched sweep --sigmas 5 3 --trials 52 --first-seed 79300 "
        "--observers one_particle --particles 1 --classifiers --names-only --size-jitter 0.2 --yaw-jitter 45 ",
        {208, 416},
    ),
    "sheaths": Command("people.md", "`haptic-slam study sheaths --trials 24` (96 explorations", {96}),
    "whole_hand": Command(
        "learning.md",
        "    haptic-slam evaluate --hand myo --policy whole_hand random_torque enclosure --sigmas 5 3 --trials 6 "
        "--first-seed 77700 --observers haptic_slam --names-only --size-jitter 0.2 --yaw-jitter 45 ",
        {24, 48},
    ),
}


@pytest.mark.parametrize("table", HELD, ids=lambda each: f"{each.document}: {each.heading} {each.nth}")
def test_a_table_says_what_its_file_does(table: Held) -> None:
    lines, above = read(table.file), [""] * table.labels
    rows = documents.rows(table.document, table.heading, table.nth)
    assert rows
    for row in rows:
        above = [told or last for told, last in zip(row, above, strict=False)]
        assert row[table.labels :] == table.told(lines, *above), above


@pytest.mark.parametrize("file", COMMANDS)
def test_the_command_of_a_file_is_told(file: str) -> None:
    command, lines = COMMANDS[file], read(file)
    assert command.flags in (ROOT / "docs" / command.document).read_text()
    assert set(lines["worlds" if "worlds" in lines else "trials"]) == command.trials


def test_tables_leave_out_nothing_of_their_files() -> None:
    def first(document: str, heading: str, nth: int = 0) -> list[str]:
        return [row[0].strip("`") for row in documents.rows(document, heading, nth)]

    for file, heading, nth in (
        ("benchmark_map", MAPS, 0),
        ("benchmark_name", OF_NAMES, 0),
        ("benchmark_unknown", OF_NAMES, 1),
    ):
        assert first("benchmark.md", heading, nth) == [*read(file)["policy"].unique()]
    assert set(first("notes/maps.md", "measure | better")) == set(read("against_floor")["measure"])
    assert first("policies.md", "what is measured") == [*MAPPED]
    assert set(read("coverage")["shape"]) == {"all", *sets.SETS["twelve"]}
    assert first("recordings.md", "object | raw angles | blind") == [*RECORDINGS]
    assert [each.split()[0] for each in first("recordings.md", "object | F, raw angles")] == [*RECORDINGS]
    for file, nth in (("searched", 0), ("whole_hand", 2)):
        policies = [row[1].strip("`") for row in documents.rows("learning.md", "σ | policy", nth)]
        assert {*policies} == set(read(file)["policy"])
    runs = read("whole_hand_runs")["seed"].dropna().astype(int)
    assert first("learning.md", "seed | steps") == [*map(str, sorted({*runs})), "mean"]
    assert {*first("results.md", "shape | floor"), "all"} == set(read("brackets")["shape"])
    assert set(filter(None, first("results.md", "σ | measure"))) == {"1°", "3°", "5°"}
    assert set(read("brackets")["sigma_deg"]) == {1.0, 3.0, 5.0}


def test_what_is_said_of_the_time_of_a_step_is_in_its_file() -> None:
    told = read("scaling")
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


@pytest.fixture(scope="module")
def brackets() -> pd.DataFrame:
    """What the documents tell of `summary.csv` and `against_floor.csv`, by shape, σ, observer and measure."""
    return read("brackets").set_index(BRACKET)


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


def test_the_tutorial_says_of_the_people_that_ship_what_their_files_do() -> None:
    text = " ".join((ROOT / "docs" / "tutorials" / "people.md").read_text().split())
    shares = read("example_accuracy").set_index(["who", "seconds"])["share"]
    assert f"{100 * shares['people', 0.5]:.0f} % of the trials after half a second" in text
    assert f"{100 * shares['people', 5.5]:.0f} % after 5.5 s" in text
    whole = shares[shares.index.get_level_values("seconds").isna()].droplevel("seconds").drop("people")
    assert f"`{whole.idxmax()}` is the best, `{whole.idxmin()}` the worst" in text
    fitted = read("example_fit").set_index(["subject", "parameter"])[["estimate", "low", "high"]]
    worst, lapses, found = ("simulated 2", "sigma_deg"), ("simulated 6", "lapse"), ("simulated 4", "sigma_deg")
    assert fitted.xs("sigma_deg", level="parameter")["estimate"].idxmax() == worst[0]
    assert (
        "`{}` seems to feel its joints worst (σ of {:.1f}° [{:.1f}, {:.1f}])".format(worst[0], *fitted.loc[worst])
        in text
    )
    assert "`{}` to guess in {:.0f} % [{:.0f}, {:.0f}]".format(lapses[0], *100 * fitted.loc[lapses]) in text
    assert "`{}`, of whom {:.1f}° [{:.1f}, {:.1f}] is found".format(found[0], *fitted.loc[found]) in text
    behind = -read("example_compare").set_index("model")[["difference", "difference_high", "difference_low"]]
    assert behind["difference"].idxmin() == "noise"
    said = ("{:.2f} [{:.2f}, {:.2f}]".format(*behind.loc[model]) for model in ("lapse", "ideal"))
    assert "lapses are {} nats a trial behind, no limits but σ {}".format(*said) in text


def test_what_is_said_of_calibration_is_in_its_file() -> None:
    told = read("calibration").set_index(["what", "sigma_deg"])
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
