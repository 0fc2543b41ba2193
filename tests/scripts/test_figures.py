"""Every figure at its smallest: what it shows is what the trials say, and it goes on where it was stopped."""

from __future__ import annotations

import shutil
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pandas as pd
import pytest
from matplotlib.colors import to_rgb
from PIL import Image

from haptic_env import shapes
from haptic_env.grid import Grid
from haptic_lab.commands import figures
from haptic_lab.conditions import Condition
from haptic_lab.figures import FIGURES, FROM_TRIALS, confusion, figure5, isometric_view, reliability, time_course
from haptic_lab.figures.explorations import read, run_shown_explorations
from haptic_lab.figures.paper_figure import PRINT
from haptic_lab.style import SHAPE_COLOURS
from haptic_lab.sweeps import executors, measures, tasks, worker
from tests.haptic_lab.workers import in_this_process

TINY = [
    *("--sigmas", "2", "4", "--trials", "2", "--seconds", "0.6", "--show-seconds", "0.5", "--particles", "5"),
    *("--exemplars", "1", "--jobs", "1", "--first-seed", "10", "--shapes", "cube", "sphere"),
    *("--observers", "floor", "haptic_slam", "ceiling", "--offsets", "0", "3", "--offset-sigmas", "1"),
]


@pytest.fixture(scope="module")
def roughly() -> Iterator[None]:
    """Pictures at which nobody looks: coarse, and without fonts."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(figures, "PRINT", {**PRINT, "savefig.dpi": 40, "pdf.use14corefonts": True})
        yield


@pytest.fixture(scope="module")
def drawn(roughly: None, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The folder of all figures."""
    folder = tmp_path_factory.mktemp("figures")
    with in_this_process():
        assert figures.main([*TINY, "--out", str(folder)]) == 0
    return folder


@pytest.fixture
def copied(drawn: Path, tmp_path: Path) -> Path:
    return Path(shutil.copytree(drawn, tmp_path / "copied"))


@pytest.fixture(scope="module")
def rows(drawn: Path) -> pd.DataFrame:
    return pd.read_csv(drawn / "trials" / "trials.csv")


def refused(capsys: pytest.CaptureFixture, *arguments: str) -> str:
    """What is told about a command line that makes no sense."""
    with pytest.raises(SystemExit) as ended:
        figures.main([*arguments])
    error = capsys.readouterr().err
    assert ended.value.code == 2
    assert error.count("\n") == 1
    return error


@pytest.mark.parametrize("name", FIGURES)
def test_every_figure_is_for_screen_and_print_with_its_data(drawn: Path, name: str) -> None:
    assert (drawn / f"{name}.png").read_bytes().startswith(b"\x89PNG")
    assert (drawn / f"{name}.pdf").read_bytes().startswith(b"%PDF")
    assert len(pd.read_csv(drawn / f"{name}.csv").columns) > 2
    assert (drawn / f"{name}.gif").exists() == (name == "film")


def test_the_film_moves_in_the_colours_of_the_shapes(drawn: Path) -> None:
    with Image.open(drawn / "film.gif") as film:
        assert film.n_frames == 4  # every tenth of a second up to the lag before the end, and the end
        film.seek(3)
        pixels = np.asarray(film.convert("RGB"))
    for name in ("cube", "sphere"):
        colour = np.round(255 * np.array(to_rgb(SHAPE_COLOURS[name])))
        assert (pixels == colour).all(axis=-1).sum() > 10


@pytest.mark.parametrize("name", ["figure6", "pose_error"])
def test_means_are_those_of_the_trials(drawn: Path, rows: pd.DataFrame, name: str) -> None:
    data = pd.read_csv(drawn / f"{name}.csv")
    if name == "pose_error":
        data = data[~data["observer"].isin(["kalman", "smoother"])]
    else:
        rows = pd.concat([rows, pd.read_csv(drawn / "paper" / "trials.csv")])
    assert {"cube", "sphere", "all"} == set(data["shape"])
    for _, line in data.iterrows():
        mine = rows[(rows["observer"] == line["observer"]) & (rows["sigma_deg"] == line["sigma_deg"])]
        if line["shape"] != "all":
            mine = mine[mine["shape"] == line["shape"]]
        values = mine[line["measure"].replace("_sigmas", "_deg")]
        values = values / mine["sigma_deg"] if line["measure"].endswith("_sigmas") else values
        assert line["mean"] == pytest.approx(values.mean())
        assert line["low"] <= line["mean"] <= line["high"]
        assert line["trials"] == len(mine) == (4 if line["shape"] == "all" else 2)


@pytest.mark.usefixtures("roughly", "serially")
def test_the_brackets_of_the_pose_are_those_of_observers_with_maps(drawn: Path, tmp_path: Path) -> None:
    data = pd.read_csv(drawn / "pose_error.csv")
    assert list(dict.fromkeys(data["observer"])) == ["floor", "haptic_slam", "ceiling", "kalman", "smoother"]
    poses = pd.read_csv(drawn / "poses" / "trials.csv")
    assert poses[[*measures.OF_MAPS]].isna().all(axis=None), "where no map is, nothing is measured of it"
    given = ["--observers", "kalman", "haptic_slam", "smoother"]
    assert figures.main(["pose_error", *TINY, *given, "--out", str(tmp_path)]) == 0
    assert not (tmp_path / "poses").exists(), "they are in the sweep"
    full = pd.read_csv(tmp_path / "pose_error.csv")
    keys = ["measure", "observer", "shape", "sigma_deg"]
    both = full.merge(data, on=keys, suffixes=("", "_fast"))
    assert len(both) == len(full)
    np.testing.assert_allclose(both["mean_fast"], both["mean"], rtol=1e-9)


def test_offsets_shows_bias_and_drift_of_a_sweep_of_its_own(drawn: Path) -> None:
    rows = pd.read_csv(drawn / "noises" / "trials.csv")
    told = {tuple(each) for each in rows[["sigma_deg", "bias_deg", "drift_deg"]].to_numpy()}
    assert told == {(1.0, 0.0, 0.0), (1.0, 3.0, 0.0), (1.0, 0.0, 3.0)}
    data = pd.read_csv(drawn / "offsets.csv")
    assert set(data["observer"]) == {"floor", "white", "haptic_slam", "ceiling"}
    keys = ["kind", "amount", "observer", "measure"]
    assert (data.groupby(keys).size() == 1).all()
    error = data[(data["measure"] == "pose_error_lagged_deg") & (data["amount"] == 3)].set_index(["kind", "observer"])
    for kind in ("bias_deg", "drift_deg"):
        mine = rows[(rows[kind] == 3) & (rows["observer"] == "white")]
        assert error.loc[(kind, "white"), "mean"] == pytest.approx(mine["pose_error_lagged_deg"].mean())
        assert error.loc[(kind, "haptic_slam"), "mean"] < error.loc[(kind, "white"), "mean"]


@pytest.mark.usefixtures("roughly")
def test_offsets_are_drawn_from_another_sweep_where_they_are_asked_for(
    drawn: Path, tmp_path: Path, capsys: pytest.CaptureFixture
) -> None:
    given = ["--trials-of", str(drawn / "noises"), "--out", str(tmp_path)]
    assert figures.main(["offsets", *given]) == 0
    assert (tmp_path / "offsets.csv").read_bytes() == (drawn / "offsets.csv").read_bytes()
    assert "offsets" not in figures.parse(given).names
    white = ["--trials-of", str(drawn / "trials"), "--out", str(tmp_path)]
    assert figures.main(["offsets", *white]) == 1
    assert "trials with several of bias_deg or drift_deg" in " ".join(capsys.readouterr().out.split())


def test_noise_and_belief_are_of_all_trials() -> None:
    given = figures.parse(["--bias-deg", "2", "--believed-drift-deg", "1", "--believed-sigma-deg", "unknown"])
    for sweep in (given.sweep, given.poses, given.noises):
        assert sweep is not None
        assert (sweep.settings.believed_drift_deg, sweep.settings.believed_sigma_deg) == (1.0, "unknown")
    assert {each.bias_deg for each in given.sweep.conditions} == {2.0}
    assert given.noises is not None
    assert {each.bias_deg for each in given.noises.conditions} == {0.0, 1.0, 3.0, 5.0}


def test_figure_6_has_each_way_to_name_between_its_brackets(drawn: Path) -> None:
    data = pd.read_csv(drawn / "figure6.csv")
    namers = {"nearest_neighbour", "overlap_nearest_neighbour", "shape_likelihood", "shape_posterior"}
    assert set(data["measure"]) == {f"{namer}_correct" for namer in namers}
    assert {"floor", "haptic_slam", "ceiling", "paper"} == set(data["observer"])
    paper = data[data["observer"] == "paper"]
    assert set(paper["measure"]) == {"nearest_neighbour_correct", "shape_posterior_correct"}


@pytest.mark.parametrize(
    ("asked", "trials"),
    [([], 12), (["--trials", "3"], 3), (["--paper-trials", "40"], 40), (["--paper-trials", "0"], None)],
)
def test_the_papers_recursion_repeats_the_first_explorations(asked: list[str], trials: int | None) -> None:
    plan = figures.parse(["figure6", *asked])
    assert (None if plan.papers is None else plan.papers.trials) == trials
    if plan.papers is not None:
        assert plan.papers.settings.observers == ("paper",)
        assert plan.papers.settings.first_seed == plan.sweep.settings.first_seed
        assert plan.papers.conditions == plan.sweep.conditions
    assert figures.parse(["figure5", *asked]).papers is None
    assert figures.parse(["figure6", *asked, "--observers", "haptic_slam", "paper"]).papers is None


def test_confusions_add_up_and_agree_with_the_accuracy(drawn: Path, rows: pd.DataFrame) -> None:
    data = pd.read_csv(drawn / "confusion.csv")
    keys = ["namer", "observer", "sigma_deg", "shape"]
    assert data.groupby(keys)["share"].sum().to_numpy() == pytest.approx(1.0)
    for _, line in data[data["shape"] == data["named"]].iterrows():
        mine = rows[[*keys[1:], f"{line['namer']}_correct"]]
        mine = mine[(mine[keys[1:]] == line[keys[1:]]).all(axis=1)]
        assert line["share"] == pytest.approx(mine.iloc[:, -1].mean())


def test_several_draws_of_the_exemplars_share_a_trial() -> None:
    rows = pd.DataFrame(
        {
            "candidates": "cube sphere",
            "observer": "haptic_slam",
            "sigma_deg": 3.0,
            "shape": ["cube", "cube", "sphere"],
            "nearest_neighbour": ["cube sphere", "cube cube", "cube sphere"],
        }
    )
    share = confusion.table(rows).set_index(["shape", "named"])["share"]
    assert share.to_dict() == {
        ("cube", "cube"): 0.75,
        ("cube", "sphere"): 0.25,
        ("sphere", "cube"): 0.5,
        ("sphere", "sphere"): 0.5,
    }


def test_the_course_of_time_is_that_of_the_posterior() -> None:
    """The probability of the truth rises by 0.01 each step, and is the largest from 0.5 on."""
    seconds = 0.02 * np.arange(1, 101)
    p = 0.01 * np.arange(1, 101)
    trace = SimpleNamespace(labels=("sphere", "cube"), posterior=np.stack([1 - p - 1e-9, p], axis=1))
    exploration = SimpleNamespace(seconds=seconds, solid=SimpleNamespace(name="cube"))
    posterior, correct = measures.course(exploration, trace)
    np.testing.assert_allclose(posterior, 0.01 * np.ceil(50 * 0.25 * np.arange(1, 9) - 1e-9))
    np.testing.assert_array_equal(correct, [0, 0, 0, 1, 1, 1, 1, 1])


def test_decisions_are_counted_from_their_time_on() -> None:
    rows = pd.DataFrame(
        {
            "sigma_deg": 3.0,
            "observer": "haptic_slam",
            "course_p": ["0.3 0.6 0.99", "0.2 0.4 0.5"],
            "course_correct": ["0 1 1", "0 0 1"],
            "time_to_decision": [0.6, np.nan],
        }
    )
    mean = time_course.curves(rows).pivot(index="seconds", columns="measure", values="mean")
    assert mean.index.tolist() == [0.25, 0.5, 0.75]
    assert mean["decided"].tolist() == [0.0, 0.0, 0.5]
    assert mean["correct"].tolist() == [0.0, 0.5, 1.0]
    np.testing.assert_allclose(mean["posterior"], [0.25, 0.5, 0.745])


@pytest.mark.parametrize(("course", "points"), [("", 0), ("0.3", 1), ("0.3 0.6", 2)])
def test_a_course_may_be_as_short_as_a_table_can_say(course: str, points: int, tmp_path: Path) -> None:
    columns = "sigma_deg,observer,course_p,course_correct,time_to_decision"
    table = f"{columns}\n3.0,haptic_slam,{course},{course},\n3.0,haptic_slam,{course},{course},0.1\n"
    (tmp_path / "trials.csv").write_text(table, encoding="utf-8")
    rows = pd.read_csv(tmp_path / "trials.csv")
    data = time_course.curves(rows)
    assert sorted(set(data["seconds"])) == [0.25, 0.5][:points]
    if not points:
        with pytest.raises(ValueError, match=r"time_course has a point each 0\.25 s"):
            time_course.draw(rows)


def test_reliability_counts_every_voxel_once(drawn: Path, rows: pd.DataFrame) -> None:
    data = pd.read_csv(drawn / "reliability.csv")
    for (sigma, observer), line in data.groupby(["sigma_deg", "observer"]):
        mine = rows[(rows["sigma_deg"] == sigma) & (rows["observer"] == observer)]
        assert line["voxels"].sum() == sum(int(each) for text in mine["skin_cells"] for each in text.split())
    assert ((data["low"] <= data["found"] + 1e-9) & (data["found"] <= data["high"] + 1e-9)).all()
    assert len(reliability.draw(rows).data) == len(data)


def test_scenes_show_their_explorations(drawn: Path) -> None:
    maps = pd.read_csv(drawn / "figure5.csv")
    assert set(maps["sigma_deg"]) <= set(figure5.SIGMAS)
    assert ((maps["probability"] >= 0.5) & (maps["probability"] <= 1)).all()
    course = pd.read_csv(drawn / "film.csv")
    assert len(course) == 25
    np.testing.assert_allclose(course[["p_cube", "p_sphere"]].sum(axis=1), 1.0)
    assert course["inferred_error_deg"].mean() < course["felt_error_deg"].mean()
    assert len(list((drawn / "explorations").iterdir())) == 2 * len(figure5.SIGMAS)


def test_stopped_it_goes_on_to_the_same(copied: Path, drawn: Path) -> None:
    table = copied / "trials" / "trials.csv"
    whole = table.read_bytes()
    table.write_bytes(whole[: 2 * len(whole) // 3])
    lost = next((copied / "explorations").glob("sphere_5*"))
    lost.unlink()
    with in_this_process():
        assert figures.main(["figure6", *TINY, "--out", str(copied)]) == 0
    assert figures.main(["figure2", *TINY, "--out", str(copied)]) == 0  # by a process of its own
    assert table.read_bytes() == whole
    assert lost.exists()
    for name in ("figure6.csv", "figure2.csv", "figure6.png", "figure6.pdf", "figure2.pdf"):
        assert (copied / name).read_bytes() == (drawn / name).read_bytes(), name


@pytest.mark.usefixtures("roughly")
def test_what_is_there_is_not_run_again(copied: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.delattr(executors.LocalWorkers, "run")
    (copied / "pose_error.csv").unlink()
    assert figures.main(["pose_error", "figure4", *TINY, "--out", str(copied)]) == 0
    assert (copied / "pose_error.csv").exists()


@pytest.mark.usefixtures("roughly")
def test_the_trials_of_another_sweep(
    drawn: Path, rows: pd.DataFrame, tmp_path: Path, capsys: pytest.CaptureFixture
) -> None:
    assert figures.main([*FROM_TRIALS, "--trials-of", str(drawn / "trials"), "--out", str(tmp_path)]) == 0
    for name in FROM_TRIALS:
        here, there = (pd.read_csv(folder / f"{name}.csv") for folder in (tmp_path, drawn))
        if name in ("pose_error", "figure6"):  # there it has trials of its own as well
            there = there[there["observer"].isin(here["observer"])].reset_index(drop=True)
        pd.testing.assert_frame_equal(here, there)
    assert not (tmp_path / "trials").exists()
    other = tmp_path / "other"
    other.mkdir()
    for changed, told in (
        (pd.concat([rows, rows.assign(bias_deg=2.0)]), "vary in more than sigma"),
        (rows[rows["observer"] == "floor"], "without the observer haptic_slam"),
    ):
        changed.to_csv(other / "trials.csv", index=False)
        assert figures.main(["figure6", "--trials-of", str(other), "--out", str(tmp_path)]) == 1
        assert told in " ".join(capsys.readouterr().out.split())
    whole = (drawn / "trials" / "trials.csv").read_bytes()
    (other / "trials.csv").write_bytes(whole[: len(whole) // 2])
    assert figures.main(["figure6", "--trials-of", str(other), "--out", str(tmp_path)]) == 1
    assert "trials.csv is cut off in its last line" in " ".join(capsys.readouterr().out.split())


@pytest.mark.parametrize(
    ("arguments", "told"),
    [
        (["--seed", "-1"], "--seed must be an integer"),
        (["--show-seconds", "0"], "--show-seconds must be a finite number"),
        (["--seconds", "0.2"], "--seconds (of time_course) must be a finite number in [0.25, 3600] s, got 0.2"),
        (["--trials", "0"], "--trials must be an integer in [1, 100000]"),
        (["--sigmas", "nan"], "must be a finite number"),
        (["--policy", "push"], "unknown --policy 'push'; choose from"),
        (["--offsets", "0", "91"], "--offsets: bias_deg must be a finite number in [0, 90] degrees, got 91"),
        (["--offset-sigmas", "0"], "must be a finite number in (0, 90] degrees, got 0"),
        (["--believed", "me"], "unknown --believed 'me'; choose from human"),
        (
            ["--trials-of", "nowhere"],
            "--trials-of must be a folder of evaluate.py, with trials.csv in it, got 'nowhere'",
        ),
        (["--out", "/dev/null/here"], "--out must be a folder"),
    ],
)
def test_bad_input_is_one_clear_line(
    arguments: list[str], told: str, tmp_path: Path, capsys: pytest.CaptureFixture
) -> None:
    assert told in refused(capsys, *TINY, "--out", str(tmp_path), *arguments)


def test_an_unknown_figure_lists_the_valid_ones(tmp_path: Path, capsys: pytest.CaptureFixture) -> None:
    told = refused(capsys, "figure2", "figure3", *TINY, "--out", str(tmp_path))
    assert "unknown figure 'figure3'" in told
    assert all(name in told for name in FIGURES)


def tiny_task() -> tasks.SweepTask:
    given = {"env": "HapticSLAM/TwoFinger-v0", "particles": 3, "shapes": ("cube", "sphere"), "exemplars": 1}
    settings = tasks.SweepSettings(**given, observers=("haptic_slam",), first_seed=0, classifiers=())
    return tasks.SweepTask(settings, Condition(sigma_deg=2.0, seconds=0.6), "cube", 3)


def test_what_is_kept_of_an_exploration_is_what_was_believed(tmp_path: Path) -> None:
    task = tiny_task()
    ((_, content),) = run_shown_explorations([task])
    path = tmp_path / "kept.npz"
    path.write_bytes(content)
    showing = read(path)
    exploration, traces = worker.explore([task], naming=True)
    trace = traces[task]["haptic_slam"]
    np.testing.assert_array_equal(showing.occupancy[-1], trace.belief.occupancy.astype(np.float16))
    np.testing.assert_array_equal(showing.true_angles, exploration.true_angles)
    np.testing.assert_array_equal(showing.mean, trace.lagged_joint_angles[showing.step - 1])
    assert showing.grid == trace.belief.grid
    assert showing.solid == exploration.solid
    np.testing.assert_array_equal(showing.step, [5, 10, 15, 20, 30])
    assert [showing.frame_at(seconds) for seconds in (0.0, 0.2, 0.39, 0.6, 9.0)] == [0, 1, 2, 4, 4]
    spread = showing.poses(2, 4000).std(axis=0)
    np.testing.assert_allclose(spread, np.sqrt(np.diag(showing.covariance[2])), rtol=0.1)
    path.write_bytes(content[:100])
    with pytest.raises(ValueError, match=r"kept.npz is corrupt"):
        read(path)


def test_a_frame_has_the_map_of_its_moment(tmp_path: Path) -> None:
    """In hindsight of what was felt until then, long before the last frame."""
    task = tiny_task()
    task = replace(task, condition=replace(task.condition, seconds=5.0))
    ((_, content),) = run_shown_explorations([task])
    path = tmp_path / "kept.npz"
    path.write_bytes(content)
    showing = read(path)
    trial = worker.make_trial(task, naming=False)
    slam = trial.observer_runs["haptic_slam"].observer
    maps = {step: slam.map_now() for step in trial}
    trial.env.close()
    for step, shown in zip(showing.step.tolist(), showing.occupancy, strict=True):
        np.testing.assert_array_equal(shown, maps[step].astype(np.float16))
    assert showing.step[-2] == 240
    assert (showing.occupancy[-2] > 0.5).any(), "it has voxels before the end"


def test_a_sphere_is_seen_where_and_as_wide_as_it_is() -> None:
    grid = Grid.around(np.zeros(3), np.full(3, 0.128), 0.004)
    view = isometric_view.IsometricView(half=(40.0, 40.0))
    solid = shapes.make("sphere", size=(0.05, 0.05, 0.05))
    depth, _, gap = isometric_view.seen(solid, tuple(grid.centre.tolist()), view)
    columns, rows = view.pixels()
    square = columns[None] ** 2 + rows[:, None] ** 2
    inside = square < 24.5**2
    np.testing.assert_allclose(depth[inside], np.sqrt(25**2 - square[inside]), atol=0.2)
    near = (square > 25.05**2) & (square < 27**2)
    np.testing.assert_allclose(gap[near], np.sqrt(square[near]) - 25, atol=0.1)
    np.testing.assert_allclose(view.axes @ view.axes.T, np.eye(3), atol=1e-12)
    assert np.linalg.det(view.axes) == pytest.approx(1.0)
