"""Every entry point of the public interface by its name, area by area; what has none is `LEFT_OUT`, with a reason.

Add a new public function as one line to the `ENTRIES` of its area: its parameters, by kind. Registries of the packages
are gone through by themselves.
"""

from __future__ import annotations

from tests.properties.entries import agents, commands, environment, geometry, naming, observers, recordings
from tests.properties.entry import Entry

AREAS: dict[str, dict[str, Entry]] = {
    "environment": environment.ENTRIES,
    "shapes": geometry.ENTRIES,
    "recordings": recordings.ENTRIES,
    "observers": observers.ENTRIES,
    "naming": naming.ENTRIES,
    "agents": agents.ENTRIES,
    "commands": commands.ENTRIES,
}
ENTRIES: dict[str, Entry] = {name: entry for area in AREAS.values() for name, entry in area.items()}
