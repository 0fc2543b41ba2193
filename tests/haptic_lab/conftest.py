"""What tests of sweeps need."""

from __future__ import annotations

from collections.abc import Iterator

import pytest

from tests.haptic_lab.workers import in_this_process


@pytest.fixture
def serially() -> Iterator[None]:
    """Sweeps start no processes."""
    with in_this_process():
        yield
