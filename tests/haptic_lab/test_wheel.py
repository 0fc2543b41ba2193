"""What pip makes of this project works in an empty folder, without its sources."""

from __future__ import annotations

import json
import os
import re
import shutil
import subprocess
import sys
from importlib import metadata
from pathlib import Path

import pytest

from haptic_lab.cli import COMMANDS

ROOT = Path(__file__).resolve().parents[2]
SCRIPTS = sorted((ROOT / "scripts").glob("*.py"))
PACKAGES = ("agents", "haptic_env", "haptic_lab", "observer")
LOOK = """
import contextlib, io, json, runpy, sys
from pathlib import Path
import agents, haptic_env, haptic_lab, observer
from haptic_env import recordings
from haptic_lab import cli
from haptic_lab.learning import presets

scripts = sys.argv[1:]

def helped(run, *arguments):
    sys.argv = [*arguments, "--help"]
    with contextlib.redirect_stdout(io.StringIO()) as told, contextlib.suppress(SystemExit):
        run()
    return told.getvalue()

packages = [Path(each.__file__).parent for each in (agents, haptic_env, haptic_lab, observer)]
print(json.dumps({
    "places": [str(each.parent) for each in packages],
    "typed": [(each / "py.typed").exists() for each in packages],
    "presets": [presets.read(name).algorithm for name in presets.names()],
    "gloves": [recordings.calibration_for(name) is not None for name in ("adroit", "myo")],
    "commands": {name: helped(cli.main, "haptic-slam", name) for name in cli.COMMANDS},
    "scripts": {each: helped(lambda: runpy.run_path(each, run_name="__main__"), each) for each in scripts},
}))
"""


@pytest.fixture(scope="module")
def site(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The folder into which pip has installed a wheel of these sources."""
    if int(metadata.version("setuptools").partition(".")[0]) < 77:
        pytest.skip("building a wheel without the network needs setuptools 77 in this environment")
    folder = tmp_path_factory.mktemp("wheel")
    sources = folder / "sources"
    for name in PACKAGES:
        shutil.copytree(ROOT / name, sources / name, ignore=shutil.ignore_patterns("__pycache__"))
    for name in ("pyproject.toml", "README.md", "LICENSE"):
        shutil.copy(ROOT / name, sources)
    pip, quiet = [sys.executable, "-m", "pip"], ["--quiet", "--no-deps", "--no-index", "--disable-pip-version-check"]
    subprocess.run([*pip, "wheel", *quiet, "--no-build-isolation", "--wheel-dir", folder, sources], check=True)
    (wheel,) = folder.glob("*.whl")
    subprocess.run([*pip, "install", *quiet, "--no-compile", "--target", folder / "site", wheel], check=True)
    return folder / "site"


def run(site: Path, cwd: Path, *arguments: str) -> subprocess.CompletedProcess[str]:
    environment = {**os.environ, "PYTHONPATH": str(site), "PYTHONDONTWRITEBYTECODE": "1"}
    return subprocess.run([sys.executable, *arguments], capture_output=True, text=True, cwd=cwd, env=environment)


@pytest.fixture(scope="module")
def told(site: Path, tmp_path_factory: pytest.TempPathFactory) -> dict:
    """What a look at the installed packages finds."""
    ran = run(site, tmp_path_factory.mktemp("empty"), "-c", LOOK, *map(str, SCRIPTS))
    assert ran.returncode == 0, ran.stderr
    return dict(json.loads(ran.stdout))


def test_all_that_is_read_is_in_it(told: dict, site: Path) -> None:
    assert set(told["places"]) == {str(site)}
    assert all(told["typed"])
    assert all(told["gloves"])
    assert sorted(told["presets"]) == ["PPO", "PPO", "RecurrentPPO", "SAC"]


@pytest.mark.parametrize("command", COMMANDS)
def test_every_command_helps_with_an_example(command: str, told: dict) -> None:
    text = told["commands"][command]
    assert text.startswith(f"usage: haptic-slam {command} [-h]")
    assert re.search(rf"^examples?: haptic-slam {command} ", text, flags=re.MULTILINE)


@pytest.mark.parametrize("script", SCRIPTS, ids=lambda path: path.name)
def test_a_script_is_the_command_of_its_name(script: Path, told: dict) -> None:
    text, same = told["scripts"][str(script)], told["commands"][script.stem.replace("_", "-")]
    assert text.startswith(f"usage: {script.name} [-h]")
    assert text.partition("\n\n")[2] == same.partition("\n\n")[2]


def test_an_exploration_in_an_empty_folder(site: Path, tmp_path: Path) -> None:
    (command,) = map(str, (site / "bin").iterdir())
    assert Path(command).stem == "haptic-slam"
    few = ("--policy", "trained", "--seconds", "0.2", "--particles", "2", "--out", "felt")
    ran = run(site, tmp_path, command, "explore", *few)
    assert ran.returncode == 0, ran.stderr
    assert {each.relative_to(tmp_path).as_posix() for each in tmp_path.rglob("*")} == {
        "felt",
        *(f"felt/{name}" for name in ("explore.json", "explore.npz", "explore.png", "recording.npz")),
    }
