"""The picture of what each shape is taken for."""

from __future__ import annotations

import itertools

import pandas as pd
import pytest

from haptic_lab.analysis.summary import SLAM
from haptic_lab.figures.confusion import draw
from haptic_lab.figures.figure6 import TITLES
from haptic_lab.style import styled


@pytest.mark.parametrize("name", ["sphere", "superquadric(0.75, 0.75)", "prism(3, size=(0.04, 0.04, 0.06))"])
def test_what_stands_beside_the_rows_does_not_overlap(name: str) -> None:
    row = {"observer": SLAM, "sigma_deg": 3.0, "candidates": f"'{name}' 'cube'"}
    rows = pd.DataFrame([{**row, "shape": shape, **dict.fromkeys(TITLES, f"'{shape}'")} for shape in (name, "cube")])
    figure = styled(lambda: draw(rows).figure)()
    figure.draw_without_rendering()
    beside = [axes.yaxis.label.get_window_extent() for axes in figure.axes[: len(TITLES)]]
    assert all(upper.y0 > lower.y1 for upper, lower in itertools.pairwise(beside))
