"""A folder of results is one command's alone for as long as that runs."""

from __future__ import annotations

import errno
import os
import sys
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path

from filelock import FileLock, Timeout

from haptic_lab.files import UNFINISHED
from haptic_lab.terminal import refuse

LOCK = ".haptic-slam.lock"
NO_LOCKS = (errno.ENOLCK, errno.ENOSYS, errno.ENOTSUP, errno.EOPNOTSUPP)  # what a file system without locks answers


@contextmanager
def claimed(folder: Path) -> Iterator[None]:
    """Keep a folder for this command alone; it is made where it is not there.

    Ends the program with code 2 where another command has it, or nothing can be written to it. The lock is the
    operating system's: it is gone with the process, however that ends. What a killed command left half-written goes,
    and so does a folder that was made here and stayed empty.

    Args:
        folder: for the results.

    Yields:
        Nothing, once the folder is claimed.
    """
    made = [each for each in (folder, *folder.parents) if not os.path.exists(each)]
    lock = FileLock(folder / LOCK, timeout=0, fallback_to_soft=False)
    try:
        try:
            folder.mkdir(parents=True, exist_ok=True)
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
        yield
    finally:
        if lock.is_locked:
            with suppress(OSError):  # Windows keeps a file that is open
                (folder / LOCK).unlink(missing_ok=True)  # before it is let go: whoever has opened it then starts over
            lock.release()
            if sys.platform == "win32":  # elsewhere it might be another command's by now
                with suppress(OSError):
                    (folder / LOCK).unlink(missing_ok=True)
        with suppress(OSError):
            for each in made:
                each.rmdir()
