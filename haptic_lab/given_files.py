"""Files of a command line that are not there, or are not what they are given as: found before the command is loaded,
which takes seconds.

What is not plainly a file, a name say, or lies in a place that cannot be told from here, is left to the command, and so
is whatever else a file may have wrong in it.
"""

from __future__ import annotations

import os
from collections.abc import Collection, Iterator, Sequence
from fnmatch import fnmatchcase
from pathlib import Path
from typing import NamedTuple

LARGEST = 2**24  # bytes: larger files are left to the command, which reads them once
LARGEST_MESH = 2**20
MESHES, TABLES, TOML = (".obj", ".ply", ".stl"), (".csv", ".tsv"), (".toml",)
OTHERS = (".npz", ".parquet", ".pkl", ".txt", ".xdf", ".zarr", ".zip")
FILES = (*MESHES, *TABLES, *TOML, *OTHERS)  # endings of what is a file, and no name


class Kind(NamedTuple):
    """What a file is given as.

    Attributes:
        what: it is called.
        endings: of its name; none: it is a folder.
        held: keys, arrays or columns of which each such file has one at least; `*` stands for any letters.
        known: keys that it may have; none: any.
        named: whether a name may stand in its place.
        several: whether its flag takes more than one.
        labelled: whether it is told as NAME=FILE.
    """

    what: str
    endings: tuple[str, ...]
    held: tuple[str, ...] = ()
    known: tuple[str, ...] = ()
    named: bool = True
    several: bool = False
    labelled: bool = False


CONFIG = (  # what a sweep is asked for by
    *("ablation", "attention_seconds", "believed", "believed_bias_deg", "believed_contact_confusion"),
    *("believed_contact_false_alarm", "believed_contact_miss", "believed_drift_deg", "believed_drift_seconds"),
    *("believed_motor_noise", "believed_patches_dead", "believed_patches_stuck", "believed_proportional"),
    *("believed_sigma", "believed_sigma_deg", "believed_start_std_deg", "bias_deg", "calibration"),
    *("candidates", "classifiers", "cluster", "column", "columns", "contact_confusion", "contact_false_alarm"),
    *("contact_miss", "courses", "drift_deg", "drift_seconds", "env", "exemplars", "first_seed", "jobs"),
    *("maps_every", "memory_seconds", "meshes", "motor_noise", "name", "names_only", "none", "objects"),
    *("observers", "out", "particles", "patches_dead", "patches_stuck", "policy", "position_jitter"),
    *("proportional", "quick", "recordings", "repeats", "rotation_jitter", "scale", "seconds", "shapes"),
    *("sigmas", "size_jitter", "standard", "trial_table", "trials", "under", "unit", "wrist", "yaw_jitter"),
)
MAPS = ("columns", "control_hz", "hand", "joints", "names", "time", "touch", "units")
COURSES = Kind("courses of belief", (".npz",), ("log_posterior",))
HAND = Kind("hand", TOML, ("model",))
FOLDER = Kind("folder", ())
POLICY = Kind("policy", (".npz", ".zip"), ("description",))
TIMES = ("time", "timestamp", "timestamps", "t")
RECORDING = Kind(  # where no map says what its columns mean; `_obs` are demonstrations
    "recording", (*TABLES, ".npz", ".parquet", ".txt", ".xdf", ".zarr", ".zip"), (*TIMES, "*_obs"), named=False
)
SHAPE = Kind("shape", (*MESHES, *TOML), ("objects",))  # a set of them, where it is TOML
TRIALS = Kind("table of trials", TABLES, ("response",))
FLAGS = {
    "--candidates": SHAPE._replace(several=True),
    "--columns": Kind("map of columns", TOML, MAPS, named=False),
    "--config": Kind("configuration", TOML, known=CONFIG, named=False),
    "--courses": COURSES,
    "--env": HAND,
    "--glove-calibration": Kind("calibration of a glove", TOML, ("sensors",), named=False),
    "--hand": HAND,
    "--library": FOLDER,
    "--mesh": SHAPE,
    "--models": COURSES._replace(several=True, labelled=True),
    "--normalize": Kind("VecNormalize", (".pkl",)),
    "--object": SHAPE,
    "--objects": Kind("set of objects", TOML, ("objects",)),
    "--observers": COURSES._replace(several=True),
    "--policies": POLICY._replace(several=True),
    "--policy": POLICY,
    "--preset": Kind("preset", TOML, ("algorithm",)),
    "--recording": RECORDING,
    "--recordings": RECORDING._replace(several=True),
    "--shape": SHAPE,
    "--shapes": SHAPE._replace(several=True),
    "--trial-table": TRIALS,
    "--trials-of": FOLDER,
}
ALONE = {  # of a command, what is told without a flag
    "check-hand": HAND,
    "compare": TRIALS,
    "design": COURSES._replace(several=True, labelled=True),
    "export": Kind("model of Stable-Baselines3", (".zip",)),
    "fit": TRIALS,
    "library": FOLDER,
    "objects": SHAPE._replace(several=True),
    "people": TRIALS._replace(several=True),
    "replay": RECORDING,
    "study": Kind("study", TOML, ("title",)),
}
JOINTS = {  # of hands by name: what all of their joints are called; a table that has none of them is not of that hand
    "two_finger": ("thumb_*", "index_*"),
    "two_finger_arm": ("thumb_*", "index_*", "wrist_*"),
    "adroit": ("WRJ?", "THJ?", "FFJ?", "MFJ?", "RFJ?", "LFJ?"),
    "myo": ("pro_sup", "deviation", "*flexion", "*_abduction"),
}
WHOSE = "say whose joints and patches it has: --hand NAME, or hand = NAME in --columns"
WRITTEN = "--mesh"  # where there is no such file, or beside --shape
RENAMED = (RECORDING.what, TRIALS.what)
RENAMING = frozenset(("--column", "--columns"))  # say what their columns are called


def first_wrong(command: str, arguments: Sequence[str]) -> str | None:
    """Find the first file that is to be read and is not there, or is not what it is given as.

    Args:
        command: of `haptic_lab.cli.COMMANDS`.
        arguments: of its command line.

    Returns:
        What to say of it; None where there is none.
    """
    flags = {each.partition("=")[0] for each in arguments if each.startswith("--")}
    values = [*_values(command, arguments)]
    hand = next((value for _, value, kind, surely in reversed(values) if kind is HAND and surely), None)
    for flag, value, kind, surely in values:
        if kind.what in RENAMED and (flags & RENAMING or _shortened(flags)):
            kind = kind._replace(held=())
        path = os.path.expanduser(value)
        if not os.path.lexists(path) and kind.labelled:
            path = os.path.expanduser(value.partition("=")[2] or value)
        if os.path.lexists(path):
            told = None if flag == WRITTEN and "--shape" in flags else _wrong(value, path, kind, surely, hand)
        else:
            is_file = _ending(path) in FILES or (surely and not kind.named)
            told = f"there is no file {value!r}" if is_file and flag != WRITTEN else None
        if told is not None:
            return f"{flag}: {told}" if flag else told
    return None


def _values(command: str, arguments: Sequence[str]) -> Iterator[tuple[str, str, Kind, bool]]:
    """Flags, "" for what stands before any, with a value, what it is given as, and whether it surely is the flag's."""
    flag, count = "", 0
    for each in arguments:
        value = each
        if each.startswith("--"):
            flag, equals, value = each.partition("=")
            count = 0
            if not equals:
                continue
        kind = FLAGS.get(flag) if flag else ALONE.get(command)
        if kind is not None and value.strip():
            yield flag, value, kind, count == 0 or kind.several
        count += 1


def _shortened(flags: Collection[str]) -> bool:
    """Whether one is the beginning of a flag that says whose joints a table has, as `argparse` takes it too."""
    whole = (*RENAMING, *(flag for flag, kind in FLAGS.items() if kind is HAND))
    return any(flag not in FLAGS and each.startswith(flag) for flag in flags for each in whole if each != flag)


def _ending(path: str) -> str:
    return os.path.splitext(path)[1].lower()


def _wrong(value: str, path: str, kind: Kind, surely: bool, hand: str | None) -> str | None:
    """What is wrong with what is there at `path`, which is told as `value`; None: nothing that can be told."""
    ending, is_file = _ending(path), os.path.isfile(path)
    if surely and is_file and ending not in kind.endings and (ending or not kind.named):
        ends = f"the name of such a file ends in {', '.join(kind.endings)}" if kind.endings else "it is a file"
        return f"{value!r} is no {kind.what}: {ends}"
    largest = LARGEST_MESH if ending in MESHES else LARGEST
    if ending not in FILES or not (is_file or os.path.isdir(path)) or os.path.getsize(path) > largest:
        return None
    from haptic_env import validate
    from haptic_lab import file_contents  # NumPy takes a tenth of a second

    try:
        there = file_contents.held(Path(path))
    except OSError as error:
        return f"{value!r} cannot be read: {error.strerror or error}"
    except ValueError as error:
        return f"{value!r} {error}"
    if there is None or not surely:
        return None
    if kind.known:
        return file_contents.unknown(value, there, kind.known)
    if not kind.held:
        return None
    instead = f"; it has {validate.few(there)}" if there else ", it is empty"
    if not _holds(there, kind.held):
        return f"{value!r} is no {kind.what}: it has no {' or '.join(kind.held)}{instead}"
    return _not_of(value, hand, there, instead) if kind is RECORDING and ending in TABLES else None


def _not_of(value: str, hand: str | None, there: Collection[str], instead: str) -> str | None:
    """What to say of a table of samples without a map that is surely not of the hand that is told; None: nothing."""
    from haptic_env import ENVIRONMENTS

    if hand is None:
        return f"{value}: {WHOSE}{instead}"
    joints = JOINTS.get(ENVIRONMENTS.get(hand, hand))
    if joints is None or _holds(there, joints):
        return None
    return (
        f"{value!r} has no joint of hand {hand!r}, {' or '.join(joints)}; --columns says what they are called{instead}"
    )


def _holds(there: Collection[str], patterns: Collection[str]) -> bool:
    """Whether any of the names is one that is looked for."""
    return any(fnmatchcase(name, pattern) for name in there for pattern in patterns)
