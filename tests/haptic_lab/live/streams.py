"""A hand that moves and touches, for the tests of what is live."""

from __future__ import annotations

from collections.abc import Iterator
from typing import TYPE_CHECKING, Any

import numpy as np

if TYPE_CHECKING:  # a process that only sends needs neither
    from haptic_env.hand import Hand
    from haptic_lab.live.session import Chunk, Told


def moving(
    hand: Hand, samples: int, rate: float = 50.0, seed: int = 0, start: float = 100.0, touches: int = 8
) -> tuple[Any, Any, Any]:
    """When samples were taken (T,) s, angles (T, J) rad, contacts (T, P)."""
    rng = np.random.default_rng(seed)
    time = start + np.arange(samples) / rate
    angles = hand.rest_pose + 0.2 * np.sin(2.0 * time[:, None] + np.arange(hand.joints))
    angles += np.deg2rad(1.0) * rng.standard_normal(angles.shape)
    contacts = np.zeros((samples, len(hand.patches)))
    for _ in range(touches):
        at = int(rng.integers(samples))
        contacts[at : at + 10, rng.integers(len(hand.patches))] = 1.0
    return time, angles, contacts


def commanded(hand: Hand, samples: int, seed: int = 0) -> Any:
    """Torques (T, J), which change from sample to sample."""
    return np.random.default_rng(seed).uniform(-0.9, 0.9, (samples, hand.joints))


class Played:
    """A source that plays chunks, each when it is asked, and then ends the session."""

    def __init__(self, chunks: Iterator[list[Chunk]]) -> None:
        self._chunks = chunks
        self.session: Any = None

    def begin(self) -> None:
        pass

    def poll(self, stream: str, seconds: float) -> list[Chunk]:
        found = next(self._chunks, None)
        if found is None:
            self.session.stop = True
        return found or []

    def close(self) -> None:
        pass


class Kept:
    """A sink that keeps what it is told."""

    def __init__(self) -> None:
        self.told: list[Told] = []

    def tell(self, told: Told) -> None:
        self.told.append(told)

    def close(self) -> None:
        pass
