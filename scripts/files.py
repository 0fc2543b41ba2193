"""Result files that are either whole or not there."""

from __future__ import annotations

import json
import math
from pathlib import Path
from typing import TYPE_CHECKING, Any

from haptic_env.files import atomic as atomic

if TYPE_CHECKING:
    import pandas as pd
    from matplotlib.figure import Figure


def write_table(folder: Path, name: str, table: pd.DataFrame, picture: Figure) -> list[str]:
    """Write `table` as `name`.csv and its `picture` as `name`.png to `folder`; returns their names."""
    with atomic(folder / f"{name}.csv") as place:
        table.to_csv(place, index=False)
    with atomic(folder / f"{name}.png") as place:
        picture.savefig(place)
    return [f"{name}.csv", f"{name}.png"]


def write_json(path: Path, content: Any) -> None:
    """Write `content` as JSON; what is not finite becomes null."""
    with atomic(path) as place:
        place.write_text(json.dumps(_plain(content), indent=2, allow_nan=False) + "\n")


def _plain(value: Any) -> Any:
    if isinstance(value, dict):
        return {key: _plain(each) for key, each in value.items()}
    if isinstance(value, list | tuple):
        return [_plain(each) for each in value]
    if isinstance(value, float) and not math.isfinite(value):
        return None
    return value
