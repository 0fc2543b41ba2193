"""PLY, as text or binary of either byte order: elements declared by a header, of which corners and faces are read."""

from __future__ import annotations

import io

import numpy as np

from haptic_env.mesh_formats.ply_rows import Binary, Element, Text
from haptic_env.mesh_formats.polygons import Polygons, check_corners, check_count

TYPES = {
    "char": "i1", "uchar": "u1", "short": "i2", "ushort": "u2", "int": "i4", "uint": "u4", "float": "f4",
    "double": "f8", "int8": "i1", "uint8": "u1", "int16": "i2", "uint16": "u2", "int32": "i4", "uint32": "u4",
    "int64": "i8", "uint64": "u8", "float32": "f4", "float64": "f8",
}  # fmt: skip
ORDERS = {"ascii": "", "binary_little_endian": "<", "binary_big_endian": ">"}
LENGTHS = [name for name, kind in TYPES.items() if kind[0] in "iu"]
HEADER = 1_000_000  # bytes


def read(data: bytes) -> Polygons:
    """Read the faces of a PLY file.

    Args:
        data: the file's bytes.

    Returns:
        The faces.

    Raises:
        ValueError: where it is none.
    """
    order, elements, start = _header(data)
    least = sum(each.count * each.least(order) for each in elements)
    if least > len(data) - start + 1:  # the last line need not end
        told = ", ".join(f"{each.count:,} of {each.name}" for each in elements)
        raise ValueError(f"it declares {told}, and {len(data) - start:,} bytes follow its header")
    rows = Binary(data, start, order) if order else Text(data, start)
    vertices, corners, lengths = np.empty((0, 3)), np.empty(0, np.int64), np.empty(0, np.int64)
    for each in elements:
        check_corners(each.count)
        if each.name == "vertex":
            vertices = rows.vertices(each)
        elif each.name == "face":
            check_count(each.count)
            corners, lengths = rows.faces(each)
        else:
            rows.skip(each)
        if len(vertices) and len(lengths):
            break
    return Polygons(vertices, corners, lengths)


def _header(data: bytes) -> tuple[str, list[Element], int]:
    """The byte order ("" for text), the elements, and where their rows begin."""
    stream = io.BytesIO(data[:HEADER])
    if stream.readline().strip() != b"ply":
        raise ValueError("it does not begin with 'ply'")
    order, elements = None, list[Element]()
    for line in stream:
        words = line.decode("latin-1").split()
        match words:
            case ["format", kind, _] if kind in ORDERS:
                order = ORDERS[kind]
            case ["element", name, count] if count.isascii() and count.isdecimal() and len(count) < 20:
                elements.append(Element(name, int(count)))
            case ["property", "list", length, kind, name] if elements and length in LENGTHS and kind in TYPES:
                elements[-1].properties.append((name, TYPES[kind], TYPES[length]))
            case ["property", kind, name] if elements and kind in TYPES:
                elements[-1].properties.append((name, TYPES[kind], None))
            case ["comment" | "obj_info", *_] | []:
                pass
            case ["end_header"] if order is not None:
                return order, elements, stream.tell()
            case _:
                raise ValueError(f"its header has a line {' '.join(words)[:60]!r}")
    raise ValueError("its header does not end")
