"""The command `haptic-slam` and its name as a module."""

from __future__ import annotations

import ast
import importlib
import json
import os
import re
import runpy
import subprocess
import sys
from importlib import metadata
from pathlib import Path
from typing import Any

import pytest

from haptic_lab import cli, without_computing

ROOT = Path(__file__).resolve().parents[2]


def ended(monkeypatch: pytest.MonkeyPatch, *arguments: str) -> int | str | None:
    """The exit code of `python -m haptic_lab` with `arguments`."""
    monkeypatch.setattr(sys, "argv", ["__main__.py", *arguments])
    with pytest.raises(SystemExit) as end:
        runpy.run_module("haptic_lab", run_name="__main__")
    return end.value.code


@pytest.mark.parametrize("arguments", [("--help",), ("-h",)])
def test_it_tells_what_there_is(
    arguments: tuple[str, ...], monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture
) -> None:
    assert ended(monkeypatch, *arguments) == 0
    told = capsys.readouterr().out
    assert all(f"\n  {name} " in told for name in cli.COMMANDS)
    assert "\nexamples: haptic-slam " in told


@pytest.mark.parametrize("width", ["60", "200"])
def test_alone_it_tells_what_can_be_done_with_an_example_each(
    width: str, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture
) -> None:
    monkeypatch.setenv("COLUMNS", width)
    assert ended(monkeypatch) == 0
    told = capsys.readouterr().out
    assert all(f"  haptic-slam {name} {cli.EXAMPLES[name]}".rstrip() in told for name in cli.COMMANDS)
    assert all(what in told for what in cli.COMMANDS.values())
    assert max(map(len, told.splitlines())) <= max(int(width), 90)


def test_its_output_may_be_cut_short() -> None:
    piped = f"{sys.executable} -m haptic_lab | true"
    assert subprocess.run(["sh", "-c", piped], cwd=ROOT, capture_output=True, text=True).stderr == ""


HELPS = """
import contextlib, io, json, sys
from haptic_lab import cli
told = {}
for name in cli.COMMANDS:
    sys.argv = ["haptic-slam", name, "--help"]
    with contextlib.redirect_stdout(io.StringIO()) as text, contextlib.suppress(SystemExit):
        cli.main()
    told[name] = text.getvalue()
files = [name for name, each in sys.modules.items() if getattr(each, "__file__", None)]
print(json.dumps({"told": told, "loaded": sorted({name.partition(".")[0] for name in files})}))
"""


@pytest.fixture(scope="module")
def helps() -> dict[str, Any]:
    """What a process of its own tells of each command, and which packages it loaded for that."""
    told = {**os.environ, "COLUMNS": "100"}
    ran = subprocess.run([sys.executable, "-c", HELPS], cwd=ROOT, env=told, capture_output=True, text=True, check=True)
    return dict(json.loads(ran.stdout))


def test_help_loads_nothing_that_computes(helps: dict[str, Any]) -> None:
    assert "haptic_lab" in helps["loaded"]
    assert without_computing.HEAVY.isdisjoint(helps["loaded"])


@pytest.mark.parametrize("command", cli.COMMANDS)
def test_help_says_what_the_command_says_with_all_loaded(
    command: str, helps: dict[str, Any], monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture
) -> None:
    monkeypatch.setenv("COLUMNS", "100")
    module = importlib.import_module(f"haptic_lab.commands.{command.replace('-', '_')}")
    monkeypatch.setattr(sys, "argv", [f"haptic-slam {command}", "--help"])
    with pytest.raises(SystemExit):
        module.main()
    assert helps["told"][command] == capsys.readouterr().out
    flags = [each for each in cli.EXAMPLES[command].split() if each.startswith("--")]
    assert all(re.search(rf"{each}\b", helps["told"][command]) for each in flags)


def test_errors_are_told_while_nothing_that_computes_is_loaded() -> None:
    look = "import sys; from haptic_lab import cli; print(sorted(sys.modules))"
    ran = subprocess.run([sys.executable, "-c", look], cwd=ROOT, capture_output=True, text=True, check=True)
    assert without_computing.HEAVY.isdisjoint(ast.literal_eval(ran.stdout))


def test_it_tells_its_version(monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture) -> None:
    assert ended(monkeypatch, "--version") == 0
    assert capsys.readouterr().out == f"haptic-slam {metadata.version('haptic-slam')}\n"


@pytest.mark.parametrize(
    ("arguments", "told"),
    [
        (("exlpore",), "unknown command 'exlpore' (did you mean 'explore'?); choose from bench"),
        (("Explore", "--help"), "unknown command 'Explore' (did you mean 'explore'?); choose from"),
        (("sphere",), "unknown command 'sphere'; choose from bench"),
        (("a\nb",), r"unknown command 'a\nb'; choose from bench"),
        (("",), "unknown command ''; choose from bench"),
        (("--shape", "cube"), "the following arguments are required: COMMAND"),
    ],
)
def test_what_is_no_command_is_one_clear_line(
    arguments: tuple[str, ...], told: str, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture
) -> None:
    assert ended(monkeypatch, *arguments) == 2
    error = capsys.readouterr().err
    assert error.startswith(f"haptic-slam: error: {told}")
    assert error.count("\n") == 1


def test_errors_are_told_in_the_name_of_the_command(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture
) -> None:
    assert ended(monkeypatch, "picture-recording", "--sigma", "x") == 2
    assert capsys.readouterr().err.startswith("haptic-slam picture-recording: error: argument --sigma: ")
