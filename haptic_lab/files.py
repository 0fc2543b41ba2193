"""Result files: whole or not there, the same bytes on every machine, under names that every one takes."""

from __future__ import annotations

import hashlib
import json
import math
import re
from pathlib import Path
from typing import TYPE_CHECKING, Any

from haptic_env.files import UNFINISHED as UNFINISHED
from haptic_env.files import atomic as atomic
from haptic_env.files import check_file as check_file
from haptic_env.files import check_writable as check_writable

if TYPE_CHECKING:
    import pandas as pd
    from matplotlib.figure import Figure


def check_output(what: str, path: Path, out: Path) -> None:
    """Check that a file of results can be written, in a folder of its own or in the one for all results.

    Args:
        what: tells of it, a flag.
        path: of the file.
        out: the folder for all results, which may be made yet.

    Raises:
        ValueError: where it cannot.
    """
    if path.parent.exists() or path.parent.resolve() != out.resolve():
        check_writable(what, path)


def write_table(folder: Path, name: str, table: pd.DataFrame, picture: Figure) -> list[str]:
    """Write a table, and a picture of it.

    Args:
        folder: to write to.
        name: of both files.
        table: for NAME.csv.
        picture: for NAME.png.

    Returns:
        The names of the files.
    """
    write_csv(folder / f"{name}.csv", table)
    with atomic(folder / f"{name}.png") as place:
        picture.savefig(place)
    return [f"{name}.csv", f"{name}.png"]


def write_csv(path: Path, table: pd.DataFrame) -> None:
    """Write a table as CSV, in UTF-8.

    Args:
        path: of the file.
        table: its rows, without their index.
    """
    with atomic(path) as place:
        table.to_csv(place, index=False, encoding="utf-8", lineterminator="\n")


def write_json(path: Path, content: Any) -> None:
    """Write JSON.

    Args:
        path: of the file.
        content: of dicts, lists, texts and numbers; what is not finite becomes null.
    """
    with atomic(path) as place:
        write_text(place, json.dumps(_plain(content), indent=2, allow_nan=False) + "\n")


def write_text(path: Path, text: str) -> None:
    """Write text in UTF-8, its lines ending as they are, whatever the machine's own ways.

    Args:
        path: of the file.
        text: all of it.
    """
    path.write_text(text, encoding="utf-8", newline="")


def part_of_name(value: Any) -> str:
    """Make a part of a file's name.

    Args:
        value: a word, a number, or anything else, such as a path.

    Returns:
        Words and numbers as they are; of anything else the last part in ASCII, and a digest, as another folder may have
        a file of that name.
    """
    text = str(value)
    if not isinstance(value, str) or re.fullmatch(r"\w{1,40}", text, re.ASCII):
        return text
    stem = re.sub(r"[^\w-]+", "-", Path(text).stem, flags=re.ASCII)[:24]
    return f"{stem}-{hashlib.sha256(text.encode()).hexdigest()[:8]}"


def _plain(value: Any) -> Any:
    if isinstance(value, dict):
        return {key: _plain(each) for key, each in value.items()}
    if isinstance(value, list | tuple):
        return [_plain(each) for each in value]
    if isinstance(value, float) and not math.isfinite(value):
        return None
    return value
