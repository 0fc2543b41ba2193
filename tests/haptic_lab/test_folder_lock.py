"""One command at a time writes to a folder, and what is refused leaves nothing behind."""

from __future__ import annotations

import errno
import shutil
import subprocess
import sys
from pathlib import Path

import pytest
from filelock import FileLock

from haptic_lab import folder_lock
from haptic_lab.commands import evaluate, explore, figures
from haptic_lab.folder_lock import claimed
from haptic_lab.sweeps import options

ROOT = Path(__file__).resolve().parents[2]
HOLD = """
import sys, pathlib
from haptic_lab.folder_lock import claimed
with claimed(pathlib.Path(sys.argv[1])):
    print("has it", flush=True)
    sys.stdin.read()
"""
TINY = {
    evaluate.main: ["--shapes", "cube", "--trials", "1", "--seconds", "0.1", "--observers", "floor"],
    figures.main: ["confusion", "--shapes", "cube", "--trials", "1", "--seconds", "0.1"],
    explore.main: ["--shape", "cube", "--seconds", "0.1", "--particles", "2"],
}


def refused(capsys: pytest.CaptureFixture, folder: Path) -> str:
    """What is told where `folder` is claimed in vain."""
    with pytest.raises(SystemExit) as ended, claimed(folder):
        raise AssertionError("it was had")
    error = capsys.readouterr().err
    assert ended.value.code == 2
    assert error.count("\n") == 1
    return error


def holder(folder: Path) -> subprocess.Popen[str]:
    """Another command that has `folder` until its input ends."""
    process = subprocess.Popen(
        [sys.executable, "-c", HOLD, str(folder)],
        stdin=subprocess.PIPE,
        stdout=subprocess.PIPE,
        text=True,
        cwd=ROOT,
    )
    assert process.stdout is not None
    assert process.stdout.readline() == "has it\n"
    return process


def test_a_folder_that_another_process_has_is_refused_until_that_ends(
    tmp_path: Path, capsys: pytest.CaptureFixture
) -> None:
    folder = tmp_path / "deep" / "out"
    with holder(folder) as process:
        assert f"another command is writing to {folder} now" in refused(capsys, folder)
        process.communicate("")
    with claimed(folder):
        assert "another command" in refused(capsys, folder)
    assert not (tmp_path / "deep").exists(), "it was made here, and nothing was written to it"


def test_the_lock_of_a_killed_process_holds_nobody_up(tmp_path: Path) -> None:
    with holder(tmp_path) as process:
        process.kill()
        process.wait()
    assert (tmp_path / folder_lock.LOCK).exists()
    (tmp_path / "exemplars").mkdir()
    for half in (
        tmp_path / f"{folder_lock.UNFINISHED}a.csv",
        tmp_path / "exemplars" / f"{folder_lock.UNFINISHED}b.npz",
    ):
        half.touch()
    (tmp_path / "trials.csv").touch()
    with claimed(tmp_path):
        assert sorted(each.name for each in tmp_path.iterdir()) == [folder_lock.LOCK, "exemplars", "trials.csv"]
        assert not list((tmp_path / "exemplars").iterdir())
    assert not (tmp_path / folder_lock.LOCK).exists()


@pytest.mark.parametrize("command", TINY, ids=lambda command: command.__module__)
def test_no_command_writes_to_a_folder_that_another_one_has(
    command, tmp_path: Path, capsys: pytest.CaptureFixture
) -> None:
    with claimed(tmp_path):
        with pytest.raises(SystemExit) as ended:
            command([*TINY[command], "--out", str(tmp_path)])
        assert [each.name for each in tmp_path.iterdir()] == [folder_lock.LOCK]
    assert ended.value.code == 2
    assert f"another command is writing to {tmp_path} now" in capsys.readouterr().err


def test_figures_and_a_sweep_of_its_own_trials_do_not_write_at_once(
    tmp_path: Path, capsys: pytest.CaptureFixture
) -> None:
    with claimed(tmp_path / "trials"), pytest.raises(SystemExit) as ended:
        figures.main([*TINY[figures.main], "--out", str(tmp_path)])
    assert ended.value.code == 2
    assert f"another command is writing to {tmp_path / 'trials'} now" in capsys.readouterr().err
    assert not list(tmp_path.iterdir())


@pytest.mark.parametrize("command", [evaluate.main, figures.main], ids=lambda command: command.__module__)
def test_it_has_the_folder_until_it_ends(command, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    asked = []

    def sweep(plan, results, *_) -> None:
        for folder in {results.folder, tmp_path}:
            with pytest.raises(SystemExit), claimed(folder):
                asked.append(folder)
        raise ValueError("enough")

    monkeypatch.setattr(sys.modules[command.__module__], "sweep", sweep)
    assert command([*TINY[command], "--out", str(tmp_path)]) == 1
    assert not asked
    with claimed(tmp_path):
        pass


def test_a_file_system_without_locks_is_told_and_taken(
    tmp_path: Path, capsys: pytest.CaptureFixture, monkeypatch: pytest.MonkeyPatch
) -> None:
    def acquire(_: FileLock) -> None:
        raise OSError(errno.ENOLCK, "No locks available")

    monkeypatch.setattr(FileLock, "acquire", acquire)
    (tmp_path / f"{folder_lock.UNFINISHED}a.csv").touch()
    with claimed(tmp_path):
        assert len(list(tmp_path.iterdir())) == 1, "it may be another's"
    assert "its file system has no locks" in capsys.readouterr().err


@pytest.mark.parametrize("place", ["/dev/null/here", "file", "file/in/it", "l" * 300, "/proc/here"])
def test_what_can_be_no_folder_of_results_is_refused(place: str, tmp_path: Path, capsys: pytest.CaptureFixture) -> None:
    (tmp_path / "file").touch()
    assert "--out must be a folder that can be written to" in refused(capsys, tmp_path / place)
    assert [each.name for each in tmp_path.iterdir()] == ["file"]


def test_another_object_under_the_same_name_is_another_sweep(tmp_path: Path, capsys: pytest.CaptureFixture) -> None:
    trimesh = pytest.importorskip("trimesh")
    mesh = tmp_path / "box.stl"
    trimesh.creation.box((0.05, 0.05, 0.05)).export(mesh)
    arguments = ["--shapes", "cube", str(mesh), "--observers", "floor", "--out", str(tmp_path / "out")]
    options.parse(None, arguments)
    options.parse(None, arguments)
    shutil.copy(mesh, tmp_path / "box.bak")
    trimesh.creation.box((0.05, 0.05, 0.04)).export(mesh)
    with pytest.raises(SystemExit):
        options.parse(None, arguments)
    assert f"file {mesh} is" in capsys.readouterr().err
