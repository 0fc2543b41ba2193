"""The command `haptic-slam` and its name as a module."""

from __future__ import annotations

import runpy
import sys
from importlib import metadata

import pytest

from haptic_lab import cli


def ended(monkeypatch: pytest.MonkeyPatch, *arguments: str) -> int | str | None:
    """The exit code of `python -m haptic_lab` with `arguments`."""
    monkeypatch.setattr(sys, "argv", ["__main__.py", *arguments])
    with pytest.raises(SystemExit) as end:
        runpy.run_module("haptic_lab", run_name="__main__")
    return end.value.code


@pytest.mark.parametrize("arguments", [(), ("--help",), ("-h",)])
def test_it_tells_what_there_is(
    arguments: tuple[str, ...], monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture
) -> None:
    assert ended(monkeypatch, *arguments) == 0
    told = capsys.readouterr().out
    assert all(f"\n  {name} " in told for name in cli.COMMANDS)
    assert "\nexamples: haptic-slam " in told


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
