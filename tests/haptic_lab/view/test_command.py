"""`explore --view` and `--save-html` from end to end, and what they refuse."""

from __future__ import annotations

import io
import json
import multiprocessing
import os
import re
import signal
import socket
import subprocess
import sys
import threading
import urllib.request
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from playwright.sync_api import Page
from rich.console import Console

from haptic_lab.commands import explore, live
from haptic_lab.live.session import Told
from haptic_lab.view import viewer
from haptic_lab.view.drawer import Drawer
from haptic_lab.view.encoding import Encoder
from haptic_lab.view.history import History
from haptic_lab.view.live_sink import ViewSink
from haptic_lab.view.options import ViewOptions
from observer import HapticSLAM
from tests.haptic_lab.view.conftest import Direct, Shown, opened, picture

SHORT = ["--seconds", "0.6", "--particles", "10", "--seed", "900003", "--shape", "cube"]
LIVE = ["--udp", "0", "--hand", "two_finger"]


@pytest.fixture
def taken() -> Iterator[int]:
    """A port at which somebody listens."""
    with socket.create_server(("127.0.0.1", 0)) as server:
        yield server.getsockname()[1]


def test_it_is_seen_while_it_stays_and_changes_no_bit_of_the_belief(
    tmp_path: Path, look: Page, monkeypatch: pytest.MonkeyPatch
) -> None:
    flags = ["--view", "--view-port", "0", "--view-wait", "--save-html", str(tmp_path / "seen.html")]
    command = [sys.executable, "-m", "haptic_lab", "explore", *SHORT, *flags, "--out", str(tmp_path / "seen")]
    told = {**os.environ, "PYTHONUNBUFFERED": "1"}
    with subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True, env=told) as process:
        assert process.stdout is not None
        assert process.stderr is not None
        try:
            lines = []
            for line in process.stdout:
                lines.append(line)
                if "stays open" in line:
                    break
            said = "".join(lines)
            address = re.search(r"View: (\S+)", said)
            assert address, said + process.stderr.read()
            opened(look, address[1])
            assert look.evaluate("recorded.states.length") == 15
            process.send_signal(signal.SIGINT)
            assert process.wait(60) == 0
            assert process.stderr.read() == ""
        finally:
            process.kill()
    with pytest.raises(OSError, match="refused"):
        urllib.request.urlopen(address[1], timeout=5)
    look.wait_for_timeout(50)
    assert "takes it for" in look.inner_text("#status")  # what came is still there
    look.context.set_offline(True)
    opened(look, (tmp_path / "seen.html").as_uri())
    assert look.evaluate("recorded.states.length") == 15
    assert (picture(look).min(axis=2) < 200).mean() > 0.03
    monkeypatch.setattr(explore, "picture", lambda *_: None)
    assert explore.main([*SHORT, "--out", str(tmp_path / "unseen")]) == 0
    with np.load(tmp_path / "seen" / "explore.npz") as seen, np.load(tmp_path / "unseen" / "explore.npz") as unseen:
        assert set(seen) == set(unseen)
        for name in seen:
            assert seen[name].tobytes() == unseen[name].tobytes(), name
    summaries = [(tmp_path / each / "explore.json").read_text() for each in ("seen", "unseen")]
    assert all("view" not in each for each in summaries)


@pytest.mark.parametrize(
    ("flags", "told"),
    [
        (["--view-port", "9000"], "--view-port is for the page of --view, which is not given"),
        (["--no-view-wait"], "--view-wait is for the page of --view"),
        (["--view", "--view-port", "65536"], r"--view-port must be an integer in \[0, 65535\], got 65536"),
        (["--view", "--view-port", "-1"], "--view-port must be an integer"),
        (["--view", "--view-host", "example.org"], "--view-host must be an address of this machine.*'example.org'"),
        (["--view", "--view-host", "192.0.2.7"], "192.0.2.7 is no address of this machine; 127.0.0.1 is one"),
        (["--view", "--view-token", "short"], "--view-token must be 16 to 200 letters.*'short'"),
        (["--view", "--view-token", "white space white space"], "--view-token must be 16"),
        (["--save-html", "view.txt"], "--save-html must end in .html or .htm, got 'view.txt'"),
        (["--save-html", "nowhere/view.html"], "--save-html must be a file in a folder that can be written to"),
    ],
)
@pytest.mark.parametrize("command", [explore.main, live.main], ids=["explore", "live"])
def test_what_makes_no_sense_ends_with_one_line(
    command: Any,
    flags: list[str],
    told: str,
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture,
) -> None:
    monkeypatch.chdir(tmp_path)
    arguments = SHORT if command is explore.main else LIVE
    try:
        code = command([*arguments, *flags])
    except SystemExit as ended:
        code = ended.code
    error = capsys.readouterr().err
    assert code == 2
    assert re.search(told, error), error
    assert error.count("\n") == 1
    assert not list(tmp_path.rglob("*.*"))


def test_a_port_that_is_taken_is_told_before_anything_is_run(
    taken: int, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture
) -> None:
    monkeypatch.chdir(tmp_path)
    assert explore.main([*SHORT, "--view", "--view-port", str(taken)]) == 2
    error = capsys.readouterr().err
    assert f"--view-port {taken} of 127.0.0.1 is taken; say another from 1024 to 65535, or 0" in error
    assert error.count("\n") == 1
    assert not list(tmp_path.rglob("*.*"))


@pytest.mark.parametrize(
    ("host", "asks"),
    [("127.0.0.1", False), ("127.0.0.9", False), ("::1", False), ("0.0.0.0", True), ("192.0.2.7", True)],
)
def test_only_what_this_machine_alone_reaches_is_open(host: str, asks: bool) -> None:
    given = {"view": True, "view_host": host, "view_port": 0, "view_token": None, "view_wait": None, "save_html": None}
    options = ViewOptions.taken(dict(given))
    assert (options.token is not None) == asks
    address = options.address(8017)
    assert address.startswith("http://127." if host in ("127.0.0.1", "127.0.0.9", "0.0.0.0") else "http://")
    assert ("?token=" in address) == asks
    if asks:
        assert options.token != ViewOptions.taken(dict(given)).token
    told = ViewOptions.taken({**given, "view_token": "one-of-my-own-making"})
    assert told.token == "one-of-my-own-making"


def test_the_one_who_draws_never_keeps_the_observer_waiting(shown: Shown, monkeypatch: pytest.MonkeyPatch) -> None:
    """What waits is left out once there is too much of it, but for the last."""
    monkeypatch.setattr(viewer, "BACKLOG", 3)
    made = object.__new__(viewer.Viewer)
    made.dropped, made._waiting = 0, viewer.queue.Queue()
    made._pace = viewer.Pace(50.0)
    monkeypatch.setattr(made._pace, "take", lambda *_: ("moment",))
    for step in range(10):
        made.show(step, shown, np.zeros(4))  # type: ignore[arg-type]
    made.show(10, shown, np.zeros(4), whole=True)  # type: ignore[arg-type]
    assert made._waiting.qsize() == 5
    assert made.dropped == 6


@pytest.mark.parametrize("error", [ValueError, ImportError, IndexError, MemoryError])
def test_a_surface_that_cannot_be_drawn_keeps_nobody_waiting(
    shown: Shown, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, error: type[Exception]
) -> None:
    def fails(*_: object) -> str:
        raise error

    monkeypatch.setattr(Encoder, "surface", fails)
    drawer = Drawer(History(), behind=20)
    drawer.begin(shown.setting)
    for _ in range(2):
        drawer._waiting.put(shown.moments[-1])
    waiting = threading.Thread(target=drawer.write, args=(str(tmp_path / "a.html"),), daemon=True)
    waiting.start()
    waiting.join(30.0)
    assert not waiting.is_alive()
    assert not drawer.left
    assert (tmp_path / "a.html").exists()


@pytest.mark.parametrize("terminal", [False, True])
@pytest.mark.parametrize(("left", "told"), [([], False), ([2, 1], False), ([9, 4, 1], True)])
def test_what_is_still_to_be_drawn_is_told(terminal: bool, left: list[int], told: bool) -> None:
    made = object.__new__(viewer.Viewer)
    made.options, made._waiting = ViewOptions(html="a.html"), viewer.queue.Queue()
    made._pipe, theirs = multiprocessing.Pipe()
    for each in [*left, None]:
        theirs.send(each)
    out = io.StringIO()
    made.finish("over", Console(file=out, force_terminal=terminal, width=200))
    assert "As one page: a.html" in out.getvalue()
    assert ("9 surfaces are still to be drawn for a.html; Ctrl-C" in out.getvalue()) == told
    assert ("of 9" in out.getvalue()) == told, out.getvalue()


def test_a_live_session_is_shown(shown: Shown) -> None:
    """The first that is told is the reset; the rest is shown as an exploration is."""
    direct, console = Direct(), Console(file=io.StringIO())
    finished: list[str] = []
    direct.finish = lambda told, _: finished.append(told)  # type: ignore[attr-defined]
    slam = HapticSLAM(shown.setting.hand, sigma_deg=3.0, particles=5)
    last: list[Told] = []
    sink = ViewSink(direct, slam, ("cube", "sphere"), console, lambda: last[-1])  # type: ignore[arg-type]
    belief = slam.reset(seed=900001)
    for step in range(51):
        posterior = np.array([0.25, 0.75]) if step else np.array([0.5, 0.5])
        last[:] = [Told(0.02 * step, belief, ("cube", "sphere"), posterior, 1.0)]
        sink.tell(last[0])
        belief = slam.step(np.zeros(8), shown.setting.hand.rest_pose, np.arange(50) == 7)
    sink.close()
    assert [each.step for each in direct.moments] == [*range(2, 51, 2), 50]
    kinds = [json.loads(each)["kind"] for each in direct.history.texts()]
    assert kinds[:2] == ["scene", "state"]
    assert finished == ["over: it takes it for a sphere, 75% sure"]
