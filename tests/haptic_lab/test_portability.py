"""Nothing that some systems lack is imported or called: commands run where it has been taken away (`windows/`)."""

from __future__ import annotations

import importlib.util
import os
import pkgutil
import subprocess
import sys
from pathlib import Path

import pytest

from haptic_lab.commands import evaluate
from tests.haptic_lab.workers import in_this_process

PACKAGES = ("agents", "haptic_env", "haptic_lab", "observer")
ROOT = Path(__file__).resolve().parents[2]
WINDOWS = ROOT / "tests" / "haptic_lab" / "windows"
TRAINING = ("haptic_lab.learning", "haptic_lab.commands.train")  # what needs the extra `train`
EXTRAS = "ap_gym dask distributed stable_baselines3 sb3_contrib torch.utils.tensorboard"
FEW = "--particles 2 --seconds 0.2"
SWEEP = f"{FEW} --shapes cube --observers floor haptic_slam --sigmas 3 --trials 2 --classifiers"
FEW_STEPS = """
algorithm = "PPO"
steps = 40
envs = 2
evaluate_every = 40
episodes = 2
[learner]
policy = "MlpPolicy"
n_steps = 4
batch_size = 4
[world]
seconds = 0.4
variants = 4
"""
pytestmark = pytest.mark.skipif(not sys.platform.startswith("linux"), reason="Linux plays the other system")


def modules() -> list[str]:
    found = []
    for package in PACKAGES:
        found += [package, *(each.name for each in pkgutil.walk_packages([str(ROOT / package)], f"{package}."))]
    trained = importlib.util.find_spec("stable_baselines3") is not None
    return [name for name in found if not name.endswith("__main__") and (trained or not name.startswith(TRAINING))]


def play(folder: Path, program: str, installed: str = "") -> list[str]:
    """Run Python's `program` in `folder`, on Windows as far as Linux can play it; who played."""
    path = os.pathsep.join(map(str, (WINDOWS, ROOT)))
    told = {"PYTHONPATH": path, "PLAYBILL": str(folder / "playbill"), "PLAY_AFTER": installed}
    environment = {**os.environ, **told, "PYTHONWARNDEFAULTENCODING": "1"}
    ran = subprocess.run([sys.executable, "-c", program], cwd=folder, env=environment, capture_output=True, text=True)
    assert ran.returncode == 0, ran.stdout + ran.stderr
    return (folder / "playbill").read_text(encoding="utf-8").split()


def command(name: str, flags: str) -> str:
    """The program that runs a command to its end."""
    module = f"haptic_lab.commands.{name}"
    return f"import sys, {module}\ncode = {module}.main({flags.split()!r})\nassert code == 0, code\n"


IMPORTS = """
import matplotlib, os, sys
before = dict(matplotlib.rcParams.copy())
{}
assert (sys.platform, os.name) == ('win32', 'nt')
changed = {{name for name, value in before.items() if dict.__getitem__(matplotlib.rcParams, name) != value}}
assert not changed, changed
"""


def test_all_is_imported_without_what_posix_alone_has_and_matplotlib_draws_as_before(tmp_path: Path) -> None:
    imports = "\n".join(f"import {name}" for name in modules())
    assert len(play(tmp_path, IMPORTS.format(imports), EXTRAS)) == 1


def test_an_exploration_its_replay_and_a_sweep_of_two_workers_run_without_it(tmp_path: Path) -> None:
    played = tmp_path / "played"
    played.mkdir()
    program = command("explore", f"{FEW} --policy trained --out felt")
    program += command("replay", "felt/recording.npz --particles 2 --out again")
    program += command("evaluate", f"{SWEEP} --jobs 100 --out swept")
    assert len(play(played, program)) == 3, "that process and two workers: more are not needed"
    assert {each.name for each in (played / "again").iterdir()} == {each.name for each in (played / "felt").iterdir()}
    assert not list(played.rglob(".*")), "what was claimed is let go"
    with in_this_process():
        assert evaluate.main([*SWEEP.split(), "--jobs", "1", "--out", str(tmp_path / "swept")]) == 0
    for name in ("trials.csv", "summary.csv", "config.json"):
        assert (played / "swept" / name).read_bytes() == (tmp_path / "swept" / name).read_bytes()


@pytest.mark.statistical
@pytest.mark.skipif(importlib.util.find_spec("stable_baselines3") is None, reason="needs the extra train")
def test_training_in_two_processes_runs_without_it(tmp_path: Path) -> None:
    (tmp_path / "few.toml").write_text(FEW_STEPS, encoding="utf-8")
    program = command("train", "--preset few.toml --jobs 2 --out learnt") + command(
        "explore", f"{FEW} --policy learnt/model.npz --out felt"
    )
    assert len(play(tmp_path, program, EXTRAS)) == 1 + 2 + 2, "that process, and each environment in its own"
    assert (tmp_path / "learnt" / "model.npz").is_file()


def test_the_modules_are_found() -> None:
    assert {"haptic_env.rendering", "observer.fastslam", "agents.policy", "haptic_lab.processes"} <= set(modules())
