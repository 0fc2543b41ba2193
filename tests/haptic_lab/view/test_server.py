"""Who is told what over the network."""

from __future__ import annotations

import http.client
import json
import threading
from typing import Any
from urllib.parse import urlsplit

import pytest

from haptic_lab.view.history import History

TOKEN = "a-token-of-some-length"


def ask(address: str, path: str, host: str | None = None, **told: str) -> tuple[int, str]:
    headers = {name.replace("_", "-"): value for name, value in told.items()}
    connection = http.client.HTTPConnection(urlsplit(address).netloc, timeout=10)
    connection.request("GET", path, headers=headers if host is None else {**headers, "Host": host})
    answer = connection.getresponse()
    told = answer.read().decode()
    connection.close()
    return answer.status, told


@pytest.fixture
def history() -> History:
    made = History()
    made.add("scene", '{"kind":"scene"}')
    made.close()
    return made


@pytest.mark.parametrize("path", ["/", "/stream"])
@pytest.mark.parametrize(
    ("query", "status"), [("", 403), ("?token=", 403), ("?token=another-token-of-that", 403), (f"?token={TOKEN}", 200)]
)
def test_with_a_token_only_who_knows_it_is_told(
    serve: Any, history: History, path: str, query: str, status: int
) -> None:
    got, told = ask(serve(history, TOKEN), path + query, "any.example")
    assert got == status
    assert ("scene" in told) == (status == 200)


@pytest.mark.parametrize(
    ("host", "status"),
    [
        ("127.0.0.1:80", 200),
        ("localhost", 200),
        ("[::1]:1", 200),
        ("evil.example", 403),
        ("", 403),
        ("10.0.0.1", 403),
        ("[::1", 403),
    ],
)
def test_without_one_only_this_machine_by_its_own_address(serve: Any, history: History, host: str, status: int) -> None:
    """The page of a stranger, whose name was made to lead here, is not told."""
    assert ask(serve(history), "/stream", host)[0] == status


@pytest.mark.parametrize("token", [None, TOKEN])
@pytest.mark.parametrize(
    ("site", "status"), [("same-origin", 200), ("none", 200), ("same-site", 403), ("cross-site", 403)]
)
def test_a_page_of_others_takes_no_stream(
    serve: Any, history: History, token: str | None, site: str, status: int
) -> None:
    """It could not read it, but would keep a place from who may."""
    assert ask(serve(history, token), f"/stream?token={TOKEN}", Sec_Fetch_Site=site)[0] == status
    assert ask(serve(history, token), f"/?token={TOKEN}", Sec_Fetch_Site=site)[0] == 200  # a link may lead here


@pytest.mark.parametrize("path", ["/favicon.ico", "/../pyproject.toml", "/stream/", "/style.css"])
def test_there_is_nothing_else(serve: Any, history: History, path: str) -> None:
    assert ask(serve(history), path)[0] == 404


def test_whoever_comes_late_is_told_all_and_then_what_comes(serve: Any) -> None:
    history = History()
    for step in range(5):
        history.add("state", json.dumps({"step": step}))
    connection = http.client.HTTPConnection(urlsplit(serve(history)).netloc, timeout=10)
    connection.request("GET", "/stream")
    answer = connection.getresponse()
    threading.Timer(0.1, history.add, ("state", json.dumps({"step": 5}))).start()
    got: list[int] = []
    while len(got) < 6:
        line = answer.readline().strip()
        if line:
            got.append(json.loads(line)["step"])
    assert got == list(range(6))
    connection.close()


def test_a_long_session_is_thinned_evenly_and_keeps_the_last(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("haptic_lab.view.history.MOST", {"state": 8})
    history = History()
    history.add("scene", "scene")
    for step in range(100):
        history.add("state", str(step))
        kept = history.texts()
        assert kept[0] == "scene"
        assert kept[-1] == str(step)
        assert len(kept) <= 9
    steps = [int(each) for each in history.texts()[1:]]
    assert steps == sorted(steps)
    assert steps[0] < 20
