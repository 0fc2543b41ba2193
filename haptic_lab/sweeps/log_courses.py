"""The column of a table of trials that says what was believed of every name, through time (`--courses`).

Shapes: T steps, K times, C names.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from haptic_env.arrays import Array
from haptic_lab.records import BeliefTrace

COLUMN = "course_log_posterior"
SECONDS = 0.1  # from one time to the next; the first is 0, the prior


def times(seconds: Array) -> Array:
    """Say of which times the beliefs are kept.

    Args:
        seconds: (T,) s of the steps.

    Returns:
        (K,) s.
    """
    return np.asarray(SECONDS * np.arange(int((seconds[-1] + 1e-9) / SECONDS) + 1))


def text_of(seconds: Array, trace: BeliefTrace, labels: Sequence[str]) -> str:
    """Write a course down.

    Args:
        seconds: (T,) s of the steps.
        trace: what was believed, with its `log_posterior`.
        labels: (C,) of the table, of which an observer may hold some for impossible.

    Returns:
        What stands in the table: nats, the names of one time after the other, with spaces between.
    """
    assert trace.log_posterior is not None
    at = np.searchsorted(np.append(0.0, seconds), times(seconds) - 1e-9)
    course = np.full((len(at), len(labels)), -np.inf)
    course[:, [labels.index(label) for label in trace.labels]] = trace.log_posterior[at]
    return " ".join(f"{each:.6g}" for each in course.ravel())
