"""`haptic-slam demo` as a person meets it."""

from __future__ import annotations

import re
import signal
import socket
import subprocess
import sys
import urllib.request
from pathlib import Path

import pytest

from haptic_lab.commands import demo
from haptic_lab.view import options


@pytest.fixture
def quick(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> Path:
    """A folder in which a demo runs with few particles."""
    monkeypatch.chdir(tmp_path)
    monkeypatch.setitem(demo.DEFAULTS, "particles", 10)
    return tmp_path


@pytest.mark.parametrize(
    ("display", "flags", "opens"),
    [("", [], sys.platform != "linux"), (":9", [], True)],
)
def test_a_browser_is_opened_where_there_is_a_screen(
    display: str,
    flags: list[str],
    opens: bool,
    quick: Path,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture,
) -> None:
    called: list[str] = []
    monkeypatch.setattr(demo.webbrowser, "open", called.append)
    monkeypatch.setenv("DISPLAY", display)
    monkeypatch.delenv("WAYLAND_DISPLAY", raising=False)
    waited: list[float] = []
    monkeypatch.setattr(demo, "monotonic", lambda: 0.0)
    monkeypatch.setattr(demo, "sleep", waited.append)
    assert demo.main(["--seconds", "0.4", "--view-port", "0", "--shape", "cube", *flags]) == 0
    assert waited == pytest.approx([0.02 * step for step in range(1, 21)])  # until then, as in the world
    told = capsys.readouterr().out
    address = re.search(r"View: (http://127\.0\.0\.1:(\d+)/)", told)
    assert address
    assert called == ([address[1]] if opens else [])
    assert (f"ssh -L {address[2]}:127.0.0.1:{address[2]} HOST" in told) != opens
    assert "in truth it is" in told
    assert list(quick.iterdir()) == []


def test_a_port_that_is_taken_is_not_the_end(
    quick: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture
) -> None:
    monkeypatch.setenv("DISPLAY", ":9")
    monkeypatch.setattr(demo.webbrowser, "open", lambda _: pytest.fail("--no-browser"))
    with socket.create_server(("127.0.0.1", 0)) as server:
        taken = server.getsockname()[1]
        monkeypatch.setattr(demo, "PORT", taken)
        assert demo.main(["--seconds", "0.1", "--no-browser"]) == 0
        told = capsys.readouterr().out
        assert "View: http" in told
        assert f":{taken}/" not in told
        monkeypatch.setattr(demo, "PORT", options.PORT)
        with pytest.raises(SystemExit) as ended:
            demo.main(["--seconds", "0.1", "--no-browser", "--view-port", str(taken)])
    assert ended.value.code == 2
    assert "--view-port" in capsys.readouterr().err


@pytest.mark.parametrize(
    ("flags", "told"),
    [
        (["--seconds", "0"], "--seconds"),
        (["--shape", "cubee"], "did you mean 'cube'"),
        (["--hand", "paw"], "paw"),
        (["--view-port", "70000"], "--view-port"),
        (["--policy", "push"], "unknown --policy 'push'"),
    ],
)
def test_bad_input_is_one_line(flags: list[str], told: str, quick: Path, capsys: pytest.CaptureFixture) -> None:
    with pytest.raises(SystemExit) as ended:
        demo.main(flags)
    assert ended.value.code == 2
    said = capsys.readouterr()
    assert told in said.err
    assert (said.err.count("\n"), said.out) == (1, "")


def test_ctrl_c_ends_it_cleanly() -> None:
    command = [sys.executable, "-m", "haptic_lab", "demo", "--no-browser", "--view-port", "0", "--seconds", "600"]
    with subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True) as process:
        assert process.stdout is not None
        assert process.stderr is not None
        try:
            said = ""
            for line in process.stdout:  # comes while it runs
                said += line
                if "1.0 s" in line:
                    break
            address = re.search(r"View: (\S+)", said)
            assert address, said
            with urllib.request.urlopen(address[1], timeout=10) as page:
                assert b"<html" in page.read().lower()
            process.send_signal(signal.SIGINT)
            rest = process.stdout.read()
            assert process.wait(60) == 130
            assert process.stderr.read() == ""
            assert "in truth it is" in rest
        finally:
            process.kill()
