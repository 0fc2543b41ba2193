"""What came of a recording with measured touch, of which nobody knows the truth: figures, table and picture.

Shapes: T steps, J joints, C labels, (X, Y, Z) voxels.
"""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from numpy.typing import NDArray
from rich.console import Console
from rich.table import Table

from haptic_env.arrays import Array
from haptic_env.hand import Hand
from haptic_env.recordings import MeasuredTouch
from haptic_lab.exploration import senses
from haptic_lab.exploration.output import save_trace
from haptic_lab.exploration.settings import OBSERVER, ExplorationSettings
from haptic_lab.exploration.summary import opening, shared_figures
from haptic_lab.files import atomic, write_json
from haptic_lab.panels import draw_posterior, draw_sides, label_time
from haptic_lab.records import BeliefTrace, Exploration
from haptic_lab.style import OBSERVER_COLOURS, as_drawn, titles_of, with_article

MEASURED = {"contacts": "measured"}


def finish(
    settings: ExplorationSettings,
    exploration: Exploration,
    traces: Mapping[str, BeliefTrace],
    took: float,
    recording: MeasuredTouch,
    console: Console,
) -> None:
    """Write and tell what came of a recording with measured touch.

    Args:
        settings: of the exploration; its folder gets explore.png, explore.json, explore.npz and recording.npz.
        exploration: what happened.
        traces: of the observers, by name.
        took: seconds of computing.
        recording: that was played; it is written on the steps of the observer, to be replayed without a map.
        console: that it is told on.
    """
    out, slam = Path(settings.out), traces[OBSERVER]
    summary = summarise(settings, exploration, traces, settings.shape, took, recording)
    picture(out / "explore.png", exploration, traces, summary)
    save_trace(out / "explore.npz", exploration, dict(traces))
    if settings.save_mesh is not None:
        surface = slam.belief.surface()
        summary["mesh"] = {}
        if not surface.empty:
            surface.save(Path(settings.save_mesh))
    write_json(out / "explore.json", summary)
    with atomic(out / "recording.npz") as place:
        np.savez_compressed(place, **recording.streams())  # type: ignore[arg-type]
    console.print(table(summary))
    senses.tell(console, summary)
    senses.save(settings, summary, recording.source)
    files = "explore.json, explore.npz, recording.npz"
    console.print(f"Picture, figures, trace and recording: {out / 'explore.png'}, {files}", highlight=False)


def summarise(
    settings: ExplorationSettings,
    exploration: Exploration,
    traces: Mapping[str, BeliefTrace],
    truth: str | None,
    took: float,
    recording: MeasuredTouch,
) -> dict[str, Any]:
    """Work out the figures of a recording with measured touch.

    Args:
        settings: of the exploration.
        exploration: what happened.
        traces: of the observers, by name.
        truth: the object as the user names it; None: nobody says.
        took: seconds of computing.
        recording: that was played.

    Returns:
        What JSON can say, but for NaN.
    """
    slam = traces[OBSERVER]
    belief = slam.belief
    (online, lost), (lagged, _) = (known(each, exploration.hand) for each in (slam.joint_std, slam.lagged_joint_std))
    about = {**MEASURED, "measured": recording.coverage._asdict()}
    return {
        **shared_figures(settings, exploration, slam, took, truth, about),
        "joint_std": float(np.rad2deg(online).mean()),
        "lagged_joint_std": float(np.rad2deg(lagged).mean()),
        "joints_lost": float(lost.mean()),
        **senses.found(settings, exploration, slam),
        "occupied_voxels": int((belief.occupancy > 0.5).sum()),
        "voxel": belief.grid.resolution,
    }


def known(std: Array, hand: Hand) -> tuple[Array, NDArray[np.bool_]]:
    """Say how well joints are known: never worse than somewhere within their limits.

    Args:
        std: (T, J) rad, as believed; after a long silence a filter without limits believes in any number of turns.
        hand: with the limits.

    Returns:
        (T, J) rad, at most the SD of a joint that may stand anywhere; and where that is all that is known.
    """
    anywhere = np.ptp(hand.joint_limits, axis=1) / np.sqrt(12.0)
    return np.minimum(std, anywhere), std >= anywhere


def table(summary: Mapping[str, Any]) -> Table:
    """Lay out the figures of a recording with measured touch.

    Args:
        summary: what `summarise` returns.

    Returns:
        The table as a person reads it.
    """
    result = opening(summary, "measured", "you say it is", summary["truth"])
    told = summary["measured"]
    result.add_row("joint angles not measured", f"{told['joints_missing']:.1%}")
    result.add_row(f"contacts of {told['patches_measured']} patches not measured", f"{told['touch_missing']:.1%}")
    result.add_row("longest gap", f"{told['longest_gap']:.2f} s")
    result.add_row("samples late, twice", f"{told['late']}, {told['repeated']}")
    result.add_row("SD of a joint angle, online", f"{summary['joint_std']:.2f}°")
    result.add_row("SD of a joint angle, lagged", f"{summary['lagged_joint_std']:.2f}°")
    if summary["joints_lost"]:
        result.add_row("joints that may be anywhere in their range", f"{summary['joints_lost']:.1%} of the time")
    result.add_section()
    result.add_row("occupied voxels", f"{summary['occupied_voxels']} of {1000 * summary['voxel']:g} mm")
    result.add_row("fingers touched it", f"{summary['touching_share']:.0%} of the time")
    result.add_row("computing took", f"{summary['computing_seconds']:.1f} s")
    return result


def picture(
    path: Path, exploration: Exploration, traces: Mapping[str, BeliefTrace], summary: Mapping[str, Any]
) -> None:
    """Write explore.png: the map from three sides; and through time how surely the hand is known, and the posterior.

    Args:
        path: of the picture.
        exploration: what happened.
        traces: of the observers, by name.
        summary: what `summarise` returns.
    """
    slam = traces[OBSERVER]
    belief = slam.belief
    figure = Figure(figsize=(11, 7.2), layout="constrained")
    parts: Any = figure.subfigures(2, 1, height_ratios=(1.45, 1))
    above, below = parts
    draw_sides(above, belief.occupancy, belief.grid, None, exploration.hand, slam.joint_angles[-1])
    left, right = below.subplots(1, 2)
    missing = np.isnan(exploration.felt_angles).any(axis=1)
    _draw_spread(left, exploration, slam, missing)
    draw_posterior(right, exploration.seconds, slam.posterior, slam.labels, "")
    title = as_drawn(titles_of(slam.labels)[slam.name])
    figure.suptitle(
        f"{exploration.seconds[-1]:g} s of measured touch: “{with_article(title, slam.name)}”, "
        f"{summary['posterior'][slam.name]:.0%} sure",
        fontsize=13,
        fontweight="bold",
    )
    with atomic(path) as place:
        figure.savefig(place)


def _draw_spread(axes: Axes, exploration: Exploration, slam: BeliefTrace, missing: Any) -> None:
    """Draw the mean SD of the joints through time, steps that touch or miss an angle shaded."""
    seconds, touching = exploration.seconds, exploration.contacts.any(axis=1)
    kinds = {"online": slam.joint_std, "lagged": slam.lagged_joint_std}
    spread = {label: np.rad2deg(known(each, exploration.hand)[0]).mean(axis=1) for label, each in kinds.items()}
    top = max(float(each.max()) for each in spread.values()) * 1.25 + 0.1  # the legend stands above
    for shade, where, label in (("#EEEEEE", touching, "touching"), ("#F5D5C8", missing, "not measured")):
        axes.fill_between(seconds, 0, top, where=where, color=shade, step="mid", linewidth=0, label=label)
    for label, style in (("online", ":"), ("lagged", "-")):
        axes.plot(seconds, spread[label], style, color=OBSERVER_COLOURS[OBSERVER], linewidth=1.2, label=label)
    label_time(axes, seconds, "How well the hand is known", "SD of a joint (degrees)", top, 4)
