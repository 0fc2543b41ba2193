"""Files of a command line that are not there, or are something else, are told before the command is loaded."""

from __future__ import annotations

import importlib
import json
import os
import subprocess
import sys
from collections.abc import Callable
from fnmatch import fnmatchcase
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import agents
from haptic_env import hands, mesh_formats, recordings, shapes
from haptic_env.recordings import adroit_demonstrations, streams
from haptic_lab import cli, file_contents, given_files, without_computing
from haptic_lab.learning import presets
from haptic_lab.people import courses, options, trial_columns, trials
from haptic_lab.people.studies import presets as studies
from haptic_lab.sweeps import config_files
from haptic_lab.sweeps import options as sweep_options
from tests.haptic_env import meshes

ROOT = Path(__file__).resolve().parents[2]
LOADED = without_computing.HEAVY - {"gymnasium"}  # which haptic_env registers its environments with
PNG = b"\x89PNG\r\n\x1a\n" + bytes(100)
WRONG = [  # of each kind of file one that is none
    ("explore", "--hand text.toml", "--hand: 'text.toml' is no TOML file: "),
    ("explore", "--hand picture.toml", "--hand: 'picture.toml' is no TOML file: not a text file"),
    ("explore", "--hand empty.toml", "--hand: 'empty.toml' is no hand: it has no model, it is empty"),
    ("explore", "--hand other.toml", "--hand: 'other.toml' is no hand: it has no model; it has a{b}"),
    ("explore", "--hand picture.png", "--hand: 'picture.png' is no hand: the name of such a file ends in .toml"),
    ("explore", "--shape text.stl", "--shape: 'text.stl' cannot be read, it is no STL or was cut short: "),
    ("explore", "--shape=picture.PLY", "--shape: 'picture.PLY' cannot be read, it is no PLY or was cut short: "),
    ("explore", "--seed 1 --object text.obj", "--object: 'text.obj' has no triangles"),
    ("explore", "--candidates cube text.obj", "--candidates: 'text.obj' has no triangles"),
    ("explore", "--mesh picture.png", "--mesh: 'picture.png' is no shape: "),
    ("explore", "--objects empty.toml", "--objects: 'empty.toml' is no set of objects: it has no objects"),
    ("explore", "--policy text.npz", "--policy: 'text.npz' cannot be read: not a whole .npz file"),
    ("explore", "--policy other.npz", "--policy: 'other.npz' is no policy: it has no description; it has a{b}"),
    ("explore", "--recording text.npz", "--recording: 'text.npz' cannot be read: not a whole .npz file"),
    ("explore", "--recording picture.csv", "--recording: 'picture.csv' cannot be read: not a text file"),
    ("explore", "--recording README", "--recording: 'README' is no recording: the name of such a file ends in .csv"),
    ("explore", "--recording a.csv --columns other.toml", "--columns: 'other.toml' is no map of columns: "),
    ("explore", "--recording a.txt --glove-calibration empty.toml", "--glove-calibration: 'empty.toml' is no calib"),
    ("explore", "--library other.npz", "--library: 'other.npz' is no folder: it is a file"),
    ("explore", "--policy folder.npz", "--policy: 'folder.npz' cannot be read: Is a directory"),
    ("demo", "--policy picture.png", "--policy: 'picture.png' is no policy: "),
    ("learn", "thing --shape text.stl", "--shape: 'text.stl' cannot be read, "),
    ("replay", "empty.npz", "'empty.npz' cannot be read: not a whole .npz file"),
    (
        "replay",
        "other.npz",
        "'other.npz' is no recording: it has no time or timestamp or timestamps or t or *_obs; it h",
    ),
    ("explore", "--recording other.csv", "--recording: 'other.csv' is no recording: it has no time or timestamp or "),
    ("replay", "joints.csv", "joints.csv: say whose joints and patches it has: --hand NAME, or hand = NAME in --colu"),
    ("replay", "joints.csv --hand adroit", "'joints.csv' has no joint of hand 'adroit', WRJ? or THJ? or FFJ? or MFJ? "),
    (
        "explore",
        "--env HapticSLAM/MyoHand-v0 --recording joints.csv",
        "--recording: 'joints.csv' has no joint of hand ",
    ),
    ("replay", "text.txt", "'text.txt' is no recording of a glove: it begins with 'nothing to be read'"),
    ("replay", "text.xdf", "'text.xdf' is no xdf file: it does not begin as one"),
    ("replay", "text.parquet", "'text.parquet' is no parquet file: it does not begin as one"),
    ("replay", "text.zip", "'text.zip' is no zip file: it does not begin as one"),
    ("live", "--udp 5005 --columns empty.toml", "--columns: 'empty.toml' is no map of columns: it has no columns"),
    ("evaluate", "--recordings text.npz --shapes cube", "--recordings: 'text.npz' cannot be read: "),
    ("evaluate", "--recordings joints.csv empty.csv", "--recordings: 'empty.csv' is empty"),
    ("evaluate", "--config text.toml", "--config: 'text.toml' is no TOML file: "),
    ("evaluate", "--config other.toml", "--config: other.toml: unknown key 'a{b}'; choose from ablation, "),
    ("evaluate", "--shapes cube picture.png", "--shapes: 'picture.png' is no shape: "),
    ("check-hand", "control.toml", "'control.toml' is no hand: it has no model; it has '\\x1b[2J'"),
    ("evaluate", "--trial-table other.csv", "--trial-table: 'other.csv' is no table of trials: it has no response; i"),
    ("people", "a.csv other.csv", "'other.csv' is no table of trials: it has no response; it has one, two"),
    ("people", "example --observers text.npz", "--observers: 'text.npz' cannot be read: "),
    ("figures", "figure5 --trials-of other.npz", "--trials-of: 'other.npz' is no folder: it is a file"),
    ("fit", "picture.csv --courses example", "'picture.csv' cannot be read: not a text file"),
    ("fit", "example --courses other.npz", "--courses: 'other.npz' is no courses of belief: it has no log_posterior"),
    ("compare", "example --courses example --models a=text.npz", "--models: 'a=text.npz' cannot be read: "),
    ("design", "ideal a=other.npz --courses example", "'a=other.npz' is no courses of belief: "),
    ("simulate", "--sigma 3 --out x.csv --courses picture.png", "--courses: 'picture.png' is no courses of belief: "),
    ("train", "--preset empty.toml", "--preset: 'empty.toml' is no preset: it has no algorithm, it is empty"),
    ("export", "text.zip --trust", "'text.zip' is no zip file: "),
    ("export", "other.npz --trust", "'other.npz' is no model of Stable-Baselines3: the name of such a file ends in"),
    ("benchmark", "--policies random_torque text.npz", "--policies: 'text.npz' cannot be read: "),
    ("study", "empty.toml", "'empty.toml' is no study: it has no title, it is empty"),
    ("objects", "cube empty.toml", "'empty.toml' is no shape: it has no objects, it is empty"),
    ("bench", "--shape text.stl", "--shape: 'text.stl' cannot be read, "),
    ("check-hand", "other.toml", "'other.toml' is no hand: it has no model; it has a{b}"),
    ("picture-recording", "--recording text.npz --mesh text.stl", "--recording: 'text.npz' cannot be read: "),
    ("library", "other.npz", "'other.npz' is no folder: it is a file"),
]
TOLD = """
import contextlib, io, json, os, sys
from haptic_lab import cli
told = []
for command, flags in json.load(sys.stdin):
    sys.argv = ["haptic-slam", command, *flags.split()]
    with contextlib.redirect_stderr(io.StringIO()) as text:
        try:
            code = cli.main()
        except SystemExit as end:
            code = end.code
    told.append((code, text.getvalue(), sorted(sys.modules)))
print(json.dumps(told))
"""


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Files that are not what they are called."""
    place = tmp_path_factory.mktemp("given")
    for ending in ("toml", "stl", "obj", "ply", "npz", "csv", "txt", "xdf", "parquet", "zip"):
        (place / f"text.{ending}").write_text("nothing to be read\n")
        (place / f"empty.{ending}").touch()
        (place / f"picture.{ending}").write_bytes(PNG)
    (place / "picture.PLY").write_bytes(PNG)
    (place / "picture.png").write_bytes(PNG)
    (place / "README").write_text("read me")
    (place / "other.toml").write_text("['a{b}']\nc = 1")
    (place / "control.toml").write_text('"\\u001b[2J" = 1')
    (place / "other.csv").write_text("one,two\n1,2\n")
    (place / "a.csv").write_text("subject,object,response,seconds\n1,cube,cube,2\n")
    (place / "joints.csv").write_text("t,index_mcp\n0,0\n")
    (place / "a.txt").write_text("2013 1 1 0 0 0.0 1 0 0\n")
    np.savez(place / "other.npz", **{"a{b}": np.zeros(3)})
    (place / "folder.npz").mkdir()
    return place


@pytest.fixture(scope="module")
def told(folder: Path) -> dict[str, Any]:
    """What a process of its own tells of each command line of `WRONG`, and what it has loaded by then."""
    lines = json.dumps([each[:2] for each in WRONG])
    given = {**os.environ, "PYTHONPATH": str(ROOT)}
    ran = subprocess.run(
        [sys.executable, "-c", TOLD], input=lines, cwd=folder, env=given, capture_output=True, text=True, check=True
    )
    return {" ".join(each[:2]): found for each, found in zip(WRONG, json.loads(ran.stdout), strict=True)}


@pytest.mark.parametrize(("command", "flags", "message"), WRONG, ids=[" ".join(each[:2]) for each in WRONG])
def test_a_file_that_is_something_else_is_told_while_nothing_that_computes_is_loaded(
    command: str, flags: str, message: str, told: dict[str, Any]
) -> None:
    code, error, loaded = told[f"{command} {flags}"]
    assert error.startswith(f"haptic-slam {command}: error: {message}")
    assert (code, error.count("\n")) == (2, 1)
    assert LOADED.isdisjoint(loaded)


def test_each_command_that_takes_a_file_is_tried() -> None:
    without = {"scaling", "scheduling"}
    assert {each[0] for each in WRONG} == set(cli.COMMANDS) - without


MISSING = [
    ("explore", "--recording no.npz", "--recording: there is no file 'no.npz'"),
    ("explore", "--seed 3 --shape=no.STL --sigma 2", "--shape: there is no file 'no.STL'"),
    ("explore", "--recording no", "--recording: there is no file 'no'"),
    ("replay", "no", "there is no file 'no'"),
    ("explore", "--shape no.stl", "--shape: there is no file 'no.stl'"),
    ("replay", "no.npz --seed 3", "there is no file 'no.npz'"),
    ("evaluate", "--shapes cube no.obj", "--shapes: there is no file 'no.obj'"),
    ("evaluate", "--config no.toml", "--config: there is no file 'no.toml'"),
    ("people", "~/no.csv", "there is no file '~/no.csv'"),
    ("live", "--udp 5005 --columns no.toml", "--columns: there is no file 'no.toml'"),
    ("check-hand", "no.toml", "there is no file 'no.toml'"),
    ("compare", "example --courses example --models floor=no.npz", "--models: there is no file 'floor=no.npz'"),
]


@pytest.mark.parametrize(("command", "flags", "told"), MISSING, ids=[" ".join(each[:2]) for each in MISSING])
def test_a_file_that_is_not_there_is_told_before_the_command_is_loaded(
    command: str, flags: str, told: str, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture, tmp_path: Path
) -> None:
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr(importlib, "import_module", lambda *_: pytest.fail("it was loaded"))
    monkeypatch.setattr(sys, "argv", ["haptic-slam", command, *flags.split()])
    with pytest.raises(SystemExit) as end:
        cli.main()
    assert end.value.code == 2
    assert capsys.readouterr().err == f"haptic-slam {command}: error: {told}\n"


@pytest.mark.parametrize(
    ("command", "flags"),
    [
        ("explore", "--out no.csv --seed 3"),
        ("explore", "--save-mesh no.ply"),
        ("explore", "--shape cube --objects four"),
        ("explore", "--mesh new.stl --seed 3"),
        ("explore", "--mesh text.stl --shape cube"),  # it is written
        ("explore", "--recording="),
        ("explore", "--shape there.stl"),
        ("explore", "--shape large.stl"),
        ("explore", "--shape cube"),  # a file of that name is none
        ("replay", "--hand adroit joints.csv"),
        ("replay", "joints.csv --hand two_finger"),
        ("replay", "joints.csv --hand mine.toml"),
        ("replay", "joints.csv --hand adroit --hand two_finger"),  # the last one counts
        ("replay", "joints.csv --han two_finger"),
        ("replay", "joints.csv --en HapticSLAM/TwoFinger-v0"),
        ("replay", "other.csv --hand adroit --col map.toml"),
        ("replay", "--hand adroit other.csv --columns map.toml"),
        ("replay", "--part p p.npz"),
        ("evaluate", "--config sweep.toml"),
        ("replay", "--policy sweep joints.csv"),  # which may be the recording
        ("live", "no.npz"),
        ("people", "example"),
        ("people", "other.csv --column response=two"),
        ("fit", "there.csv --model floor=no.npz"),
        ("fit", "there.csv --courses results"),
        ("evaluate", "--shapes there.stl@0.001 noise(4,0.3)"),
        ("evaluate", "--observers floor haptic_slam"),
        ("evaluate", "--recordings sigma=3.npz"),
        ("replay", "large.npz"),
        ("replay", "nothing.zip"),
        ("people", "tabs.tsv"),
        ("people", "semicolons.csv quoted.csv"),
    ],
)
def test_what_may_be_right_is_left_to_the_command(
    command: str, flags: str, monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    monkeypatch.chdir(tmp_path)
    meshes.save(meshes.box((1, 1, 1)), Path("there.stl"))
    Path("cube").touch()
    Path("text.stl").touch()
    Path("results").mkdir()
    Path("there.csv").write_text("subject,object,response,seconds\n1,cube,cube,2\n")
    Path("other.csv").write_text("one,two\n1,2\n")
    Path("joints.csv").write_text("t,index_mcp\n0,0\n")
    Path("mine.toml").write_text('model = "mine.xml"\n')
    Path("map.toml").write_text('hand = "adroit"\n')
    Path("sweep.toml").write_text("repeats = 3\n")
    np.savez("p.npz", p_obs=np.zeros(3))
    Path("large.npz").write_bytes(bytes(given_files.LARGEST + 1))
    Path("large.stl").write_bytes(bytes(given_files.LARGEST_MESH + 1))
    Path("nothing.zip").write_bytes(b"PK\x05\x06" + bytes(18))
    Path("tabs.tsv").write_text("subject\tresponse\n1\tcube\n")
    Path("semicolons.csv").write_text("subject;response\n1;cube\n")
    Path("quoted.csv").write_text('"subject","response"\n"1","cube"\n')
    np.savez("sigma=3.npz", time=np.zeros(3))
    assert given_files.first_wrong(command, flags.split()) is None


def test_a_mesh_that_needs_what_is_not_installed_is_left_to_the_command(
    monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    def missing(*_: str) -> None:
        raise ImportError("manifold3d is missing")

    (tmp_path / "arrow.obj").write_text("v 0 0 0\nv 4 0 0\nv 4 4 0\nv 2 1 0\nv 0 4 0\nf 1 2 3 4 5\n")
    monkeypatch.setattr(mesh_formats.polygons.extras, "load", missing)
    with pytest.raises(ImportError):
        mesh_formats.read(tmp_path / "arrow.obj")
    assert given_files.first_wrong("explore", ["--shape", str(tmp_path / "arrow.obj")]) is None


SOUND = [
    *(("train", f"--preset {path}") for path in presets.FOLDER.glob("*.toml")),
    *(("study", str(path)) for path in studies.FOLDER.glob("*.toml")),
    *(("explore", f"--recording a.txt --glove-calibration {path}") for path in ROOT.glob("haptic_env/**/adroit.toml")),
    *(("check-hand", str(path)) for path in ROOT.glob("examples/**/*.toml")),
    *(("explore", f"--policy {path}") for path in Path(agents.__path__[0]).glob("*.npz")),
    ("fit", f"{options.SHIPPED['table']} --courses {options.SHIPPED['courses']}"),
]


@pytest.mark.parametrize(("command", "flags"), SOUND)
def test_what_ships_is_taken(command: str, flags: str, folder: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(folder)
    assert given_files.first_wrong(command, flags.split()) is None


READERS: dict[str, Callable[[str], Any]] = {
    "--columns": recordings.read_columns,
    "--courses": courses.Courses.load,
    "--glove-calibration": recordings.read_calibration,
    "--hand": hands.make,
    "--objects": shapes.read_set,
    "--policy": lambda path: agents.sb3.read_model(Path(path)),
    "--preset": presets.read,
    "--trial-table": trials.read_trials,
    "study": studies.read,
}


@pytest.mark.parametrize("flag", READERS)
def test_what_is_missed_in_a_file_is_missed_by_its_reader(flag: str, folder: Path) -> None:
    kind = {**given_files.FLAGS, **given_files.ALONE}[flag]
    assert kind.held
    other = folder / f"other{kind.endings[0]}"
    with pytest.raises(ValueError, match=r"a\{b\}|response|log_posterior"):
        READERS[flag](str(other))


@pytest.mark.parametrize("name", hands.HANDS)
def test_joints_of_the_hands_that_ship_are_known(name: str) -> None:
    patterns = given_files.JOINTS[name]
    joints = hands.make(name).joint_names
    assert all(any(fnmatchcase(joint, pattern) for pattern in patterns) for joint in joints)
    assert all(any(fnmatchcase(joint, pattern) for joint in joints) for pattern in patterns)


def test_files_are_taken_by_the_endings_that_are_read() -> None:
    assert set(given_files.RECORDING.endings) == {*recordings.READERS, *recordings.FOREIGN}
    assert set(given_files.MESHES) == set(mesh_formats.READERS)
    assert set(given_files.TABLES) == set(trials.SEPARATORS)
    assert {*trial_columns.CONTENT, *recordings.column_map.CONTENT} == set(given_files.MAPS)
    assert {*given_files.RECORDING.held} == {*streams.TIMES, f"*{adroit_demonstrations.SUFFIX}"}
    _, keys = sweep_options.make_parser(None)
    assert {*given_files.CONFIG} == {*keys, *config_files.ALSO}, "a flag of evaluate is a key of its file"
    assert file_contents.BEGIN[".xdf"] == (recordings.xdf.MAGIC,)
