"""Tables of samples: CSV and TSV, and Parquet as LeRobot lays out its datasets. Nothing in them is run.

Shapes: T samples.

In a LeRobot dataset (v2: a file an episode; v3: several in a file) each row is a frame: `timestamp` s, `frame_index`,
`episode_index`, and lists such as `observation.state`. What the entries of a list are called stands in
`meta/info.json`, some folders above the file.
"""

from __future__ import annotations

import csv
import io
import json
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np

from haptic_env import extras, reading, validate
from haptic_env.recordings.streams import Stream, Streams, numbered

SEPARATORS = {".csv": ",", ".tsv": "\t"}
EPISODE = "episode_index"
INFO = Path("meta", "info.json")
UP = 4  # folders above a file of data in which the dataset's description is looked for
NONE_THERE = ["", "nan", "NaN", "NA", "null", "None"]


def read_text(path: Path, part: str | None) -> Streams:
    """Read a table of text, whose first line names its columns.

    Args:
        path: of the file.
        part: None; such a file holds one recording.

    Returns:
        Its columns; NaN where a cell is empty.

    Raises:
        ValueError: for what is no such table; it names the line.
        OSError: where it cannot be read.
    """
    import pandas as pd  # which takes half a second to import; few recordings are tables

    whole_file(path, part)
    try:
        text = reading.text(path)
        _check_rows(text, SEPARATORS[path.suffix.lower()])
        table = pd.read_csv(
            io.StringIO(text),
            sep=SEPARATORS[path.suffix.lower()],
            dtype=str,
            keep_default_na=False,
            index_col=False,
            skipinitialspace=True,
        )
    except (ValueError, pd.errors.ParserWarning) as error:  # of which pandas' errors are some
        raise ValueError(f"{path}: not a table with a line of names ({' '.join(str(error).split())})") from error
    columns: dict[int, str] = {}
    values = np.empty(table.shape)
    for c, name in enumerate(str(name).strip() for name in table.columns):
        cells = table.iloc[:, c].str.strip()
        numbers = pd.to_numeric(cells.mask(cells.isin(NONE_THERE)), errors="coerce").to_numpy(dtype=np.float64)
        wrong = np.isnan(numbers) & ~cells.isin(NONE_THERE).to_numpy()
        if wrong.all() and len(wrong):
            continue  # a column of words
        values[:, c], columns[c] = numbers, name
        if wrong.any():
            row = int(np.argmax(wrong))
            raise ValueError(f"{path}, line {row + 2}: {name} is {cells.iloc[row]!r}, no number")
    return Streams(str(path), [Stream("", tuple(columns.values()), values[:, list(columns)])])


def read_parquet(path: Path, part: str | None) -> Streams:
    """Read a table in a Parquet file.

    Args:
        path: of the file.
        part: the episode, of a file that holds several.

    Returns:
        Each column a stream; those of lists have the names that the dataset's description gives them.

    Raises:
        ValueError: for what is wrong with it.
        ImportError: where pyarrow is missing.
        OSError: where it cannot be read.
    """
    arrow = extras.load("pyarrow", "recordings", "a Parquet file")
    parquet, types = extras.load("pyarrow.parquet", "recordings", "a Parquet file"), arrow.types
    try:
        content = reading.content(path)
    except ValueError as error:
        raise ValueError(f"{path}: {error}") from error
    try:
        file = parquet.ParquetFile(arrow.BufferReader(content))
        size = sum(file.metadata.row_group(g).total_byte_size for g in range(file.metadata.num_row_groups))
        if size > reading.LARGEST_ARRAYS:
            raise ValueError(f"it takes {size} bytes unpacked, of which at most {reading.LARGEST_ARRAYS} are read")

        def some_numbers(kind: Any) -> bool:
            while types.is_list(kind) or types.is_large_list(kind) or types.is_fixed_size_list(kind):
                kind = kind.value_type
            return bool(types.is_integer(kind) or types.is_floating(kind) or types.is_boolean(kind))

        wanted = [each.name for each in file.schema_arrow if some_numbers(each.type)]
        table = file.read(columns=wanted, use_pandas_metadata=False)
        columns = {name: table.column(name).to_pylist() for name in wanted}
    except (arrow.ArrowException, OSError, ValueError, OverflowError) as error:
        raise ValueError(f"{path}: not a whole Parquet file ({' '.join(str(error).split())})") from error
    rows = _episode(path, columns.get(EPISODE), part, table.num_rows)
    names = _names(path)
    return Streams(str(path), _streams(path, columns, rows, names))


def _check_rows(text: str, separator: str) -> None:
    """Check that no row has fewer cells than the line of names, as that has at which a file was cut short."""
    rows = csv.reader(io.StringIO(text), delimiter=separator, skipinitialspace=True)
    try:
        names = next((row for row in rows if row), [])
        for row in rows:
            if 0 < len(row) < len(names):
                raise ValueError(f"line {rows.line_num} has {len(row)} cells of {len(names)}: was it cut short?")
    except csv.Error as error:
        raise ValueError(f"line {rows.line_num}: {error}") from error


def whole_file(path: Path, part: str | None) -> None:
    """Check that no part of a file is asked for that has but one recording.

    Args:
        path: of the file.
        part: that is asked for.

    Raises:
        ValueError: where one is.
    """
    if part is not None:
        raise ValueError(f"{path}: it holds one recording, no part {part!r}")


def _streams(path: Path, columns: dict[str, list[Any]], rows: Any, names: dict[str, Any]) -> Iterator[Stream]:
    for name, cells in columns.items():
        told = [cells[row] for row in rows]
        widths = {np.size(cell) for cell in told if cell is not None}
        if len(widths) > 1:
            raise ValueError(
                f"{path}: {name} has {min(widths)} to {max(widths)} numbers a row; it must have as many in each"
            )
        shape = next((np.shape(cell) for cell in told if cell is not None), ())
        values = np.array([np.full(shape, np.nan) if cell is None else cell for cell in told], dtype=np.float64)
        stream = numbered(name, values)
        called = names.get(name)
        if shape and isinstance(called, list) and len(called) == len(stream.columns):
            stream = Stream(name, tuple(map(str, called)), stream.values)
        yield stream


def _episode(path: Path, episodes: list[Any] | None, part: str | None, count: int) -> Any:
    """Indices of the rows of the episode that is asked for."""
    if episodes is None:
        whole_file(path, part)
        return range(count)
    known = list(dict.fromkeys(str(each) for each in episodes))
    if part is None and len(known) > 1:
        raise ValueError(f"{path}: it holds several episodes; choose a part from {validate.listed(known)}")
    name = known[0] if part is None and known else validate.choice(f"episode of {path}", part, known)
    return [row for row, each in enumerate(episodes) if str(each) == name]


def _names(path: Path) -> dict[str, Any]:
    """What the entries of lists are called, by the description of a LeRobot dataset, if there is one."""
    for folder in list(path.resolve().parents)[:UP]:
        if (folder / INFO).is_file():
            try:
                features = json.loads(reading.text(folder / INFO))["features"]
                told = {name: each.get("names") for name, each in features.items()}
            except (ValueError, KeyError, AttributeError, TypeError, RecursionError) as error:
                raise ValueError(f"{folder / INFO}: not the description of a LeRobot dataset ({error})") from error
            return {name: next(iter(n.values()), None) if isinstance(n, dict) else n for name, n in told.items()}
    return {}
