"""Checkpoints of a training run: each one whole, or not taken for one.

A checkpoint is a folder with a list of its files and their digests, which is written last.
"""

from __future__ import annotations

import hashlib
import json
import shutil
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from files import write_json
from stable_baselines3.common.base_class import BaseAlgorithm
from stable_baselines3.common.off_policy_algorithm import OffPolicyAlgorithm

MODEL, REPLAY, LIST = "model.zip", "replay_buffer.pkl", "checkpoint.json"
KEPT = 2


@dataclass(frozen=True)
class Checkpoint:
    """A whole checkpoint: its `folder`, and the `state` that was saved with it."""

    folder: Path
    state: dict[str, Any]


def save(folder: Path, model: BaseAlgorithm, state: dict[str, Any]) -> None:
    """Save `model`, and `state` as JSON, below `folder`; older checkpoints but `KEPT` go."""
    place = folder / f"{model.num_timesteps:09d}"
    shutil.rmtree(place, ignore_errors=True)
    place.mkdir(parents=True)
    model.save(place / MODEL)
    if isinstance(model, OffPolicyAlgorithm):
        model.save_replay_buffer(place / REPLAY)
    write_json(place / LIST, {"files": {each.name: _digest(each) for each in place.iterdir()}, "state": state})
    for old in sorted(folder.iterdir())[:-KEPT]:
        shutil.rmtree(old)


def newest(folder: Path) -> tuple[Checkpoint | None, list[Path]]:
    """The newest whole checkpoint below `folder`, if any, and those after it that were cut short."""
    broken: list[Path] = []
    for place in sorted(folder.iterdir(), reverse=True) if folder.is_dir() else []:
        try:
            listed = json.loads((place / LIST).read_text())
            if all(_digest(place / name) == digest for name, digest in listed["files"].items()):
                return Checkpoint(place, listed["state"]), broken
        except (OSError, ValueError, KeyError):
            pass
        broken.append(place)
    return None, broken


def _digest(path: Path) -> str:
    with path.open("rb") as file:
        return hashlib.file_digest(file, "sha256").hexdigest()
