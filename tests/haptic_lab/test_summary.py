"""What is printed of a sweep: names come first where they are what was asked."""

from __future__ import annotations

import pandas as pd
import pytest
from rich.console import Console

from haptic_lab.analysis.summary import TITLES, print_report, summarise


@pytest.mark.parametrize("names_first", [True, False])
def test_names_come_first_where_they_are_what_was_asked(names_first: bool, capsys: pytest.CaptureFixture[str]) -> None:
    measures = ["pose_error_lagged_deg", "correct_2s"]
    rows = pd.DataFrame({"sigma_deg": 1.0, "shape": ["cube", "cube"], "observer": "floor", "seed": [0, 1]})
    rows = rows.assign(**dict.fromkeys(measures, 1.0), shape_posterior_correct=1.0)
    print_report(summarise(rows, measures, ["shape_posterior"]), Console(width=120), names_first=names_first)
    told = " ".join(capsys.readouterr().out.split())  # titles are broken to the width of their tables
    pose, *names = (told.index(TITLES[each]) for each in (*measures, "shape_posterior_correct"))
    assert all((name < pose) == names_first for name in names)
