"""Where results are kept between processes that only cost time to find again: compiled code, pieces of meshes.

What lies there is loaded without a question, so it is a folder that nobody else can write to, or a fresh one.
"""

from __future__ import annotations

import atexit
import functools
import os
import shutil
import stat
import tempfile
import warnings
from pathlib import Path

import platformdirs

VARIABLE = "HAPTIC_SLAM_CACHE"
NAME = "haptic_slam"


def folder() -> Path:
    """Find the user's cache folder, or the one that the environment variable `HAPTIC_SLAM_CACHE` names; made if
    missing.

    Where it cannot be written, belongs to somebody else or is open to others, a temporary folder instead that lasts as
    long as this process, with a warning said once; child processes share it.

    Returns:
        The folder, which exists and can be written.

    Raises:
        OSError: where not even a temporary folder can be made.
    """
    return _usable(os.environ.get(VARIABLE, ""), os.environ.get("XDG_CACHE_HOME", ""))


@functools.cache
def _usable(chosen: str, *_: str) -> Path:
    """Once for as long as the environment asks for the same."""
    try:
        return _private(
            Path(chosen).expanduser() if chosen else Path(platformdirs.user_cache_dir(NAME, appauthor=False))
        )
    except (OSError, RuntimeError, ValueError) as error:  # no such user, no such place, not ours
        fresh = _temporary()
        os.environ[VARIABLE] = str(fresh)
        warnings.warn(
            f"the cache folder cannot be used ({error}); what is compiled or found now is kept in {str(fresh)!r} until "
            f"this process ends: set {VARIABLE} to a folder of yours to keep it",
            RuntimeWarning,
            stacklevel=3,
        )
        return fresh


def _private(place: Path) -> Path:
    """`place`, made if missing; raises `OSError` where it cannot be written, `ValueError` where others may do so."""
    if str(place).startswith("~"):
        raise ValueError("there is no home folder")
    place = place.absolute()
    place.mkdir(mode=0o700, parents=True, exist_ok=True)
    place = place.resolve()
    if hasattr(os, "getuid"):  # elsewhere a user's folders are private as they are
        told = place.stat()
        if told.st_uid != os.getuid():
            raise ValueError(f"{str(place)!r} belongs to another user")
        if told.st_mode & (stat.S_IWGRP | stat.S_IWOTH):
            raise ValueError(f"others may write to {str(place)!r}: chmod go-w")
        for above in place.parents:
            mode = above.stat().st_mode
            if mode & stat.S_IWOTH and not mode & stat.S_ISVTX:
                raise ValueError(f"others may write to {str(above)!r}")
    with tempfile.TemporaryFile(dir=place):  # permissions alone do not tell: a file system may be read-only or full
        return place


def _temporary() -> Path:
    fresh = Path(tempfile.mkdtemp(prefix=f"{NAME}-"))
    atexit.register(_remove, fresh, os.getpid())
    return fresh


def _remove(fresh: Path, maker: int) -> None:
    if os.getpid() == maker:  # not a copy of that process
        shutil.rmtree(fresh, ignore_errors=True)
