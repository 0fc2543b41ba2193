"""evaluate --courses and --trial-table: beliefs through time of what people explored."""

from __future__ import annotations

import re
import shutil
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pandas as pd
import pytest
from scipy.special import log_softmax

from haptic_env import recordings
from haptic_env.recordings import Recording
from haptic_lab.commands import evaluate
from haptic_lab.people.courses import Courses
from haptic_lab.people.sweep_courses import condition_of
from haptic_lab.sweeps import options
from haptic_lab.sweeps.tasks import SweepTask
from haptic_lab.sweeps.worker import make_trial
from haptic_lab.trial import Trial
from tests.haptic_env.movements import closing
from tests.haptic_lab.workers import in_this_process

pytestmark = pytest.mark.usefixtures("coarse", "here")
TINY = ["--particles", "5", "--jobs", "1", "--observers", "floor", "haptic_slam", "ceiling", "--first-seed", "900000"]
TABLE = """subject,object,response,seconds,condition
a,cube,cube,0.6,bare
a,sphere,cube,0.4,bare
a,sphere,cylinder,0.5,bare
b,cube,sphere,0.6,sheath
"""
SWEEP = [*TINY, "--sigmas", "3", "5", "--repeats", "2", "--courses"]


@pytest.fixture(scope="module")
def here() -> Iterator[None]:
    """Sweeps start no processes, and draw nothing."""
    with in_this_process(), pytest.MonkeyPatch.context() as patch:
        patch.setattr(evaluate, "report", lambda plan, results, console: results.rewrite())
        yield


@pytest.fixture(scope="module")
def table(tmp_path_factory: pytest.TempPathFactory) -> Path:
    place = tmp_path_factory.mktemp("table") / "trials.csv"
    place.write_text(TABLE, encoding="utf-8")
    return place


@pytest.fixture(scope="module")
def swept(here: None, tmp_path_factory: pytest.TempPathFactory, table: Path) -> Path:
    folder = tmp_path_factory.mktemp("swept") / "out"
    assert evaluate.main(["--trial-table", str(table), *SWEEP, "--out", str(folder)]) == 0
    return folder


def test_cells_are_what_people_explored_for_its_longest_time(swept: Path) -> None:
    courses = Courses.of_sweep(swept)
    assert set(courses.cells) == {("cube", "bare"), ("sphere", "bare"), ("cube", "sheath")}
    assert courses.names == ("cube", "sphere", "cylinder"), "objects, then what else was answered"
    np.testing.assert_array_equal(courses.sigmas, [3.0, 5.0])
    np.testing.assert_allclose(courses.seconds, np.arange(7) / 10)
    assert courses.repeats == 2
    known = ~np.isnan(courses.log_posterior).any(axis=-1)
    assert known[courses.cell("cube", "bare")].all()
    assert known[courses.cell("sphere", "bare"), :, :, :6].all()
    assert not known[courses.cell("sphere", "bare"), :, :, 6].any(), "it lasted 0.5 s"
    np.testing.assert_allclose(courses.log_posterior[:, :, :, 0], -np.log(3), atol=1e-5)
    assert not np.array_equal(*courses.log_posterior[courses.cell("cube", "bare"), 0]), "noise of their own"
    same = [courses.log_posterior[courses.cell("cube", under)] for under in ("bare", "sheath")]
    np.testing.assert_array_equal(*same, "a name of a condition changes nothing of the world")


def test_a_course_is_what_the_observer_believed(swept: Path) -> None:
    rows = pd.read_csv(swept / "trials.csv")
    plan = options.check(None, ["--shapes", "cube", "--candidates", "cube", "sphere", "cylinder", *TINY, "--courses"])
    condition = next(each for each in plan.conditions if each.sigma_deg == 3.0)
    for observer in ("haptic_slam", "ceiling"):
        courses = Courses.of_sweep(swept, observer=observer)
        course = courses.log_posterior[courses.cell("cube", "bare"), 0, 1]
        mine = rows[(rows["shape"] == "cube") & (rows["seed"] == 900001) & (rows["sigma_deg"] == 3.0)]
        last = mine[(mine["observer"] == observer) & (mine["condition"] == "bare")].iloc[0]
        np.testing.assert_allclose(np.exp(course[-1]), [last[f"p_{name}"] for name in courses.names], atol=1e-5)
        trial = make_trial(SweepTask(plan.settings, condition, "cube", 900001), naming=True)
        told = _posteriors(trial, observer, steps=25)
        np.testing.assert_allclose(course[:6], log_softmax(told[::5], axis=1), atol=1e-4)


def _posteriors(trial: Trial, observer: str, steps: int) -> np.ndarray:
    """(steps + 1, C) after the reset and each step of the live observer."""
    shape = trial.observer_runs[observer].shape
    assert shape is not None
    told = [shape.log_posterior]
    for step in trial:
        told.append(shape.log_posterior)
        if step == steps:
            break
    trial.env.close()
    return np.array(told)


def test_killed_half_way_it_goes_on_to_the_same_courses(swept: Path, table: Path, tmp_path: Path) -> None:
    folder = Path(shutil.copytree(swept, tmp_path / "out"))
    whole = (folder / "trials.csv").read_bytes()
    (folder / "trials.csv").write_bytes(whole[: int(0.6 * len(whole))])
    part = Courses.of_sweep(folder)
    assert np.isnan(part.log_posterior).any() or len(part.cells) < 3
    assert evaluate.main(["--trial-table", str(table), *SWEEP, "--out", str(folder)]) == 0
    assert (folder / "trials.csv").read_bytes() == whole
    expected = Courses.of_sweep(swept)
    np.testing.assert_array_equal(Courses.of_sweep(folder).log_posterior, expected.log_posterior)


def test_without_maps_the_courses_are_the_same(swept: Path, table: Path, tmp_path: Path) -> None:
    told = ["--trial-table", str(table), *SWEEP, "--names-only", "--out", str(tmp_path / "out")]
    assert evaluate.main(told) == 0
    for observer in ("floor", "haptic_slam", "ceiling"):
        one, other = (Courses.of_sweep(folder, observer=observer) for folder in (swept, tmp_path / "out"))
        assert one.cells == other.cells
        np.testing.assert_allclose(one.log_posterior, other.log_posterior, atol=1e-5)
    assert pd.read_csv(tmp_path / "out" / "trials.csv")["surface_f_score_1"].isna().all()


def test_sweeps_of_conditions_apart_come_together(swept: Path, table: Path, tmp_path: Path) -> None:
    for under, extra in (("bare", []), ("sheath", ["--contact-miss", "0.3"])):
        told = ["--trial-table", str(table), "--under", under, "--candidates", "cube", "sphere", "cylinder"]
        out = ["--out", str(tmp_path / under)]
        assert evaluate.main([*told, *TINY, "--sigmas", "3", "--repeats", "1", "--courses", *extra, *out]) == 0
    courses = Courses.of_sweep(tmp_path / "bare", tmp_path / "sheath")
    assert set(courses.cells) == {("cube", "bare"), ("sphere", "bare"), ("cube", "sheath")}
    whole = Courses.of_sweep(swept)
    for cell in (("cube", "bare"), ("sphere", "bare")):
        mine, theirs = courses.log_posterior[courses.cell(*cell)], whole.log_posterior[whole.cell(*cell)]
        np.testing.assert_array_equal(mine[0, 0], theirs[0, 0])
    sheathed = [each.log_posterior[each.cell("cube", "sheath")][0, 0] for each in (courses, whole)]
    assert not np.array_equal(*sheathed)


def test_a_recording_of_a_subject_is_a_cell_of_its_own(tmp_path: Path) -> None:
    moved = closing()
    recordings.write(tmp_path / "a.npz", Recording("made", moved.time, moved.joint_names, moved.joint_angles))
    recordings.write(tmp_path / "b.npz", Recording("made", moved.time, moved.joint_names, 0.8 * moved.joint_angles))
    table = tmp_path / "trials.csv"
    table.write_text(
        "subject,object,response,seconds,recording\nx,cube,cube,0.3,a.npz\nx,sphere,cube,0.4,b.npz\n", encoding="utf-8"
    )
    out = ["--out", str(tmp_path / "out")]
    assert (
        evaluate.main(["--trial-table", str(table), *TINY, "--sigmas", "3", "--repeats", "2", "--courses", *out]) == 0
    )
    courses = Courses.of_sweep(tmp_path / "out")
    cells = [(name, condition_of("", str(tmp_path / file))) for name, file in (("cube", "a.npz"), ("sphere", "b.npz"))]
    assert set(courses.cells) == set(cells)
    lasted = (~np.isnan(courses.log_posterior[:, 0, 0, :, 0])).sum(axis=1) - 1
    assert [lasted[courses.cell(*each)] for each in cells] == [3, 4]


def test_of_two_intervals_the_standard_is_explored_as_long(tmp_path: Path) -> None:
    table = tmp_path / "two.csv"
    table.write_text(re.sub(",(cube|cylinder|sphere),(0.*)", r",yes,\2", TABLE), encoding="utf-8")
    flags = ["--trial-table", str(table), *SWEEP, "--standard", "cylinder", "--out", "unused"]
    plan = options.check(None, flags)
    assert set(plan.settings.known) == {"cube", "sphere", "cylinder"}
    lasts = {each.condition: each.seconds for each in plan.conditions if "cylinder" in plan.explored(each)}
    assert lasts == {"bare": 0.6, "sheath": 0.6}


@pytest.mark.parametrize(
    ("flags", "told"),
    [
        (["--shapes", "cube"], "--trial-table says what is explored, and so does --shapes"),
        (["--under", "glove"], "unknown condition of .* 'glove'.*; choose from bare, sheath"),
        (["--column", "seconds"], "--column must be like seconds=duration"),
        (["--seconds", "0"], "--seconds must be"),
        (["--names-only", "--ablation"], "--names-only makes no maps, which --ablation is about"),
    ],
)
def test_what_does_not_go_with_a_table_is_refused(
    table: Path, tmp_path: Path, capsys: pytest.CaptureFixture, flags: list[str], told: str
) -> None:
    with pytest.raises(SystemExit) as ended:
        evaluate.main(["--trial-table", str(table), *TINY, *flags, "--out", str(tmp_path / "out")])
    error = capsys.readouterr().err
    assert ended.value.code == 2
    assert not (tmp_path / "out").exists()
    assert re.search(told, error), error
    assert error.count("\n") == 1


def test_an_altered_course_is_refused_by_its_line(swept: Path, tmp_path: Path) -> None:
    folder = Path(shutil.copytree(swept, tmp_path / "out"))
    table = folder / "trials.csv"
    lines = table.read_text(encoding="utf-8").splitlines(keepends=True)
    lines[4] = lines[4].replace("-1.09861", "-1.09862", 1)
    table.write_text("".join(lines), encoding="utf-8")
    with pytest.raises(ValueError, match=r"trials.csv, line 5: it was altered"):
        Courses.of_sweep(folder)
    with pytest.raises(ValueError, match=r"observer of .* 'nobody'; choose from ceiling, floor, haptic_slam"):
        Courses.of_sweep(swept, observer="nobody")
    with pytest.raises(ValueError, match=r"is not there: it must be a folder of haptic-slam evaluate --courses"):
        Courses.of_sweep(tmp_path)


def test_of_a_table_without_conditions_none_is_chosen(tmp_path: Path, capsys: pytest.CaptureFixture) -> None:
    table = tmp_path / "plain.csv"
    table.write_text("subject,object,response,seconds\nA,cube,cube,1\n", encoding="utf-8")
    with pytest.raises(SystemExit) as ended:
        evaluate.main(["--trial-table", str(table), *TINY, "--under", "bare", "--out", str(tmp_path / "out")])
    assert ended.value.code == 2
    assert "--under is for tables with a column condition, and" in capsys.readouterr().err
