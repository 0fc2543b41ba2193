"""Objects are called what their files are called, whatever that is, on the screen, in files and in pictures."""

from __future__ import annotations

import io
from pathlib import Path

import pandas as pd
import pytest
import trimesh
from matplotlib.figure import Figure

from haptic_lab.analysis.summary import parts
from haptic_lab.commands import evaluate, explore, figures
from haptic_lab.conditions import FACTORS
from haptic_lab.figures import confusion, figure5
from haptic_lab.figures.paper_figure import PRINT
from haptic_lab.style import as_drawn, titles_of
from haptic_lab.sweeps.results import listed

pytestmark = pytest.mark.usefixtures("coarse")
ODD = "_a [old] [bold]:smile: $x_$ ü.stl"
TINY = [
    *("--sigmas", "3", "--trials", "1", "--seconds", "0.6", "--particles", "3", "--exemplars", "1"),
    *("--observers", "floor", "haptic_slam"),
]


@pytest.fixture
def meshes(serially: None, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> list[str]:
    """Files in a folder below this one, of which one is called as a shape is."""
    here = tmp_path / "here"
    (here / "in [it]").mkdir(parents=True)
    trimesh.creation.box((0.05, 0.05, 0.03)).export(here / "in [it]" / "cube.stl")
    trimesh.creation.box((0.06, 0.05, 0.03)).export(here / "in [it]" / ODD)
    monkeypatch.chdir(here)
    monkeypatch.setattr(io, "text_encoding", lambda encoding, _=2: "latin-1" if encoding is None else encoding)
    return ["in [it]/cube.stl", f"in [it]/{ODD}"]


def files(folder: Path) -> set[str]:
    return {each.relative_to(folder).as_posix() for each in folder.rglob("*") if each.is_file()}


def test_an_exploration(
    meshes: list[str], tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture
) -> None:
    (tmp_path / "home").mkdir()
    trimesh.creation.box((60, 50, 30)).export(tmp_path / "home" / ODD)
    monkeypatch.setenv("HOME", str(tmp_path / "home"))
    before = files(tmp_path / "here")
    arguments = ["--shape", f"~/{ODD}", "--scale", "0.001", "--seconds", "0.2", "--particles", "2"]
    assert explore.main([*arguments, "--out", "~/out [a]"]) == 0
    told = capsys.readouterr().out
    title = Path(ODD).stem
    assert f"Exploring a {title} by blind touch" in told
    assert f" a {title} (" in " ".join(told.partition("in truth it is")[2].split())
    assert f"{tmp_path}/home/out [a]/explore.png" in told.replace("\n", "")
    assert files(tmp_path / "home" / "out [a]") == {"explore.json", "explore.npz", "explore.png", "recording.npz"}
    assert files(tmp_path / "here") == before


def test_every_figure_of_a_sweep(meshes: list[str], tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(figure5, "SIGMAS", figure5.SIGMAS[:1])
    monkeypatch.setattr(figures, "PRINT", {**PRINT, "savefig.dpi": 40})
    before = files(tmp_path)
    few = ["figure5", "film", "figure6", "confusion"]
    given = [*TINY, "--shapes", "cube", *meshes, "--first-seed", "7"]
    assert figures.main([*few, *given, "--show-seconds", "0.3", "--out", "out"]) == 0
    new = files(tmp_path) - before
    assert all(name.startswith("here/out/") for name in new)
    for name in few:
        kinds = {Path(each).suffix for each in new if Path(each).stem == name}
        assert kinds == {".png", ".pdf", ".csv"} | ({".gif"} if name == "film" else set())
    assert all(name.isascii() for name in new), "any file system has such names"
    rows = pd.read_csv("out/trials/trials.csv")
    assert set(rows["shape"]) == {"cube", *meshes}
    assert set(pd.read_csv("out/confusion.csv")["named"]) == {"cube", *meshes}
    same = [*given, "--classifiers", *figures.DEFAULTS["classifiers"], "--calibration", "--out", "out/trials"]
    assert evaluate.main(same) == 0, "and goes on from what it has written"
    assert files(tmp_path) - before - new == {
        f"here/out/trials/{name}"
        for name in (
            *(f"calibration_{observer}.png" for observer in ("floor", "haptic_slam")),
            *("against_floor.csv", "calibration.csv", "evaluate.png", "summary.csv"),
        )
    }


def test_a_model_in_a_folder_is_a_policy_of_a_sweep() -> None:
    rows = pd.DataFrame(dict.fromkeys(FACTORS, 1.0) | {"policy": ["trained", "out/a b/model.zip"]})
    names = [name for name, _ in parts(rows)]
    assert names[0] == "policy=trained"
    assert Path(names[1]).name == names[1]


def test_observers_without_a_map_confuse_nothing() -> None:
    columns = {"candidates": listed([ODD, "cube"]), "sigma_deg": 3.0, "shape": [ODD, "cube"] * 2}
    rows = pd.DataFrame(columns).assign(
        observer=["haptic_slam", "haptic_slam", "smoother_pose", "smoother_pose"],
        nearest_neighbour=[listed([ODD]), "cube", None, None],
        shape_posterior=[listed([ODD]), listed([ODD]), "cube", "cube"],
    )
    share = confusion.table(rows).set_index(["observer", "namer", "shape", "named"])["share"]
    assert share["haptic_slam", "nearest_neighbour", ODD, ODD] == 1.0
    assert share["smoother_pose", "shape_posterior", ODD, "cube"] == 1.0
    assert ("smoother_pose", "nearest_neighbour") not in share.index.droplevel([2, 3])


def test_titles_tell_objects_apart() -> None:
    labels = ["cube", "a/cube.stl", "b/cube.stl", "b/cup.ply", "b/cup.obj", "pan.stl", "x/bowl.stl"]
    assert titles_of(labels) == {
        "cube": "cube",
        "a/cube.stl": "a/cube.stl",
        "b/cube.stl": "b/cube.stl",
        "b/cup.ply": "cup.ply",
        "b/cup.obj": "cup.obj",
        "pan.stl": "pan",
        "x/bowl.stl": "bowl",
    }
    assert titles_of(["sphere", "sphere.stl"]) == {"sphere": "sphere", "sphere.stl": "sphere.stl"}


@pytest.mark.parametrize("title", ["cube", "$x_$", "a$b", "$$", "_x", "ü [b]", "x" * 300, "\\$", "_" * 300, "%s{}"])
def test_pictures_show_titles_as_they_are(title: str) -> None:
    figure = Figure()
    axes = figure.subplots()
    axes.plot([0, 1], label=as_drawn(title))
    shown = axes.legend().get_texts()
    axes.set_title(as_drawn(title))
    figure.savefig(io.BytesIO())
    figure.savefig(io.BytesIO(), format="pdf")
    assert len(shown) == 1
    assert len(shown[0].get_text()) <= 43
