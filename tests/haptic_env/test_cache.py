"""The cache folder: the user's own, another that is named, or a temporary one where neither is safe."""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path

import pytest

from haptic_env import cache

POSIX = pytest.mark.skipif(not hasattr(os, "getuid"), reason="owners and modes as POSIX has them")


@pytest.fixture(autouse=True)
def own_environment(monkeypatch: pytest.MonkeyPatch) -> None:
    """What a fallback writes into the environment is taken back."""
    monkeypatch.setenv(cache.VARIABLE, "")
    cache._usable.cache_clear()


def _shared(path: Path) -> Path:
    path.mkdir()
    path.chmod(0o777)
    return path


def _below_shared(path: Path) -> Path:
    return _shared(path) / "mine"


def _of_another(path: Path) -> Path:
    path.mkdir()
    return path


def _file(path: Path) -> Path:
    path.write_text("a file")
    return path


def _below_file(path: Path) -> Path:
    return _file(path) / "below"


def _no_home(_: Path) -> Path:
    return Path("~nobody-of-that-name/cache")


def test_it_is_made_private(tmp_path, monkeypatch):
    monkeypatch.setenv(cache.VARIABLE, str(tmp_path / "a" / "b"))
    assert cache.folder() == tmp_path / "a" / "b"
    assert cache.folder().is_dir()
    if os.name == "posix":
        assert cache.folder().stat().st_mode & 0o077 == 0


def test_it_is_the_users_where_none_is_named(tmp_path, monkeypatch):
    monkeypatch.setattr("platformdirs.user_cache_dir", lambda name, **_: str(tmp_path / name))
    assert cache.folder() == tmp_path / "haptic_slam"


def test_a_tilde_is_the_home_folder(tmp_path, monkeypatch):
    monkeypatch.setenv("HOME", str(tmp_path))
    monkeypatch.setenv("USERPROFILE", str(tmp_path))
    monkeypatch.setenv(cache.VARIABLE, "~/kept")
    assert cache.folder() == tmp_path / "kept"


@pytest.mark.parametrize(
    ("make", "why"),
    [
        pytest.param(_shared, "others may write to", marks=POSIX),
        pytest.param(_below_shared, "others may write to", marks=POSIX),
        pytest.param(_of_another, "belongs to another user", marks=POSIX),
        (_file, "File exists|cannot"),
        (_below_file, "Not a directory|cannot"),
        (_no_home, "home"),
    ],
)
def test_where_it_is_not_safe_a_temporary_one_is_used_and_said_once(tmp_path, monkeypatch, make, why):
    monkeypatch.setenv(cache.VARIABLE, str(make(tmp_path / "place")))
    if make is _of_another:
        monkeypatch.setattr("os.getuid", lambda: 10**6)
    with pytest.warns(RuntimeWarning, match=rf"cannot be used \(.*({why}).*set HAPTIC_SLAM_CACHE"):
        found = cache.folder()
    monkeypatch.undo()
    assert tmp_path not in found.parents
    (found / "file").write_text("kept")
    if os.name == "posix":
        assert found.stat().st_mode & 0o077 == 0


def test_a_child_shares_the_temporary_one_and_it_goes_with_its_maker(tmp_path, monkeypatch):
    monkeypatch.setenv(cache.VARIABLE, str(_file(tmp_path / "file")))
    child = "from haptic_env import cache; print(cache.folder())"
    code = f"import sys, subprocess; {child}; sys.stdout.flush(); subprocess.run([sys.executable, '-c', {child!r}])"
    ran = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True, timeout=120)
    own, childs = ran.stdout.split()
    assert own == childs
    assert ran.stderr.count("RuntimeWarning") == 1
    assert not Path(own).exists()
