"""Whether files can be written is found out before there is anything to write, and nothing is left of trying."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import pytest

from haptic_env import recordings
from haptic_lab.commands import bench, evaluate, explore, figures, picture_recording, scaling, scheduling, train
from haptic_lab.files import check_writable
from haptic_lab.folder_lock import made
from tests.haptic_env.movements import closing

Command = Callable[[list[str]], object]
FOLDERS: dict[str, tuple[Command, str]] = {
    "explore": (explore.main, "explore.npz"),
    "evaluate": (evaluate.main, "summary.csv"),
    "figures": (figures.main, "film.gif"),
    "train": (train.main, "model.zip"),
    "scaling": (scaling.main, "scaling.png"),
    "scheduling": (scheduling.main, "scheduling.csv"),
}
NO_FOLDERS = ("/proc/out", "/dev/null", "/dev/null/out", "o" * 300)
NO_FILES = {"/proc/a.png": "must be a file in a folder that can be written to", "a" * 300 + ".png": "cannot be written"}


def refused(command: Command, arguments: list[str], capsys: pytest.CaptureFixture) -> str:
    with pytest.raises(SystemExit) as ended:
        command(arguments)
    told = capsys.readouterr()
    assert ended.value.code == 2
    assert told.err.count("\n") == 1
    assert ": error: " in told.err
    assert told.out == "", "nothing was begun"
    return told.err


@pytest.fixture(autouse=True)
def _here(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    (tmp_path / "here").mkdir()
    monkeypatch.chdir(tmp_path / "here")


@pytest.mark.parametrize("command", FOLDERS)
@pytest.mark.parametrize("folder", NO_FOLDERS)
def test_a_folder_that_cannot_be(command: str, folder: str, capsys: pytest.CaptureFixture) -> None:
    assert "--out" in refused(FOLDERS[command][0], ["--out", folder], capsys)
    assert not list(Path().iterdir())


@pytest.mark.parametrize("command", FOLDERS)
def test_a_folder_where_a_file_is_to_be(command: str, capsys: pytest.CaptureFixture) -> None:
    main, name = FOLDERS[command]
    (Path("out") / name).mkdir(parents=True)
    assert f"--out must be a file, got 'out/{name}'" in refused(main, ["--out", "out"], capsys)
    assert {*Path().rglob("*")} == {Path("out"), Path("out") / name}


@pytest.mark.parametrize("path", NO_FILES)
def test_a_picture_that_cannot_be(path: str, tmp_path: Path, capsys: pytest.CaptureFixture) -> None:
    recordings.write(tmp_path / "captured.npz", closing())
    flags = ["--recording", str(tmp_path / "captured.npz"), "--shape", "cube", "--out"]
    for place in {path, str(Path("new") / path)}:
        assert f"--out {NO_FILES[path]}" in refused(picture_recording.main, [*flags, place], capsys)
    assert not list(Path().iterdir())


@pytest.mark.parametrize("path", ["/proc/a.json", "/dev/null", "/", "a" * 300, "none/a.json"])
def test_figures_of_a_benchmark_that_cannot_be(path: str, capsys: pytest.CaptureFixture) -> None:
    assert "--json" in refused(bench.main, ["--json", path], capsys)
    assert not list(Path().iterdir())


def test_what_can_be_written_is_neither_made_nor_changed() -> None:
    check_writable("--it", Path("a.toml"))
    assert not list(Path().iterdir())
    Path("a.toml").write_text("kept")
    check_writable("--it", Path("a.toml"))
    assert [each.read_text() for each in Path().iterdir()] == ["kept"]


def test_a_folder_that_stayed_empty_goes_and_what_was_there_stays() -> None:
    with made(Path("a/b")):
        assert Path("a/b").is_dir()
    assert not list(Path().iterdir())
    Path("a").mkdir()
    with made(Path("a/b")):
        Path("a/b/file").touch()
    with made(Path("a")):
        pass
    assert Path("a/b/file").exists()
