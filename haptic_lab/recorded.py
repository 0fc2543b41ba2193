"""Recordings as commands are told of them: what is in their files, and of which hand they are."""

from __future__ import annotations

from pathlib import Path

import haptic_env
from haptic_env import hands, recordings, validate
from haptic_env.recordings import MeasuredTouch, Recording
from haptic_lab.given_files import WHOSE

GLOVE = "adroit"  # the hand that a glove moves where nothing is said


def load(
    path: str, part: str | None, calibration: str | None, hand: str | None, columns: str | None = None
) -> Recording | MeasuredTouch:
    """Read a recording.

    Args:
        path: of the file: .npz, a glove's .txt, or one of those of `recordings.FOREIGN`.
        part: which recording, of a file that holds several.
        calibration: path of a glove's calibration; None: the one that comes for `hand`.
        hand: that a glove moves, or that felt, by its name.
        columns: path of a TOML that says what the columns mean of a file with measured touch.

    Returns:
        The recording.

    Raises:
        ValueError: for what is wrong with it.
        ImportError: where a library is missing that reads it.
        OSError: where it cannot be read.
    """
    validate.choice("kind of recording", Path(path).suffix.lower(), {*recordings.READERS, *recordings.FOREIGN})
    meaning = None
    if columns is not None or has_touch(Path(path)):
        if calibration is not None:
            raise ValueError(f"--glove-calibration is for a glove's text, not for {path}")
        return _load_measured(path, part, hand, columns)
    if Path(path).suffix.lower() == ".txt":
        name = hand or GLOVE
        meaning = recordings.read_calibration(calibration) if calibration else recordings.calibration_for(name)
    elif calibration is not None:
        raise ValueError(f"--glove-calibration is for a glove's text, not for {path}")
    return recordings.read(path, part=part, calibration=meaning)


def has_touch(path: Path) -> bool:
    """Tell whether a file is of a kind that has measured touch, by its name, or, of arrays, by theirs.

    Args:
        path: of the file.

    Returns:
        Whether it is.
    """
    suffix = path.suffix.lower()
    return suffix in recordings.FOREIGN and (suffix != ".npz" or recordings.has_touch(path))


def _load_measured(path: str, part: str | None, hand: str | None, columns: str | None) -> MeasuredTouch:
    told = None if columns is None else recordings.read_columns(columns)
    name = hand or (told.whose if told is not None else None)
    if name is None:
        raise ValueError(f"{path}: {WHOSE}")
    return recordings.read_measured(path, told, hands.make(hands.check("hand", name)), part=part)


def environment_of(recording: Recording) -> str:
    """Find the environment whose hand a recording is of.

    Args:
        recording: with the names of joints.

    Returns:
        Its id.

    Raises:
        ValueError: where no hand has these joints.
    """
    names, known = set(recording.joint_names), []
    for env_id, name in haptic_env.ENVIRONMENTS.items():
        try:
            hand = hands.make(name)
        except ImportError:  # of a hand that is not installed
            continue
        if names == set(hand.joint_names):
            return env_id
        known.append(hand)
    nearest = max(known, key=lambda hand: len(names & set(hand.joint_names)))
    if names & set(nearest.joint_names):
        recording.columns_of(nearest)  # raises, and says which joints are missing or unknown
    raise ValueError(
        f"{recording.source}: no hand has its joints, {validate.listed(recording.joint_names)}; "
        "say which it is by --hand"
    )
