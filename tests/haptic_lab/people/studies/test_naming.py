"""Observers without a map name as those with one, and what they cannot tell is left out."""

from __future__ import annotations

import math

import numpy as np
import pytest

from agents import make
from agents.few_joints import FewJoints
from haptic_env import hand_of, registration
from haptic_lab.people.studies.naming import OBSERVERS, make_without_maps, name_objects
from haptic_lab.sweeps import options
from haptic_lab.sweeps.tasks import SweepTask
from haptic_lab.sweeps.worker import explore, run_trials

SHAPES = ["cube", "sphere"]


def _bundle(*flags: str) -> list[SweepTask]:
    said = ["--shapes", *SHAPES, "--sigmas", "1", "5", "--seconds", "0.8", "--classifiers", "--particles", "1"]
    plan = options.check(None, [*said, "--observers", *OBSERVERS, "--out", "unused", *flags])
    return [SweepTask(plan.settings, each, "sphere", 900_007) for each in plan.conditions]


@pytest.mark.parametrize("flags", [(), ("--bias-deg", "3", "--contact-miss", "0.2"), ("--believed-sigma-deg", "4")])
def test_they_name_as_with_a_map(flags: tuple[str, ...]) -> None:
    bundle = _bundle(*flags)
    learnt = [()] * len(bundle)
    for with_map, without in zip(run_trials(bundle, *learnt), name_objects(bundle, *learnt), strict=True):
        for one, other in zip(with_map, without, strict=True):
            assert list(one) == list(other)
            assert one["observer"] == other["observer"]
            assert one["touching_share"] == other["touching_share"] > 0.1
            for name in (*(f"p_{each}" for each in SHAPES), "time_to_decision", "step_accuracy"):
                np.testing.assert_allclose(one[name], other[name], atol=1e-6)
            assert one["shape_posterior"] == other["shape_posterior"]
            assert math.isnan(other["surface_f_score_1"])


def test_a_sweep_drives_the_joints_that_it_is_told() -> None:
    exploration, _ = explore(_bundle()[:1], naming=False, moves=(1, 5), make=make_without_maps)
    assert exploration.torques[:, [1, 5]].all()
    assert not np.delete(exploration.torques, [1, 5], axis=1).any()


def test_only_some_joints_are_driven() -> None:
    env = registration.make("HapticSLAM/TwoFinger-v0", shape="cube")
    every, few = make("random_torque", env, seed=1), FewJoints(make("random_torque", env, seed=1), [1, 5])
    observation, _ = env.reset(seed=0)
    action, _ = every.predict(observation)
    some, _ = few.predict(observation)
    assert hand_of(env).joints == few.joints
    np.testing.assert_array_equal(some[[1, 5]], action[[1, 5]])
    assert not np.delete(some, [1, 5]).any()
    assert action.all()
    with pytest.raises(ValueError, match="joints must be"):
        FewJoints(every, [8])
