"""What the site gives a reader to do works: examples, notebooks, and what its pages leave to files and ports."""

from __future__ import annotations

import importlib
import json
import os
import runpy
import socket
import subprocess
import sys
from importlib import util
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
import pytest

from haptic_env import hands, shapes
from haptic_lab.analysis.summary import summarise
from tests.scripts import documents
from tests.scripts.documents import ROOT

EXAMPLES = {path.stem: path for path in sorted((ROOT / "examples").glob("*.py"))}
NOTEBOOKS = sorted((ROOT / "docs" / "notebooks").glob("*.ipynb"))


def example(name: str) -> dict[str, Any]:
    return runpy.run_path(str(EXAMPLES[name]))


def block(document: str, marked: str) -> str:
    """The Python of a document that is marked as not run by itself."""
    text = (ROOT / "docs" / document).read_text()
    (found,) = [code for note, kind, code in documents.BLOCK.findall(text) if kind == "python" and marked in note]
    return found


def test_what_was_hidden_is_named() -> None:
    posterior = example("name_it")["main"](seconds=1.5)
    assert max(posterior, key=posterior.get) == "cylinder"


def test_a_map_and_a_mesh_are_made(tmp_path: Path) -> None:
    occupancy, surface = example("map_it")["main"](tmp_path / "felt.ply", steps=75)
    assert (occupancy > 0.5).any()
    assert (tmp_path / "felt.ply").stat().st_size > 1000
    assert 0 < surface.std.min() < 0.002


def test_policies_are_compared() -> None:
    found = example("own_policy")["main"](seconds=1.0)
    assert {"Squeeze", "random_torque"} == set(found)


def test_offsets_of_a_glove_are_found() -> None:
    true, found, std = example("biased_glove")["main"](steps=100)
    assert np.abs(found - true).max() < 0.2 * np.abs(true).max()
    assert (std < 1.0).all()


def test_arrays_that_touch_nothing_tell_next_to_nothing() -> None:
    assert max(example("from_arrays")["main"]().values()) < 0.5


def test_observers_with_limits_are_worse() -> None:
    found = example("ideal_observer")["main"]()
    ideal, *limited = (shares[-1] for shares in found.values())
    assert all(share < ideal for share in limited)


def test_a_learner_is_paid_in_bits() -> None:
    (earned,) = example("belief_reward")["main"](episodes=1)
    assert 0 < earned <= 2


@pytest.mark.parametrize("sender", ["the example", "the tutorial"])
def test_a_sender_sends_what_live_reads(sender: str, monkeypatch: pytest.MonkeyPatch) -> None:
    sent: list[bytes] = []
    monkeypatch.setattr(socket.socket, "sendto", lambda self, line, to: sent.append(line))
    monkeypatch.setattr("time.sleep", lambda seconds: None)
    if sender == "the example":
        example("udp_sender")["main"](seconds=0.2, pace=0.0)
    else:
        monkeypatch.chdir(ROOT)
        exec(block("tutorials/hands.md", "sends to a port").replace("range(500)", "range(10)"), {})
    hand = hands.make(str(ROOT / "examples/gripper/gripper.toml"))
    assert len(sent) == 10
    line = json.loads(sent[-1])
    assert list(line["joints"]) == list(hand.joint_names)
    assert len(line["contacts"]) == len(hand.patches)


def test_a_shape_from_a_formula_can_be_explored(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    (tmp_path / "lenses.py").write_text(block("howto/shape.md", "lenses.py"))
    monkeypatch.syspath_prepend(str(tmp_path))
    monkeypatch.chdir(tmp_path)
    importlib.import_module("lenses")
    solid = shapes.make("lenses:Lens(size=0.05)")
    rim, pole = solid.signed_distance(np.array([[0.025, 0.0, 0.0], [0.0, 0.0, 0.0125]]))
    assert abs(rim) < 1e-6
    assert abs(pole) < 1e-6


def test_parts_of_a_job_array_are_put_together(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    measures = ["pose_error_lagged_deg", "surface_f_score_1", "shape_posterior_correct"]
    rng = np.random.default_rng(0)
    whole = pd.DataFrame({name: rng.integers(0, 2, 12).astype(float) for name in measures})
    whole = whole.assign(sigma_deg=3.0, shape=["cube", "sphere"] * 6, observer="haptic_slam", seed=np.arange(12) // 2)
    for part in range(3):
        folder = Path(f"out/array/part_{part}")
        folder.mkdir(parents=True)
        whole[whole["seed"] // 2 == part].to_csv(folder / "trials.csv", index=False)
    names: dict[str, Any] = {}
    exec(block("howto/cluster.md", "needs the parts"), names)
    pd.testing.assert_frame_equal(names["summary"], summarise(whole, measures, []))
    assert set(names["summary"]["trials"]) == {6, 12}


@pytest.mark.parametrize("path", NOTEBOOKS, ids=lambda path: path.stem)
def test_a_notebook_runs(path: Path, tmp_path: Path) -> None:
    if not util.find_spec("nbclient") and "CI" not in os.environ:
        pytest.skip("the extra test is not installed: nbclient missing")
    command = [sys.executable, "-c", "from nbclient.cli import main; main()", str(path), "--timeout", "200"]
    places = os.pathsep.join([str(ROOT), os.environ.get("PYTHONPATH", "")])
    environment = {**os.environ, "PYTHONPATH": places}
    done = subprocess.run(command, env=environment, cwd=tmp_path, capture_output=True, text=True)
    assert done.returncode == 0, done.stderr


def test_every_example_is_told_and_tested() -> None:
    told = (ROOT / "docs" / "notebooks" / "README.md").read_text()
    source = Path(__file__).read_text()
    for name, path in EXAMPLES.items():
        assert f"examples/{path.name}" in told
        assert f'example("{name}")' in source or name == "psychopy_beside"  # which has a test of its own
        assert len(path.read_text().splitlines()) <= 55
    for path in NOTEBOOKS:
        assert f"({path.name})" in told


def test_pages_with_a_picture_are_told_of_with_its_command() -> None:
    figures = ROOT / "docs" / "figures.md"
    told = {(figures.parent / path).resolve() for path, _ in documents.links(figures) if path}
    shown = {document for document in documents.DOCUMENTS if "![" in document.read_text()}
    assert shown - {ROOT / "docs" / "tutorials" / "hands.md"} <= told  # whose picture is that of hands.md
