"""The cost of scheduling is measured on tables that are the same bits; what it is is for people to read."""

from __future__ import annotations

from pathlib import Path

import pandas as pd
import pytest

from haptic_lab.commands import scheduling

pytest.importorskip("distributed")


def test_quick_measures_every_way(tmp_path: Path, capsys: pytest.CaptureFixture) -> None:
    assert scheduling.main(["--quick", "--out", str(tmp_path)]) == 0
    rows = pd.read_csv(tmp_path / "scheduling.csv").set_index("way")
    assert list(rows.index) == list(scheduling.WAYS)
    assert (rows["trials"] == 1).all(), "the first is not counted"
    assert (rows[["trial_ms", "trial_cpu_ms", "between_ms", "cost_percent"]] > 0).all(axis=None)
    assert rows.loc[scheduling.LOOP, "here_ms"] == 0
    assert "between ms" in capsys.readouterr().out


def test_bad_input_is_one_clear_line(capsys: pytest.CaptureFixture) -> None:
    with pytest.raises(SystemExit) as ended:
        scheduling.main(["--trials", "0"])
    assert ended.value.code == 2
    assert "--trials must be an integer in [1, 10000], got 0" in capsys.readouterr().err
