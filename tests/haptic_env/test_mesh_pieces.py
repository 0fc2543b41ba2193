"""Convex pieces: cut in a process of its own that may die, hang or be left behind; kept where nobody else writes."""

from __future__ import annotations

import os
import pickle
import signal
import subprocess
import sys
import time
from collections.abc import Callable
from pathlib import Path

import gymnasium as gym
import numpy as np
import pytest
import trimesh

from haptic_env import cache, shapes
from haptic_env.shapes import decomposition, pieces
from tests.haptic_env import meshes

POSIX = pytest.mark.skipif(os.name != "posix", reason="signals as POSIX has them")
KILLED = "import os, signal; os.kill(os.getpid(), signal.SIGSEGV)"
STUBS = {
    "killed": KILLED,
    "hangs": "import time; time.sleep(600)",
    "raises": "raise MemoryError",
    "prints": "print('a word', flush=True); return [(mesh.vertices, mesh.indices)] * 2",
}


@pytest.fixture
def cutter(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Callable[[str], None]:
    """Puts a module in CoACD's place, in the process that cuts."""

    def put(body: str) -> None:
        (tmp_path / "stub").mkdir()
        (tmp_path / "stub" / "coacd.py").write_text(
            "class Mesh:\n"
            "    def __init__(self, vertices, indices):\n"
            "        self.vertices, self.indices = vertices, indices\n"
            "def set_log_level(level): pass\n"
            f"def run_coacd(mesh, **how):\n    {body}\n"
        )
        monkeypatch.syspath_prepend(str(tmp_path / "stub"))

    monkeypatch.setenv(cache.VARIABLE, str(tmp_path / "cache"))
    return put


def _corner() -> trimesh.Trimesh:
    """A bracket: a concave solid of 20 triangles."""
    corners, faces = meshes.prism(meshes.BRACKET, 0.04, first=3)
    triangles = [[face[0], *face[k : k + 2]] for face in faces for k in range(1, len(face) - 1)]
    return trimesh.Trimesh(corners, triangles, process=False)


def _arms(at: np.ndarray | float = 0.0) -> list[np.ndarray]:
    """The corners of two boxes that are the bracket together."""
    unit = np.array([(x, y, z) for x in (0, 1) for y in (0, 1) for z in (0, 1)], dtype=float)
    return [unit * (0.08, 0.03, 0.04) + at, unit * (0.03, 0.08, 0.04) + at]


def _cut(seconds: float = 100.0) -> list[np.ndarray]:
    solid = _corner()
    return decomposition.cut(np.asarray(solid.vertices), np.asarray(solid.faces), seconds)


@POSIX
def test_a_signal_in_the_library_is_an_error_that_names_the_mesh(cutter, tmp_path):
    cutter(STUBS["killed"])
    path = meshes.save(_corner(), tmp_path / "bracket.stl")
    assert shapes.make(path).signed_distance((0.0, 0.0, 0.0)) > 0, "the truth needs no pieces"
    with pytest.raises(ValueError, match=r"mesh '.*bracket\.stl' cannot be cut .*, CoACD ended by signal 11: .*repair"):
        gym.make("HapticSLAM/TwoFinger-v0", shape=path)
    env = gym.make("HapticSLAM/TwoFinger-v0", shape=[path, "cube"])  # of several, when it is drawn
    with pytest.raises(ValueError, match=r"bracket\.stl' cannot be cut"):
        env.reset(seed=0, options={"shape": path})
    env.reset(seed=0, options={"shape": "cube"})


@pytest.mark.parametrize(
    ("what", "seconds", "why"),
    [("raises", 100.0, "ended with code 1"), ("hangs", 0.5, r"is not cut .* in 0\.5 s: simplify")],
)
def test_a_library_that_fails_or_hangs_is_an_error(cutter, what, seconds, why):
    cutter(STUBS[what])
    with pytest.raises(ValueError, match=why):
        _cut(seconds)


def test_what_the_library_prints_is_no_answer(cutter, capfd):
    cutter(STUBS["prints"])
    first, second = _cut()
    np.testing.assert_array_equal(first, _corner().vertices)
    np.testing.assert_array_equal(second, first)
    assert "word" not in capfd.readouterr().out


@POSIX
def test_the_one_that_cuts_ends_with_the_one_that_waits(cutter, tmp_path):
    told = tmp_path / "pid"
    cutter(f"import os, time; open({str(told)!r}, 'w').write(str(os.getpid())); time.sleep(600)")
    # By itself, without the package, which takes seconds to import.
    alone = str(Path(decomposition.__file__).parent)
    code = f"import sys; sys.path[:] = {[*sys.path, alone]}; import decomposition, numpy as np; "
    code += "decomposition.cut(np.zeros((4, 3)), np.zeros((1, 3), int))"
    parent = subprocess.Popen([sys.executable, "-c", code])
    try:
        _until(lambda: told.exists() and told.read_text() != "")
    finally:
        parent.send_signal(signal.SIGKILL)
        parent.wait()
    child = int(told.read_text())
    _until(lambda: not _runs(child))


def _until(happens: Callable[[], bool]) -> None:
    for _ in range(2000):
        if happens():
            return
        time.sleep(0.05)
    pytest.fail("it never happened")


def _runs(process: int) -> bool:
    try:
        os.kill(process, 0)
    except ProcessLookupError:
        return False
    stat = Path(f"/proc/{process}/stat")
    return not stat.exists() or stat.read_text().rpartition(")")[2].split()[0] != "Z"


def _kept() -> Path:
    (found,) = (cache.folder() / "pieces").iterdir()
    return found


@pytest.fixture
def counted(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> list[int]:
    """How often something was cut, into the two arms of a bracket."""
    monkeypatch.setenv(cache.VARIABLE, str(tmp_path / "cache"))
    calls: list[int] = []

    def cut(vertices: np.ndarray, faces: np.ndarray) -> list[np.ndarray]:
        calls.append(len(faces))
        return _arms(vertices.min(axis=0))

    monkeypatch.setattr("haptic_env.shapes.decomposition.cut", cut)
    return calls


def test_pieces_are_found_once_and_kept_as_plain_arrays(counted):
    first, again = (pieces.convex_pieces(_corner(), 1e-4) for _ in range(2))
    assert len(counted) == 1
    for one, other in zip(first, again, strict=True):
        np.testing.assert_array_equal(one, other)
    with np.load(_kept(), allow_pickle=False) as arrays:
        assert arrays["lengths"].tolist() == [8, 8]
    moved = _corner().apply_translation((1e-3, 0, 0))
    pieces.convex_pieces(moved, 1e-4)
    assert len(counted) == 2, "of another solid"


def _write(how: str, path: Path) -> None:
    whole = path.read_bytes()
    if how == "cut short":
        path.write_bytes(whole[: len(whole) // 2])
    elif how == "empty":
        path.write_bytes(b"")
    elif how == "a pickle":
        path.write_bytes(pickle.dumps(_Bomb()))
    elif how == "objects":
        with path.open("wb") as file:
            np.savez(file, corners=np.array([_Bomb()], dtype=object), lengths=np.array([1]))
    elif how == "another's":
        with path.open("wb") as file:
            np.savez(file, a=np.zeros(3))
    elif how == "a folder":
        path.unlink()
        path.mkdir()


class _Bomb:
    def __reduce__(self) -> tuple:
        return pytest.fail, ("it was unpickled",)


@pytest.mark.parametrize("how", ["cut short", "empty", "a pickle", "objects", "another's", "a folder"])
def test_what_is_kept_and_is_no_answer_is_found_again(counted, how):
    expected = pieces.convex_pieces(_corner(), 1e-4)
    _write(how, _kept())
    again = pieces.convex_pieces(_corner(), 1e-4)
    assert len(counted) == 2
    for one, other in zip(expected, again, strict=True):
        np.testing.assert_array_equal(one, other)


def test_where_nothing_can_be_kept_a_word_is_said_and_it_goes_on(counted, tmp_path, monkeypatch):
    (tmp_path / "file").write_text("no folder")
    monkeypatch.setenv(cache.VARIABLE, str(tmp_path / "file" / "cache"))
    with pytest.warns(RuntimeWarning, match="the cache folder cannot be used"):
        assert len(pieces.convex_pieces(_corner(), 1e-4)) == 2
    pieces.convex_pieces(_corner(), 1e-4)
    assert len(counted) == 1, "it is kept for as long as the process lives"


def test_a_full_disk_costs_time_and_no_more(counted, monkeypatch):
    def full(*_: object) -> None:
        raise OSError(28, "No space left on device")

    monkeypatch.setattr("haptic_env.shapes.pieces.os.replace", full)
    for _ in range(2):
        assert len(pieces.convex_pieces(_corner(), 1e-4)) == 2
    assert len(counted) == 2
    assert not list((cache.folder() / "pieces").iterdir()), "and nothing half-written is left"


def test_a_solid_of_many_triangles_is_simplified_first(counted, monkeypatch):
    monkeypatch.setattr(pieces, "MANY", 3000)
    monkeypatch.setattr("haptic_env.shapes.decomposition.cut", lambda v, f: counted.append(len(f)) or [v])
    monkeypatch.setattr(pieces, "_astray", lambda *_: 0.0)
    torus = trimesh.creation.torus(0.03, 0.01, major_sections=64, minor_sections=48)
    assert len(torus.faces) > 2 * 3000
    tolerance = 0.006 * 0.08
    found = pieces.convex_pieces(torus, tolerance)[0]
    assert counted[0] <= 3000
    assert np.abs(pieces.distance_from(torus.vertices, torus.faces, found)).max() <= tolerance


@pytest.mark.parametrize(
    "wrong",
    [
        _arms()[:1],
        [*_arms(), _arms()[0] + (0.03, 0.03, 0)],
        [2 * arm for arm in _arms()],
        [np.vstack(_arms())],
        [_arms()[0][:3]],
    ],
)
def test_pieces_that_do_not_fill_the_solid_are_refused(counted, tmp_path, monkeypatch, wrong):
    path = meshes.save(_corner(), tmp_path / "bracket.stl")
    gym.make("HapticSLAM/TwoFinger-v0", shape=path).reset(seed=0)
    shapes.find(path).__dict__.pop("_pieces")
    _kept().unlink()
    monkeypatch.setattr("haptic_env.shapes.decomposition.cut", lambda *_: wrong)
    with pytest.raises(
        ValueError, match=r"mesh '.*bracket\.stl' cannot be cut into convex pieces: they differ from it in"
    ):
        shapes.find(path).prepare()


def test_flakes_that_the_physics_cannot_take_are_left_out():
    box = np.array([(x, y, z) for x in (0, 1) for y in (0, 1) for z in (0, 1)], dtype=float)
    flakes = [box * [1, 1, 1e-9], box * [1, 1, 0], box[:3], 1e-3 * box, box[[0, 0, 0, 0]]]
    (left,) = pieces.felt([*flakes, box], 1.0)
    np.testing.assert_array_equal(left, box)
