"""The picture of one exploration (map, pose error and posterior over time), and its archive of belief traces.

Shapes: T steps, J joints, C labels, (X, Y, Z) voxels.
"""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
from matplotlib.figure import Figure

from haptic_lab.exploration import offsets, patches
from haptic_lab.exploration.settings import OBSERVER, RAW
from haptic_lab.exploration.summary import object_of, touch_of
from haptic_lab.files import atomic
from haptic_lab.panels import draw_pose_error, draw_posterior, draw_sides
from haptic_lab.records import BeliefTrace, Exploration
from haptic_lab.style import OBSERVER_COLOURS, as_drawn, titles_of, with_article
from observer import metrics


def picture(path: Path, exploration: Exploration, traces: dict[str, BeliefTrace], summary: dict[str, Any]) -> None:
    """Write explore.png: the map from three sides, pose error and posterior through time, and where the observer
    believes in offsets of felt angles, or in patches that lie, what was found of them.

    Args:
        path: of the picture.
        exploration: what happened.
        traces: of the observers, by name.
        summary: what `summarise` returns.
    """
    slam, settings = traces[OBSERVER], summary["settings"]
    belief = slam.belief
    found, lying = summary.get("joint_offset", {}), summary.get("patches", {})
    also = bool(found) + bool(lying)
    figure = Figure(figsize=((11, 7.2), (13, 8.2), (16, 8.2))[also], layout="constrained")
    parts: Any = figure.subfigures(2, 1, height_ratios=(1.45, 1))
    above, below = parts
    root, angles = None if exploration.roots is None else exploration.roots[-1], slam.joint_angles[-1]
    truth, simulated = object_of(summary)
    # What a glove's hand touched nobody knows: nothing that is only simulated is called true.
    outline, really = ("what touch is simulated with", "simulated") if simulated else ("the true shape", "the truth")
    draw_sides(above, belief.occupancy, belief.grid, exploration.solid, exploration.hand, angles, root, outline)
    left, right, *more = below.subplots(1, 2 + also, width_ratios=(1, 1, *[0.8] * also))
    errors = {
        "raw angles": (metrics.pose_error_deg(exploration.felt_angles, exploration.true_angles), OBSERVER_COLOURS[RAW]),
        "haptic SLAM": (
            metrics.pose_error_deg(slam.lagged_joint_angles, exploration.true_angles),
            OBSERVER_COLOURS[OBSERVER],
        ),
    }
    draw_pose_error(left, exploration.seconds, errors, exploration.contacts.any(axis=1), settings["sigma"])
    draw_posterior(right, exploration.seconds, slam.posterior, slam.labels, truth, really)
    if found:
        offsets.draw(more[0], found)
    if lying:
        patches.draw(more[-1], lying, exploration.hand.patches)
    sure = summary["posterior"][slam.name]
    titles = titles_of(slam.labels)
    verdict = "right" if slam.name == truth else f"wrong: {with_article(as_drawn(titles[truth]), truth)}"
    if simulated:
        verdict = f"contacts simulated with {with_article(as_drawn(titles[truth]), truth)}"
    figure.suptitle(
        f"{exploration.seconds[-1]:g} s of {touch_of(summary)} touch, "
        f"joint noise σ = {settings['sigma']:g}°{_lasting(settings)}: "
        f"“{with_article(as_drawn(titles[slam.name]), slam.name)}”, {sure:.0%} sure ({verdict})",
        fontsize=13,
        fontweight="bold",
    )
    with atomic(path) as place:
        figure.savefig(place)


def _lasting(settings: dict[str, Any]) -> str:
    """What a title says of errors of felt angles that last."""
    told = ", ".join(f"{what} {settings[f'{what}_deg']:g}°" for what in ("bias", "drift") if settings[f"{what}_deg"])
    return f", {told}" if told else ""


def save_trace(path: Path, exploration: Exploration, traces: dict[str, BeliefTrace]) -> None:
    """Write explore.npz: map, belief through time, and everything that was commanded and felt.

    Args:
        path: of the file.
        exploration: what happened.
        traces: of the observers, by name; that of haptic SLAM is written.
    """
    slam = traces[OBSERVER]
    belief = slam.belief
    with atomic(path) as place:
        np.savez_compressed(
            place,
            occupancy=belief.occupancy,
            grid_origin=belief.grid.origin,
            grid_resolution=belief.grid.resolution,
            weights=belief.weights,
            particles=belief.particles,
            seconds=exploration.seconds,
            torques=exploration.torques,
            felt_angles=exploration.felt_angles,
            true_angles=exploration.true_angles,
            contacts=exploration.contacts,
            joint_angles=slam.joint_angles,
            joint_std=slam.joint_std,
            lagged_joint_angles=slam.lagged_joint_angles,
            lagged_joint_std=slam.lagged_joint_std,
            joint_offset=slam.joint_offset,
            joint_offset_std=slam.joint_offset_std,
            patch_reliability=slam.patch_reliability,
            touched=exploration.contacts if slam.touched is None else slam.touched,
            patches=np.array(exploration.hand.patches.names),
            n_eff=slam.n_eff,
            posterior=slam.posterior,
            labels=np.array(slam.labels),
        )
