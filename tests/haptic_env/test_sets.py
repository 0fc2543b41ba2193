"""Sets of objects, by name and in files, and names that say how large a mesh is."""

from __future__ import annotations

from pathlib import Path

import gymnasium as gym
import numpy as np
import pytest
import trimesh

from haptic_env import hands, shapes
from haptic_env.shapes import sets
from observer import ShapePosterior

DAILY = """
scale = 0.001
[objects]
box = "meshes/box.stl"
large = { file = "meshes/box.stl", scale = 0.002 }
slim = { file = "meshes/box.stl", size = 0.09 }
said = "meshes/box.stl(scale=0.0015)"
egg = "ellipsoid(1,1, 1.3)"
"coffee tin" = { shape = "cylinder", size = [0.06, 0.06, 0.09] }
ball = { shape = "sphere", size = 0.06 }
"""
SIZES = {
    "box": (0.06, 0.05, 0.03),
    "large": (0.12, 0.1, 0.06),
    "slim": (0.09, 0.075, 0.045),
    "said": (0.09, 0.075, 0.045),
    "egg": shapes.default_size("ellipsoid(1, 1, 1.3)"),
    "coffee tin": (0.06, 0.06, 0.09),
    "ball": (0.06, 0.06, 0.06),
}


@pytest.fixture
def daily(tmp_path: Path) -> Path:
    (tmp_path / "meshes").mkdir()
    trimesh.creation.box((60, 50, 30)).export(tmp_path / "meshes" / "box.stl")
    (tmp_path / "daily.toml").write_text(DAILY)
    return tmp_path / "daily.toml"


@pytest.mark.parametrize("name", shapes.SETS)
def test_sets_that_ship_have_objects_that_are_each_there_once(name: str) -> None:
    names = shapes.read_set(name)
    assert len({*names}) == len(names) == {"four": 4, "twelve": 12, "twenty": 20, "fifty": 50}[name]
    assert [shapes.check("object", each) for each in names] == list(names)


def test_a_file_says_names_files_and_sizes_in_one_place(
    daily: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    (tmp_path / "elsewhere").mkdir()
    monkeypatch.chdir(tmp_path / "elsewhere")
    names = shapes.read_set(daily)
    assert names == tuple(f"{daily}:{label}" for label in SIZES)
    for name, size in zip(names, SIZES.values(), strict=True):
        np.testing.assert_allclose(shapes.default_size(name, scale=0.5), size, rtol=1e-6)
        assert shapes.make(name).name == shapes.check("shape", name) == name
        assert shapes.find(name) is shapes.find(name)


def test_a_list_names_its_meshes_by_their_files(daily: Path) -> None:
    other = daily.with_name("other.toml")
    other.write_text('objects = ["cube", "torus( .4)", "meshes/box.stl(size=0.05)"]')
    assert shapes.read_set(other) == ("cube", "torus(0.4)", f"{other}:box")
    assert max(shapes.default_size(f"{other}:box")) == pytest.approx(0.05)


def test_environments_and_namers_take_a_set(daily: Path) -> None:
    names = [f"{daily}:box", f"{daily}:ball"]
    namer = ShapePosterior(hands.make("two_finger"), names)
    assert namer.labels == tuple(names)
    with gym.make("HapticSLAM/TwoFinger-v0", shape=names, reveal_truth=True) as env:
        seen = {}
        for seed in range(6):
            truth = env.reset(seed=seed)[1]["truth"]
            seen[truth["shape"]] = truth["object_size"]
    assert set(seen) == set(names)
    np.testing.assert_allclose(seen[names[0]], SIZES["box"], rtol=1e-5)


@pytest.mark.parametrize("change", [("0.06 }", "0.05 }"), ("box = ", "bix = ")])
def test_a_file_that_changes_is_read_again(daily: Path, change: tuple[str, str]) -> None:
    before = {name: shapes.origin(name) for name in shapes.read_set(daily)}
    daily.write_text(DAILY.replace(*change) + "\n")
    after = {name: shapes.origin(name) for name in shapes.read_set(daily)}
    assert before != after


def test_what_a_mesh_is_made_of_tells_it_from_another_of_that_name(daily: Path) -> None:
    name, mesh = f"{daily}:box", daily.parent / "meshes" / "box.stl"
    before = shapes.origin(name), shapes.origin(str(mesh))
    trimesh.creation.box((60, 50, 31)).export(mesh)
    assert all(old != new for old, new in zip(before, (shapes.origin(name), shapes.origin(str(mesh))), strict=True))
    assert shapes.origin("torus(0.4)") == b""


@pytest.mark.parametrize(
    ("text", "why"),
    [
        ("", "a table of objects"),
        ("[objects]", "a table of objects"),
        ("objects = []", "a table of objects"),
        ("objects = 3", "a table of objects"),
        ("[objects", "Expected"),
        ("[object]\na = 'cube'", "unknown key 'object' .*did you mean 'objects'"),
        ("scale = -1\nobjects = ['cube']", "scale must be"),
        ("scale = 'mm'\nobjects = ['cube']", "scale must be"),
        ("objects = ['cube', 'cube']", "'cube' twice"),
        ("objects = [3]", "names of shapes"),
        ("objects = ['a/b.stl', 'c/b.stl']", "'b' twice"),
        ("[objects]\n'a:b' = 'cube'", "an object's name"),
        ("[objects]\n'' = 'cube'", "an object's name"),
        ("[objects]\nnone = 'cube'", "must not be 'none'"),
        ("objects = ['meshes/none.stl']", "must not be 'none'"),
        ("[objects]\na = 3", "object 'a'.*name of a shape or the path"),
        ("[objects]\na = {}", "object 'a'.*either shape or file"),
        ("[objects]\na = {file = 'a.stl', shape = 'cube'}", "either shape or file"),
        ("[objects]\na = {file = 'cube'}", "path of a mesh"),
        ("[objects]\na = {shape = 'cube', scale = 2}", "say its size"),
        ("[objects]\na = {shape = 'cube', size = 0}", "object 'a'.*size must be"),
        ("[objects]\na = {shape = 'cube', size = [1, 2]}", "object 'a'.*size must"),
        ("[objects]\na = {shape = 'cube(size=0.04)', size = 0.04}", "size once"),
        ("[objects]\na = {file = 'a.stl', size = 0.04, scale = 2}", "either size or scale"),
        ("[objects]\na = {file = 'a.stl(scale=2)', scale = 2}", "size or scale once"),
        ("[objects]\na = {shape = 'cube', colour = 'red'}", "unknown key 'colour'"),
        ("[objects]\na = 'other.toml:b'", "name of a shape or the path"),
    ],
)
def test_a_file_that_is_no_set_is_refused_in_a_line(tmp_path: Path, text: str, why: str) -> None:
    (tmp_path / "set.toml").write_text(text)
    with pytest.raises(ValueError, match=rf"(?s)set\.toml.*{why}") as refused:
        shapes.read_set(tmp_path / "set.toml")
    assert "\n" not in str(refused.value)


@pytest.mark.parametrize(
    ("name", "why"),
    [
        ("thirty", "unknown set of objects 'thirty'.*four, twelve|choose from fifty, four, twelve"),
        ("missing.toml", "missing.toml.*No such file"),
        ("a\0.toml", "null"),
        (3, "unknown set of objects 3"),
        (None, "unknown set of objects None"),
    ],
)
def test_what_is_no_set_is_refused(name: object, why: str) -> None:
    with pytest.raises(ValueError, match=why):
        shapes.read_set(name)  # type: ignore[arg-type]


@pytest.mark.parametrize(
    ("label", "why"),
    [
        ("bax", r"unknown object of .*daily\.toml 'bax' \(did you mean 'box'\?\); choose from ball, box, coffee tin"),
        ("gone", r"daily\.toml:gone.*cannot be read"),
        ("vast", r"daily\.toml:vast.*object size must|daily\.toml:vast.* m wide"),
        ("odd", r"daily\.toml:odd.*unknown shape 'cuub'"),
    ],
)
def test_an_object_that_cannot_be_explored_is_told_by_its_name(daily: Path, label: str, why: str) -> None:
    more = 'gone = "gone.stl"\nvast = { file = "meshes/box.stl", scale = 1 }\nodd = "cuub"\n'
    daily.write_text(DAILY + more)
    with pytest.raises(ValueError, match=why):
        shapes.check("shape", f"{daily}:{label}")


@pytest.mark.parametrize(
    "brackets", ["(2)", "()", "(scale=1, size=2)", "(width=3)", "(scale=0)", "(size=9)", "(scale=x)"]
)
def test_brackets_of_a_mesh_say_one_scale_or_size(daily: Path, brackets: str) -> None:
    with pytest.raises(ValueError, match=r"box\.stl"):
        shapes.find(f"{daily.parent}/meshes/box.stl{brackets}")


def test_a_mesh_has_one_name_however_it_is_typed(daily: Path) -> None:
    path = daily.parent / "meshes" / "box.stl"
    assert shapes.check("shape", f"{path} ( scale = .001 )") == f"{path}(scale=0.001)"
    assert sets.title(f"{daily}:coffee tin") == "coffee tin"
