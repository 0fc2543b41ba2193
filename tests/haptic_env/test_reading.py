"""Files of a stranger: read whole, or refused before they take memory or run anything."""

from __future__ import annotations

import io
import struct
import zipfile
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from haptic_env import reading


def header(shape: tuple[int, ...], descr: Any = "<f8") -> bytes:
    file = io.BytesIO()
    np.lib.format.write_array_header_1_0(file, {"descr": descr, "fortran_order": False, "shape": shape})
    return file.getvalue()


def packed(method: int = zipfile.ZIP_DEFLATED, **members: bytes) -> bytes:
    file = io.BytesIO()
    with zipfile.ZipFile(file, "w", method) as archive:
        for name, content in members.items():
            archive.writestr(name + ".npy", content)
    return file.getvalue()


def saved(**arrays: Any) -> bytes:
    file = io.BytesIO()
    np.savez_compressed(file, **arrays)
    return file.getvalue()


@pytest.mark.parametrize(
    "value",
    [np.arange(6.0).reshape(2, 3).T, np.array("text"), np.array(["a", "bc"]), np.zeros((0, 3), bool), np.float16(2)],
)
def test_arrays_are_read_as_numpy_does(value: Any) -> None:
    whole = saved(a=value, b=3)
    arrays = reading.Arrays(whole, "it.npz")
    assert list(arrays) == ["a", "b"]
    assert "c" not in arrays
    with np.load(io.BytesIO(whole)) as usual:
        assert (arrays["a"].dtype, arrays["a"].flags.f_contiguous) == (usual["a"].dtype, usual["a"].flags.f_contiguous)
        np.testing.assert_array_equal(arrays["a"], usual["a"])
    with pytest.raises(KeyError):
        arrays["c"]


@pytest.mark.parametrize(
    ("whole", "told"),
    [
        (
            packed(a=header((10**12,))),
            r"declares shape \(1000000000000,\) of float64, 8000000000000 bytes, and holds 0",
        ),
        (packed(a=header((2,)) + bytes(24)), "16 bytes, and holds 24"),
        (packed(a=header((-1,)) + bytes(8)), "declares shape"),
        (packed(a=header((0,), "<U1000000")), "declares shape"),
        (packed(a=header((1,), "|O") + bytes(8)), "it holds object; nothing is read but truth values"),
        (packed(a=header((1,), [("x", "<f8")]) + bytes(8)), "it holds .*; nothing is read but truth values"),
        (packed(a=b"\x93NUMPY\x01\x00" + struct.pack("<H", 60000) + b" " * 60000), "a: .*[Hh]eader"),
        (packed(a=b"\x93NUMPY\x09\x00" + bytes(80)), "a: "),
        (packed(a=b"text"), "a: "),
        (packed(zipfile.ZIP_LZMA, a=header((1,)) + bytes(8)), "a is packed by method 14; NumPy's are 0 and 8"),
        (b"nothing of the kind", "not a whole .npz file"),
        (b"", "not a whole .npz file"),
        (reading.LISTED * (reading.MOST_ARRAYS + 1), "more than 10000 arrays"),
    ],
)
def test_what_declares_other_than_it_holds_is_refused(whole: bytes, told: str) -> None:
    with pytest.raises(ValueError, match=rf"(?s)^it\.npz: .*{told}"):
        reading.Arrays(whole, "it.npz")


def test_what_unpacks_to_more_than_the_limit_is_not_unpacked(monkeypatch: pytest.MonkeyPatch) -> None:
    whole = saved(a=np.zeros(2 * reading.MIB, np.int8), b=np.zeros(2 * reading.MIB, np.int8))
    assert len(whole) < 10_000
    assert len(reading.Arrays(whole, "it.npz", 5 * reading.MIB)["a"]) == 2 * reading.MIB
    monkeypatch.setattr(zipfile.ZipFile, "open", None)
    with pytest.raises(ValueError, match=r"it\.npz: its arrays take 4 MiB unpacked; at most 3 MiB are read"):
        reading.Arrays(whole, "it.npz", 3 * reading.MIB)


def test_one_name_is_there_once() -> None:
    file = io.BytesIO()
    with zipfile.ZipFile(file, "w") as archive:
        archive.writestr("a.npy", header((0,)))
        with pytest.warns(UserWarning, match="Duplicate"):
            archive.writestr("a.npy", header((0,)))
    with pytest.raises(ValueError, match=r"it\.npz: a is there twice"):
        reading.Arrays(file.getvalue(), "it.npz")


@pytest.mark.parametrize("seed", range(40))
def test_a_damaged_file_is_refused_or_read(seed: int) -> None:
    """Whatever a few wrong bytes do to it: only a `ValueError` that names the file."""
    rng = np.random.default_rng(seed)
    whole = bytearray(saved(time=np.arange(20.0), names=np.array(["a", "b"])))
    for place in rng.integers(0, len(whole), 1 + seed % 4):
        whole[place] = rng.integers(256)
    try:
        arrays = reading.Arrays(bytes(whole), "it.npz")
        assert [arrays[name].shape for name in arrays]
    except ValueError as error:
        assert str(error).startswith("it.npz: ")  # noqa: PT017 - or it is read


@pytest.mark.parametrize("damage", [lambda whole: whole[:-1], lambda whole: whole + b"x", lambda whole: b""])
def test_one_array_in_a_file(tmp_path: Path, damage: Any) -> None:
    path = tmp_path / "it.npy"
    np.save(path, np.arange(12).reshape(3, 4))
    np.testing.assert_array_equal(reading.npy(path), np.load(path))
    path.write_bytes(damage(path.read_bytes()))
    with pytest.raises(ValueError, match=r"not a whole \.npy file"):
        reading.npy(path)


def test_objects_are_not_made(tmp_path: Path) -> None:
    np.save(tmp_path / "it.npy", np.array([{}]), allow_pickle=True)
    with pytest.raises(ValueError, match="it holds object; nothing is read but"):
        reading.npy(tmp_path / "it.npy")


def test_files_have_a_size_limit(tmp_path: Path) -> None:
    path = tmp_path / "it.txt"
    path.write_bytes(b"a" * 1000)
    assert reading.text(path, 1000) == "a" * 1000
    with pytest.raises(ValueError, match="larger than 0 MiB, which is the most"):
        reading.text(path, 999)
    with pytest.raises(ValueError, match="larger than 1 MiB"):
        reading.toml("/dev/zero")  # has no end
    with path.open("wb") as file:
        file.truncate(reading.LARGEST_ARRAYS + 1)  # takes no room
    with pytest.raises(ValueError, match=r"it\.txt: the file is larger than 512 MiB"):
        reading.npz(path)


@pytest.mark.parametrize(("content", "told"), [(b"\xff\xfe", "not a text file"), (b"a = " + b"[" * 5000, "too deeply")])
def test_what_is_no_toml_is_refused(tmp_path: Path, content: bytes, told: str) -> None:
    path = tmp_path / "it.toml"
    path.write_bytes(content)
    with pytest.raises(ValueError, match=told):
        reading.toml(path)
