"""The rows of a PLY file, as lines or as bytes."""

from __future__ import annotations

import io
import struct
from abc import ABC, abstractmethod
from array import array
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from haptic_env.mesh_formats.polygons import check_corners
from haptic_env.mesh_formats.text import numbers, whole, words_of

LISTS = ("vertex_indices", "vertex_index")  # names that the corners of a face go by
CODES = {"i1": "b", "u1": "B", "i2": "h", "u2": "H", "i4": "i", "u4": "I", "i8": "q", "u8": "Q", "f4": "f", "f8": "d"}


@dataclass
class Element:
    """What a PLY file holds many of.

    Attributes:
        name: as the file calls it.
        count: of its rows.
        properties: the name of each, its type and, where it is a list, the type of its length.
    """

    name: str
    count: int
    properties: list[tuple[str, str, str | None]] = field(default_factory=list)

    @property
    def has_list(self) -> bool:
        return any(length for _, _, length in self.properties)

    def least(self, order: str) -> int:
        """Count the fewest bytes of a row; in text, a digit and a space for each property.

        Args:
            order: of the bytes, as NumPy has it; empty in text.

        Returns:
            The count.
        """
        if not order:
            return 2 * len(self.properties)
        return sum(np.dtype(length or kind).itemsize for _, kind, length in self.properties)

    def columns(self, *names: str) -> list[int]:
        """Find properties.

        Args:
            *names: of the properties.

        Returns:
            Their numbers.

        Raises:
            ValueError: where one is missing or is a list.
        """
        told = [name for name, _, length in self.properties if not length]
        if not set(names) <= set(told):
            raise ValueError(f"its {self.name} has no {' '.join(names)}, but {' '.join(told) or 'nothing'}")
        every = [name for name, _, _ in self.properties]
        return [every.index(name) for name in names]

    def corners(self) -> int:
        """Find the property that holds the corners of a face.

        Returns:
            Its number.

        Raises:
            ValueError: where there is none.
        """
        for index, (name, kind, length) in enumerate(self.properties):
            if name in LISTS and length and "f" not in kind + length:
                return index
        raise ValueError(f"its {self.name} has no list of whole numbers called {' or '.join(LISTS)}")


class Rows(ABC):
    """The rows of one element after the other."""

    @abstractmethod
    def walk(self, element: Element, wanted: Sequence[int]) -> Iterator[list[Sequence[float]]]:
        """Go through the rows of an element.

        Args:
            element: the next one of the file.
            wanted: numbers of properties.

        Yields:
            For each row the numbers of each wanted property.
        """

    def vertices(self, element: Element) -> NDArray[np.float64]:
        """Read the rows of an element as corners.

        Args:
            element: the next one of the file.

        Returns:
            (V, 3).
        """
        found = array("d")
        for cells in self.walk(element, element.columns("x", "y", "z")):
            found.extend(cell[0] for cell in cells)
        return np.array(found).reshape(-1, 3)

    def faces(self, element: Element) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
        """Read the rows of an element as faces.

        Args:
            element: the next one of the file.

        Returns:
            The corners of face after face, and how many each has (F,).
        """
        corners, lengths = array("q"), array("q")
        for (cell,) in self.walk(element, [element.corners()]):
            corners.extend(min(int(each), 2**62) for each in cell)
            lengths.append(len(cell))
            check_corners(len(corners) // 3)
        return np.array(corners, dtype=np.int64), np.array(lengths, dtype=np.int64)

    def skip(self, element: Element) -> None:
        """Leave the rows of an element aside.

        Args:
            element: the next one of the file.
        """
        if element.properties:
            for _ in self.walk(element, []):
                pass


class Text(Rows):
    """Rows as lines of `data` from the byte `start` on."""

    def __init__(self, data: bytes, start: int) -> None:
        """Begin at the first row.

        Args:
            data: the file's bytes.
            start: the byte where the rows begin.
        """
        self._lines = io.BytesIO(data)
        self._lines.seek(start)
        self._number = data.count(b"\n", 0, start)

    def walk(self, element: Element, wanted: Sequence[int]) -> Iterator[list[Sequence[float]]]:
        for _ in range(element.count):
            words, at = self._row(element), 0
            cells: list[Sequence[bytes]] = []
            for _, _, length in element.properties:
                count = whole(words[at], self._number) if length and at < len(words) else 1
                at += bool(length)
                if count < 0 or at + count > len(words):
                    raise ValueError(f"line {self._number}: its {element.name} is cut short")
                cells.append(words[at : at + count])
                at += count
            yield [self._read(cells[k], element.properties[k][1]) for k in wanted]

    def _read(self, words: Sequence[bytes], kind: str) -> Sequence[float]:
        if kind[0] == "f":
            return numbers(words, len(words), self._number)
        return [whole(word, self._number) for word in words]

    def _row(self, element: Element) -> list[bytes]:
        for line in self._lines:
            self._number += 1
            if words := words_of(line, self._number):
                return words
        raise ValueError(f"it ends before the last of {element.count:,} of {element.name}")


class Binary(Rows):
    """Rows as bytes of `data` from `start` on, in the byte `order`."""

    def __init__(self, data: bytes, start: int, order: str) -> None:
        """Begin at the first row.

        Args:
            data: the file's bytes.
            start: the byte where the rows begin.
            order: of the bytes, as NumPy has it.
        """
        self._data, self._at, self._order = data, start, order

    def vertices(self, element: Element) -> NDArray[np.float64]:
        if element.has_list:
            return super().vertices(element)
        columns = element.columns("x", "y", "z")
        fields = [(f"{k}", self._order + kind) for k, (_, kind, _) in enumerate(element.properties)]
        table = self._table(fields, element)
        return np.stack([table[f"{k}"].astype(np.float64) for k in columns], axis=-1)

    def faces(self, element: Element) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
        which, begin = element.corners(), self._at
        if element.count and sum(bool(length) for _, _, length in element.properties) == 1:
            first = next(self.walk(element, [which]))[0]
            self._at = begin
            fields: list[tuple] = []
            for k, (_, kind, length) in enumerate(element.properties):
                fields += [("length", self._order + length)] if length else []
                fields.append((f"{k}", self._order + kind, len(first)) if length else (f"{k}", self._order + kind))
            if begin + element.count * np.dtype(fields).itemsize <= len(self._data):
                table = self._table(fields, element)
                if (table["length"] == len(first)).all():
                    return table[f"{which}"].astype(np.int64).reshape(-1), np.full(element.count, len(first))
                self._at = begin
        return super().faces(element)

    def _table(self, fields: list[tuple], element: Element) -> NDArray:
        """All rows of `element` at once."""
        kind = np.dtype(fields)
        table = np.frombuffer(self._data, kind, element.count, self._at)
        self._at += table.nbytes
        return table

    def walk(self, element: Element, wanted: Sequence[int]) -> Iterator[list[Sequence[float]]]:
        for _ in range(element.count):
            cells: list[Sequence[float]] = []
            for _, kind, length in element.properties:
                count = int(self._take(1, length, element)[0]) if length else 1
                cells.append(self._take(count, kind, element))
            yield [cells[k] for k in wanted]

    def _take(self, count: int, kind: str, element: Element) -> Sequence[float]:
        size = count * int(kind[1])
        check_corners(count // 3)
        if count < 0 or self._at + size > len(self._data):
            raise ValueError(f"it ends before the last of {element.count:,} of {element.name}")
        found = struct.unpack_from(f"{self._order}{count}{CODES[kind]}", self._data, self._at)
        self._at += size
        return found
