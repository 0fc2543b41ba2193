"""What nobody expects: numbers, arrays, names that are legal Python and no legal value of anything.

Odd arrays are drawn as a kind and a seed and built from these, which is a hundred times faster than entry by entry.
"""

from __future__ import annotations

import datetime
import itertools
from collections.abc import Callable
from decimal import Decimal
from fractions import Fraction
from pathlib import Path
from typing import Any

import numpy as np
from hypothesis import strategies as st

Shape = tuple[int, ...]
Strategy = st.SearchStrategy[Any]
SEEDS = st.integers(0, 2**32 - 1)


class Stranger:
    """Something that is no number, no array and no text, and says so in its own way."""

    def __repr__(self) -> str:
        return "<a stranger>"


class Liar:
    """Claims to be an array and is none."""

    def __array__(self, *_: Any, **__: Any) -> Any:
        raise RuntimeError("no array after all")

    def __repr__(self) -> str:
        return "<a liar>"


NUMBERS: tuple[Any, ...] = (
    *(0, 1, -1, 2, 3, 7, 10**3, 10**6, 10**9, 2**31, 2**63, -(2**63) - 1, 2**64, 10**30, 10**400, -(10**400)),
    *(0.0, -0.0, 0.5, 1.0, -1.0, 1.5, 90.0, 180.0, 1e3, 1e6, 1e9, 1e17, -1e17, 1e150, 1e300, -1e300, 1.7e308),
    *(1e-3, 1e-9, 1e-17, 1e-300, 5e-324, -1e-300, float("nan"), float("inf"), -float("inf")),
    *(True, False, None, "", "1", "nan", "3.0", "ä", b"1", 1 + 2j, complex("nan")),
    *(Fraction(1, 3), Fraction(10**400, 3), Decimal("0.5"), Decimal("nan"), Decimal("1e999"), Decimal("sNaN")),
    *(np.float16(0.5), np.float16("inf"), np.float32(0.5), np.float32("nan"), np.float64("nan"), np.float64(3.0)),
    *(np.longdouble("1e4000"), np.int8(3), np.int64(-1), np.uint64(2**64 - 1), np.bool_(True), np.complex64(1j)),
    *(np.datetime64("2020-01-01"), np.timedelta64(3, "s"), np.str_("3"), np.bytes_(b"3"), datetime.timedelta(1)),
    *(np.array(0.5), np.array([0.5]), np.zeros((0,)), np.ma.masked, [], [1.0], (), {}, {3}, range(3), iter(())),
    *(object, Stranger(), Liar(), NotImplemented, ...),
)
NAMES: tuple[Any, ...] = (
    *("", " ", "\n", "a\nb", "cube\n", "cube ", " cube", "CUBE", "Cube", "cubee", "cube,sphere", "cube+sphere", "+"),
    *("none", "None", "[x]", "[/]", "[bold", "[red]cube[/red]", "ümläut", "Würfel", "立方体", "💩", "a/b", "/", "//"),
    *("~", "~root", "~nobody_of_that_name", "..", "../..", ".", "a\x00b", "\x00", "x" * 300, "x" * 100_000, "-"),
    *("--help", "%s%n", "{}", "{0.__class__}", "\\", "'", '"', "\ud800", "a\udcffb", "\u202e", "\x1b[31m", "\r", "\t"),
    *("haptic_slam+", "+no_lag", "no_lag+no_lag", "paper+paper", "haptic_slam+no_lag+x", "..zip", ".zip", "~/.zip"),
    *(b"cube", b"", None, True, 3, 3.5, float("nan"), ["cube"], ("cube",), {"cube"}, {"cube": 1}, [], (), [None]),
    *(Path("cube"), Path(), Path("/"), np.str_("cube"), np.array("cube"), np.array(["cube"]), Stranger(), object, ...),
)
PATHS: tuple[Any, ...] = tuple(
    f"{stem}{suffix}"
    for stem in ("", "missing", "~/missing", "../missing", "no/folder", "a\x00b", "x" * 300, "[x]", "ü", "\ud800")
    for suffix in (".stl", ".obj", ".ply", ".npz", ".txt", ".toml", ".zip", ".npy", ".csv", "")
) + (
    "/dev/null",
    "/proc/self/mem",
    "/tmp",
    "/",
    ".",
    "",
    "/dev/full",
    "/dev/stdin/x",
    Path("/tmp"),
    3,
    None,
    b"x.stl",
    3.5,
)

odd_numbers: Strategy = st.one_of(st.sampled_from(NUMBERS), st.floats(), st.integers())
odd_names: Strategy = st.one_of(st.sampled_from(NAMES), st.text(max_size=6))
odd_paths: Strategy = st.one_of(st.sampled_from(PATHS), odd_names)


def _some(rng: np.random.Generator, shape: Shape) -> np.ndarray:
    return rng.uniform(0.0, 1.0, shape)


def _spoilt(*values: Any) -> Callable[[np.random.Generator, Shape], Any]:
    """One entry, or all, replaced."""

    def build(rng: np.random.Generator, shape: Shape) -> Any:
        array, value = _some(rng, shape), values[rng.integers(len(values))]
        if array.size:
            array.flat[rng.integers(array.size) if rng.random() < 0.7 else slice(None)] = value
        return array

    return build


def _typed(*types: str) -> Callable[[np.random.Generator, Shape], Any]:
    def build(rng: np.random.Generator, shape: Shape) -> Any:
        return _some(rng, shape).astype(types[rng.integers(len(types))])

    return build


def _other_shape(rng: np.random.Generator, shape: Shape) -> Any:
    shapes = [shape[:-1], (*shape, 1), (1, *shape), (0,), (), (0, *shape), (*shape, 0), (*shape, *shape), shape[::-1]]
    shapes += [tuple(n + more for n in shape) for more in (-1, 1, 2)]
    return _some(rng, shapes[rng.integers(len(shapes))])


def _strided(rng: np.random.Generator, shape: Shape) -> Any:
    if not shape:
        return _some(rng, (1,))[::-1]
    array = _some(rng, (*shape[:-1], 2 * shape[-1]))
    return (array[..., ::2], array[..., ::-2], np.asfortranarray(array[..., ::2]))[rng.integers(3)]


def _unaligned(rng: np.random.Generator, shape: Shape) -> Any:
    return np.frombuffer(b"-" + _some(rng, shape).tobytes(), np.uint8)[1:].view(np.float64).reshape(shape)


def _read_only(rng: np.random.Generator, shape: Shape) -> Any:
    array = _some(rng, shape)
    array.flags.writeable = False
    return array


def _masked(rng: np.random.Generator, shape: Shape) -> Any:
    return np.ma.MaskedArray(_some(rng, shape), mask=rng.random(shape) < (0.0, 0.5, 1.0)[rng.integers(3)])


def _objects(rng: np.random.Generator, shape: Shape) -> Any:
    array = _some(rng, shape).astype(object)
    stranger = (None, "x", Stranger(), 10**400, Decimal("nan"), 1j, [1], 0.5)[rng.integers(8)]
    if array.size:
        array.flat[rng.integers(array.size)] = stranger
    return array


def _nested(rng: np.random.Generator, shape: Shape) -> Any:
    listed = _some(rng, shape).tolist()
    if isinstance(listed, list) and listed and rng.random() < 0.5:
        listed[rng.integers(len(listed))] = ([], [1.0, 2.0], None, "x", {}, float("nan"))[rng.integers(6)]
    return tuple(listed) if isinstance(listed, list) and rng.random() < 0.5 else listed


def _declared(rng: np.random.Generator, shape: Shape) -> Any:
    """Larger than any memory, and takes none."""
    return np.broadcast_to(np.float64(rng.random()), (10**9, *(shape or (1,))))


def _structured(rng: np.random.Generator, shape: Shape) -> Any:
    return np.zeros(shape, dtype=[("x", "f8"), ("y", "f8")])


def _no_array(rng: np.random.Generator, shape: Shape) -> Any:
    odd = (None, "", "text", b"bytes", 3, 0.5, float("nan"), {}, {"x": 1}, {1, 2}, Stranger(), Liar(), object, ..., [])
    more = iter([1.0]), range(3), (x for x in (1.0, 2.0)), memoryview(b"abc"), itertools.count()
    return (*odd, *more)[rng.integers(len(odd) + len(more))]


ARRAYS: dict[str, Callable[[np.random.Generator, Shape], Any]] = {
    "not finite": _spoilt(np.nan, np.inf, -np.inf),
    "far off": _spoilt(1e300, -1e300, 1e150, -1e150, 1e17, -1e17, 1e9, 1e6, -1e6, 100.0, 10.0, -1.0, 1.7e308),
    "tiny": _spoilt(1e-300, -1e-300, 5e-324, -0.0, 1e-17),
    "in degrees": lambda rng, shape: rng.uniform(-180.0, 180.0, shape),
    "all zero": lambda rng, shape: np.zeros(shape),
    "another shape": _other_shape,
    "strided": _strided,
    "unaligned": _unaligned,
    "read-only": _read_only,
    "Fortran order": lambda rng, shape: np.asfortranarray(_some(rng, shape)),
    "masked": _masked,
    "objects": _objects,
    "complex": _typed("complex128", "complex64"),
    "other floats": _typed("float16", "float32", "longdouble", ">f8"),
    "integers": _typed("int8", "uint8", "int64", "uint64", "bool", ">i4"),
    "text": _typed("U8", "S8"),
    "times": lambda rng, shape: np.full(shape, np.datetime64("NaT", "s")),
    "huge float16": lambda rng, shape: np.full(shape, np.float16(65504)),
    "wider than floats": lambda rng, shape: np.full(shape, np.longdouble("1e4000")),
    "structured": _structured,
    "nested": _nested,
    "declared": _declared,
    "no array": _no_array,
}


def build_array(kind: str, seed: int, shape: Shape) -> Any:
    """The odd array that `kind` and `seed` stand for, `shape` being what is asked for."""
    return ARRAYS[kind](np.random.default_rng(seed), shape)


def odd_arrays(shape: Shape) -> Strategy:
    """Odd arrays where one of `shape` is wanted."""
    return st.builds(build_array, st.sampled_from(list(ARRAYS)), SEEDS, st.just(shape))
