"""Explorations of which only the name of the object is asked: observers without a map, which name as those with one.

A study has thousands of explorations, and a map takes most of the time of an observer, but names nothing
(`ShapePosterior` takes the pose and the contacts).
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

from haptic_env.hand import Hand
from haptic_lab.limits import LIMITED, Limits
from haptic_lab.limits import NONE as NO_LIMITS
from haptic_lab.raw_pose import RawPose
from haptic_lab.sweeps.measures import measures_without_map
from haptic_lab.sweeps.rows import Exemplars
from haptic_lab.sweeps.tasks import SweepTask
from haptic_lab.sweeps.worker import explore, rows_of
from haptic_lab.trial import make_observers
from observer import ShapePosterior
from observer.brackets import WHITE_ONLY
from observer.pose_only import PoseOnly
from observer.variants import Observer

FLOOR, CEILING = "floor", "ceiling"
OBSERVERS = (FLOOR, "haptic_slam", CEILING)


def make_without_maps(
    names: Sequence[str],
    hand: Hand,
    sigma_deg: Any,
    particles: int,
    limits: Limits = NO_LIMITS,
    candidates: ShapePosterior | None = None,
    **keywords: Any,
) -> dict[str, Observer]:
    """Make observers that name as those of `make_observers` do, and map nothing.

    Args:
        names: of `OBSERVERS`; others are made as they are.
        hand: that explores.
        sigma_deg: that they are told, degrees; None: they find it out.
        particles: of those that are made as they are.
        limits: of those that are called limited.
        candidates: what the object may be, for those that are called informed, which are made as they are.
        **keywords: of all.

    Returns:
        The observers by name.
    """
    made: dict[str, Observer] = {}
    for name in names:
        kind = name.replace(LIMITED, "")  # a map that forgets is none either
        if kind == FLOOR:
            made[name] = RawPose(hand, sigma_deg, **keywords)
        elif kind == CEILING:
            made[name] = RawPose(hand, 0.0, **{**keywords, **WHITE_ONLY})
        elif kind == "haptic_slam":
            made[name] = PoseOnly(hand, sigma_deg, **keywords)
        else:
            made |= make_observers([name], hand, sigma_deg, particles, limits, candidates, **keywords)
    return made


def name_objects(
    bundle: Sequence[SweepTask], *exemplars: Exemplars, moves: Sequence[int] | None = None
) -> list[list[dict[str, Any]]]:
    """Make the rows of trials, in which there is nothing of maps.

    Args:
        bundle: tasks of one exploration.
        *exemplars: for each task those of no classifier.
        moves: indices of the joints that the policy drives; None: all.

    Returns:
        For each task a row for each observer.
    """
    exploration, traces = explore(bundle, naming=True, moves=moves, make=make_without_maps)
    return rows_of(bundle, exemplars, exploration, traces, lambda trace: measures_without_map(exploration, trace))
