"""What hosting services and pre-commit are told to run is what this project has."""

from __future__ import annotations

import os
import re
import shlex
import shutil
import subprocess
import tomllib
from collections.abc import Iterable
from importlib import metadata
from pathlib import Path
from typing import Any

import pytest
import yaml

from haptic_lab.cli import COMMANDS
from haptic_lab.commands import explore
from haptic_lab.sweeps import options

ROOT = Path(__file__).resolve().parents[2]
PROJECT = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["project"]
JOBS: dict[str, Any] = yaml.safe_load((ROOT / ".github/workflows/tests.yml").read_text(encoding="utf-8"))["jobs"]
HOOKS = [
    hook
    for repository in yaml.safe_load((ROOT / ".pre-commit-config.yaml").read_text(encoding="utf-8"))["repos"]
    for hook in repository["hooks"]
]
SCRIPTS = {
    f"{job}, step {n}": step["run"] for job in JOBS for n, step in enumerate(JOBS[job]["steps"]) if "run" in step
}

PARSERS: dict[str, Any] = {"explore": explore.parse, "evaluate": lambda flags: options.check(None, flags)}


def names(requirements: Iterable[str]) -> set[str]:
    """The packages of `requirements`, but for those of extras, as indexes spell them."""
    found = (re.match(r"[\w.-]+", each) for each in requirements if "extra ==" not in each)
    return {re.sub(r"[-_.]+", "-", each[0]).lower() for each in found if each}


def test_the_versions_of_python_that_are_told_are_those_that_are_tested() -> None:
    told = [each.rpartition(" ")[2] for each in PROJECT["classifiers"] if re.search(r":: 3\.\d+$", each)]
    assert JOBS["tests"]["strategy"]["matrix"]["python"] == told
    assert JOBS["expected"]["strategy"]["matrix"]["python"] == told
    assert PROJECT["requires-python"].startswith(f">={told[0]}")


@pytest.mark.parametrize("step", SCRIPTS)
def test_a_step_runs_what_there_is(step: str) -> None:
    script = SCRIPTS[step]
    assert subprocess.run([shutil.which("bash") or "bash", "-n"], input=script, text=True).returncode == 0
    for line in map(shlex.split, script.replace("\\\n", " ").splitlines()):
        if line[0] == "haptic-slam":
            assert line[1] in COMMANDS
            if line[1] in PARSERS:
                PARSERS[line[1]](line[2:])
        elif line[0].startswith("."):
            assert os.access(ROOT / line[0], os.X_OK)
        else:
            assert line[0] in ("python", "sudo")


def test_the_packages_that_one_job_names_are_all_that_are_needed() -> None:
    (script,) = (each for name, each in SCRIPTS.items() if name.startswith("python-3_13") and "pip" in each)
    given = names(each for each in shlex.split(script.replace("\\\n", " ")) if not each.startswith("-"))
    wanted = names(PROJECT["dependencies"]) | names(metadata.requires("dm-control") or ())
    assert wanted - given == {"labmaze"}, "which has no wheel there"


def test_a_commit_is_checked_by_what_make_check_runs() -> None:
    make = (ROOT / "Makefile").read_text(encoding="utf-8")
    checks = re.search(r"^check:.*\n((?:\t.*\n)+)", make, flags=re.MULTILINE)
    assert checks
    programs = [
        re.sub(r" --\w+| \.$", "", each.strip()) for each in checks[1].replace("$(BIN)", ".venv/bin").splitlines()
    ]
    assert [hook["entry"].removesuffix(" --fix") for hook in HOOKS] == programs
