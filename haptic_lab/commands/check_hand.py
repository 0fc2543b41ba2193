"""Check a hand: list its joints and links, draw it with its patches, and say what is wrong with it.

Writes hand.png (the hand at rest, its skin coloured by patch, geoms that capsules stand for as dots), joints.csv,
links.csv and patches.csv to --out. Ends with code 1 where something is wrong with a hand that can be built.
"""

from __future__ import annotations

import argparse
from pathlib import Path

import pandas as pd

from haptic_env import hands, registration
from haptic_env.hand import Hand
from haptic_env.hands import own, wrist
from haptic_lab.files import atomic, write_csv
from haptic_lab.folder_lock import claimed
from haptic_lab.hand_check import picture, reach
from haptic_lab.hand_check.listing import joint_table, link_table, shown
from haptic_lab.style import styled
from haptic_lab.terminal import Parser, as_path, make_console, tell_error

EXAMPLE = """examples: haptic-slam check-hand examples/gripper/gripper.toml --out out/gripper
          haptic-slam check-hand two_finger"""
FILES = ("hand.png", "joints.csv", "links.csv", "patches.csv")


@styled
def main(arguments: list[str] | None = None) -> int:
    """Run the command.

    Args:
        arguments: of the command line; None: those of this process.

    Returns:
        Its exit code: 1 where something is wrong.
    """
    parser = Parser(description=__doc__, epilog=EXAMPLE, formatter_class=argparse.RawDescriptionHelpFormatter)
    add = parser.add_argument
    add("hand", type=as_path, metavar="HAND", help=f"{', '.join(hands.HANDS)}, or a hand.toml of your own")
    add("--wrist", choices=wrist.WRISTS, help="as explore's")
    add("--out", type=as_path, help="folder for the picture and the tables (default: they are not written)")
    given = parser.parse_args(arguments)
    keywords = {} if given.wrist is None else {"wrist": given.wrist}
    try:
        hands.check("hand", given.hand)
        if registration.is_file(given.hand):
            found = own.read(given.hand, **keywords)
        else:
            found = own.OwnHand(hands.make(given.hand, **keywords), (), ())
    except ValueError as error:
        parser.error(str(error))
    except ImportError as error:  # of a hand that is not installed
        tell_error(str(error))
        return 2
    wrong = reach.problems(found.hand)
    _tell(found, wrong)
    if given.out is not None:
        with claimed(Path(given.out), FILES):
            _write(Path(given.out), found)
    return 1 if wrong else 0


def _tell(found: own.OwnHand, wrong: list[str]) -> None:
    console, hand = make_console(), found.hand
    counts = f"{hand.joints} joints, {len(hand.links)} links, {len(hand.patches)} patches"
    joints = joint_table(hand).drop(columns="axis")
    caption = "positive: what a growing angle does; torque: of an action of 1, N·m, or N of what slides"
    console.print(shown(f"{hand.name}: {counts}", joints, caption))
    console.print(shown("Links of skin", link_table(hand)))
    if found.fits:
        table = pd.DataFrame(
            {
                "geom": [fit.geom for fit in found.fits],
                "kind": [fit.kind for fit in found.fits],
                "stands for it": [fit.link for fit in found.fits],
                "capsules": [fit.capsules for fit in found.fits],
                "out_mm": [round(1e3 * fit.out, 1) for fit in found.fits],
                "bare_mm": [round(1e3 * fit.bare, 1) for fit in found.fits],
            }
        )
        caption = "out: how far capsules stand out of the geom at most; bare: how far it stands out of them"
        console.print(shown("Capsules in place of geoms", table, caption))
    for note in found.notes:
        console.print(f"note: {note}", highlight=False, markup=False)
    for each in wrong:
        console.print(f"wrong: {each}", highlight=False, markup=False)
    if not wrong:
        console.print("Nothing is wrong: the four shapes fit where it rests, and it reaches them.", highlight=False)


def _write(out: Path, found: own.OwnHand) -> None:
    hand = found.hand
    drawn = picture.draw(hand, f"{hand.name}: {len(hand.patches)} patches", [fit.outline for fit in found.fits])
    with atomic(out / "hand.png") as place:
        drawn.savefig(place)
    write_csv(out / "joints.csv", joint_table(hand))
    write_csv(out / "links.csv", link_table(hand))
    write_csv(out / "patches.csv", _patch_table(hand))


def _patch_table(hand: Hand) -> pd.DataFrame:
    patches = hand.patches
    columns = {f"{axis}_mm": (1e3 * patches.position[:, k]).round(2) for k, axis in enumerate("xyz")}
    normals = {f"normal_{axis}": patches.normal[:, k].round(4) for k, axis in enumerate("xyz")}
    links = [hand.links[link].name for link in patches.link]
    area = {"area_mm2": (1e6 * patches.area).round(1)}
    return pd.DataFrame({"patch": patches.names, "link": links, **columns, **normals, **area})
