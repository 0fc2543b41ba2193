"""Courses of an observer that can be made at once: four names are points in space, of which noisy samples come in."""

from __future__ import annotations

import numpy as np

from haptic_lab.people.courses import Courses

NAMES = ("cube", "sphere", "pyramid", "cylinder")
PLACES = np.array([[0.0, 0.0, 0.0], [1.0, 0.2, 0.0], [0.3, 1.1, 0.2], [0.6, 0.5, 1.0]])
SIGMAS = np.array([1.0, 2.0, 4.0, 8.0, 15.0])


def made(seed: int, repeats: int, sigmas: np.ndarray = SIGMAS, last: float = 6.0, conditions: int = 1) -> Courses:
    """An ideal observer's courses, each 0.25 s; what comes in gets less with time."""
    rng, seconds = np.random.default_rng(seed), np.arange(0.25, last + 0.1, 0.25)
    size = (len(NAMES) * conditions, 1, repeats, len(seconds), 1)
    gain = np.sqrt(rng.exponential(6.0, size) * np.exp(-seconds / 4.0)[:, None])
    noise = sigmas[:, None, None, None] * rng.standard_normal((*size[:1], 1, *size[2:4], 3))
    felt = gain * np.tile(PLACES, (conditions, 1))[:, None, None, None] + noise
    miss = ((felt[..., None, :] - gain[..., None] * PLACES) ** 2).sum(axis=-1)
    believed = np.cumsum(-0.5 * miss / sigmas[:, None, None, None] ** 2, axis=3)
    believed -= np.logaddexp.reduce(believed, axis=-1, keepdims=True)
    under = [f"condition {each}" if conditions > 1 else "" for each in range(conditions) for _ in NAMES]
    return Courses(
        names=NAMES, objects=NAMES * conditions, conditions=tuple(under), sigmas=sigmas, seconds=seconds,
        log_posterior=believed,
    )  # fmt: skip
