"""The picture of how time grows is drawn and its numbers are written; what they are is for people to read."""

from __future__ import annotations

import pandas as pd
import pytest

from haptic_lab.commands import scaling


def test_quick_writes_a_picture_and_its_numbers(tmp_path, capsys: pytest.CaptureFixture) -> None:
    assert scaling.main(["--quick", "--rounds", "1", "--out", str(tmp_path)]) == 0
    rows = pd.read_csv(tmp_path / "scaling.csv")
    assert set(rows["axis"]) == set(scaling.AXES)
    assert (rows["ms"] > 0).all()
    assert rows[rows["axis"] == "patches"]["value"].is_monotonic_increasing
    assert (tmp_path / "scaling.png").stat().st_size > 5000
    assert "particles N" in capsys.readouterr().out


def test_the_picture_says_how_fast_it_grows_and_what_is_usual() -> None:
    steps = {"particles": (200, 400), "candidates": (8, 16), "patches": (50, 100), "voxels": (32, 128)}
    slopes = {"particles": 0.002, "candidates": 0.05, "patches": 0.0, "voxels": 0.01}
    rows = [(axis, value, 1.0 + slopes[axis] * value) for axis, values in steps.items() for value in values]
    panels = scaling.draw(pd.DataFrame(rows, columns=["axis", "value", "ms"])).axes
    assert [panel.get_title() for panel in panels] == [
        "2 µs more for each particle",
        "50 µs more for each candidate",
        "no longer with more patches",
        "470 µs more for each million voxels",
    ]
    usual = [line.get_xdata().tolist() for panel in panels for line in panel.lines if line.get_label() == "as usual"]
    assert usual == [[200], [8], [50], [0.032768]]


def test_bad_input_is_one_clear_line(capsys: pytest.CaptureFixture) -> None:
    with pytest.raises(SystemExit) as ended:
        scaling.main(["--rounds", "0"])
    assert ended.value.code == 2
    assert "--rounds must be an integer in [1, 1000], got 0" in capsys.readouterr().err
