"""How much of a surface the reflexes that ship cover, beside the best policy made by hand."""

from __future__ import annotations

from functools import partial

import numpy as np
import pytest

from tests.haptic_lab.tasks.test_oracle_long import BY_HAND, explored, more, told
from tests.kept import folder_of, once

SEEDS = (*range(79_424, 79_472), *range(79_648, 79_770))  # nothing was tuned on them; the first 48 were seen first


@pytest.mark.statistical
@pytest.mark.timeout(2 * 3600)
def test_reflexes_cover_more_than_what_is_made_by_hand(tmp_path_factory: pytest.TempPathFactory) -> None:
    """In `HapticSLAM/Map-v0`, with intervals by bootstrap over the worlds."""
    kept = folder_of("covered", tmp_path_factory)
    rows = {
        name: [once(kept / f"{name}_{seed}.npz", partial(explored, "Map", name, seed)) for seed in SEEDS]
        for name in (BY_HAND, "reflexes")
    }
    low = {}
    for what in ("covered", "share"):
        table = {name: np.array([float(each[what]) for each in found]) for name, found in rows.items()}
        for name, column in table.items():
            told(f"{name}: {what}", column[:, None], np.mean)
        low[what] = more(f"reflexes beside {BY_HAND}: {what}", np.stack([*table.values()], axis=1))
    assert low["covered"] > 0.0
    assert low["share"] > 0.0
