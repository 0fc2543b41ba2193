"""Checkpoints of a training run: each one whole, or not taken for one; and numbers alone, so that reading one runs
nothing, whoever has made it.

A checkpoint is a folder with a list of its files and their digests, which is written last. The weights are those of
Stable-Baselines3's zip, without the pickles that it has beside them.
"""

from __future__ import annotations

import hashlib
import json
import shutil
import zipfile
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from stable_baselines3.common.base_class import BaseAlgorithm
from stable_baselines3.common.off_policy_algorithm import OffPolicyAlgorithm
from stable_baselines3.common.save_util import load_from_zip_file, recursive_setattr

from haptic_env import validate
from haptic_lab.files import write_json
from haptic_lab.learning import replay_buffer

MODEL, REPLAY, LIST = "model.zip", "replay_buffer.npz", "checkpoint.json"
COUNTERS = {"steps": "num_timesteps", "updates": "_n_updates", "episodes": "_episode_num"}
KEPT = 2


@dataclass(frozen=True)
class Checkpoint:
    """A whole checkpoint.

    Attributes:
        folder: where it is.
        state: that was saved with it.
        counters: how far the learner was, by the names of `COUNTERS`.
    """

    folder: Path
    state: dict[str, Any]
    counters: dict[str, int]


def save(folder: Path, model: BaseAlgorithm, state: dict[str, Any]) -> None:
    """Save a checkpoint; older ones but `KEPT` go.

    Args:
        folder: of all checkpoints.
        model: that learns.
        state: what JSON can say, kept with it.
    """
    place = folder / f"{model.num_timesteps:09d}"
    shutil.rmtree(place, ignore_errors=True)
    place.mkdir(parents=True)
    model.save(place / MODEL, exclude=vars(model))  # all but the weights
    if isinstance(model, OffPolicyAlgorithm):
        assert model.replay_buffer is not None
        replay_buffer.save(place / REPLAY, model.replay_buffer)
    counters = {name: int(getattr(model, attribute)) for name, attribute in COUNTERS.items()}
    files = {each.name: _digest(each) for each in place.iterdir()}
    write_json(place / LIST, {"files": files, "state": state, "counters": counters})
    for old in _places(folder)[KEPT:]:
        shutil.rmtree(old)


def newest(folder: Path) -> tuple[Checkpoint | None, list[Path]]:
    """Find the newest whole checkpoint.

    Args:
        folder: of all checkpoints.

    Returns:
        The checkpoint, None where there is none, and the folders of those after it that were cut short.

    Raises:
        ValueError: for one that is whole, and not as `save` writes it.
    """
    broken: list[Path] = []
    for place in _places(folder):
        listed = _listed(place)
        if listed is None:
            broken.append(place)
        else:
            return _checked(place, listed), broken
    return None, broken


def restore(found: Checkpoint, model: BaseAlgorithm) -> None:
    """Put a checkpoint into a learner.

    Args:
        found: the checkpoint.
        model: a new learner of the same preset.

    Raises:
        ValueError: for a checkpoint of another learner.
    """
    try:
        with zipfile.ZipFile(found.folder / MODEL) as file:
            if any(each.compress_type != zipfile.ZIP_STORED for each in file.infolist()):
                raise ValueError("its weights are packed, and could unpack to anything")
        # Not "data", which would be unpickled; the weights are read by torch with weights_only=True.
        _, weights, variables = load_from_zip_file(found.folder / MODEL, load_data=False, device="cpu")
        model.set_parameters(weights, exact_match=True, device="cpu")
        for name in model._get_torch_save_params()[1]:
            recursive_setattr(model, f"{name}.data", (variables or {})[name].data)
        if isinstance(model, OffPolicyAlgorithm):
            assert model.replay_buffer is not None
            replay_buffer.restore(found.folder / REPLAY, model.replay_buffer)
    except Exception as error:  # torch and pickle say in many ways that a file is not what it should be
        raise ValueError(f"{found.folder} is no checkpoint of this run: {error}") from error
    for name, attribute in COUNTERS.items():
        setattr(model, attribute, found.counters[name])


def _places(folder: Path) -> list[Path]:
    """The checkpoints below `folder`, whole or not, the newest first; what else lies there is not touched."""
    found = folder.iterdir() if folder.is_dir() else ()
    return sorted((each for each in found if each.name.isdecimal() and each.is_dir()), reverse=True)


def _listed(place: Path) -> dict[str, Any] | None:
    """What the list of a checkpoint says; None where it was cut short."""
    try:
        listed = json.loads((place / LIST).read_text(encoding="utf-8"))
        digests = {name: digest for name, digest in listed["files"].items() if name in (MODEL, REPLAY)}
        return listed if all(_digest(place / name) == digest for name, digest in digests.items()) else None
    except (OSError, ValueError, AttributeError, KeyError, TypeError):
        return None


def _checked(place: Path, listed: dict[str, Any]) -> Checkpoint:
    state, counters = listed.get("state"), listed.get("counters")
    if not isinstance(state, dict) or not isinstance(counters, dict):
        raise ValueError(
            f"{place} is of a version that kept pickles, which may run code when they are read; choose another --out"
        )
    for name in COUNTERS:
        validate.integer(f"{name} in {place / LIST}", counters.get(name), 0, 2**62)
    validate.number(f"seconds in {place / LIST}", state.get("seconds"), 0.0)
    if state.get("best") is not None:
        validate.number(f"best in {place / LIST}", state["best"])
    return Checkpoint(place, state, counters)


def _digest(path: Path) -> str:
    with path.open("rb") as file:
        return hashlib.file_digest(file, "sha256").hexdigest()
