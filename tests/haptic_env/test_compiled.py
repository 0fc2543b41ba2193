"""What is compiled is kept, and processes that start at once do each other no harm."""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path

import pytest

from haptic_env import cache, kernel_cache
from haptic_env.compiled import inner, kernel, part

ROOT = Path(__file__).resolve().parents[2]
WORK = """
import numpy as np
from haptic_env import sensors, touch, validate
validate.array("action", np.zeros(3), (3,), bound=1.0)
print(sensors.MotorNoise(0.1).sample(np.random.default_rng(0), np.ones(3)).tolist())
"""


def begin(place: Path) -> subprocess.Popen:
    variables = {**os.environ, "PYTHONPATH": str(ROOT), cache.VARIABLE: str(place)}
    return subprocess.Popen([sys.executable, "-c", WORK], stdout=subprocess.PIPE, cwd=place, env=variables)


def end(run: subprocess.Popen) -> bytes:
    told, _ = run.communicate()
    assert run.returncode == 0
    return told


def kept(place: Path) -> dict[Path, int]:
    return {path: path.stat().st_mtime_ns for path in place.rglob("*.kernel")}


def test_two_processes_compile_at_once_and_a_third_finds_it_done(tmp_path: Path) -> None:
    first, second = (end(run) for run in [begin(tmp_path), begin(tmp_path)])
    assert first == second
    compiled = kept(tmp_path)
    assert any("_touch" in path.name for path in compiled)
    assert end(begin(tmp_path)) == first
    assert kept(tmp_path) == compiled


def test_what_a_function_is_compiled_to_does_not_depend_on_who_calls_it_first(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """numba compiles a callee as its first caller is compiled, where nothing else is said of it."""
    monkeypatch.setattr(kernel_cache, "folder", lambda: tmp_path)

    @inner()
    def exact(x: float) -> float:
        return (x / 3.0 + x) - x

    @part(fastmath=True)
    def hasty(x: float) -> float:
        return exact(x) / 7.0

    @kernel(fastmath=True)
    def first(x: float) -> float:
        return hasty(x)

    first(1.0)
    (plain,), (fast,) = exact.inspect_llvm().values(), hasty.inspect_llvm().values()
    assert " fast " in fast
    assert "alwaysinline" in fast
    assert " fast " not in plain
    assert "alwaysinline" not in plain
