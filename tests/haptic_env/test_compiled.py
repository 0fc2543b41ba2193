"""What is compiled is kept, and processes that start at once do each other no harm."""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path

from haptic_env import cache

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
