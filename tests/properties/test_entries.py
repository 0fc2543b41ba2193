"""Some tens of inputs for each entry point: it works, or is refused with an error that names the value."""

from __future__ import annotations

import resource
from collections.abc import Iterator

import pytest

from tests.properties.accounts import shown
from tests.properties.fuzz import inputs_of, limit_memory
from tests.properties.registry import ENTRIES

INPUTS, LEAST = 16, 2


@pytest.fixture(autouse=True)
def bounded() -> Iterator[None]:
    """Memory runs out before the machine's does."""
    before = resource.getrlimit(resource.RLIMIT_AS)
    limit_memory()
    yield
    resource.setrlimit(resource.RLIMIT_AS, before)


@pytest.fixture(autouse=True)
def elsewhere(monkeypatch: pytest.MonkeyPatch, tmp_path) -> None:
    """Odd paths are relative to a folder of their own."""
    place = tmp_path / "deep" / "down"
    place.mkdir(parents=True)
    monkeypatch.chdir(place)


@pytest.mark.parametrize("name", ENTRIES)
def test_it_works_or_is_refused_by_name(name):
    entry = ENTRIES[name]
    count = max(LEAST, round(INPUTS * min(entry.weight, 2.0)))
    for index, arguments in enumerate(inputs_of(name, entry, seed=0, count=count)):
        outcome = entry.try_with(arguments)
        assert not outcome.fault, f"input {index}: {outcome.kind}\n{shown(arguments)}\n{outcome.told}"
