"""`haptic-slam learn`, `library` and `explore --library`: an object is learnt, listed and recognised."""

from __future__ import annotations

import json
import shutil

import numpy as np
import pytest

from haptic_lab.commands import explore, learn, library
from observer.library import Library

pytestmark = pytest.mark.usefixtures("coarse")
SHORT = ["--particles", "2", "--seconds", "2", "--seed", "3"]


@pytest.fixture(scope="module")
def learnt(tmp_path_factory):
    """A folder with a library, and with what it was learnt from."""
    folder = tmp_path_factory.mktemp("learnt")
    told = ["--library", str(folder / "objects"), "--out", str(folder / "learnt")]
    assert learn.main(["block", "--shape", "cube", *SHORT, *told]) == 0
    return folder


@pytest.fixture
def objects(learnt, tmp_path):
    """A library with a cube, called block, and beside it what it was learnt from: each test has its own."""
    shutil.copytree(learnt, tmp_path, dirs_exist_ok=True)
    return tmp_path / "objects"


def _refused(capsys, main, arguments: list[str]) -> str:
    capsys.readouterr()
    with pytest.raises(SystemExit) as ended:
        main(arguments)
    assert ended.value.code == 2
    said = capsys.readouterr().err.strip()
    assert len(said.splitlines()) == 1
    return said


def test_what_is_learnt_is_recognised(objects, tmp_path, capsys):
    kept = Library(objects)["block"]
    assert kept.about["shape"] == "cube"
    assert kept.about["seconds"] == pytest.approx(2.0)
    out = tmp_path / "out"
    told = ["--shape", "cube", *SHORT, "--library", str(objects), "--candidates", "sphere", "--rotation-jitter", "10"]
    assert explore.main([*told, "--out", str(out)]) == 0
    summary = json.loads((out / "explore.json").read_text())
    assert set(summary["posterior"]) == {"sphere", "block"}
    assert summary["truth"] == "block"
    said = capsys.readouterr().out
    assert ("This is what you called block, " in said) == (summary["named"] == "block")
    assert "block" in said
    assert "a block" not in said


def test_an_object_lies_any_way_where_one_is_sought_among_those_learnt(objects):
    settings, _ = explore.parse(["--library", str(objects)])
    assert settings.rotation_jitter == 180.0
    settings, _ = explore.parse(["--library", str(objects), "--yaw-jitter", "20"])
    assert settings.rotation_jitter == 0.0
    settings, _ = explore.parse([])
    assert settings.rotation_jitter == 0.0


def test_a_recording_is_learnt(objects, tmp_path, capsys):
    recording = str(tmp_path / "learnt" / "recording.npz")
    arguments = ["again", "--recording", recording, "--library", str(objects), "--out", str(tmp_path / "replayed")]
    assert learn.main([*arguments, "--particles", "2", "--shape", "cube"]) == 0
    assert "Learnt again: " in capsys.readouterr().out
    first, again = (Library(objects)[name].surface for name in ("block", "again"))
    np.testing.assert_allclose(np.ptp(again.vertices, axis=0), np.ptp(first.vertices, axis=0), atol=0.02)


def test_nothing_touched_is_not_learnt(tmp_path, capsys):
    folder = tmp_path / "objects"
    arguments = ["air", "--shape", "cube", "--seconds", "0.1", "--particles", "2", "--library", str(folder)]
    assert learn.main([*arguments, "--out", str(tmp_path / "out")]) == 0
    assert "Nothing was touched: air is not learnt" in capsys.readouterr().out
    assert not folder.exists()


def test_a_name_that_is_taken_meanwhile_is_told(objects, tmp_path, capsys, monkeypatch):
    monkeypatch.setattr(Library, "check", lambda *_, **__: None)
    monkeypatch.setattr(Library, "add", lambda *_, **__: (_ for _ in ()).throw(ValueError("taken")))
    arguments = ["block", "--shape", "cube", *SHORT, "--library", str(objects), "--out", str(tmp_path / "again")]
    capsys.readouterr()
    with pytest.raises(SystemExit):
        learn.main(arguments)
    assert capsys.readouterr().err.strip().endswith("error: block is not learnt: taken")
    assert (tmp_path / "again" / "explore.json").exists()


def test_a_library_is_listed(objects, capsys):
    (objects / "cut.npz").write_bytes((objects / "block.npz").read_bytes()[:500])
    assert library.main([str(objects)]) == 0
    said = capsys.readouterr()
    assert "block" in said.out
    assert "cube" in said.out
    assert "cut.npz" in said.err
    assert library.main([str(objects), "--remove", "cut"]) == 0
    assert Library(objects).names == ("block",)


def test_what_cannot_be_learnt_is_refused_before_anything_is_explored(objects, tmp_path, capsys):
    out = ["--out", str(tmp_path / "out"), "--library", str(objects)]
    assert "'block' is there already" in _refused(capsys, learn.main, ["block", *out])
    assert "'none'" in _refused(capsys, learn.main, ["none", *out])
    assert "'a/b'" in _refused(capsys, learn.main, ["a/b", *out])
    assert "folder" in _refused(capsys, learn.main, ["new", *out[:2], "--library", str(objects / "block.npz")])
    assert not (tmp_path / "out").exists()
    settings, _ = explore.parse(["block", *out, "--replace"], learning=True)
    assert settings.replace


def test_what_is_no_library_is_refused(objects, tmp_path, capsys):
    (tmp_path / "empty").mkdir()
    for wrong in ("missing", "empty"):
        said = _refused(capsys, explore.main, ["--library", str(tmp_path / wrong), "--out", str(tmp_path / "out")])
        assert wrong in said
    assert "missing" in _refused(capsys, library.main, [str(tmp_path / "missing")])
    assert "block" in _refused(capsys, library.main, [str(objects), "--remove", "mug"])
    recording = str(tmp_path / "learnt" / "recording.npz")
    assert "--library" in _refused(capsys, explore.main, ["--recording", recording, "--library", str(objects)])
    said = _refused(capsys, explore.main, ["--recording", recording, "--rotation-jitter", "10"])
    assert "--rotation-jitter" in said
    (objects / "inspect.npz").write_bytes((tmp_path / "learnt" / "recording.npz").read_bytes())
    assert "not an object of a library" in _refused(capsys, library.main, [str(objects), "--remove", "inspect"])
    assert (objects / "inspect.npz").exists()


def test_two_candidates_of_one_name_are_told(objects, tmp_path, capsys):
    (objects / "block.npz").rename(objects / "sphere.npz")
    arguments = ["--library", str(objects), "--candidates", "sphere", "cube", "--out", str(tmp_path / "out")]
    assert explore.main(arguments) == 2
    assert "sphere" in capsys.readouterr().err


def test_what_is_right_is_looked_up_once(objects, tmp_path, monkeypatch):
    """A page asks as well, and libraries may be large."""
    reads, read = [], Library.read
    monkeypatch.setattr(Library, "read", lambda self: reads.append(1) or read(self))
    told = ["--shape", "cube", "--candidates", "sphere", "--rotation-jitter", "5", *SHORT[:2], "--seconds", "0.2"]
    counts = []
    for name, more in (("unseen", []), ("seen", ["--save-html", str(tmp_path / "a.html")])):
        reads.clear()
        given = [*told, "--library", str(objects), "--out", str(tmp_path / name), *more]
        assert explore.main(given) == 0
        counts.append(len(reads))
    assert counts[0] == counts[1] > 0
