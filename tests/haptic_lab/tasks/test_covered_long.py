"""How much of a surface the reflexes that ship cover, beside the best policy made by hand and what they began with."""

from __future__ import annotations

from dataclasses import replace
from functools import partial
from pathlib import Path

import numpy as np
import pytest

from agents.gains import OF_REFLEXES, gains_of
from agents.sb3 import Reflexes, read_model
from haptic_lab.learning import presets
from tests.haptic_lab.tasks.test_oracle_long import BY_HAND, explored, more, told
from tests.kept import folder_of, once

SEEDS = range(79_424, 79_472)
BEGAN = "as the search began"  # gains to hundredths, and nothing remembered


def begun(folder: Path) -> str:
    """The path of a model of the gains with which the preset begins, which remembers nothing."""
    begin = presets.read("reflexes").rhythm
    model = read_model(Reflexes.shipped)
    path = folder / "began.npz"
    replace(model, gains=gains_of({name: begin[name] for name in OF_REFLEXES})).write(path)
    return str(path)


@pytest.mark.statistical
@pytest.mark.timeout(3600)
def test_reflexes_cover_more_than_what_is_made_by_hand(tmp_path_factory: pytest.TempPathFactory) -> None:
    """In `HapticSLAM/Map-v0`, with intervals by bootstrap over the worlds."""
    kept = folder_of("covered", tmp_path_factory)
    who = {BY_HAND: BY_HAND, BEGAN: begun(kept), "reflexes": "reflexes"}
    rows = {
        name: [once(kept / f"{name}_{seed}.npz", partial(explored, "Map", policy, seed)) for seed in SEEDS]
        for name, policy in who.items()
    }
    low = {}
    for what in ("covered", "share"):
        table = {name: np.array([float(each[what]) for each in found]) for name, found in rows.items()}
        for name, column in table.items():
            told(f"{name}: {what}", column[:, None], np.mean)
        for before in (BY_HAND, BEGAN):
            pair = np.stack([table[before], table["reflexes"]], axis=1)
            low[what, before] = more(f"reflexes beside {before}: {what}", pair)
        more(f"{BEGAN} beside {BY_HAND}: {what}", np.stack([table[BY_HAND], table[BEGAN]], axis=1))
    assert low["covered", BY_HAND] > 0.0
    assert low["share", BY_HAND] > 0.0
