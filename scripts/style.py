"""How every picture looks: one colour for one thing, safe for the colour-blind (Okabe & Ito 2008)."""

from __future__ import annotations

import matplotlib
from matplotlib.colors import LinearSegmentedColormap

from haptic_env.shapes import SHAPES

matplotlib.use("Agg")  # pictures are files; no window, no display needed

SPARE = ("#56B4E9", "#F0E442", "#999999", "#882255", "#44AA99", "#AA4499")  # for shapes to come
KNOWN = {"cube": "#0072B2", "sphere": "#D55E00", "pyramid": "#009E73", "cylinder": "#CC79A7"}
SHAPE_COLOURS = KNOWN | dict(zip([name for name in SHAPES if name not in KNOWN], SPARE, strict=False))

OBSERVER_COLOURS = {
    "floor": "#999999",
    "paper": "#CC79A7",
    "kalman": "#E69F00",
    "smoother": "#56B4E9",
    "haptic_slam": "#000000",
    "ceiling": "#117733",
}
OBSERVER_NAMES = {
    "floor": "raw angles (floor)",
    "paper": "as the paper has it",
    "kalman": "Kalman",
    "smoother": "smoother",
    "haptic_slam": "haptic SLAM",
    "ceiling": "true pose (ceiling)",
}
OUTLINE = "#000000"
FREE = "#DCEBF5"
HAND = "#CDBDB6"
# From nothing at 0.5, which is not knowing, to dark at 1; on a scale from 0.5 to 1.
OCCUPANCY = LinearSegmentedColormap.from_list(
    "occupancy", [(0.0, "#FDD48A00"), (0.2, "#FDC765"), (0.55, "#E8590C"), (1.0, "#6A0D1E")]
)

matplotlib.rcParams.update(
    {
        "font.size": 9,
        "axes.spines.top": False,
        "axes.spines.right": False,
        "axes.titlesize": 10,
        "axes.titleweight": "bold",
        "legend.frameon": False,
        "figure.dpi": 110,
        "savefig.dpi": 160,
    }
)
