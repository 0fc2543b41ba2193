"""How an error quotes what it was given: in one line, and no more than its beginning."""

from __future__ import annotations

from collections.abc import Collection, Iterable

QUOTED = 300  # characters of a value that an error quotes
FEW = 5  # of many names


def shown(value: object) -> str:
    """Quote a value.

    Args:
        value: any, of which the `repr` may be of many lines, or raise.

    Returns:
        One line of at most `QUOTED` characters, and "…" where that is not all.
    """
    try:
        text = " ".join(line.strip() for line in repr(value).splitlines())
    except Exception:  # of an int of thousands of digits, say, or whatever a stranger's class does
        text = f"a value of type {type(value).__name__}"
    return text if len(text) <= QUOTED else f"{text[:QUOTED]}…"


def plain(name: object) -> str:
    """Tell a name.

    Args:
        name: whose text is told.

    Returns:
        The text as it is where it can be printed in a line, else quoted.
    """
    text = str(name)
    return text if text.isprintable() and 0 < len(text) <= QUOTED else shown(text)


def listed(names: Iterable[object]) -> str:
    """Tell names one after the other.

    Args:
        names: each told as `plain` does.

    Returns:
        The names, with commas.
    """
    return ", ".join(map(plain, names))


def counted(count: int, thing: str) -> str:
    """Tell how many there are.

    Args:
        count: of them.
        thing: what one is called; many are called so with an s.

    Returns:
        The number and the word.
    """
    return f"{count} {thing}{'' if count == 1 else 's'}"


def few(names: Collection[object]) -> str:
    """Tell the first of many names, and how many more there are.

    Args:
        names: each told as `plain` does.

    Returns:
        The names, with commas, all of them where they are not many.
    """
    more = len(names) - FEW
    return listed(names) if more <= 1 else f"{listed(list(names)[:FEW])} and {more} more"
