"""The command that compares objects with what physics touches, and says which are refused."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pandas as pd
import pytest
import trimesh

from haptic_lab.commands import objects
from haptic_lab.objects.report import COLUMNS

pytestmark = pytest.mark.usefixtures("coarse")


@pytest.fixture(autouse=True)
def here(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    box = trimesh.creation.box((60, 50, 30))
    box.export(tmp_path / "box.stl")
    opened, turned = box.copy(), box.copy()
    opened.update_faces(np.arange(12) > 0)
    opened.export(tmp_path / "open.stl")
    turned.invert()
    turned.export(tmp_path / "turned.stl")
    monkeypatch.chdir(tmp_path)
    return tmp_path


def test_a_line_for_each_object_and_a_picture(here: Path, capsys: pytest.CaptureFixture) -> None:
    assert objects.main(["cube", "box.stl", "torus(0.4)", "--scale", "0.001", "--out", "out"]) == 0
    rows = pd.read_csv(here / "out" / "objects.csv").set_index("object")
    assert [rows.index.name, *rows.columns] == list(COLUMNS)
    assert list(rows.index) == ["cube", "box.stl", "torus(0.4)"]
    np.testing.assert_allclose(rows.loc["box.stl", ["size_x_mm", "size_y_mm", "size_z_mm"]].astype(float), (60, 50, 30))
    assert rows.loc["box.stl", "volume_ml"] == pytest.approx(90, rel=0.03)
    assert rows["pieces"].tolist() == [1, 1, 32]
    assert (rows["off_max_mm"] < 0.4).all()
    assert rows["refused"].isna().all()
    assert (here / "out" / "objects.png").stat().st_size > 1000
    told = capsys.readouterr()
    assert "torus(0.4)" in told.out
    assert told.err == ""


@pytest.mark.parametrize(
    ("said", "why"),
    [
        ('"open.stl"', "open.stl' is not watertight"),
        ('"turned.stl"', "turned.stl' is turned inside out"),
        ('{ file = "box.stl", scale = 1 }', "box.stl' is 60 × 50 × 30 m wide"),
        ('{ file = "box.stl", scale = 1e-6 }', "box.stl' is 6e-05 × 5e-05 × 3e-05 m wide"),
        ('"gone.stl"', "gone.stl' cannot be read"),
        ('"cubee"', "unknown shape 'cubee'"),
    ],
)
def test_what_is_refused_is_told_by_name_and_the_others_are_compared(
    here: Path, said: str, why: str, capsys: pytest.CaptureFixture
) -> None:
    (here / "set.toml").write_text(f'scale = 0.001\n[objects]\ngood = "box.stl"\nbad = {said}\n')
    assert objects.main(["--objects", "set.toml", "--out", "out"]) == 1
    error = capsys.readouterr().err
    assert error.count("\n") == 1
    assert "'set.toml:bad': " in error
    assert why in error
    rows = pd.read_csv(here / "out" / "objects.csv").set_index("object")
    assert why in rows.loc["set.toml:bad", "refused"]
    assert rows.loc["set.toml:good", "pieces"] == 1


@pytest.mark.parametrize("flags", [["--objects", "sett"], ["--scale", "0"], ["gone:Egg"], ["gone.toml"]])
def test_what_makes_no_sense_leaves_nothing(here: Path, flags: list[str], capsys: pytest.CaptureFixture) -> None:
    with pytest.raises(SystemExit) as ended:
        objects.main([*flags, "--out", "out"])
    assert ended.value.code == 2
    assert capsys.readouterr().err.count("\n") == 1
    assert not (here / "out").exists()
