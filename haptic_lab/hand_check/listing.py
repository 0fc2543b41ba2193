"""The joints and the links of a hand as tables."""

from __future__ import annotations

import mujoco
import numpy as np
import pandas as pd
from rich import box
from rich.table import Table

from haptic_env.hand import Hand

ASIDE = 0.25  # of the way of the farthest point: as little nearer or farther is to the side


def joint_table(hand: Hand) -> pd.DataFrame:
    """List the joints.

    Args:
        hand: with J joints.

    Returns:
        J rows: `joint`, `unit` (deg or mm), `least`, `largest` and `rest` in it, `axis` (x y z in the world, at rest),
        `positive` (what an angle that grows does: the hand closes about the grasp centre, opens, or goes to the side),
        `torque` (N·m, or N, of an action of 1) and `patches` (how many it moves).
    """
    data = hand.at_rest()
    slides = hand.lever_arms > 0.0
    scale = np.where(slides, 1e3 * hand.lever_arms, np.rad2deg(1.0))
    moved = (hand.moves[hand.patches.link]).sum(axis=0)
    axes = data.xaxis / np.maximum(np.linalg.norm(data.xaxis, axis=1, keepdims=True), 1e-12)
    return pd.DataFrame(
        {
            "joint": hand.joint_names,
            "unit": np.where(slides, "mm", "deg"),
            "least": (scale * hand.joint_limits[:, 0]).round(1),
            "largest": (scale * hand.joint_limits[:, 1]).round(1),
            "rest": (scale * hand.rest_pose).round(1) + 0.0,
            "axis": [" ".join(f"{each:g}" for each in axis.round(2) + 0.0) for axis in axes],
            "positive": [_positive(hand, joint) for joint in range(hand.joints)],
            "torque": (hand.torque_limits / np.where(slides, hand.lever_arms, 1.0)).round(4),
            "patches": moved,
        }
    )


def link_table(hand: Hand) -> pd.DataFrame:
    """List the links.

    Args:
        hand: with L links.

    Returns:
        L rows: `link`, `radius_mm`, `length_mm`, `tip`, `patches` and their `area_mm2`, and the last `joint` that moves
        it, "" for none.
    """
    patches = hand.patches
    last = [np.flatnonzero(of)[-1] if of.any() else -1 for of in hand.moves]
    return pd.DataFrame(
        {
            "link": [link.name for link in hand.links],
            "radius_mm": [round(1e3 * link.radius, 1) for link in hand.links],
            "length_mm": [round(1e3 * link.length, 1) for link in hand.links],
            "tip": [link.tip for link in hand.links],
            "patches": np.bincount(patches.link, minlength=len(hand.links)),
            "area_mm2": (1e6 * np.bincount(patches.link, patches.area, len(hand.links))).round().astype(int),
            "joint": [hand.joint_names[joint] if joint >= 0 else "" for joint in last],
        }
    )


def shown(title: str, table: pd.DataFrame, caption: str = "") -> Table:
    """Make a table that a terminal shows.

    Args:
        title: of the table.
        table: with its columns.
        caption: beneath it.

    Returns:
        The table.
    """
    drawn = Table(
        title=title,
        title_justify="left",
        caption=caption or None,
        caption_justify="left",
        box=box.SIMPLE_HEAD,
        padding=(0, 1, 0, 0),
    )
    for name in table.columns:
        number = pd.api.types.is_numeric_dtype(table[name]) and table[name].dtype != bool
        drawn.add_column(str(name), justify="right" if number else "left", overflow="fold")
    for row in table.itertuples(index=False):
        drawn.add_row(*("yes" if each is True else "" if each is False else f"{each}" for each in row))
    return drawn


def _positive(hand: Hand, joint: int) -> str:
    """What the links that `joint` moves do in the first small way of a growing angle."""
    links = np.flatnonzero(hand.moves[:, joint])
    if not links.size:
        return "moves no skin"
    data = hand.at_rest()
    before = hand.link_ends(data)[links]
    data.qpos[joint] += 0.01
    mujoco.mj_kinematics(hand.model, data)
    after = hand.link_ends(data)[links]
    way = np.linalg.norm(after - before, axis=1)
    far = int(way.argmax())
    near = np.linalg.norm(before[far] - hand.grasp_centre) - np.linalg.norm(after[far] - hand.grasp_centre)
    if abs(near) < ASIDE * way[far] or joint in hand.wrist:
        step = after[far] - before[far]
        axis = int(np.abs(step).argmax())
        return f"to {'+' if step[axis] > 0 else '-'}{'xyz'[axis]}"
    return "closes" if near > 0 else "opens"
