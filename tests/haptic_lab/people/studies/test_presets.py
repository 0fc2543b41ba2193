"""Experiments that were done with people: what ships, and what a file of one's own may say."""

from __future__ import annotations

import re
from pathlib import Path

import pytest

from haptic_env import shapes
from haptic_lab.people.studies import presets, report, running

MINE = """
title = "Size"
task = "discrimination"
about = "Which is larger?"
parameter = "edge"
standard = 1.0
stimuli = [[1.0, "cube(size=0.05)"], [1.1, "cube(size=0.055)"]]

[sweep]
sigmas = [3.0]
"""


def _read(folder: Path, text: str) -> presets.Study:
    (folder / "mine.toml").write_text(text, encoding="utf-8")
    return presets.read(str(folder / "mine.toml"))


@pytest.mark.parametrize("name", presets.names())
def test_what_ships_can_be_run_and_says_where_its_figures_are_from(name: str, tmp_path: Path) -> None:
    study = presets.read(name)
    plans = running.plan(study, {"trials": 1}, tmp_path / "out")
    assert [each.name for each in plans] == [each.name for each in study.conditions]
    assert not (tmp_path / "out").exists()
    for _, shape in study.stimuli:
        assert shapes.default_size(shape) is not None
    assert study.differs
    for figure in study.published:
        assert figure.checked or report.UNREAD in report.source_of(figure)


def test_the_one_finger_moves_alone_and_its_skin_alone_feels(tmp_path: Path) -> None:
    plans = {each.name: each for each in running.plan(presets.read("fingers"), {}, tmp_path)}
    assert plans["free hand"].moves is None
    assert plans["free hand"].sweep.conditions[0].patches_dead == 0.0
    moves = plans["one finger"].moves
    assert moves is not None
    dead = str(plans["one finger"].sweep.conditions[0].patches_dead)
    living = 157 - len(dead.rstrip(",").split(","))
    assert (len(moves), living) == (5, 25)
    assert len(plans["five fingers"].moves or ()) == 13


@pytest.mark.parametrize(
    ("old", "new", "why"),
    [
        ('task = "discrimination"', 'task = "naming"', "unknown task 'naming'"),
        ("standard = 1.0", "standard = 1.05", "standard must be one of the values of stimuli, got 1.05"),
        ("standard = 1.0", "", "standard must be a finite number"),
        ("standard = 1.0", "standard = true", "standard must be a finite number"),
        ('[1.1, "cube(size=0.055)"]', '[1.0, "cube(size=0.055)"]', "each once"),
        ('[1.1, "cube(size=0.055)"]', "[1.1]", "stimuli must be pairs"),
        ('[1.1, "cube(size=0.055)"]', '["a", "cube"]', "value of stimuli"),
        ('[1.1, "cube(size=0.055)"]', '[1.1, "cubee"]', "cubee"),
        ('[1.1, "cube(size=0.055)"]', '[1.1, "cube"], [0.9, "sphere"]', "all be above the standard"),
        ('about = "Which is larger?"', "", "about"),
        ('about = "Which is larger?"', "about = 3", "about must be a text"),
        ('about = "Which is larger?"', 'about = ""\nintervals = 0', "intervals must be"),
        ("[sweep]", '[[condition]]\nname = "a"\nfeels = ["nose*"]\n[sweep]', "'nose*' fits none of thumb_proximal"),
        ("[sweep]", '[[condition]]\nname = "a"\nmoves = []\n[sweep]', "moves of condition 'a'"),
        ("[sweep]", '[[condition]]\nname = "a"\n[[condition]]\nname = "a"\n[sweep]', "names of their own"),
        ("[sweep]", '[[published]]\nvalue = 1.1\nwhat = "a"\n[sweep]', "source"),
        ("[sweep]", '[[published]]\nvalue = "much"\nwhat = "a"\nsource = "b"\n[sweep]', "value of published"),
        ('title = "Size"', "", "title is missing"),
        ("[sweep]", '[[condition]]\nfeels = ["*"]\n[sweep]', "name of condition is missing"),
        ("sigmas = [3.0]", "sigmas = [3.0]\nbias_deg = [0, 2]", "varies sigmas and seconds alone"),
        ("sigmas = [3.0]", 'out = "elsewhere"', "out is no key of sweep"),
        ("sigmas = [3.0]", 'sigma = "a"', "unknown key 'sigma'"),
        ("sigmas = [3.0]", 'sigmas = "a"', "sigmas must be a number or a list of such"),
        ("sigmas = [3.0]", 'shapes = ["cube"]', "not by shapes or objects in [sweep]"),
        ("[sweep]", "[sweeps]", "unknown key 'sweeps'"),
    ],
)
def test_a_file_that_makes_no_sense_is_refused_by_what_is_wrong(tmp_path: Path, old: str, new: str, why: str) -> None:
    assert old in MINE
    with pytest.raises(ValueError, match=re.escape(why)):
        running.plan(_read(tmp_path, MINE.replace(old, new)), {}, tmp_path)


def test_a_file_of_ones_own_is_a_study(tmp_path: Path) -> None:
    study = _read(tmp_path, MINE)
    assert (study.name, study.guess, study.standard_shape) == ("mine", 0.5, "cube(size=0.05)")
    assert study.comparisons == ((1.1, "cube(size=0.055)"),)
