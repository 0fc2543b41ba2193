"""What pip makes of this project works in an empty folder, without its sources."""

from __future__ import annotations

import importlib.util
import json
import os
import re
import shutil
import subprocess
import sys
import zipfile
from collections.abc import Iterable
from importlib import metadata
from pathlib import Path

import pytest

from haptic_env import recordings
from haptic_lab.cli import COMMANDS
from tests.haptic_env.movements import closing
from tests.haptic_env.test_rendering import offscreen  # noqa: F401 - skips where nothing can be drawn
from tests.haptic_lab.test_portability import FEW_STEPS

ROOT = Path(__file__).resolve().parents[2]
SCRIPTS = sorted((ROOT / "scripts").glob("*.py"))
DRAWING = ("DISPLAY", "MUJOCO_GL", "WAYLAND_DISPLAY")  # a server has none of these
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
    subprocess.run([*pip, "install", *quiet, "--target", folder / "site", wheel], check=True)
    return folder / "site"


def run(site: Path, cwd: Path, *arguments: str) -> subprocess.CompletedProcess[str]:
    told = {name: value for name, value in os.environ.items() if name not in DRAWING}
    environment = {**told, "PYTHONPATH": str(site)}
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
    assert sorted(told["presets"]) == [*["CMA-ES"] * 5, "PPO", "PPO", "RecurrentPPO", "SAC"]


def test_an_editable_install_is_a_path_that_type_checkers_follow(site: Path, tmp_path: Path) -> None:
    sources = site.parent / "sources"
    build = f"from setuptools import build_meta; build_meta.build_editable({str(tmp_path)!r})"
    subprocess.run([sys.executable, "-c", build], cwd=sources, check=True, capture_output=True)
    (wheel,) = tmp_path.glob("*.whl")
    with zipfile.ZipFile(wheel) as content:
        (path,) = (name for name in content.namelist() if ".dist-info/" not in name)  # and no hook that finds modules
        assert content.read(path).decode().split() == [str(sources)]


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


RUN = """
import contextlib, sys
from haptic_lab import cli
for line in sys.argv[1:]:
    sys.argv = ["haptic-slam", *line.split()]
    try:
        cli.main()
    except SystemExit as ended:
        if ended.code:
            sys.exit(f"{line}: {ended.code}")
"""
EXPLORED = [f"explore.{kind}" for kind in ("json", "npz", "png")] + ["recording.npz"]
JUDGED = ("accuracy", "agreement", "confusion", "sensitivity")
ANSWERS = "subject,object,response,seconds\nA,cube,cube,0.2\nA,sphere,cube,0.2\n"
SHORT = "--seconds 0.2 --particles 2"
QUICK = {  # the command lines, in turn, and the files that each leaves in the empty folder
    # First: how MuJoCo draws is settled when it is imported.
    "picture-recording --recording closing.npz --shape cube --at 0.1 --out seen.png": ["seen.png"],
    f"explore --policy trained {SHORT} --out felt": [f"felt/{name}" for name in EXPLORED],
    "replay felt/recording.npz --particles 2 --out again": [f"again/{name}" for name in EXPLORED],
    f"evaluate {SHORT} --shapes cube sphere --sigmas 3 --trials 1 --exemplars 1 --observers floor haptic_slam --jobs 1 "
    "--out swept": [
        f"swept/{name}" for name in ("against_floor.csv", "config.json", "evaluate.png", "summary.csv", "trials.csv")
    ],
    "figures confusion pose_error --trials-of swept --out drawn": [
        f"drawn/{name}.{kind}" for name in ("confusion", "pose_error") for kind in ("csv", "pdf", "png")
    ],
    "people answers.csv --observers swept --out judged": [
        "judged/report.html",
        *(f"judged/{name}.csv" for name in ("accuracy", "agreement", "confusion", "efficiency", "sensitivity")),
        *(f"judged/{name}.{kind}" for name in JUDGED for kind in ("pdf", "png")),
    ],
    "study size --sigmas 3 --seconds 0.2 --trials 2 --observers floor --jobs 1 --out compared": [
        *(f"compared/{name}" for name in ("counts.csv", "published.csv", "study.csv", "study.png")),
        *(f"compared/trials/all/{name}" for name in ("config.json", "trials.csv")),
    ],
    "simulate --courses example --sigma 4 --trials 8 --out told.csv": ["told.csv"],
    "fit told.csv --courses example --model ideal --draws 0 --out fitted": [
        f"fitted/{name}" for name in ("fit.csv", "fit.json", "fit.png", "predicted.csv")
    ],
    "compare told.csv --courses example --models ideal lapse --draws 0 --out beside": [
        f"beside/{name}" for name in ("compare.csv", "compare.png")
    ],
    "design ideal lapse --courses example --most 20 --rounds 2 --out designed": [
        f"designed/{name}" for name in ("design.csv", "design.png")
    ],
    "objects cube --out measured": ["measured/objects.csv", "measured/objects.png"],
    "check-hand two_finger --out hand": [
        f"hand/{name}" for name in ("hand.png", "joints.csv", "links.csv", "patches.csv")
    ],
    "learn mug1 --shape sphere --policy enclosure --seconds 0.8 --particles 2 --library shelf --out kept": [
        "shelf/mug1.npz",
        *(f"kept/{name}" for name in EXPLORED),
    ],
    "library shelf": [],
    "demo --seconds 0.3 --no-browser": [],
}
SLOW = {
    "bench --quick --rounds 1 --json fast.json": ["fast.json"],
    "train --preset few.toml --jobs 1 --out learnt": [
        "learnt/best_model.npz",
        "learnt/model.npz",
        "learnt/training.json",
    ],
    "export learnt/model.zip --trust --out passed.npz": ["passed.npz", "passed.json"],
    "benchmark --tasks Map --policies random_torque --worlds 1 --jobs 1 --out held": [
        f"held/{name}" for name in ("benchmark.csv", "benchmark.md", "benchmark.png", "config.json", "trials.csv")
    ],
    f"explore --policy learnt/model.npz {SHORT} --out used": [f"used/{name}" for name in EXPLORED],
    "figures figure2 figure6 --trials 1 --seconds 0.2 --show-seconds 0.4 --jobs 1 --out drawn": [
        f"drawn/{name}.{kind}" for name in ("figure2", "figure6") for kind in ("csv", "pdf", "png")
    ],
}


def left_by(site: Path, folder: Path, lines: Iterable[str]) -> set[str]:
    """Run command `lines`, one after the other; the files that are in `folder` then."""
    ran = run(site, folder, "-c", RUN, *lines)
    assert ran.returncode == 0, ran.stderr
    return {each.relative_to(folder).as_posix() for each in folder.rglob("*") if each.is_file()}


def test_the_command_that_is_installed_runs(site: Path, tmp_path: Path) -> None:
    (command,) = map(str, (site / "bin").iterdir())
    assert Path(command).stem == "haptic-slam"
    ran = run(site, tmp_path, command, "--version")
    assert (ran.returncode, ran.stdout) == (0, f"haptic-slam {metadata.version('haptic-slam')}\n")


@pytest.mark.usefixtures("offscreen")
def test_every_quick_command_runs_in_an_empty_folder(site: Path, tmp_path: Path) -> None:
    recordings.write(tmp_path / "closing.npz", closing(12))
    (tmp_path / "answers.csv").write_text(ANSWERS, encoding="utf-8")
    left = left_by(site, tmp_path, QUICK)
    wanted = {file for files in QUICK.values() for file in files}
    assert {name for name in left if not name.startswith("swept/exemplars/")} == wanted | {"answers.csv", "closing.npz"}


@pytest.mark.statistical
@pytest.mark.skipif(importlib.util.find_spec("stable_baselines3") is None, reason="needs the extra train")
def test_every_slow_command_runs_in_an_empty_folder(site: Path, tmp_path: Path) -> None:
    (tmp_path / "few.toml").write_text(FEW_STEPS, encoding="utf-8")
    assert {file for files in SLOW.values() for file in files} <= left_by(site, tmp_path, SLOW)


def test_every_command_is_run() -> None:
    run_here = {line.split()[0] for line in (*QUICK, *SLOW)}
    for_developers, beside_a_sender = {"scaling", "scheduling"}, {"live"}
    assert run_here | for_developers | beside_a_sender == set(COMMANDS)
