"""A stream that comes more seldom than it is to is told, once; one that falls silent is told otherwise."""

from __future__ import annotations

import numpy as np
import pytest

from haptic_lab.live.rates import WINDOW, Rates
from haptic_lab.live.session import Chunk
from tests.haptic_lab.live.streams import Played, moving
from tests.haptic_lab.live.test_live import session


def said(
    rate: float, expected: float = 50.0, silent: tuple[float, float] = (0.0, 0.0), burst: float = 0.1
) -> list[str]:
    rates, lines = Rates({"joints": "Glove"}, {"joints": expected}), []
    for now in np.arange(0.0, 6 * WINDOW, 0.1):
        gone = silent[0] <= now < silent[1]
        until = silent[0] if gone else now - now % burst  # of what has come
        count = round(rate * (until - 12.0 if until > silent[1] > 0.0 else until))
        lines += rates.told({"joints": (count, until)}, {"joints"} if gone else set())
    return lines


@pytest.mark.parametrize("rate", [1.0, 10.0, 30.0])
def test_what_comes_too_seldom_is_told_once_with_a_rate_that_fits(rate: float) -> None:
    (told,) = said(rate, burst=1.0)
    assert f"samples of joints come from Glove {rate:g} times a second, not 50" in told
    assert f"--control-hz {rate:g} fits" in told


@pytest.mark.parametrize("burst", [0.1, 4.0, 11.0])
@pytest.mark.parametrize("rate", [0.0, 40.0, 50.0, 500.0])
def test_what_comes_as_often_or_never_is_not(rate: float, burst: float) -> None:
    assert said(rate, burst=burst) == []


def test_silence_is_told_otherwise() -> None:
    assert said(50.0, silent=(7.0, 19.05)) == []


@pytest.mark.parametrize("seldom", ["joints", "contacts"])
def test_a_session_tells_it(monkeypatch: pytest.MonkeyPatch, seldom: str) -> None:
    source, made = session()
    source.close()
    lines: list[str] = []
    made._say = lines.append
    now = [0.0]
    monkeypatch.setattr("haptic_lab.live.session.time.monotonic", lambda: now[0])
    streams = dict(zip(("joints", "contacts"), moving(made.slam.hand, 500)[1:], strict=True))

    def chunks():
        for k in range(0, 500, 10):
            now[0] += 0.2
            yield [
                Chunk(name, 100.0 + np.arange(k, k + 10, step) / 50.0, values[k : k + 10 : step])
                for name, values in streams.items()
                for step in [5 if name == seldom else 1]
            ]

    source = Played(chunks())
    source.session = made
    monkeypatch.setattr(made, "observe", lambda *_: None)
    made.run(source, [])
    kind = {"joints": "joints", "contacts": "touch"}[seldom]
    assert [each for each in lines if "times a second" in each] == [
        each for each in lines if each.startswith(f"samples of {kind} come from {seldom} 10 times a second, not 50")
    ]
    assert len(lines) == 1
