"""Make a model of Stable-Baselines3 one that runs nothing when it is read.

A .zip holds pickles: whoever opens one runs whatever program its author has put into it. This command opens it once,
where you say with --trust that you would run a program of whoever made it, and writes its weights as plain numbers
(model.npz), which --policy of the commands and agents.make take without torch, and what they are for as JSON
(model.json, which the .npz holds too). Pass these on, not the .zip.
"""

from __future__ import annotations

import argparse
from pathlib import Path

from agents.exporting import export_saved
from haptic_lab.terminal import Parser, as_path, make_console
from observer.wrappers.belief_observation import ENTRIES

EXAMPLE = """examples: haptic-slam export model.zip --trust
          haptic-slam export model.zip --trust --normalize vecnormalize.pkl --out models/mine.npz"""


def main(arguments: list[str] | None = None) -> int:
    """Run the command.

    Args:
        arguments: of the command line; None: those of this process.

    Returns:
        Its exit code.
    """
    parser = Parser(description=__doc__, epilog=EXAMPLE, formatter_class=argparse.RawDescriptionHelpFormatter)
    add = parser.add_argument
    add("model", type=as_path, metavar="MODEL.zip", help="what the algorithm has saved")
    add("--trust", action="store_true", help="run what is in it, as you would run a program of whoever made it")
    add("--normalize", type=as_path, metavar="FILE.pkl", help="the VecNormalize that it was trained under, a pickle")
    add("--entries", nargs="+", choices=list(ENTRIES), metavar="ENTRY", help="of the belief that it was shown")
    add("--hold", type=int, metavar="STEPS", help="control steps for which it holds an action")
    add("--out", type=as_path, metavar="MODEL.npz", help="default: beside it, of the same name")
    given = parser.parse_args(arguments)
    out = Path(given.out or Path(given.model).with_suffix(".npz"))
    try:
        kept = {"trust": given.trust, "entries": given.entries, "hold": given.hold}
        said = export_saved(given.model, out, given.normalize, **kept)
    except (ValueError, ImportError, OSError) as error:
        parser.error(str(error))
    shown = ", ".join(said["told"].get("entries", [])) or "what is felt"
    make_console().print(
        f"{out}: shown {shown}, an action lasts {said['told'].get('hold', 1)} control steps; told in "
        f"{out.with_suffix('.json').name}",
        highlight=False,
        soft_wrap=True,
    )
    return 0
