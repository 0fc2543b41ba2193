"""Wavefront OBJ: corners and faces of any number of corners; materials, textures and normals are left aside."""

from __future__ import annotations

import io
from array import array

import numpy as np

from haptic_env.mesh_formats.polygons import Polygons, check_corners, check_count
from haptic_env.mesh_formats.text import numbers, whole, words_of


def read(data: bytes) -> Polygons:
    """Read the faces of an OBJ file, whatever object, group or material they are of.

    A negative index counts back from the corners that stand above the face.

    Args:
        data: the file's bytes.

    Returns:
        The faces.

    Raises:
        ValueError: where it is none.
    """
    vertices, corners, lengths = array("d"), array("q"), array("q")
    triangles = 0
    joined = data.replace(b"\\\r\n", b" ").replace(b"\\\n", b" ")
    for number, line in enumerate(io.BytesIO(joined), 1):
        words = words_of(line, number)
        if not words:
            continue
        if words[0] == b"v":
            vertices.extend(numbers(words[1:], 3, number))
        elif words[0] == b"f":
            corners.extend(_corner(word, len(vertices) // 3, number) for word in words[1:])
            lengths.append(len(words) - 1)
            triangles += len(words) - 3
            check_count(triangles)
        check_corners(len(vertices) // 3)
    return Polygons(np.array(vertices).reshape(-1, 3), np.array(corners), np.array(lengths))


def _corner(word: bytes, above: int, number: int) -> int:
    """Which corner `word` (corner/texture/normal) names, from 0, where `above` of them stand above it."""
    index = whole(word.partition(b"/")[0], number)
    if index == 0 or index < -above:
        raise ValueError(f"line {number}: a face names corner {index}, {above} are above it, counted from 1")
    return index - 1 if index > 0 else above + index
