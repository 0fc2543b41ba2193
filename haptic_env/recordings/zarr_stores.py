"""Zarr stores in the layout of Open-X-Tactile (FTP-1): a folder `.zarr`, or one that is zipped.

Shapes: T samples.

`data/` has arrays whose first dimension is the sample: `timestamps`, `left_hand_joints`, `right_hand_joints` (T, J),
`right_tactile_data_NAME` (T, ...) with `right_tactile_type_NAME`, one of "state", "matrix", "binary" and "image"; and
`meta/episode_ends` tells where each of several recordings ends. What numcodecs would unpickle is refused.
"""

from __future__ import annotations

import warnings
import zipfile
from pathlib import Path
from typing import Any

import numpy as np

from haptic_env import extras, reading, validate
from haptic_env.recordings.streams import Stream, Streams, numbered
from haptic_env.recordings.tables import whole_file

DATA, ENDS = "data", "meta/episode_ends"
TIMESTAMPS, TACTILE, TYPE = "timestamps", "_tactile_data_", "_tactile_type_"
JOINTS = "_hand_joints"
PICTURES = "image"  # of touch: what a camera behind a gel sees, of which no threshold makes contacts
NUMBERS = "biuf"
MOST_COLUMNS = 100_000
CODECS = (
    "astype",
    "blosc",
    "bytes",
    "bz2",
    "crc32c",
    "delta",
    "fixedscaleoffset",
    "gzip",
    "lz4",
    "lzma",
    "packbits",
    "quantize",
    "shuffle",
    "sharding_indexed",
    "transpose",
    "vlen-utf8",
    "zlib",
    "zstd",
)


def read(path: Path, part: str | None) -> Streams:
    """Read the joints and the touch of a store.

    Args:
        path: of the folder, or of the zip file.
        part: number of the episode, from 0, of a store that holds several.

    Returns:
        Its arrays as streams, each column called `name[3]`.

    Raises:
        ValueError: for what is wrong with it.
        ImportError: where zarr is missing.
        OSError: where it cannot be read.
    """
    zarr = extras.load("zarr", "recordings", "a Zarr store")
    path.stat()
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")  # of what another version of the library may not read
            inside, store = _store(path)
            root = zarr.open_group(store, mode="r", path=inside)
            arrays = dict(root.get(DATA, root).arrays())
            streams = _streams(path, arrays, _rows(path, root, arrays, part))
    except Exception as error:  # a damaged store ends the library in many ways
        if isinstance(error, ImportError) or str(error).startswith(f"{path}: "):
            raise
        raise ValueError(f"{path}: not a whole Zarr store ({' '.join(str(error).split())})") from error
    return Streams(str(path), streams)


def _store(path: Path) -> tuple[str, Any]:
    """Where in a store the group is, and the store."""
    storage = extras.load("zarr.storage", "recordings", "a Zarr store")
    if path.is_dir():
        return "", storage.LocalStore(path, read_only=True)
    with zipfile.ZipFile(path) as file:
        if sum(each.file_size for each in file.infolist()) > reading.LARGEST_ARRAYS:
            raise ValueError(f"{path}: it takes more than {reading.LARGEST_ARRAYS} bytes unpacked")
        tops = {name.split("/")[0] for name in file.namelist()}
    inside = [name for name in tops if name.endswith(".zarr")]
    return (inside[0] if len(inside) == 1 else ""), storage.ZipStore(path, mode="r")


def _rows(path: Path, root: Any, arrays: dict[str, Any], part: str | None) -> slice:
    """The samples of the episode that is asked for."""
    ends = _numbers(path, ENDS, root[ENDS], slice(None)).astype(np.int64).tolist() if ENDS in root else []
    if not ends:
        whole_file(path, part)
        return slice(None)
    known = [str(k) for k in range(len(ends))]
    if part is None and len(ends) > 1:
        raise ValueError(f"{path}: it holds several episodes; choose a part from {validate.listed(known)}")
    k = int(validate.choice(f"episode of {path}", part or "0", known))
    first = ends[k - 1] if k else 0
    length = min((each.shape[0] for each in arrays.values() if each.ndim), default=0)
    if not 0 <= first < ends[k] <= length:
        raise ValueError(f"{path}: cut short: episode {k} ends at sample {ends[k]}, but there are {length}")
    return slice(first, ends[k])


def _streams(path: Path, arrays: dict[str, Any], rows: slice) -> list[Stream]:
    streams = []
    for name, array in arrays.items():
        columns = int(np.prod(array.shape[1:], dtype=np.int64))
        wanted = TACTILE in name or name.endswith((JOINTS, "_arm_joints")) or name == TIMESTAMPS or array.ndim <= 2
        if not wanted or not array.ndim or array.dtype.kind not in NUMBERS or columns > MOST_COLUMNS:
            continue
        kind = arrays.get(name.replace(TACTILE, TYPE)) if TACTILE in name else None
        if kind is not None and _kind(path, kind) == PICTURES:
            continue
        streams.append(numbered(name, _numbers(path, name, array, rows)))
    if not streams:
        raise ValueError(f"{path}: it has no {DATA}/{TIMESTAMPS}, no {DATA}/*{JOINTS} and no {DATA}/*{TACTILE}*")
    return streams


def _kind(path: Path, array: Any) -> str:
    """What a kind of touch is called, as the first sample says."""
    if array.dtype.kind not in "UST" or not array.size:
        return ""
    _refuse(path, array)
    told = np.asarray(array[:1]).ravel()[0]
    return told.decode() if isinstance(told, bytes) else str(told)


def _numbers(path: Path, name: str, array: Any, rows: slice) -> Any:
    if array.dtype.kind not in NUMBERS:
        raise ValueError(f"{path}: {name} must be numbers, got {array.dtype}")
    _refuse(path, array)
    if array.nbytes > reading.LARGEST_ARRAYS:
        raise ValueError(
            f"{path}: {name} takes {array.nbytes} bytes unpacked; at most {reading.LARGEST_ARRAYS} are read"
        )
    return np.asarray(array[rows])


def _refuse(path: Path, array: Any) -> None:
    """Raise `ValueError` for an array that is packed by what may run code, or is not known."""
    for codec in (*array.filters, *array.compressors):
        said = codec.to_dict() if hasattr(codec, "to_dict") else codec.get_config()
        name = str(said.get("name", said.get("id", ""))).removeprefix("numcodecs.")
        if name not in CODECS:
            raise ValueError(
                f"{path}: {array.basename} is packed by {name or said}, which is not read: it may run code"
            )
