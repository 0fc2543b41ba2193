"""Where the error of the lagged pose is that is left to an observer told of a bias: by what each finger does.

    python -m pytest -m statistical -s tests/haptic_lab/test_where_errors_are_long.py

Shapes: T steps, J joints.
"""

from __future__ import annotations

from typing import NamedTuple

import gymnasium as gym
import numpy as np
import pytest

from haptic_env import shapes
from haptic_env.arrays import Array
from haptic_env.hand import Hand
from haptic_lab.records import Exploration
from haptic_lab.trial import Trial
from observer import PoseOnly, ShapePosterior

SEEDS = range(77560, 77562)
BIAS = 3.0  # degrees
FIRST, AFTER = 2.0, 0.2  # s: of an exploration; since the last touch
STILL = 0.3  # rad/s, of the fastest joint of a finger that is stopped


class Part(NamedTuple):
    """Squared errors and variances told, degrees²."""

    errors: Array
    told: Array


def _doing(exploration: Exploration, hand: Hand, finger: str) -> Array:
    """What a finger does at each step (T,)."""
    rate = round(1.0 / (exploration.seconds[1] - exploration.seconds[0]))
    mine = np.array([name.startswith(finger) for name in hand.joint_names])
    speed = np.abs(np.gradient(exploration.true_angles[:, mine], axis=0)).max(axis=1) * rate
    skin = np.array([name.startswith(finger) for name in hand.patches.names])
    touch = exploration.contacts[:, skin].any(axis=1)
    recent = np.array([touch[max(0, t - round(AFTER * rate)) : t].any() for t in range(len(touch))])
    free = np.where(recent, "just after a touch", "free")
    doing = np.where(touch, np.where(speed < STILL, "stopped", "touching, moving"), free)
    return np.where(exploration.seconds < FIRST, "in the first 2 s", doing)


@pytest.mark.statistical
@pytest.mark.timeout(3600)
@pytest.mark.parametrize("sigma", [1.0, 3.0])
def test_a_stopped_finger_is_not_where_the_error_is(sigma: float) -> None:
    parts: dict[str, list[Part]] = {}
    for shape in shapes.SHAPES:
        for seed in SEEDS:
            noise = {"sigma_deg": sigma, "bias_deg": BIAS}
            env = gym.make("HapticSLAM/TwoFinger-v0", shape=shape, **noise, reveal_truth=True)
            hand = env.unwrapped.hand
            trial = Trial(
                env, "random_torque", {"told": PoseOnly(hand, **noise)}, ShapePosterior(hand), seed, naming=()
            )
            trial.run()
            exploration, traces = trial.finish()
            found = traces["told"]
            errors = np.rad2deg(found.lagged_joint_angles - exploration.true_angles) ** 2
            told = np.rad2deg(found.lagged_joint_std) ** 2
            for finger in ("thumb", "index"):
                mine = np.array([name.startswith(finger) for name in hand.joint_names])
                doing = _doing(exploration, hand, finger)
                for what in np.unique(doing):
                    now = np.ix_(doing == what, mine)
                    parts.setdefault(str(what), []).append(Part(errors[now].ravel(), told[now].ravel()))
    whole = {what: Part(*map(np.concatenate, zip(*each, strict=True))) for what, each in parts.items()}
    steps, squares = (
        sum(each) for each in zip(*((len(p.errors), p.errors.sum()) for p in whole.values()), strict=True)
    )
    for what, part in sorted(whole.items()):
        print(
            f"σ {sigma:g} | {what} | {len(part.errors) / steps:.0%} of the steps | "
            f"{part.errors.sum() / squares:.0%} of the squared error | "
            f"RMS {np.sqrt(part.errors.mean()):.2f}° | SD told {np.sqrt(part.told.mean()):.2f}°"
        )
    assert whole["stopped"].errors.sum() < 0.1 * squares
