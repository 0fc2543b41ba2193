"""Arrays in files of others: .npz and .npy.

Nothing in them is run, and what they declare is looked at before room is made for it: a few hundred bytes may declare
a terabyte, and megabytes may unpack to gigabytes.
"""

from __future__ import annotations

import math
import zipfile
from pathlib import Path
from typing import IO, Any

from numpy.lib import format as npy
from numpy.typing import NDArray

LARGEST = 2**28  # bytes, unpacked
HEADERS: dict[tuple[int, int], Any] = {(1, 0): npy.read_array_header_1_0, (2, 0): npy.read_array_header_2_0}
PLAIN = (zipfile.ZIP_STORED, zipfile.ZIP_DEFLATED)  # as NumPy writes them
ENCRYPTED = 0x1


def read_npz(path: Path, largest: int = LARGEST) -> dict[str, NDArray[Any]]:
    """All arrays of the .npz file at `path`, by name.

    Raises `ValueError` for what is no whole .npz file of plain arrays, or would take more than `largest` bytes.
    """
    try:
        with zipfile.ZipFile(path) as file:
            entries = file.infolist()
            total = sum(entry.file_size for entry in entries)
            if total > largest:
                raise ValueError(f"it would unpack to {total:,} bytes; {largest:,} are allowed")
            found = {}
            for entry in entries:
                if not entry.filename.endswith(".npy"):
                    raise ValueError(f"{entry.filename!r} is no array")
                if entry.compress_type not in PLAIN or entry.flag_bits & ENCRYPTED:
                    raise ValueError(f"{entry.filename!r} is packed in another way than NumPy does")
                with file.open(entry) as stream:
                    _check(stream, entry.filename, entry.file_size)
                with file.open(entry) as stream:
                    found[entry.filename.removesuffix(".npy")] = npy.read_array(stream, allow_pickle=False)
            return found
    except Exception as error:  # bytes of a stranger, in three formats one within the other
        raise ValueError(f"{path} is no whole .npz file: {error}") from error


def read_npy(path: Path, largest: int = LARGEST) -> NDArray[Any]:
    """The array of the .npy file at `path`; raises `ValueError` as `read_npz` does."""
    try:
        size = path.stat().st_size
        if size > largest:
            raise ValueError(f"it has {size:,} bytes; {largest:,} are allowed")
        with path.open("rb") as stream:
            _check(stream, path.name, size)
            stream.seek(0)
            return npy.read_array(stream, allow_pickle=False)
    except Exception as error:
        raise ValueError(f"{path} is no whole .npy file: {error}") from error


def _check(stream: IO[bytes], name: str, size: int) -> None:
    """Raise `ValueError` unless the array that begins at `stream` is plain and fills the `size` bytes that are left."""
    version = npy.read_magic(stream)
    if version not in HEADERS:
        raise ValueError(f"{name!r} is of version {version} of the format, not 1 or 2")
    shape, _, dtype = HEADERS[version](stream)
    if dtype.hasobject:
        raise ValueError(f"{name!r} holds objects of Python, which are pickles: they run code when they are read")
    held = size - stream.tell()
    declared = math.prod(shape) * dtype.itemsize
    if min(shape, default=0) < 0 or declared != held:
        raise ValueError(f"{name!r} declares {declared:,} bytes of numbers and holds {held:,}")
