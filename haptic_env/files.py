"""Files that are either whole or not there."""

from __future__ import annotations

import os
import stat
import tempfile
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from haptic_env import validate

UNFINISHED = ".unfinished-"  # how the names of files begin that are being written


@contextmanager
def atomic(path: Path) -> Iterator[Path]:
    """Give a place beside `path` to write to; what was written there becomes `path` when all went well.

    Args:
        path: the file that is written whole, or not at all.

    Yields:
        The place to write to.
    """
    handle, name = tempfile.mkstemp(dir=path.parent, prefix=UNFINISHED, suffix=path.suffix)
    os.close(handle)
    place = Path(name)
    try:
        yield place
        with place.open("rb") as written:
            os.fsync(written.fileno())
        place.chmod(0o644)
        place.replace(path)
    finally:
        place.unlink(missing_ok=True)


def check_file(what: str, path: Path) -> None:
    """Check that no folder or device stands where a file is to be written.

    Args:
        what: tells of it, a flag.
        path: of the file, which may be there.

    Raises:
        ValueError: where one does, or there can be no such file.
    """
    try:
        if not stat.S_ISREG(os.stat(path).st_mode):
            raise ValueError(f"{what} must be a file, got {validate.shown(str(path))}, which is something else")
    except FileNotFoundError:
        return
    except OSError as error:  # a name that is too long, a file in place of a folder
        raise ValueError(f"{what} cannot be written: {error}") from error


def check_writable(what: str, path: Path) -> None:
    """Check, by trying, that a file can be written; nothing is left of it.

    Args:
        what: tells of it, a flag.
        path: of the file.

    Raises:
        ValueError: where it cannot.
    """
    check_file(what, path)
    try:
        handle, name = tempfile.mkstemp(dir=path.parent, prefix=UNFINISHED)
        os.close(handle)
        os.unlink(name)
    except OSError as error:
        told = validate.shown(str(path))
        raise ValueError(f"{what} must be a file in a folder that can be written to, got {told}") from error
