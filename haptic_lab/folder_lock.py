"""A folder of results is one command's alone for as long as that runs, and of one configuration."""

from __future__ import annotations

import errno
import json
import os
import sys
from collections.abc import Iterable, Iterator, Mapping
from contextlib import ExitStack, contextmanager, suppress
from pathlib import Path
from typing import Any

from filelock import FileLock, Timeout

from haptic_env import reading
from haptic_lab.files import UNFINISHED, check_file
from haptic_lab.terminal import refuse

LOCK = ".haptic-slam.lock"
NO_LOCKS = (errno.ENOLCK, errno.ENOSYS, errno.ENOTSUP, errno.EOPNOTSUPP)  # what a file system without locks answers


@contextmanager
def made(folder: Path) -> Iterator[None]:
    """Make a folder where it is not there; it goes again, and those above it, where it was made here and stayed empty.

    Args:
        folder: for the results.

    Yields:
        Nothing, once the folder is there.

    Raises:
        OSError: where it cannot be made.
    """
    new = [each for each in (folder, *folder.parents) if not os.path.exists(each)]
    try:
        folder.mkdir(parents=True, exist_ok=True)
        yield
    finally:
        with suppress(OSError):
            for each in new:
                each.rmdir()


@contextmanager
def claimed(folder: Path, files: Iterable[str] = ()) -> Iterator[None]:
    """Keep a folder for this command alone; it is made where it is not there.

    Ends the program with code 2 where another command has it, or nothing can be written to it. The lock is the
    operating system's: it is gone with the process, however that ends. What a killed command left half-written goes,
    and so does a folder that was made here and stayed empty.

    Args:
        folder: for the results.
        files: names of those that are written to it in the end, so that it is known before that they can be.

    Yields:
        Nothing, once the folder is claimed.
    """
    lock = FileLock(folder / LOCK, timeout=0, fallback_to_soft=False)
    with ExitStack() as stack:
        try:
            stack.enter_context(made(folder))
            stack.callback(_let_go, lock)
            lock.acquire()
        except Timeout:
            refuse(f"another command is writing to {folder} now; wait until it has ended, or choose another --out")
        except OSError as error:
            if error.errno not in NO_LOCKS:
                refuse(f"--out must be a folder that can be written to: {error}")
            told = "its file system has no locks, so that a second command on it would not be noticed"
            sys.stderr.write(f"{folder}: {told}\n")
        if lock.is_locked:
            for each in (*folder.glob(f"{UNFINISHED}*"), *folder.glob(f"*/{UNFINISHED}*")):
                each.unlink(missing_ok=True)
        try:
            for name in files:
                check_file("a file of --out", folder / name)
        except ValueError as error:
            refuse(str(error))
        yield


def check_configuration(path: Path, configuration: Mapping[str, Any], what: str) -> None:
    """End the program with code 2 where a folder holds results of another configuration.

    Args:
        path: of the JSON file in the folder that says which it holds; there need be none.
        configuration: what results of one folder must have in common.
        what: the folder holds, for the error.
    """
    if not path.exists():
        return
    try:
        kept = json.loads(reading.text(path))
    except (OSError, ValueError, RecursionError) as error:
        refuse(f"{path} is not whole: {error}; choose another --out")
    for key, value in configuration.items():
        held = kept.get(key) if isinstance(kept, dict) else None
        if held != value:
            refuse(f"{path.parent} holds a {what} with {key} = {held!r}, not {value!r}; choose another --out")


def _let_go(lock: FileLock) -> None:
    if not lock.is_locked:
        return
    path = Path(lock.lock_file)
    with suppress(OSError):  # Windows keeps a file that is open
        path.unlink(missing_ok=True)  # before it is let go: whoever has opened it then starts over
    lock.release()
    if sys.platform == "win32":  # elsewhere it might be another command's by now
        with suppress(OSError):
            path.unlink(missing_ok=True)
