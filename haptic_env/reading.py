"""Files that somebody hands over: nothing in them is run, and none is unpacked that says it is larger than may be.

Errors name the file where it holds arrays; whoever reads a text says which one it was.
"""

from __future__ import annotations

import io
import math
import os
import tomllib
import zipfile
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import IO, Any

import numpy as np
from numpy.typing import NDArray

from haptic_env import readable, validate

MIB = 2**20
LARGEST_ARRAYS = 512 * MIB  # bytes: an hour of a whole hand that explores takes 200 MiB
LARGEST_TEXT = 64 * MIB  # an hour of a glove takes 50 MiB
LARGEST_TOML = MIB
PART = 16 * MIB
MOST_ARRAYS = 10_000  # in a file
LISTED = b"PK\x01\x02"  # begins each entry of a zip file's list
KINDS = {"b": "truth values", "i": "integers", "u": "integers", "f": "numbers", "c": "complex numbers", "U": "text"}
HEADERS = {(1, 0): np.lib.format.read_array_header_1_0, (2, 0): np.lib.format.read_array_header_2_0}


def content(path: Path | str, largest: int = LARGEST_ARRAYS) -> bytes:
    """Read the bytes of a file.

    Args:
        path: of the file.
        largest: bytes that are taken.

    Returns:
        The bytes.

    Raises:
        ValueError: for more than `largest` bytes, and for what is no path.
        OSError: where it cannot be read.
    """
    with validate.path("path", path).open("rb") as file:
        if os.fstat(file.fileno()).st_size <= largest:
            parts, left = [], largest  # a pipe has no size
            while left >= 0 and (part := file.read(PART)):
                parts.append(part)
                left -= len(part)
            if left >= 0:
                return b"".join(parts)
    raise ValueError(f"the file is larger than {_mib(largest)}, which is the most that is read")


def text(path: Path | str, largest: int = LARGEST_TEXT) -> str:
    """Read the UTF-8 text in a file.

    Args:
        path: of the file.
        largest: bytes that are taken.

    Returns:
        The text.

    Raises:
        ValueError: for another file, or more than `largest` bytes.
        OSError: where it cannot be read.
    """
    try:
        return content(path, largest).decode("utf-8-sig")
    except UnicodeDecodeError as error:
        raise ValueError(f"not a text file ({error})") from error


def toml(path: Path | str) -> dict[str, Any]:
    """Read a TOML file.

    Args:
        path: of the file.

    Returns:
        What it says.

    Raises:
        ValueError: where it is none.
        OSError: where it cannot be read.
    """
    try:
        return tomllib.loads(text(path, LARGEST_TOML))
    except RecursionError as error:
        raise ValueError("its tables and lists are nested too deeply") from error


def npz(path: Path | str, largest: int = LARGEST_ARRAYS) -> Arrays:
    """Read the arrays in an `.npz` file.

    Args:
        path: of the file.
        largest: bytes that the arrays may take.

    Returns:
        The arrays by their names.

    Raises:
        ValueError: where it is none, or would take more than `largest` bytes.
        OSError: where it cannot be read.
    """
    place = validate.path("path", path)
    try:
        whole = content(place, largest)
    except ValueError as error:
        raise ValueError(f"{place}: {error}") from error
    return Arrays(whole, place, largest)


def npy(path: Path | str) -> NDArray[Any]:
    """Read the array in a `.npy` file.

    Args:
        path: of the file.

    Returns:
        The array.

    Raises:
        ValueError: where it is none, or too large.
        OSError: where it cannot be read.
    """
    whole = content(path)
    try:
        file = io.BytesIO(whole)
        _header(file, len(whole))
        file.seek(0)
        return np.lib.format.read_array(file, allow_pickle=False)
    except Exception as error:  # a damaged file ends NumPy's reader in many ways
        raise ValueError(f"not a whole .npy file ({error})") from error


class Arrays(Mapping[str, NDArray[Any]]):
    """The arrays of an `.npz` file by their names, each unpacked when it is asked for.

    What each declares is compared with what the file holds, and with `largest` bytes for all of them, before anything
    is unpacked. Objects and records are refused.
    """

    def __init__(self, whole: bytes, source: Path | str, largest: int = LARGEST_ARRAYS) -> None:
        """Read what the file says that it holds, and unpack nothing.

        Args:
            whole: the bytes of the file.
            source: its name, for messages.
            largest: bytes that all arrays may take.

        Raises:
            ValueError: for what is wrong with it.
        """
        self.source = str(source)
        try:
            if whole.count(LISTED) > MOST_ARRAYS:
                raise ValueError(f"more than {MOST_ARRAYS} arrays")
            self._file = zipfile.ZipFile(io.BytesIO(whole))
            listed = self._file.infolist()
        except Exception as error:
            raise self._broken(error) from error
        unpacked = sum(max(member.file_size, 0) for member in listed)
        if unpacked > largest:
            raise ValueError(f"{source}: its arrays take {_mib(unpacked)} unpacked; at most {_mib(largest)} are read")
        self._members: dict[str, zipfile.ZipInfo] = {}
        for member in listed:
            name = member.filename.removesuffix(".npy")
            if name in self._members:
                raise ValueError(f"{source}: {name} is there twice")
            self._check(member, name)
            self._members[name] = member

    __repr__ = readable.line

    def __getitem__(self, name: str) -> NDArray[Any]:
        member = self._members[name]
        try:
            with self._file.open(member) as file:
                result = np.lib.format.read_array(file, allow_pickle=False)
                file.read()  # to the end, where the checksum is compared
                return result
        except Exception as error:
            raise self._broken(error) from error

    def __contains__(self, name: object) -> bool:
        return name in self._members

    def __iter__(self) -> Iterator[str]:
        return iter(self._members)

    def __len__(self) -> int:
        return len(self._members)

    def _check(self, member: zipfile.ZipInfo, name: str) -> None:
        if member.compress_type not in (zipfile.ZIP_STORED, zipfile.ZIP_DEFLATED):
            raise ValueError(f"{self.source}: {name} is packed by method {member.compress_type}; NumPy's are 0 and 8")
        try:
            with self._file.open(member) as file:
                _header(file, member.file_size)
        except Exception as error:
            raise self._broken(f"{name}: {error}") from error

    def _broken(self, error: object) -> ValueError:
        return ValueError(f"{self.source}: not a whole .npz file ({error})")


def _header(file: IO[bytes], size: int) -> None:
    """Read the header of an array of `size` bytes; `ValueError` unless it declares as many numbers or letters."""
    version = np.lib.format.read_magic(file)
    if version not in HEADERS:
        raise ValueError(f"its format {version} is none of {', '.join(map(str, HEADERS))}")
    shape, _, dtype = HEADERS[version](file)
    if dtype.kind not in KINDS or dtype.hasobject:
        raise ValueError(f"it holds {dtype}; nothing is read but {', '.join(dict.fromkeys(KINDS.values()))}")
    declared, held = math.prod(shape) * dtype.itemsize, size - file.tell()
    # Of an array without entries NumPy makes room for one.
    if declared != held or min(shape, default=0) < 0 or dtype.itemsize > max(held, MIB):
        raise ValueError(f"it declares shape {shape} of {dtype}, {declared} bytes, and holds {held}")


def _mib(size: int) -> str:
    return f"{size / MIB:,.0f} MiB"
