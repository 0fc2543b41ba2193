"""What tests of sweeps need."""

from __future__ import annotations

from collections.abc import Iterator

import pytest

from haptic_lab import style
from tests.haptic_lab.workers import in_this_process


@pytest.fixture
def serially() -> Iterator[None]:
    """Sweeps start no processes."""
    with in_this_process():
        yield


@pytest.fixture
def coarse(monkeypatch: pytest.MonkeyPatch) -> None:
    """Pictures at which nobody looks."""
    monkeypatch.setitem(style.RC, "savefig.dpi", 40)
