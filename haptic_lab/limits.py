"""Observers with human limits, beside those that have none: "haptic_slam+limited" watches the same exploration, but
forgets, and attends to one finger at a time.

Shapes: P patches, F fingers (parts of the hand whose patches are attended to together, the palm being one).
"""

from __future__ import annotations

import copy
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from haptic_env import validate
from haptic_env.hand import Hand
from observer import ShapePosterior, variants
from observer.shape import fading

LIMITED = "+limited"  # of the names of observers
INFORMED = "+informed"  # told what the object may be, so that contacts tell it of the pose, too


def plain(name: str) -> str:
    """Tell which observer is limited or informed.

    Args:
        name: of an observer.

    Returns:
        The name of the one that is neither.
    """
    return name.replace(LIMITED, "").replace(INFORMED, "")


def check_name(name: str, recorded: bool = False) -> str:
    """Check the name of an observer.

    Args:
        name: of an observer or a variant, which may be limited or informed.
        recorded: whether it watches recordings.

    Returns:
        The name.

    Raises:
        ValueError: for any other, and for one that cannot make use of what the object may be.
    """
    said = f"{name} of --observers"
    base, *changes = variants.check("--observers", name, also=[each[1:] for each in (LIMITED, INFORMED)]).split("+")
    if len(set(changes)) < len(changes):
        raise ValueError(f"{said} has a change twice, say each once")
    unfit = [each for each in changes if each in variants.NO_SECOND_LOOK or f"+{each}" == INFORMED]
    if base == variants.SECOND_LOOK and unfit:
        valid = [each for each in variants.VARIANTS if each not in variants.NO_SECOND_LOOK]
        raise ValueError(f"{said}: {unfit[0]} leaves nothing to look at a second time, choose from {', '.join(valid)}")
    if INFORMED not in name:
        return name
    if recorded:
        raise ValueError(f"{said}: those of --recordings are told the candidates already")
    if LIMITED in name:
        raise ValueError(f"{said}: who is informed has no limits, leave out one of the two")
    if base not in (*variants.WITH_PARTICLES, *variants.VARIANTS):
        raise ValueError(f"{said} has no particles to inform, such as {variants.FULL}{INFORMED} has")
    return name


class Attention:
    """One finger at a time is attended to, each in its turn; what touches the others is not noticed."""

    def __init__(self, hand: Hand, seconds: float, step_seconds: float, seed: int) -> None:
        """Begin a trial.

        Args:
            hand: with P patches.
            seconds: s, for which a finger is attended to.
            step_seconds: s, from step to step.
            seed: of the order of the fingers.
        """
        self._finger = hand.link_group[hand.patches.link]
        self._order = np.random.default_rng([seed, 1]).permutation(np.unique(self._finger))
        self._seconds, self._step = seconds, step_seconds

    def attended(self, step: int, contacts: NDArray[Any]) -> NDArray[np.float64]:
        """Take what is noticed out of what is felt.

        Args:
            step: its number, from 1.
            contacts: (P,) that were felt.

        Returns:
            (P,), NaN of the fingers that are not attended to: not measured.
        """
        turn = int((step - 1) * self._step / self._seconds + 1e-9)
        return np.where(self._finger == self._order[turn % len(self._order)], contacts, np.nan)


@dataclass(frozen=True)
class Limits:
    """What observers are limited to that are called so.

    Attributes:
        memory_seconds: s, time constant with which evidence for names and maps fade; inf: they do not.
        attention_seconds: s, for which one finger is attended to before the next one is; None: all are, always.

    Raises:
        ValueError: for a value out of its range.
    """

    memory_seconds: float = np.inf
    attention_seconds: float | None = None

    def __post_init__(self) -> None:
        fading.check(self.memory_seconds)
        if self.attention_seconds is not None:
            validate.seconds("attention_seconds", self.attention_seconds)

    def keywords(self, name: str) -> dict[str, Any]:
        """Say what an observer is told.

        Args:
            name: of it.

        Returns:
            Keywords, none where it is not limited.
        """
        without = LIMITED not in name or plain(name) in variants.WITHOUT_MAP
        return {} if without else {"memory_seconds": self.memory_seconds}

    def namer(self, name: str, shape: ShapePosterior, control_hz: float) -> ShapePosterior:
        """Make who names the object from what an observer believes.

        Args:
            name: of the observer.
            shape: that has no limits.
            control_hz: Hz, of the steps.

        Returns:
            A copy of it, which shares its tables; it is to be reset.
        """
        made = copy.copy(shape)
        if LIMITED in name:
            made.memory_seconds, made.control_hz = self.memory_seconds, control_hz
        return made

    def attention(self, name: str, hand: Hand, control_hz: float, seed: int) -> Attention | None:
        """Say what an observer attends to.

        Args:
            name: of it.
            hand: that explores.
            control_hz: Hz, of the steps.
            seed: of the trial.

        Returns:
            Its attention; None: it notices all.
        """
        if LIMITED not in name or self.attention_seconds is None:
            return None
        return Attention(hand, self.attention_seconds, 1.0 / control_hz, seed)


NONE = Limits()


def add_flags(add: Callable[..., Any]) -> None:
    """Let a command take limits.

    Args:
        add: adds an argument to its parser.
    """
    whose = f"of observers that are called so, haptic_slam{LIMITED} say"
    add("--memory-seconds", type=float, help=f"evidence and maps fade with this time constant, {whose} (default: not)")
    add("--attention-seconds", type=float, help=f"one finger at a time is heeded, for so long, {whose} (default: all)")
