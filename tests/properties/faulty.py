"""Entry points that break the rule in every way, to see that the fuzzer counts them and goes on."""

from __future__ import annotations

import os
import signal
import time
from typing import Any

import numpy as np

from tests.properties.entry import Entry
from tests.properties.parameters import integer


def _killed(count: Any) -> None:
    if isinstance(count, int) and count == 3:
        os.kill(os.getpid(), signal.SIGSEGV)


def _slow(count: Any) -> None:
    if isinstance(count, int) and count == 3:
        time.sleep(60)


def _large(count: Any) -> Any:
    return np.zeros((10**5, 10**5, count)) if isinstance(count, int) and count == 3 else None


def _other(count: Any) -> Any:
    return {}[count] if isinstance(count, int) and count == 3 else 1.0


def prepare(area: str) -> None:
    """Nothing is compiled."""


COUNT = {"count": integer(1, 4).always}
AREAS = {
    "faulty": {name: Entry(call, COUNT) for name, call in {"k": _killed, "s": _slow, "m": _large, "o": _other}.items()}
}
ENTRIES = AREAS["faulty"]
