"""Files that are either whole or not there."""

from __future__ import annotations

import os
import tempfile
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

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
