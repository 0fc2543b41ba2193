"""Kernels are compiled before a trial begins, once, and by whoever asks first."""

from __future__ import annotations

import os
import subprocess
import sys

import numpy as np
import psutil
import pytest
from numba.core import event

import observer
from haptic_env import cache, hands, kernel_cache
from observer import compiling
from observer.variants import ABLATION, NAMES, make_observer

SOURCE = """
from haptic_env.compiled import kernel
@kernel()
def twice(x):
    return 2.0 * x
def go(hand):
    twice(1.0)
def fail(hand):
    twice(1.0)
    raise RuntimeError
def hang(hand):
    import time
    print("hangs", flush=True)
    time.sleep(600)
"""


@pytest.fixture
def part(tmp_path, monkeypatch):
    """A module with parts to be compiled, and a cache of its own."""
    (tmp_path / "parts_of_a_test.py").write_text(SOURCE)
    monkeypatch.syspath_prepend(str(tmp_path))
    monkeypatch.setenv(cache.VARIABLE, str(tmp_path / "cache"))
    monkeypatch.setattr(compiling, "_ready", set())
    return "parts_of_a_test"


def test_a_part_is_compiled_once(part, two_finger, monkeypatch, caplog):
    told = []
    compiling.ensure([f"{part}:go"], two_finger, lambda done, total: told.append((done, total)))
    assert told[-1][0] == told[-1][1] > 0
    assert len(list(kernel_cache.folder().glob("parts_of_a_test.twice-*.kernel"))) == 1
    monkeypatch.setattr(compiling, "_ready", set())  # as in a new process
    monkeypatch.setattr(compiling, "_compile", lambda *_: pytest.fail("compiled again"))
    compiling.ensure([f"{part}:go"], two_finger)
    assert not caplog.records, "nothing is said where there is nothing to do"


def test_a_part_that_fails_is_not_done_and_it_is_told_where_nobody_shows_progress(part, two_finger, caplog):
    compiling.ensure([f"{part}:fail"], two_finger)
    assert [record.getMessage() for record in caplog.records] == [compiling.TOLD]
    assert not list(kernel_cache.folder().glob("*.compiled"))


def test_who_compiles_ends_with_who_asked(part, tmp_path):
    code = (
        "from haptic_env import hands; from observer import compiling; "
        f"compiling.ensure(['{part}:hang'], hands.make('two_finger'), print)"
    )
    path = os.pathsep.join(filter(None, sys.path))
    parent = subprocess.Popen(
        [sys.executable, "-c", code], env={**os.environ, "PYTHONPATH": path}, stdout=subprocess.PIPE
    )
    try:
        assert parent.stdout is not None
        parent.stdout.readline()
        children = psutil.Process(parent.pid).children(recursive=True)
        assert children
    finally:
        parent.kill()
        parent.communicate()
    _, alive = psutil.wait_procs(children, timeout=30)
    assert not alive


def test_observers_ask_at_their_reset(monkeypatch, two_finger):
    asked = []
    monkeypatch.setattr(compiling, "ensure", lambda parts, hand, progress=None: asked.append(tuple(parts)))
    for name in NAMES:
        make_observer(name, two_finger, 3.0, 2).reset(seed=0)
        assert set(compiling.USUAL) <= set(asked.pop()), name


def _compiled_here() -> tuple[list[str], event.Listener]:
    names: list[str] = []

    class Listener(event.Listener):
        def on_start(self, event):
            pass

        def on_end(self, event):
            function = event.data["dispatcher"].py_func
            if function.__module__.partition(".")[0] in ("haptic_env", "observer"):
                names.append(f"{function.__module__}.{function.__qualname__}")

    return names, Listener()


COLD = """
import sys
sys.path.insert(0, sys.argv[1])
import test_compiling
test_compiling.nothing_is_compiled_late()
"""


def nothing_is_compiled_late() -> None:
    """Once a hand is warmed up no observer compiles anything."""
    names, listener = _compiled_here()
    hand = hands.make("two_finger")
    observer.warm_up(hand)
    event.register("numba:compile", listener)
    touch = np.arange(len(hand.patches)) % 4 == 0
    for name in sorted({*NAMES, *ABLATION}):
        slam = make_observer(name, hand, 3.0, 4)
        shape = observer.ShapePosterior(hand)
        slam.reset(seed=0)
        for step in range(slam.lag + 12):
            belief = slam.step(np.zeros(hand.joints), hand.rest_pose, touch & (step % 5 > 1))
            shape.update(belief)
        for belief in slam.flush():
            shape.update(belief)
        belief.occupancy.sum()
        assert not names, (name, names)
    doubtful = observer.HapticSLAM(hand, particles=2, motion="kinematic", lag=2, patches_stuck=0.01)
    event.unregister("numba:compile", listener)
    observer.warm_up(hand, observer=doubtful)
    event.register("numba:compile", listener)
    doubtful.reset(0, hand.rest_pose)
    for step in range(6):
        doubtful.step(None, hand.rest_pose, touch & (step % 5 > 1)).occupancy.sum()
    assert not names, names
    print("ok")


@pytest.mark.statistical
def test_nothing_is_compiled_in_mid_trial(tmp_path):
    """From an empty cache, in a process of its own."""
    path = os.pathsep.join(filter(None, sys.path))
    env = {**os.environ, "PYTHONPATH": path, cache.VARIABLE: str(tmp_path / "cold")}
    here = os.path.dirname(__file__)
    ran = subprocess.run([sys.executable, "-c", COLD, here], env=env, capture_output=True, text=True)
    assert ran.stdout.endswith("ok\n"), ran.stderr
