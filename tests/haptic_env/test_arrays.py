"""Files of arrays: whole ones are read, and what lies about itself is refused before room is made for it."""

from __future__ import annotations

import io
import zipfile
from pathlib import Path

import numpy as np
import pytest
from numpy.lib import format as npy

from haptic_env.arrays import read_npy, read_npz

ARRAYS = {
    "numbers": np.arange(6.0).reshape(2, 3),
    "columns": np.asfortranarray(np.arange(6, dtype=np.int32).reshape(2, 3)),
    "text": np.array("a word"),
    "nothing": np.zeros((0, 3)),
    "yes": np.array([True, False]),
}


def _header(shape: tuple[int, ...], descr: str = "<f8") -> bytes:
    out = io.BytesIO()
    npy.write_array_header_1_0(out, {"descr": descr, "fortran_order": False, "shape": shape})
    return out.getvalue()


def _npz(path: Path, **entries: bytes) -> Path:
    with zipfile.ZipFile(path, "w", zipfile.ZIP_DEFLATED) as file:
        for name, content in entries.items():
            file.writestr(f"{name}.npy", content)
    return path


@pytest.mark.parametrize("write", [np.savez, np.savez_compressed])
def test_what_numpy_writes_is_read_bit_for_bit(tmp_path, write):
    write(tmp_path / "a.npz", **ARRAYS)
    found = read_npz(tmp_path / "a.npz")
    assert found.keys() == ARRAYS.keys()
    for name, array in ARRAYS.items():
        np.testing.assert_array_equal(found[name], array)
        assert found[name].dtype == array.dtype
        np.save(tmp_path / "a.npy", array)
        np.testing.assert_array_equal(read_npy(tmp_path / "a.npy"), array)


@pytest.mark.parametrize(
    ("content", "said"),
    [
        (_header((10**12,)), "declares 8,000,000,000,000 bytes of numbers and holds 0"),
        (_header((1,), "<U200000000"), "declares 800,000,000 bytes"),
        (_header((3,)) + bytes(16), "declares 24 bytes of numbers and holds 16"),
        (_header((-1, -3)) + bytes(24), "declares 24 bytes"),
        (_header((1,), "|O") + b"cos\nsystem\n(S'true'\ntR.", "pickles: they run code"),
        (b"\x93NUMPY\x01\x00\xff\xff{", "EOF|header"),
        (b"\x93NUMPY\x07\x00", "version"),
        (b"", "EOF|magic"),
        (b"\x93NUMPY\x01\x00\x76\x00" + b"(" * 117 + b"\n", "EOF|header"),
    ],
)
def test_arrays_that_lie_about_themselves_are_refused(tmp_path, content, said):
    with pytest.raises(ValueError, match=f"is no whole .npz file: .*({said})"):
        read_npz(_npz(tmp_path / "a.npz", one=_header((1,)) + bytes(8), two=content))
    (tmp_path / "a.npy").write_bytes(content)
    with pytest.raises(ValueError, match=f"is no whole .npy file: .*({said})"):
        read_npy(tmp_path / "a.npy")


def test_what_unpacks_to_far_more_is_refused_by_its_declared_size(tmp_path):
    path = _npz(tmp_path / "a.npz", junk=_header((10**6,)) + bytes(8 * 10**6))
    assert path.stat().st_size < 20_000
    with pytest.raises(ValueError, match="would unpack to 8,000,128 bytes; 1,000,000 are allowed"):
        read_npz(path, largest=10**6)
    np.save(tmp_path / "a.npy", np.zeros(10**6))
    with pytest.raises(ValueError, match="has 8,000,128 bytes; 1,000,000 are allowed"):
        read_npy(tmp_path / "a.npy", largest=10**6)


def test_files_of_other_kinds_are_refused(tmp_path):
    (tmp_path / "text").write_text("no zip")
    whole = tmp_path / "whole.npz"
    np.savez(whole, **ARRAYS)
    (tmp_path / "cut").write_bytes(whole.read_bytes()[:-100])
    flipped = bytearray(whole.read_bytes())
    flipped[flipped.index(np.float64(5.0).tobytes())] ^= 1
    (tmp_path / "flipped").write_bytes(flipped)
    with zipfile.ZipFile(tmp_path / "foreign", "w") as file:
        file.writestr("data", "{}")
    with zipfile.ZipFile(tmp_path / "packed", "w", zipfile.ZIP_LZMA) as file:
        file.writestr("a.npy", _header((0,)))
    for name in ("text", "cut", "flipped", "foreign", "packed", "missing", "."):
        with pytest.raises(ValueError, match="is no whole"):
            read_npz(tmp_path / name)
