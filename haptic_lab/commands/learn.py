"""Let a blind hand explore an object, and keep what it felt under a name, so that it is recognised later.

Adds NAME.npz to --library, the surface that was felt and how surely, and writes the same files to --out as
`haptic-slam explore`, which takes the library then (`explore --library DIR`). `haptic-slam library DIR` lists it.
"""

from __future__ import annotations

from pathlib import Path

from haptic_lab.commands.explore import FILES, parse, run
from haptic_lab.folder_lock import claimed
from haptic_lab.style import styled

EXAMPLE = """examples: haptic-slam learn mug1 --shape mug.stl --hand adroit --policy enclosure --library objects
          haptic-slam learn key --recording inspect.npz --library objects
          haptic-slam explore --shape mug.stl --hand adroit --policy enclosure --library objects"""


@styled
def main(arguments: list[str] | None = None) -> int:
    """Run the command.

    Args:
        arguments: of the command line; None: those of this process.

    Returns:
        Its exit code.
    """
    settings, recording = parse(arguments, description=__doc__, example=EXAMPLE, learning=True)
    with claimed(Path(settings.out), FILES):
        return run(settings, recording)
