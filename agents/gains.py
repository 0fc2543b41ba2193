"""The gains of a rhythm: what each does, where it begins, and how far it may go."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, NamedTuple

from haptic_env import validate


class Gain(NamedTuple):
    """One number of a rhythm.

    Attributes:
        usual: where it begins: without reflexes, as the policy `sweep`.
        unit: in which it is searched.
        low: the least that it may be.
        high: the most.
    """

    usual: float
    unit: float
    low: float = -10.0
    high: float = 10.0


OF_REFLEXES = {
    # Strokes, as fractions of the torque limits.
    "flexion": Gain(0.5, 1.0),  # close: always
    "opening": Gain(0.5, 1.0),  # with the beat
    "close_touch": Gain(0.0, 1.0),  # by a trace of touch, fast
    "close_slow": Gain(0.0, 1.0),  # and slow
    "close_along": Gain(0.0, 1.0),  # where the tip touches, and less where the root does
    "close_back": Gain(0.0, 1.0),  # where its back touches
    "close_others": Gain(0.0, 1.0),  # where other fingers touch
    "curled": Gain(0.0, 1.0),  # curl: always, and so on
    "curl_beat": Gain(0.0, 1.0),
    "curl_drift": Gain(-0.5, 1.0),
    "curl_touch": Gain(0.0, 1.0),
    "curl_slow": Gain(0.0, 1.0),
    "curl_along": Gain(0.0, 1.0),
    "curl_back": Gain(0.0, 1.0),
    "curl_others": Gain(0.0, 1.0),
    "sideways": Gain(1.0, 1.0),  # across: with the turn
    "across_drift": Gain(0.0, 1.0),
    "across_side": Gain(0.0, 1.0),  # away from the side that touches, or towards it
    "across_slow": Gain(0.0, 1.0),
    # Phases, Hz, and how much touch quickens them (1: twice as fast).
    "beat": Gain(1.0, 1.0, 0.05, 5.0),
    "turn": Gain(0.5, 0.5, 0.02, 5.0),
    "drift": Gain(0.17, 0.2, 0.01, 5.0),
    "beat_touch": Gain(0.0, 2.0),
    "beat_slow": Gain(0.0, 2.0),
    "turn_touch": Gain(0.0, 2.0),
    "turn_slow": Gain(0.0, 2.0),
    "drift_touch": Gain(0.0, 2.0),
    "drift_slow": Gain(0.0, 2.0),
    # By how much the next finger is ahead, rad.
    "beat_ahead": Gain(0.0, 2.0),
    "turn_ahead": Gain(0.0, 2.0),
    # s.
    "withdraw": Gain(0.6, 0.15, 0.0, 10.0),  # for so long a finger that closes may touch, and then opens
    "fast": Gain(0.2, 0.2, 0.02, 10.0),  # time constants of traces
    "slow": Gain(1.5, 1.0, 0.1, 60.0),
}
OF_PLACES = {
    # Of places where a finger has touched, which it remembers where `enough` is more than 0.
    "enough": Gain(0.0, 0.2, 0.0, 60.0),  # s of touch by which a place is half known
    "width": Gain(0.4, 0.15, 0.05, 5.0),  # of a place, as a fraction of a stroke
    "lag": Gain(0.18, 0.1, 0.01, 10.0),  # s, by which a finger follows its strokes
    "close_away": Gain(0.0, 1.0),  # towards places that it does not know
    "across_away": Gain(0.0, 1.0),
    "curl_away": Gain(0.0, 1.0),
    "close_known": Gain(0.0, 1.0),  # where it knows the place
    "curl_known": Gain(0.0, 1.0),
    "beat_known": Gain(0.0, 1.0),  # by how much that quickens phases
    "turn_known": Gain(0.0, 1.0),
    "drift_known": Gain(0.0, 1.0),
}
GAINS = {**OF_REFLEXES, **OF_PLACES}


def searched(begin: Mapping[str, float]) -> dict[str, Gain]:
    """Tell which gains are searched.

    Args:
        begin: all of `GAINS`, with which a search begins.

    Returns:
        Those that make a difference: without those of places, where none is remembered.
    """
    return GAINS if begin["enough"] > 0.0 else OF_REFLEXES


def gains_of(told: Mapping[str, Any], what: str = "gain") -> dict[str, float]:
    """Check gains.

    Args:
        told: some of `GAINS`, by name.
        what: they are, for messages.

    Returns:
        All of them, those that are not told as usual.

    Raises:
        ValueError: for an unknown one, or out of range.
    """
    for name in told:
        validate.choice(what, name, GAINS)
    return {
        name: validate.number(f"{what} {name}", told.get(name, each.usual), each.low, each.high)
        for name, each in GAINS.items()
    }
