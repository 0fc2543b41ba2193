"""Observers see the same exploration whether they watch it together, step by step, or one after the other."""

from __future__ import annotations

import gymnasium as gym
import numpy as np

from haptic_lab.records import BeliefTrace
from haptic_lab.trial import Trial, make_observers
from observer import ShapePosterior


def _watched(at_once: bool) -> dict[str, BeliefTrace]:
    env = gym.make("HapticSLAM/TwoFinger-v0", shape="sphere", sigma_deg=3.0, reveal_truth=True, episode_seconds=1.5)
    hand = env.unwrapped.hand
    observers = make_observers(("haptic_slam", "ceiling"), hand, 3.0, 4)
    observers["floor at 5"] = make_observers(("floor",), hand, 5.0, 4)["floor"]
    trial = Trial(env, "random_torque", observers, ShapePosterior(hand), 3, felt_at={"floor at 5": 5.0})
    if at_once:
        assert list(trial) == list(range(1, 76))
    else:
        trial.run()
    return trial.finish()[1]


def test_watching_one_after_the_other_changes_nothing() -> None:
    together, apart = _watched(at_once=True), _watched(at_once=False)
    assert list(together) == list(apart) == ["haptic_slam", "ceiling", "floor at 5"]
    for name, trace in together.items():
        for field in ("joint_angles", "joint_std", "lagged_joint_angles", "n_eff", "posterior", "growing"):
            np.testing.assert_array_equal(getattr(apart[name], field), getattr(trace, field), err_msg=field)
        np.testing.assert_array_equal(apart[name].belief.occupancy, trace.belief.occupancy)
