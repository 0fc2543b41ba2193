"""RMS pose error against sensor noise, of the observer between its brackets."""

from __future__ import annotations

import pandas as pd
from matplotlib.figure import Figure

from haptic_lab.analysis.summary import ALL, SLAM, draw_curve, draw_pose, summarise
from haptic_lab.figures.paper_figure import WIDTH, PaperFigure
from haptic_lab.style import OBSERVER_NAMES, as_drawn, colours_of, titles_of
from haptic_lab.sweeps.results import names_in

MEASURES = ("pose_error_lagged_deg", "pose_error_online_deg")
NAMES = OBSERVER_NAMES | {"kalman": "Kalman (no lag)"}
SMOOTHER = "smoother_pose"  # the observer that gives both brackets of the pose; maps have no say in it


def brackets(rows: pd.DataFrame) -> pd.DataFrame:
    """Tell one filter's rows twice: its estimate now is the Kalman filter's, which has no lag, its lagged one the
    smoother's.

    Args:
        rows: of the observer `SMOOTHER`.

    Returns:
        Rows of the observers kalman and smoother.
    """
    online = rows.assign(observer="kalman", pose_error_lagged_deg=rows["pose_error_online_deg"])
    return pd.concat([online, rows.assign(observer="smoother")])


def draw(rows: pd.DataFrame) -> PaperFigure:
    """Draw pose error against noise.

    Args:
        rows: of the table of trials; those of `SMOOTHER` stand for both brackets.

    Returns:
        Left every observer, in degrees; right haptic SLAM with each shape, in multiples of sigma.
    """
    smoothed = rows["observer"] == SMOOTHER
    rows = pd.concat([rows[~smoothed], brackets(rows[smoothed])])
    relative = {f"{name.removesuffix('deg')}sigmas": rows[name] / rows["sigma_deg"] for name in MEASURES}
    data = summarise(rows.assign(**relative), (*MEASURES, *relative), ())
    data = data[["measure", "observer", "shape", "sigma_deg", "mean", "low", "high", "trials"]]
    figure = Figure(figsize=(WIDTH, 2.9), layout="constrained")
    left, right = figure.subplots(1, 2)
    lagged = data[data["measure"] == MEASURES[0]]
    draw_pose(left, lagged[lagged["shape"] == ALL])
    last = lagged[(lagged["shape"] == ALL) & (lagged["sigma_deg"] == lagged["sigma_deg"].max())]
    for _, line in last.iterrows():
        left.annotate(
            NAMES[line["observer"]],
            (line["sigma_deg"], line["mean"]),
            (6, 0),
            textcoords="offset points",
            va="center",
            fontsize=7,
        )
    left.set_title("Pose error after 200 ms, all shapes")
    mine = data[(data["measure"] == next(iter(relative))) & (data["observer"] == SLAM) & (data["shape"] != ALL)]
    shapes = names_in(rows["candidates"].iloc[0])
    colours, titles = colours_of(shapes), titles_of(shapes)
    for shape in shapes:
        line = mine[mine["shape"] == shape]
        draw_curve(right, line, markersize=4, capsize=2, color=colours[shape], label=as_drawn(titles[shape]))
    right.axhline(1, color="#777777", linestyle=":", linewidth=1)
    right.set(title="Haptic SLAM, each shape (dotted: felt)", ylabel="RMS error (multiples of σ)")
    right.set_ylim(0, 1.05)
    right.legend(loc="center right", bbox_to_anchor=(1.0, 0.75))
    for axes in (left, right):
        axes.set_xlim(0, 1.03 * data["sigma_deg"].max())
        axes.set_xlabel("σ of joint noise (°)")
    return PaperFigure(figure, data)
