"""Memory that fades: evidence for names that leaks away, as people's does.

Shapes: T times, C names. Let L_t be the log posterior of an observer that forgets nothing. One that forgets has

    E_t = exp(-Δt / memory) E_{t-1} + L_t - L_{t-1},   E = 0 before anything was felt,

and believes in names as prior · exp(E_t): what was felt `memory` seconds ago counts 1/e of what it did, and of a hand
that feels nothing any more the belief goes back to the prior. An infinite memory gives L_t, bit for bit; one near 0
what the last Δt said alone. It is the leaky accumulator of models of decisions (Usher & McClelland 2001, Psychological
Review 108(3), 550-592), with what an ideal observer hears for its input.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike
from scipy.special import log_softmax

from haptic_env import readable, validate
from haptic_env.arrays import Array

LEAST = -1e4  # nats: a name that is as improbable as this can become probable again
CLOSE = 1e-6  # nats, by which the log of a probability may be above 0


def check(memory_seconds: float) -> float:
    """Check a time constant.

    Args:
        memory_seconds: s, which may be infinite.

    Returns:
        The same.

    Raises:
        ValueError: for what is not above 0.
    """
    if isinstance(memory_seconds, float) and memory_seconds == np.inf:
        return np.inf
    try:
        return validate.seconds("memory_seconds", memory_seconds)
    except ValueError as error:
        raise ValueError(f"{error}; or inf, for a memory that does not fade") from error


def fade(evidence: Array, change: Array, seconds: float, memory_seconds: float) -> Array:
    """Let evidence fade, and take in what is new.

    Args:
        evidence: (..., C) nats.
        change: (..., C) nats, of the log posterior of whoever forgets nothing.
        seconds: s that have passed.
        memory_seconds: s, the time constant.

    Returns:
        (..., C) nats.
    """
    return np.asarray(np.exp(-seconds / memory_seconds) * evidence + change)


def faded(log_posterior: ArrayLike, seconds: ArrayLike, memory_seconds: float, prior: ArrayLike | None = None) -> Array:
    """Say what an observer believes that forgets, from what one believes that does not.

    Args:
        log_posterior: (..., T, C) nats, of whoever forgets nothing, as `haptic_lab.people.courses.Courses` has it; NaN
            where nothing is known, -inf of a name that is impossible all along.
        seconds: (T,) s, ascending.
        memory_seconds: s, the time constant of memory; inf: nothing is forgotten.
        prior: (C,) nats, before anything was felt; None: all names that are possible at the first time are equally
            probable.

    Returns:
        (..., T, C) nats, normalised over names.

    Raises:
        ValueError: for a time constant that is not above 0, and for what does not fit together.
    """
    memory = check(memory_seconds)
    ideal = validate.real(log_posterior)
    times = validate.numbers("seconds", seconds, 1)
    if ideal is None or ideal.ndim < 2 or ideal.shape[-2] != len(times) or not ideal.size:
        got = validate.shown(log_posterior) if ideal is None else f"shape {ideal.shape}"
        raise ValueError(f"log_posterior must be numbers of shape (..., {len(times)}, names), got {got}")
    if (np.diff(times) <= 0.0).any():
        raise ValueError(f"seconds must be ascending, got {validate.shown(times.tolist())}")
    if ideal.size > validate.MOST:
        raise ValueError(f"log_posterior must have {validate.MOST} numbers at most, got shape {ideal.shape}")
    ideal = ideal.astype(np.float64)
    if (ideal == -np.inf).all(axis=-1).any():
        raise ValueError("log_posterior must have a name that is possible at each time, got -inf of all")
    above = ideal > CLOSE
    if above.any():
        raise ValueError(f"log_posterior must be logs of probabilities, got {ideal[above][0].item()!r}")
    impossible = ideal[..., :1, :] == -np.inf
    before = np.where(impossible[..., 0, :], -np.inf, 0.0)
    if prior is not None:
        before = before + validate.array("prior", prior, ideal.shape[-1:], bound=-LEAST)
    if memory == np.inf:
        return ideal
    now = np.where(impossible, 0.0, np.maximum(ideal, LEAST))
    start = np.where(impossible[..., 0, :], 0.0, _normalised(before))
    evidence, last, result = np.zeros_like(start), start, np.empty_like(ideal)
    for index, passed in enumerate(np.diff(times, prepend=times[0])):
        evidence = fade(evidence, now[..., index, :] - last, passed, memory)
        last = now[..., index, :]
        result[..., index, :] = _normalised(before + evidence)
    return result


def _normalised(log: Array) -> Array:
    return np.asarray(log_softmax(log, axis=-1))


class FadingNames:
    """The same of one trial, as it goes on."""

    __repr__ = readable.line

    def __init__(self, prior: Array, step_seconds: float, memory_seconds: float) -> None:
        """Begin before anything was felt.

        Args:
            prior: (C,) nats.
            step_seconds: s from one step to the next.
            memory_seconds: s, the time constant.
        """
        self._prior, self._last, self._evidence = prior, prior, np.zeros_like(prior)
        self._step, self._memory = step_seconds, memory_seconds

    def take(self, ideal: Array) -> Array:
        """Take in a step.

        Args:
            ideal: (C,) nats, the log posterior of whoever forgets nothing.

        Returns:
            (C,) nats, that of who forgets.
        """
        self._evidence = fade(self._evidence, ideal - self._last, self._step, self._memory)
        self._last = ideal
        return _normalised(self._prior + self._evidence)
