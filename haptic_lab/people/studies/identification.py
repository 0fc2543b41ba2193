"""How often objects are named right, in each condition of the hand, after some seconds."""

from __future__ import annotations

import numpy as np
import pandas as pd

from haptic_lab.people.studies.presets import Study
from haptic_lab.sweeps.measures import COURSE_SECONDS
from observer import metrics

GROUPS = ["condition", "observer", "sigma_deg", "after"]
COLUMNS = [*GROUPS, "mean", "low", "high", "trials"]


def accuracy(rows: pd.DataFrame, study: Study) -> pd.DataFrame:
    """Count what was named right.

    Args:
        rows: of the tables of trials, with `condition`.
        study: an identification.

    Returns:
        A line for each condition, observer, sigma and time `after` which the name is asked for, as long as was
        explored: the share `mean` with its 95 % interval (Wilson) `low` and `high`, and the number of `trials`.
    """
    lines = []
    for (condition, observer, sigma, seconds), group in rows.groupby(
        ["condition", "observer", "sigma_deg", "seconds"], sort=False
    ):
        courses = np.array([[float(each) for each in text.split()] for text in group["course_correct"]])
        for after in [each for each in sorted(study.after) if each <= seconds] or [seconds]:
            index = round(after / COURSE_SECONDS) - 1
            if 0 <= index < courses.shape[1]:
                lines.append((condition, observer, sigma, after, *metrics.accuracy(courses[:, index])))
    return pd.DataFrame(lines, columns=COLUMNS).drop_duplicates(GROUPS, ignore_index=True)
