"""Lines of text as numbers; what is wrong is said with the number of the line."""

from __future__ import annotations

from collections.abc import Sequence

from haptic_env.mesh_formats.polygons import Refused

LONGEST = 1_000_000  # bytes of a line
LINES = 5_000_000  # ten a triangle
LARGEST = 2**31  # of a whole number: no mesh has so many corners


def words_of(line: bytes, number: int) -> list[bytes]:
    """Split a line into words.

    Args:
        line: without its end.
        number: of the line, for messages.

    Returns:
        The words.

    Raises:
        ValueError: where it is longer than any line of a mesh.
        Refused: where the file has more lines than are taken.
    """
    if number > LINES:
        raise Refused(f"has more than {LINES:,} lines: simplify it")
    if len(line) > LONGEST:
        raise ValueError(f"line {number} has {len(line):,} characters, more than {LONGEST:,}")
    return line.split()


def numbers(words: Sequence[bytes], count: int, number: int) -> list[float]:
    """Read words as numbers.

    Args:
        words: of the line.
        count: how many are read, from the first on.
        number: of the line, for messages.

    Returns:
        The numbers (count,).

    Raises:
        ValueError: where they are too few, or no numbers.
    """
    try:
        return [float(words[k]) for k in range(count)]
    except (ValueError, IndexError):
        raise ValueError(f"line {number}: {count} numbers are needed, got {_quoted(b' '.join(words[:5]))}") from None


def whole(word: bytes, number: int) -> int:
    """Read a word as a whole number.

    Args:
        word: of the line.
        number: of the line, for messages.

    Returns:
        The number.

    Raises:
        ValueError: where it is none.
    """
    try:
        value = int(word)
    except ValueError:
        value = LARGEST
    if abs(value) >= LARGEST:
        raise ValueError(f"line {number}: a whole number is needed, got {_quoted(word)}")
    return value


def _quoted(text: bytes) -> str:
    return repr(text[:60].decode(errors="replace"))
