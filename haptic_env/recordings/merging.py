"""Samples that come when they come, on the steps of an observer.

Shapes: T samples, K steps, J joints, P patches. Seconds. NaN: not measured.
"""

from __future__ import annotations

from bisect import bisect_left
from collections.abc import Iterator
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from haptic_env.arrays import Array

LATE = 1.0  # s: a sample that is later than this among its neighbours is not late, its clock runs back
SAME = 1e-4  # of a step: stamps that near to one are its own, rounded
CLOSE = 0.02  # of a step: a line is drawn on so far, so that live a sample a little before a step is enough
BRIDGED = 1.5  # steps between two samples that what lies between them is known from
HELD = 0.75  # of the usual time between samples of touch, for which one is taken to hold before and after it


@dataclass(frozen=True)
class Samples:
    """Samples in the order of their time.

    Attributes:
        time: (T,) s, rising.
        values: (T, C).
        late: how many came after one that was taken later.
        repeated: how many had the time stamp of another, and were left out.
    """

    time: Array
    values: Array
    late: int = 0
    repeated: int = 0

    def __len__(self) -> int:
        return len(self.time)

    @property
    def interval(self) -> float:
        """Seconds from one sample to the next, usually."""
        return float(np.median(np.diff(self.time)))

    def known(self) -> Samples:
        """Leave out samples of which nothing was measured.

        Returns:
            The others.
        """
        some = np.isfinite(self.values).any(axis=1)
        return self if some.all() else replace(self, time=self.time[some], values=self.values[some])


def in_order(source: str, what: str, time: Array, values: Array) -> Samples:
    """Put samples in the order of their time.

    Args:
        source: of the recording, for messages.
        what: they tell of, for messages.
        time: (T,) s, as they came.
        values: (T, C).

    Returns:
        The samples.

    Raises:
        ValueError: where the clock runs back by more than `LATE`.
    """
    newest = np.maximum.accumulate(time)
    back = newest - time
    if len(time) and back.max() > LATE:
        at = int(np.argmax(back > LATE))
        raise ValueError(
            f"{source}: the time of {what} runs back by {back[at]:g} s at sample {at} (counted from 0); samples may be "
            f"late by up to {LATE:g} s, and time must rise"
        )
    return replace(rising(time, values), late=int((back > 0).sum()))


def rising(time: Array, values: Array) -> Samples:
    """Sort samples by their time; of those with one stamp the first is kept.

    Args:
        time: (T,) s.
        values: (T, C).

    Returns:
        The samples; how many were `late` is not told.
    """
    order = np.argsort(time, kind="stable")
    stamps = time[order]
    fresh = np.diff(stamps, prepend=-np.inf) > 0
    return Samples(stamps[fresh], values[order][fresh], repeated=int((~fresh).sum()))


def angles_at(samples: Samples, steps: Array, step: float | None = None) -> Array:
    """Tell where joints were at steps.

    Between two samples of a joint that are at most `BRIDGED` steps apart a line is drawn, and on to a step that is
    `CLOSE` behind the second; elsewhere the nearest sample counts for the one step that it is nearest to.

    Args:
        samples: of angles (T, J) rad.
        steps: (K,) s, evenly spaced.
        step: s, from one to the next; None: as the first two lie.

    Returns:
        (K, J) rad; NaN where a joint was not measured.
    """
    step = steps[1] - steps[0] if step is None else step
    result = np.full((len(steps), samples.values.shape[1]), np.nan)
    for joints, time, value in _alike(samples):
        after = np.searchsorted(time, steps).clip(1, max(len(time) - 1, 1))
        before = after - 1
        after = after.clip(max=len(time) - 1)
        near = np.where(np.abs(time[after] - steps) < np.abs(steps - time[before]), after, before)
        away = np.abs(time[near] - steps)
        gap = time[after] - time[before]
        inside = (time[before] <= steps) & (steps <= time[after]) & (gap > 0) & (gap <= BRIDGED * step)
        share = np.divide(steps - time[before], gap, out=np.zeros(len(steps)), where=gap > 0)
        between = value[before] + share[:, None] * (value[after] - value[before])
        alone = np.where((away <= 0.5 * step)[:, None], value[near], np.nan)
        told = np.where(inside[:, None], between, alone)
        early = (time[near] < steps) & (away <= CLOSE * step)
        last = (near - 1).clip(0)
        gap = time[near] - time[last]
        share = np.divide(away, gap, out=np.zeros(len(steps)), where=(gap > 0) & (gap <= BRIDGED * step))
        told[early] = (value[near] + share[:, None] * (value[near] - value[last]))[early]
        exact = away <= SAME * step
        told[exact] = value[near[exact]]
        result[:, joints] = told
    return result


def angles_of_one(samples: Samples, at: float, step: float) -> Array:
    """Tell where joints were at a single step: as `angles_at`, bit for bit, in a fraction of the time.

    Args:
        samples: of angles (T, J) rad.
        at: s, of the step.
        step: s, from one to the next.

    Returns:
        (J,) rad; NaN where a joint was not measured.
    """
    value, last = samples.values, len(samples) - 1
    if last < 0 or not np.isfinite(value).all():
        return np.asarray(angles_at(samples, np.array([at]), step)[0])
    time = samples.time.tolist()
    before = min(max(bisect_left(time, at), 1), max(last, 1)) - 1
    after = min(before + 1, last)
    near = after if abs(time[after] - at) < abs(at - time[before]) else before
    away = abs(time[near] - at)
    if away <= SAME * step:
        return np.array(value[near])
    if time[near] < at and away <= CLOSE * step:
        before, after = near, max(near - 1, 0)
        gap = time[before] - time[after]
        share = away / gap if 0.0 < gap <= BRIDGED * step else 0.0
        return np.asarray(value[before] + share * (value[before] - value[after]))
    gap = time[after] - time[before]
    if time[before] <= at <= time[after] and 0.0 < gap <= BRIDGED * step:
        return np.asarray(value[before] + (at - time[before]) / gap * (value[after] - value[before]))
    return np.array(value[near]) if away <= 0.5 * step else np.full(value.shape[1], np.nan)


def contacts_of_one(samples: Samples, at: float, grid: tuple[float, float], interval: float) -> Array:
    """Tell what was touched at a single step: as `contacts_at`, bit for bit, in a fraction of the time.

    Args:
        samples: of contacts (T, P), 0 or 1.
        at: s, of the step.
        grid: s, when the first of all steps is, and from one to the next.
        interval: s, from one sample to the next, usually.

    Returns:
        (P,), 0 or 1; NaN where a patch was not measured.
    """
    first, step = grid
    this = round((at - first) / step)
    rows = [k for k, time in enumerate(samples.time.tolist()) if round((time - first) / step) == this]
    if rows and np.isfinite(samples.values).all():
        return np.asarray(samples.values[rows[0] : rows[-1] + 1].max(axis=0))
    return np.asarray(contacts_at(samples, np.array([at]), grid, interval)[0])


def contacts_at(
    samples: Samples, steps: Array, grid: tuple[float, float] | None = None, interval: float | None = None
) -> Array:
    """Tell what was touched at steps: whatever touched about a step; and where samples come less often, the nearest.

    Args:
        samples: of contacts (T, P), 0 or 1.
        steps: (K,) s, evenly spaced.
        grid: s, when the first of all steps is, and from one to the next; None: these are all, as they lie.
        interval: s, from one sample to the next, usually; None: as they lie.

    Returns:
        (K, P), 0 or 1; NaN where a patch was not measured.
    """
    first, step = (steps[0], steps[1] - steps[0]) if grid is None else grid
    skipped = 0 if grid is None else int(np.rint((steps[0] - first) / step))
    result = np.full((len(steps), samples.values.shape[1]), np.nan)
    if interval is None and len(samples) > 1:
        interval = samples.interval
    held = 0.5 * step if interval is None else max(0.5 * step, HELD * interval)
    for patches, time, value in _alike(samples):
        of = np.rint((time - first) / step).astype(np.int64) - skipped
        inside = (of >= 0) & (of < len(steps))
        most = np.full((len(steps), value.shape[1]), -np.inf)
        np.maximum.at(most, of[inside], value[inside])
        after = np.searchsorted(time, steps).clip(max=len(time) - 1)
        before = (after - 1).clip(min=0)
        near = np.where(np.abs(time[after] - steps) < np.abs(steps - time[before]), after, before)
        close = np.abs(time[near] - steps) <= held
        result[:, patches] = np.where(np.isfinite(most), most, np.where(close[:, None], value[near], np.nan))
    return result


def _alike(samples: Samples) -> Iterator[tuple[NDArray[np.int64], Array, Array]]:
    """The columns that were measured in the same samples, together: which they are, the time of these, the values."""
    finite = np.isfinite(samples.values)
    masks: dict[bytes, list[int]] = {}
    if finite.all():  # mostly
        masks[finite[:, :1].tobytes()] = list(range(finite.shape[1]))
    else:
        for column in range(finite.shape[1]):
            masks.setdefault(finite[:, column].tobytes(), []).append(column)
    for columns in masks.values():
        rows = finite[:, columns[0]] if columns else np.zeros(0, dtype=bool)
        if rows.any():
            yield np.array(columns), samples.time[rows], samples.values[rows][:, columns]


def longest_run(missing: NDArray[np.bool_]) -> int:
    """Tell how long the longest gap is.

    Args:
        missing: (K,) whether each step is one of a gap.

    Returns:
        Steps.
    """
    edges = np.flatnonzero(np.diff(np.concatenate([[False], missing.astype(bool), [False]])))
    return int(np.max(edges[1::2] - edges[::2], initial=0))
