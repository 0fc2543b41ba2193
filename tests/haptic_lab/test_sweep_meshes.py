"""How much of the surface is known, and how well meshes fit: `evaluate --meshes`."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pandas as pd
import pytest

from haptic_env.shapes import triangles
from haptic_lab.commands import evaluate
from haptic_lab.sweeps import meshes, options
from haptic_lab.sweeps.measures import GroundTruth
from haptic_lab.sweeps.meshes import MESHES, OF_MESH, TOUCHED
from haptic_lab.sweeps.tasks import SweepTask
from haptic_lab.sweeps.worker import make_trial
from observer.surface.metrics import mesh_score
from observer.surface_metrics import surface_coverage, surface_places, touched_places
from tests.haptic_lab.workers import in_this_process

FEW = ["--shapes", "cube", "sphere", "--sigmas", "3", "--seconds", "2", "--trials", "1", "--first-seed", "900000"]
FEW += ["--particles", "1", "--classifiers", "--jobs", "1"]
OBSERVERS = ["--observers", "floor", "smoother_pose", "haptic_slam", "ceiling"]
pytestmark = pytest.mark.usefixtures("coarse", "serially")


@pytest.fixture(scope="module")
def swept(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("meshes")
    with in_this_process():
        assert evaluate.main([*FEW, *OBSERVERS, "--meshes", "--out", str(folder)]) == 0
    return folder


def test_each_row_says_how_well_the_mesh_fits_where_there_is_a_map(swept: Path) -> None:
    rows = pd.read_csv(swept / "trials.csv").set_index(["shape", "observer"])
    with_map = rows[rows.index.get_level_values("observer") != "smoother_pose"]
    assert with_map[list(MESHES)].notna().all(axis=None)
    assert rows.xs("smoother_pose", level="observer")[list(OF_MESH)].isna().all(axis=None)
    assert (rows.groupby("shape")[TOUCHED].nunique() == 1).all(), "what the skin was at is nobody's belief"
    assert (rows.xs("ceiling", level="observer")["mesh_iou"] > rows.xs("floor", level="observer")["mesh_iou"]).all()


def test_a_row_has_what_the_metrics_make_of_the_last_belief(swept: Path, tmp_path: Path) -> None:
    plan = options.check(None, [*FEW, *OBSERVERS, "--out", str(tmp_path)])
    trial = make_trial(SweepTask(plan.settings, plan.conditions[0], "sphere", 900_000), naming=True)
    trial.run()
    exploration, traces = trial.finish()
    solid, belief = exploration.solid, traces["haptic_slam"].belief
    touched = touched_places(exploration.hand, exploration.true_angles, exploration.contacts, solid)
    row = pd.read_csv(swept / "trials.csv").set_index(["shape", "observer"]).loc["sphere", "haptic_slam"]
    for name, value in mesh_score(belief.surface(), solid, touched)._asdict().items():
        assert row[f"mesh_{name}"] == pytest.approx(value, rel=1e-5), name
    assert row["surface_coverage"] == pytest.approx(surface_coverage(belief.occupancy, belief.grid, solid), rel=1e-5)
    away = np.linalg.norm(surface_places(solid, belief.grid)[:, None] - touched, axis=2).min(axis=1)
    assert row[TOUCHED] == pytest.approx((away <= belief.grid.resolution).mean(), rel=1e-5)
    assert 0.0 < row[TOUCHED] < 1.0


def test_what_was_never_touched_is_not_covered() -> None:
    nowhere, some = np.empty((0, 3)), np.array([[0.0, 0.0, 0.0], [0.1, 0.0, 0.0]])
    nothing = np.zeros(0, dtype=bool)
    truth = GroundTruth(nothing, nowhere, nothing, nothing, nothing, nothing, some)
    assert meshes.touched_coverage(truth, 0.004) == 0.0
    assert meshes.touched_coverage(truth._replace(touched=some[:1] + 0.003, surface=some), 0.004) == 0.0
    assert meshes.touched_coverage(truth._replace(touched=some[:1] + 0.002, surface=some), 0.004) == 0.5
    assert np.isnan(meshes.touched_coverage(truth._replace(surface=nowhere), 0.004))


def test_means_their_intervals_and_closures_are_told(swept: Path) -> None:
    summary = pd.read_csv(swept / "summary.csv").query("shape == 'all'").set_index(["observer", "measure"])
    rows = pd.read_csv(swept / "trials.csv").groupby("observer")
    for measure in (*MESHES, "surface_coverage"):
        line = summary.loc["haptic_slam", measure]
        assert line["mean"] == pytest.approx(rows[measure].mean()["haptic_slam"], rel=1e-4)
        assert line["low"] <= line["mean"] <= line["high"]
        assert line["trials"] == 2
    against = pd.read_csv(swept / "against_floor.csv").query("shape == 'all' and observer == 'ceiling'")
    told = against.set_index("measure")["difference"]
    assert told["mesh_iou"] > 0
    assert told["mesh_chamfer_mm"] < 0
    assert TOUCHED not in told.index, "which is nobody's merit"


def test_it_is_printed_where_it_is_asked_for(swept: Path, capsys: pytest.CaptureFixture) -> None:
    assert evaluate.main([*FEW, *OBSERVERS, "--meshes", "--out", str(swept)]) == 0
    asked = capsys.readouterr().out
    for title in meshes.TITLES.values():
        assert " ".join(title.split()) in " ".join(asked.split())


def test_without_it_a_table_has_none_of_it(tmp_path: Path, capsys: pytest.CaptureFixture) -> None:
    assert evaluate.main([*FEW, "--seconds", "0.2", "--observers", "floor", "--out", str(tmp_path)]) == 0
    assert not set(MESHES) & set(pd.read_csv(tmp_path / "trials.csv").columns)
    assert not set(MESHES) & set(pd.read_csv(tmp_path / "summary.csv")["measure"])
    assert "Intersection over union" not in capsys.readouterr().out


def test_what_makes_no_sense_is_refused_in_a_line(
    tmp_path: Path, capsys: pytest.CaptureFixture, monkeypatch: pytest.MonkeyPatch
) -> None:
    def missing() -> None:
        raise ImportError("trimesh is not installed")

    told = {}
    for name, flags in {"no maps": ["--names-only"], "no meshes": []}.items():
        if name == "no meshes":
            monkeypatch.setattr(triangles, "check", missing)
        with pytest.raises(SystemExit) as ended:
            options.check(None, ["--meshes", *flags, "--out", str(tmp_path / "out")])
        assert ended.value.code == 2
        told[name] = capsys.readouterr().err
        assert told[name].count("\n") == 1
    assert "--names-only makes no maps, which --meshes is about" in told["no maps"]
    assert "--meshes: trimesh is not installed" in told["no meshes"]
