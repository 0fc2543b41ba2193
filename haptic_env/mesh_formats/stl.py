"""STL, binary or text: triangles, three corners each."""

from __future__ import annotations

import io
from array import array

import numpy as np

from haptic_env.mesh_formats.polygons import Polygons, check_corners, check_count
from haptic_env.mesh_formats.text import numbers, words_of

HEADER = 84  # bytes, the last four of which declare the triangles
TRIANGLE = np.dtype([("normal", "<f4", 3), ("corners", "<f4", (3, 3)), ("attribute", "<u2")])


def read(data: bytes) -> Polygons:
    """Read the triangles of an STL file.

    Args:
        data: the file's bytes.

    Returns:
        The triangles.

    Raises:
        ValueError: where it is none.
    """
    declared = int.from_bytes(data[HEADER - 4 : HEADER], "little")
    if len(data) >= HEADER and len(data) == HEADER + declared * TRIANGLE.itemsize:
        check_count(declared)
        corners = np.frombuffer(data, TRIANGLE, offset=HEADER)["corners"]
        return _apart(corners.reshape(-1, 3).astype(np.float64))
    if data.removeprefix(b"\xef\xbb\xbf").lstrip()[:5].lower() == b"solid":
        return _text(data)
    if len(data) < HEADER:
        raise ValueError(f"it has {len(data)} bytes, too few for an STL")
    raise ValueError(
        f"it declares {declared:,} triangles, which are {HEADER + declared * 50:,} bytes, and has {len(data):,}"
    )


def _text(data: bytes) -> Polygons:
    corners = array("d")
    since = 0  # of `corners`, at the start of the facet
    ended = True
    for number, line in enumerate(io.BytesIO(data), 1):
        words = words_of(line, number)
        match words[0].lower() if words else b"":
            case b"vertex":
                corners.extend(numbers(words[1:], 3, number))
                check_corners(len(corners) // 3)
            case b"outer":
                since = len(corners)
            case b"endloop":
                if len(corners) - since != 9:
                    raise ValueError(f"line {number}: a facet of {(len(corners) - since) // 3} corners, not of three")
            case b"solid":
                ended = False
            case b"endsolid":
                ended = True
    if not ended or len(corners) % 9:
        raise ValueError("it ends before its last endsolid")
    return _apart(np.array(corners).reshape(-1, 3))


def _apart(vertices: np.ndarray) -> Polygons:
    return Polygons(vertices, np.arange(len(vertices)), np.full(len(vertices) // 3, 3))
