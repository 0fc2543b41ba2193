"""Importing calls nothing that some systems lack, and changes nothing: all is imported with it taken away."""

from __future__ import annotations

import importlib.util
import os
import pkgutil
import subprocess
import sys
from pathlib import Path

import pytest

PACKAGES = ("agents", "haptic_env", "haptic_lab", "observer")
ROOT = Path(__file__).resolve().parents[2]
TRAINING = ("haptic_lab.learning", "haptic_lab.commands.train")  # what needs the extra `train`
# Taken away once what is installed has been imported, which has builds of its own for each system.
LACKING = """
import importlib, os, signal, sys
for name in sys.argv[1].split():
    try:
        importlib.import_module(name)
    except ImportError:
        pass
POSIX = {
    os: "fork forkpty register_at_fork getuid geteuid getgid setsid killpg nice sched_getaffinity getloadavg uname",
    signal: "SIGKILL SIGHUP SIGALRM SIGUSR1 SIGCHLD pthread_sigmask sigwait pthread_kill alarm setitimer siginterrupt",
}
for module, names in POSIX.items():
    for name in names.split():
        if hasattr(module, name):
            delattr(module, name)
for name in "fcntl grp pwd resource termios tty pty syslog".split():
    sys.modules[name] = None
import matplotlib
before = dict(matplotlib.rcParams.copy())
for name in sys.argv[2].split():
    importlib.import_module(name)
changed = {name for name, value in before.items() if dict.__getitem__(matplotlib.rcParams, name) != value}
print(sorted(changed))
"""
INSTALLED = (
    "dask distributed dm_control.mjcf filelock gymnasium.envs.mujoco.mujoco_rendering joblib matplotlib.pyplot mujoco "
    "multiprocessing.pool numba pandas platformdirs rich.progress sklearn.ensemble scipy.spatial scipy.optimize "
    "scipy.ndimage threadpoolctl concurrent.futures.process"
)


def modules() -> list[str]:
    found = []
    for package in PACKAGES:
        found += [package, *(each.name for each in pkgutil.walk_packages([str(ROOT / package)], f"{package}."))]
    trained = importlib.util.find_spec("stable_baselines3") is not None
    return [name for name in found if not name.endswith("__main__") and (trained or not name.startswith(TRAINING))]


@pytest.mark.skipif(not hasattr(os, "fork"), reason="there is nothing to take away")
def test_all_is_imported_without_what_posix_alone_has_and_matplotlib_draws_as_before() -> None:
    first = f"{INSTALLED} stable_baselines3 sb3_contrib torch.utils.tensorboard"
    command = [sys.executable, "-c", LACKING, first, " ".join(modules())]
    ran = subprocess.run(command, capture_output=True, text=True, cwd=ROOT, check=False)
    assert ran.returncode == 0, ran.stderr
    assert ran.stdout == "[]\n", "no module changes how matplotlib draws"


def test_the_modules_are_found() -> None:
    assert {"haptic_env.rendering", "observer.fastslam", "agents.policy", "haptic_lab.processes"} <= set(modules())
