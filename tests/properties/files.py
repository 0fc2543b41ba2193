"""Files that nobody would write: whole ones cut short, with bits flipped, spliced, with other numbers or headers."""

from __future__ import annotations

import atexit
import io
import itertools
import re
import shutil
import tempfile
import zipfile
from collections.abc import Mapping
from dataclasses import dataclass
from functools import lru_cache
from pathlib import Path
from typing import Any

import numpy as np
from hypothesis import strategies as st

from tests.properties.parameters import Parameter
from tests.properties.strategies import ARRAYS, SEEDS, Strategy, build_array, odd_paths

TOKENS = (
    *(
        b"nan",
        b"inf",
        b"-inf",
        b"1e300",
        b"-1e300",
        b"1e17",
        b"1e-300",
        b"0",
        b"-1",
        b"1",
        b"2147483648",
        b"4294967295",
    ),
    *(b"99999999999999999999", b"1/1/1", b"1//", b"//", b"x", b"", b"\xff", b"\x00", b"1,5", b"0x10", b"1_0", b"-0"),
    *(b"true", b"[]", b"{}", b'""', b"[[1]]", b"2020-01-01", b"1e400", b"' '", b"\xc3\xbc", b"[red]", b"~", b".."),
)
ENDINGS = ("", ".NPZ", ".stl", ".obj", ".ply", ".npz", ".txt", ".toml", ".npy", ".csv", ".zip")


@dataclass(frozen=True)
class Content:
    """A file of these bytes, or a folder where they are None."""

    suffix: str
    data: bytes | None

    def __repr__(self) -> str:
        if self.data is None:
            return f"a folder named {self.suffix}"
        return f"{len(self.data)} bytes of {self.suffix}: {self.data[:60]!r}"


@lru_cache(maxsize=1)
def _folder() -> Path:
    place = Path(tempfile.mkdtemp(prefix="properties-"))
    atexit.register(shutil.rmtree, place, ignore_errors=True)
    return place


_numbers = itertools.count()


def put_away() -> None:
    """Delete what was written."""
    for old in _folder().iterdir():
        shutil.rmtree(old) if old.is_dir() else old.unlink()


def put(value: Any) -> Any:
    """The path of `value` where it is the content of a file; else `value`."""
    if not isinstance(value, Content):
        return value
    place = _folder() / f"input{next(_numbers)}{value.suffix}"
    if value.data is None:
        place.mkdir()
    else:
        place.write_bytes(value.data)
    return place


def out(path: Any) -> Any:
    """Where to write to what is called `path`: in the folder of the tests, wherever it leads."""
    if not isinstance(path, str | Path) or not str(path):
        return path
    inside = _folder() / str(path).lstrip("/").replace("..", "up")
    return inside if isinstance(path, Path) else str(inside)


def spoilt(suffix: str, *whole: bytes) -> Strategy:
    """Files of one kind made from `whole` ones by damage to their bytes."""

    def build(which: int, how: str, seed: int) -> Content:
        rng = np.random.default_rng(seed)
        data = whole[which % len(whole)]
        return Content(suffix, DAMAGES[how](rng, data, whole[(which + 1) % len(whole)]))

    return st.builds(build, st.integers(0, len(whole) - 1), st.sampled_from(sorted(DAMAGES)), SEEDS)


def _flipped(rng: np.random.Generator, data: bytes, _: bytes) -> bytes:
    changed = bytearray(data)
    for at in rng.integers(len(data), size=rng.integers(1, 9)) if data else ():
        changed[at] ^= 1 << int(rng.integers(8))
    return bytes(changed)


def _spliced(rng: np.random.Generator, data: bytes, other: bytes) -> bytes:
    return data[: rng.integers(len(data) + 1)] + other[rng.integers(len(other) + 1) :]


def _doubled(rng: np.random.Generator, data: bytes, _: bytes) -> bytes:
    at, to = sorted(rng.integers(len(data) + 1, size=2))
    return data[:to] + data[at:to] * int(rng.integers(1, 4)) + data[to:]


def _cut_out(rng: np.random.Generator, data: bytes, _: bytes) -> bytes:
    at, to = sorted(rng.integers(len(data) + 1, size=2))
    return data[:at] + data[to:]


def _oversized(rng: np.random.Generator, data: bytes, _: bytes) -> bytes:
    """A count in the header, or what looks like one, is as large as it can be."""
    found = list(re.finditer(rb"\d+", data[:400]))
    if found and rng.random() < 0.7:
        number = found[rng.integers(len(found))]
        large = (b"4000000000", b"999999999999", b"2147483647", b"1000000", b"-5")[rng.integers(5)]
        return data[: number.start()] + large + data[number.end() :]
    at = int(rng.integers(min(len(data), 120) + 1))
    return data[:at] + b"\xff\xff\xff\xff"[: rng.integers(1, 5)] + data[at + 4 :]


def _other_token(rng: np.random.Generator, data: bytes, _: bytes) -> bytes:
    """A word or a number is another."""
    for _round in range(int(rng.integers(1, 4))):
        found = list(re.finditer(rb"[^\s,=\[\]]+", data))
        if found:
            word = found[rng.integers(len(found))]
            data = data[: word.start()] + TOKENS[rng.integers(len(TOKENS))] + data[word.end() :]
    return data


def _other_lines(rng: np.random.Generator, data: bytes, _: bytes) -> bytes:
    lines = data.split(b"\n")
    order = rng.permutation(len(lines)) if rng.random() < 0.5 else rng.integers(len(lines), size=len(lines))
    return b"\n".join(lines[i] for i in order)


def _without_a_line(rng: np.random.Generator, data: bytes, _: bytes) -> bytes:
    lines = data.split(b"\n")
    del lines[rng.integers(len(lines))]
    return b"\n".join(lines)


DAMAGES = {
    "whole": lambda rng, data, other: data,
    "empty": lambda rng, data, other: b"",
    "truncated": lambda rng, data, other: data[: rng.integers(len(data) + 1)],
    "bits flipped": _flipped,
    "spliced": _spliced,
    "doubled": _doubled,
    "cut out": _cut_out,
    "oversized": _oversized,
    "another token": _other_token,
    "other tokens": _other_token,
    "other lines": _other_lines,
    "without a line": _without_a_line,
    "random": lambda rng, data, other: rng.bytes(int(rng.integers(300))),
    "something before": lambda rng, data, other: rng.bytes(int(rng.integers(1, 20))) + data,
    "text": lambda rng, data, other: "ein Stück Text: [x] ~ 3,5\n".encode(
        ("utf-8", "utf-16", "latin-1")[rng.integers(3)]
    ),
}


def archives(arrays: Mapping[str, np.ndarray], suffix: str = ".npz") -> Strategy:
    """Whole `.npz` files of which some of `arrays` are odd, missing, or called another name."""
    kinds = [kind for kind in ARRAYS if kind not in ("declared", "no array", "nested")]
    names = sorted(arrays)

    def build(changes: list[tuple[str, str]], seed: int) -> Content:
        content: dict[str, Any] = dict(arrays)
        for turn, (name, kind) in enumerate(changes):
            if kind == "missing":
                content.pop(name, None)
            elif kind == "another name":
                content[name.swapcase()] = content.pop(name, np.zeros(1))
            elif kind == "of another":
                content[name] = arrays[names[(seed + turn) % len(names)]]
            elif kind == "a number less":
                content[name] = arrays[name][:-1] if arrays[name].ndim else arrays[name]
            else:
                content[name] = np.asarray(build_array(kind, seed + turn, arrays[name].shape))
        return Content(suffix, _packed(content))

    changed = st.sampled_from([*kinds, "missing", "another name", "of another", "a number less"])
    changes = st.lists(st.tuples(st.sampled_from(names), changed), max_size=2)
    return st.builds(build, changes, st.integers(0, 2**31))


def _packed(content: Mapping[str, Any]) -> bytes:
    file = io.BytesIO()
    with zipfile.ZipFile(file, "w") as packed:
        for name, array in content.items():
            # Objects are pickled here, as a stranger's are; whoever reads them must not run that.
            with packed.open(f"{name}.npy", "w") as member:
                np.lib.format.write_array(member, np.asarray(array), allow_pickle=True)
    return file.getvalue()


def file(suffix: str, *whole: bytes, also: Strategy | None = None, there: bool = False) -> Parameter:
    """A file, of which `whole` are valid contents; `also`: other odd ones. `there`: it is one, whatever it holds."""
    valid = st.sampled_from(whole).map(lambda data: Content(suffix, data))
    odd_contents = [spoilt(suffix, *whole)] * 4 + ([also] * 4 if also is not None else [])
    if there:
        return Parameter(valid, st.one_of(*odd_contents))
    misnamed = st.builds(Content, st.sampled_from(ENDINGS), st.sampled_from([*whole, None]))
    return Parameter(valid, st.one_of(*odd_contents, misnamed, odd_paths))
