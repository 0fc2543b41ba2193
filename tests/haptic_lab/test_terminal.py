"""What is printed arrives at any terminal, and what is typed is the path that was meant."""

from __future__ import annotations

import argparse
import io
import os
import signal
import subprocess
import sys
from pathlib import Path

import pytest
from rich.table import Table

from haptic_lab import terminal
from haptic_lab.terminal import as_path, make_console, program

ROOT = Path(__file__).resolve().parents[2]
ODD = "a [old] [/b] [red]:smile: $x$ “σ”.stl"
SPEAK = """
from rich.table import Table
from haptic_lab.terminal import make_console, program, refuse
def main():
    console, table = make_console(80), Table()
    table.add_row("σ = 3° …", "[b] 物")
    console.print("σ = 3° …", "[b] 物")
    console.print(table)
    refuse("σ = 3° … 物")
program(main)
"""


def run(text: str, *, closed: bool = False, **variables: str) -> subprocess.CompletedProcess[bytes]:
    """What a process makes of `text`; where its output is `closed`, it has none."""
    arguments = [sys.executable, "-W", "error", "-c", text]
    if closed:
        arguments = ["sh", "-c", '"$@" >&- 2>&-', "sh", *arguments]
    return subprocess.run(arguments, cwd=ROOT, env={**os.environ, **variables}, capture_output=True)


@pytest.mark.parametrize("encoding", ["ascii", "latin-1", "cp1252", "cp437", "utf-8"])
def test_any_stream_takes_what_is_said(encoding: str) -> None:
    ended = run(SPEAK, PYTHONIOENCODING=encoding)
    assert ended.returncode == 2
    assert ended.stdout.count(b"3") == 2
    assert ended.stdout.count(b"[b]") == 2
    assert ended.stderr.startswith(b"-c: error: ")
    assert ended.stderr.count(b"\n") == 1
    if encoding == "utf-8":
        assert "σ = 3° … [b] 物\n" in ended.stdout.decode()


def test_without_any_output_it_ends_as_it_would() -> None:
    assert run(SPEAK, closed=True).returncode == 2


def test_what_takes_long_is_said_as_it_is() -> None:
    ended = run(
        "import logging\nfrom haptic_env import notice\nfrom haptic_lab.terminal import program\n"
        "logging.basicConfig()\nprogram(lambda: notice.tell('Waiting for σ', 0, 3) or 0)",
        PYTHONIOENCODING="utf-8",
    )
    assert (ended.returncode, ended.stderr.decode()) == (0, "Waiting for σ: 3\n")


def test_names_are_shown_as_they_are(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(sys, "stdout", io.StringIO())
    console, table = make_console(120), Table(ODD)
    table.add_row(ODD)
    console.print(ODD)
    console.print(table)
    console.rule(ODD)
    assert sys.stdout.getvalue().count(ODD) == 4  # type: ignore[attr-defined]


def test_the_home_folder_is_meant_by_a_tilde(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    monkeypatch.setenv("HOME", str(tmp_path))
    monkeypatch.chdir(tmp_path)
    assert as_path("~/out") == f"{tmp_path}/out"
    assert as_path("~") == str(tmp_path)
    for same in ("out/~", "a~b", "./~", "cube", "é 物.stl", "[a]", "a\u202fb.png", "-x"):
        assert as_path(same) == same
    with pytest.raises(argparse.ArgumentTypeError, match="no home folder is known for '~nobody-is-called-so/a'"):
        as_path("~nobody-is-called-so/a")
    (tmp_path / "~odd.stl").touch()
    assert as_path("~odd.stl") == "~odd.stl"


@pytest.mark.parametrize("text", ["", " ", "\t", "a\nb", "a\0b", "\x1b[31m", "\udcff", "a\u2028b", "\x85"])
def test_what_is_no_path_is_told(text: str) -> None:
    with pytest.raises(argparse.ArgumentTypeError) as refused:
        as_path(text)
    assert repr(text) in str(refused.value)


def test_an_error_is_one_line_whatever_is_in_it(capsys: pytest.CaptureFixture) -> None:
    with pytest.raises(SystemExit) as ended:
        terminal.Parser().parse_args(["--a\nb", "c\r\nd\u2028e"])
    assert ended.value.code == 2
    assert len(capsys.readouterr().err.splitlines()) == 1


def test_ctrl_c_is_one_line(capsys: pytest.CaptureFixture) -> None:
    usual = signal.getsignal(signal.SIGINT)

    def main() -> int:
        signal.raise_signal(signal.SIGINT)
        return 0

    try:
        with pytest.raises(SystemExit) as ended:
            program(main)
    finally:
        signal.signal(signal.SIGINT, usual)
    assert ended.value.code == 130
    assert capsys.readouterr().err.endswith(": stopped\n")


@pytest.mark.parametrize("number", [2, 13, 17])
def test_an_error_of_a_file_has_words_and_no_number(number: int, capsys: pytest.CaptureFixture) -> None:
    with pytest.raises(SystemExit):
        terminal.refuse(f"--out cannot be read: {OSError(number, os.strerror(number), 'a b')}")
    told = capsys.readouterr().err
    assert told.endswith(f"error: --out cannot be read: {os.strerror(number)}: 'a b'\n")
