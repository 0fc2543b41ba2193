"""Objects that were felt, in a folder: what is added is there, whole, and what is damaged is told."""

from __future__ import annotations

import numpy as np
import pytest
import trimesh

from haptic_env import hands
from observer import HapticSLAM, PoseOnly, ShapePosterior
from observer.library import DamagedEntry, Library
from observer.surface import Surface
from observer.surface.mesh import EMPTY


@pytest.fixture(scope="module")
def hand():
    return hands.make("two_finger")


@pytest.fixture
def surface():
    ball = trimesh.creation.icosphere(subdivisions=2, radius=0.025)
    return Surface(np.array(ball.vertices) + 0.1, np.array(ball.faces), 0.003 - 0.1 * np.array(ball.vertices)[:, 2])


@pytest.fixture
def library(tmp_path, surface):
    made = Library(tmp_path / "objects")
    made.add("mug1", surface, {"hand": "two_finger"})
    made.add("key 2", surface)
    return made


def test_what_is_added_is_there(library, surface):
    again = Library(str(library.path))
    assert again.names == tuple(again) == ("key 2", "mug1")
    assert len(again) == 2
    assert "mug1" in again
    assert "mug" not in again
    kept, about = again["mug1"]
    assert about == {"hand": "two_finger"}
    np.testing.assert_allclose(kept.vertices, surface.vertices - 0.1, atol=1e-12)
    np.testing.assert_array_equal(kept.faces, surface.faces)
    np.testing.assert_array_equal(kept.std, surface.std)
    assert sorted(each.name for each in library.path.iterdir()) == ["key 2.npz", "mug1.npz"]


def test_a_library_that_is_not_there_is_empty(tmp_path):
    assert Library(tmp_path / "none yet").names == ()
    assert not (tmp_path / "none yet").exists()


def test_its_objects_are_candidates(library, hand):
    candidates = library.candidates(hand)
    posterior = ShapePosterior(hand, candidates, rotation_jitter=180.0, variants=10)
    assert posterior.labels == ("key 2", "mug1")
    for (solid,) in candidates.values():
        np.testing.assert_allclose(solid.position, hand.place(np.array(solid.size)))


@pytest.mark.parametrize(
    "name", ["", "none", "None", ".hidden", "a/b", "..", "a\\b", "a\n", "con", "ü", "x" * 65, "a.", 3, None]
)
def test_a_name_that_can_be_none_is_refused(library, surface, name):
    with pytest.raises(ValueError, match="name of an object must be"):
        library.add(name, surface)
    assert len(library) == 2


def test_what_is_there_is_not_overwritten_unless_it_is_asked_for(library, surface):
    before = (library.path / "mug1.npz").read_bytes()
    for name in ("mug1", "MUG1"):
        with pytest.raises(ValueError, match=name):
            library.add(name, surface)
    with pytest.raises(ValueError, match="capitals"):
        library.add("MUG1", surface, replace=True)
    assert (library.path / "mug1.npz").read_bytes() == before
    library.add("mug1", surface, {"second": True}, replace=True)
    assert library["mug1"].about == {"second": True}


def _damaged(data: bytes, how: str) -> bytes:
    return {
        "cut short": data[: len(data) // 2],
        "empty": b"",
        "text": b"a mug",
        "flipped": data[:300] + b"\0\1\2" + data[303:],
    }[how]


@pytest.mark.parametrize("how", ["cut short", "empty", "text", "flipped"])
def test_a_damaged_object_is_told_by_name_and_others_stay(library, hand, how):
    place = library.path / "mug1.npz"
    place.write_bytes(_damaged(place.read_bytes(), how))
    with pytest.raises(ValueError, match=r"mug1\.npz"):
        library["mug1"]
    assert list(library.damaged) == ["mug1"]
    with pytest.warns(DamagedEntry, match=r"mug1\.npz"):
        assert list(library.candidates(hand)) == ["key 2"]
    library.remove("mug1")
    assert library.names == ("key 2",)
    assert library.damaged == {}


@pytest.mark.parametrize(
    ("part", "value"),
    [
        ("vertices", np.full((162, 3), np.nan)),
        ("vertices", np.zeros((0, 3))),
        ("faces", np.zeros((4, 3))),
        ("faces", np.full((320, 3), 10**6)),
        ("faces", np.array([[0, 1, 2]])),
        ("std", np.full(162, -1.0)),
        ("std", np.zeros(3)),
        ("about", np.array("[1, 2]")),
        ("about", np.array("{")),
        ("about", np.zeros(3)),
        ("std", None),
    ],
)
def test_arrays_that_are_no_object_are_refused(library, part, value):
    with np.load(library.path / "mug1.npz") as content:
        arrays = dict(content)
    arrays.pop(part)
    np.savez(library.path / "odd.npz", **arrays, **({} if value is None else {part: value}))
    with pytest.raises(ValueError, match=r"odd\.npz"):
        library["odd"]


def test_nothing_is_left_of_what_cannot_be_added(tmp_path, surface, hand):
    library = Library(tmp_path / "objects")
    slam = HapticSLAM(hand, particles=1)
    for felt, said in (
        (EMPTY, "empty"),
        (slam.reset(0), "empty"),
        (PoseOnly(hand).reset(0), "map"),
        ("mug", "felt must be"),
    ):
        with pytest.raises(ValueError, match=said):
            library.add("mug1", felt)
    with pytest.raises(ValueError, match="about must be"):
        library.add("mug1", surface, {"a": object()})
    assert not library.path.exists()


def test_an_object_is_written_whole_or_not_at_all(library, surface, monkeypatch):
    before = {each.name: each.read_bytes() for each in library.path.iterdir()}

    def cut_short(place, **arrays):
        place.write_bytes(b"PK")
        raise OSError("no space left")

    monkeypatch.setattr(np, "savez_compressed", cut_short)
    for name, replace in (("new", False), ("mug1", True)):
        with pytest.raises(OSError, match="no space"):
            library.add(name, surface, replace=replace)
    assert {each.name: each.read_bytes() for each in library.path.iterdir()} == before


def test_a_file_is_no_library(tmp_path, surface):
    (tmp_path / "file").write_text("")
    with pytest.raises(ValueError, match="folder"):
        Library(tmp_path / "file")
    with pytest.raises(ValueError, match="folder"):
        Library(tmp_path / "file" / "below").add("mug1", surface)


@pytest.mark.parametrize("place", ["/proc/objects", "/proc/objects/below"])
def test_a_library_that_cannot_be_made_is_told_by_its_own_name(place, surface):
    with pytest.raises(ValueError, match=f"library '{place}' cannot be made: '/proc' cannot be written to"):
        Library(place).check("mug1")


def test_a_name_that_is_not_there_is_told_with_those_that_are(library):
    for ask in (library.__getitem__, library.remove):
        with pytest.raises(KeyError, match=r"mug3.*key 2, mug1"):
            ask("mug3")


@pytest.mark.parametrize("arrays", [("angles",), ("vertices", "faces"), ()])
def test_a_file_of_something_else_is_neither_removed_nor_replaced(library, surface, arrays):
    place = library.path / "other.npz"
    np.savez(place, **dict.fromkeys(arrays, np.zeros(3)))
    before = place.read_bytes()
    for ask in (library.remove, lambda name: library.add(name, surface, replace=True)):
        with pytest.raises(ValueError, match=r"other\.npz: not an object of a library, it has no about"):
            ask("other")
    assert place.read_bytes() == before


def test_what_is_no_file_is_not_removed(library):
    (library.path / "folder.npz").mkdir()
    with pytest.raises(ValueError, match="it is no file"):
        library.remove("folder")
