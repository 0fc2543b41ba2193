"""What a joint that is told 2π too much costs: the figures of docs/notes/pose.md.

python -m pytest -m statistical -s tests/observer/pose/test_gating_long.py
"""

from __future__ import annotations

import warnings

import numpy as np
import pytest

from observer import HapticSLAM
from observer.pose.gating import Gate

SIGMA, SEEDS = 3.0, range(3, 9)
BEGINS, COUNTED = 100, slice(150, 250)  # steps: two seconds that end three after it has begun
TURNED_JOINT = 2


def _error(trial, motion, turn):
    """RMS error in degrees, online, of all joints."""
    observer = HapticSLAM(trial.hand, SIGMA, 2, motion=motion)
    observer.reset(seed=0, joint_angles=trial.hand.rest_pose)
    believed = []
    for step, (torque, felt, contacts) in enumerate(zip(trial.torque, trial.felt, trial.contacts, strict=True)):
        angles = felt.astype(np.float64)
        angles[TURNED_JOINT] += turn if step >= BEGINS else 0.0
        believed.append(observer.step(torque, angles, contacts).joint_angles)
    return np.rad2deg(np.sqrt(np.mean((np.array(believed) - trial.true)[COUNTED] ** 2)))


@pytest.mark.statistical
@pytest.mark.parametrize("motion", ["forward_model", "kinematic"])
def test_a_joint_that_wraps_costs_nothing(explore, monkeypatch, motion):
    trials = [explore("cube", 250, seed=seed, sigma_deg=SIGMA) for seed in SEEDS]
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        usual, odd = (np.mean([_error(trial, motion, turn) for trial in trials]) for turn in (0.0, 2 * np.pi))
        monkeypatch.setattr(Gate, "judge", lambda *_: None)
        monkeypatch.setattr(Gate, "lost", lambda *_: False)
        believed = np.mean([_error(trial, motion, 2 * np.pi) for trial in trials])
    print(f"{motion}: {usual:.2f} as it is felt, {odd:.2f} told 2 pi too much, {believed:.1f} where that is believed")
    assert abs(odd - usual) < 1e-6
    assert believed > 10 * usual
