"""Which patches an exploration has found to lie: as a table, and as a panel.

Shapes: T steps, P patches, L links.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.colors import LinearSegmentedColormap
from rich import box
from rich.table import Table

from haptic_env.patches import Patches
from haptic_lab.conditions import detection_of, lies
from haptic_lab.records import BeliefTrace, Exploration
from haptic_lab.style import OUTLINE, as_drawn
from observer.contacts.contact_filter import SURE

WORKS, STUCK, DEAD = "works", "stuck", "dead"
Found = Mapping[str, Mapping[str, Any]]
COUNTS = ("contacts", "false_alarms", "misses")
ROWS = 10  # of a table
COLOURS = LinearSegmentedColormap.from_list("faults", ["#0072B2", "#EEEEEE", "#D55E00"])  # dead, works, stuck
LARGEST = 60.0  # of a mark of the panel, square points


def found(exploration: Exploration, trace: BeliefTrace, told: Mapping[str, Any]) -> dict[str, dict[str, Any]]:
    """Say what was found.

    Args:
        exploration: what happened.
        trace: what the observer believed.
        told: keywords of the observer.

    Returns:
        For each patch `reliability`, the probability that it works; `believed` and `in_truth`, one of "works", "stuck"
        and "dead" (None where nobody knows); how many steps it has reported a `contacts`; how many of these were taken
        for `false_alarms`, and in how many others a touch is believed that it `misses`. Nothing where the observer
        takes what is reported for what is so.
    """
    if not lies(told) or trace.touched is None:
        return {}
    patches, reported = exploration.hand.patches, exploration.contacts
    works = trace.patch_reliability[-1]
    # What does not work is what it is told to be, else stuck where it rings now, as what is dead never does.
    stuck, dead = detection_of(told, patches).chances
    rings = (dead == 0.0) | ((stuck > 0.0) & reported[-1])
    fault = np.where(works >= SURE, WORKS, np.where(rings, STUCK, DEAD))
    truth: Sequence[str | None] = [None] * len(patches)
    if exploration.faults is not None:
        truth = np.where(exploration.faults[0], STUCK, np.where(exploration.faults[1], DEAD, WORKS)).tolist()
    false, missed = reported & ~trace.touched, trace.touched & ~reported
    counts = zip(*(each.sum(axis=0).tolist() for each in (reported, false, missed)), strict=True)
    return {
        name: {
            "reliability": float(works[patch]),
            "believed": str(fault[patch]),
            "in_truth": truth[patch],
            **dict(zip(COUNTS, count, strict=True)),
        }
        for patch, (name, count) in enumerate(zip(patches.names, counts, strict=True))
    }


def table(patches: Found) -> Table:
    """Lay out what was found as a person reads it.

    Args:
        patches: what `found` returns.

    Returns:
        A row for each of the patches that are the least believed in, or do not work.
    """
    lying = [name for name in patches if _lies(patches[name])]
    lying.sort(key=lambda name: (patches[name]["reliability"], -_reports(patches[name])))
    known = all(each["in_truth"] is not None for each in patches.values())
    totals = {what: sum(each[what] for each in patches.values()) for what in COUNTS}
    faults = {what: sum(each["believed"] == what for each in patches.values()) for what in (STUCK, DEAD)}
    result = Table(
        title=f"Patches that lie, found by touch: {faults[STUCK]} stuck, {faults[DEAD]} dead of {len(patches)}",
        title_justify="left",
        caption=f"of {totals['contacts']} contacts {totals['false_alarms']} were taken for false alarms, and "
        f"{totals['misses']} touches for missed, step by step",
        caption_justify="left",
        box=box.SIMPLE_HEAD,  # of narrow columns: names of patches are long
        padding=(0, 1, 0, 0),
    )
    for name in ("patch", "believed", "works", "rang", "false", "missed", *(["in truth"] if known else [])):
        result.add_column(name, justify="right" if name in ("works", "rang", "false", "missed") else "left")
    for name in lying[:ROWS]:
        each = patches[name]
        counts = [str(each[what]) for what in COUNTS]
        result.add_row(name, each["believed"], f"{each['reliability']:.1%}", *counts, *[each["in_truth"]] * known)
    return result


def _lies(patch: Mapping[str, Any]) -> bool:
    return patch["believed"] != WORKS or patch["in_truth"] in (STUCK, DEAD) or _reports(patch) > 0


def _reports(patch: Mapping[str, Any]) -> int:
    return int(patch["false_alarms"] + patch["misses"])


def draw(axes: Axes, patches: Found, hand: Patches) -> None:
    """Draw the patches of each link in a row: which are believed to be stuck or dead, and how often they lied.

    Args:
        axes: to draw into.
        patches: what `found` returns.
        hand: the patches that they are.
    """
    each = list(patches.values())
    column = np.arange(len(hand)) - hand.first[hand.link]
    doubt = np.array([1.0 - one["reliability"] for one in each])
    sign = np.array([-1.0 if one["believed"] == DEAD else 1.0 for one in each])
    cells = np.full((len(hand.links), column.max() + 1), np.nan)
    cells[hand.link, column] = sign * doubt
    edges = [np.arange(count + 1) - 0.5 for count in cells.shape[::-1]]
    axes.pcolormesh(*edges, np.ma.masked_invalid(cells), cmap=COLOURS, vmin=-1.0, vmax=1.0, edgecolors="white")
    counts = {what: np.array([one[what] for one in each]) for what in COUNTS[1:]}
    most = max(1, *(each.max() for each in counts.values()))
    marks = (("false_alarms", "false alarms", -0.2, OUTLINE), ("misses", "missed touches", 0.2, "none"))
    for what, label, shift, filled in marks:
        some = counts[what] > 0
        if not some.any():
            continue
        sizes = 3.0 + LARGEST * counts[what][some] / most
        style: Any = {"facecolors": filled, "edgecolors": OUTLINE, "linewidths": 0.8}
        axes.scatter(column[some] + shift, hand.link[some], sizes, label=f"{label} ({counts[what].sum()})", **style)
    for what, marker in ((STUCK, "x"), (DEAD, "+")):
        true = np.array([one["in_truth"] == what for one in each])
        if true.any():
            axes.scatter(column[true], hand.link[true], 55.0, color=OUTLINE, marker=marker, label=f"in truth {what}")
    for what, colour in ((STUCK, COLOURS(1.0)), (DEAD, COLOURS(0.0))):
        axes.scatter([], [], 40.0, color=[colour], marker="s", label=f"believed {what}")
    names, few = [as_drawn(link.name.replace("_", " ")) for link in hand.links], len(hand.links) <= 12
    axes.set(
        title="Patches that lie",
        xlabel="patches of each link",
        xticks=[],
        yticks=range(len(names)),
        ylim=edges[1][[-1, 0]],
    )
    axes.set_yticklabels(names, fontsize=8 if few else 5)
    axes.tick_params(axis="y", length=0)
    axes.spines[:].set_visible(False)
    axes.legend(loc="upper center", bbox_to_anchor=(0.5, -0.1), ncols=2, fontsize=7, handletextpad=0.4)
