"""Let the hand repeat a recording, watch what the observer believes, and name what it touches.

Writes the same files to --out as `haptic-slam explore`, whose flag --recording does the same.
"""

from __future__ import annotations

from pathlib import Path

from haptic_lab.commands.explore import FILES, parse, run
from haptic_lab.folder_lock import claimed
from haptic_lab.style import styled

EXAMPLE = """examples: haptic-slam replay inspect.npz --mesh cube.stl --out out/inspect
          haptic-slam replay glove.txt --hand adroit --shape sphere"""


@styled
def main(arguments: list[str] | None = None) -> int:
    """Run the command.

    Args:
        arguments: of the command line; None: those of this process.

    Returns:
        Its exit code.
    """
    settings, recording = parse(arguments, "recording", __doc__, EXAMPLE)
    with claimed(Path(settings.out), FILES):
        return run(settings, recording)
