"""Beliefs that someone has put other arrays into, given to namers. J joints, P patches."""

from __future__ import annotations

from dataclasses import replace
from functools import lru_cache
from typing import Any

import numpy as np

from haptic_env import shapes
from observer import Belief, ShapePosterior
from tests.properties import samples
from tests.properties.entries.observers import ANGLES, CONTACTS, ROOT
from tests.properties.entry import Entry
from tests.properties.parameters import Parameter, array, one_of_these
from tests.properties.rule import Allowed

J = samples.JOINTS
NAMERS: dict[str, dict[str, Any]] = {
    "exact": {},
    "jitter": {"size_jitter": 0.1, "yaw_jitter": 20.0, "variants": 6},
    "samples": {"samples": 3},
    "several steps": {"samples": 3, "stride": 2},
    "none": {"none": 0.3},
}


@lru_cache(maxsize=len(NAMERS))
def _namer(kind: str) -> ShapePosterior:
    solids = {"ball": [samples.solid()], "cube": [shapes.make("cube")]}
    return ShapePosterior(samples.hand(), solids, **{"stride": 1, **NAMERS[kind]})


@lru_cache(maxsize=1)
def _belief() -> Belief:
    slam, hand = samples.slam(), samples.hand()
    slam.reset(seed=0)
    steps = [slam.step(np.zeros(J), hand.rest_pose, np.arange(samples.PATCHES) % 9 == 0) for _ in range(3)]
    return steps[-1]


def _replaced(namer: str = "exact", **arrays: Any) -> list[Any]:
    """Of a belief some of whose `arrays` are others, before and after beliefs as they are; one that is refused changes
    nothing."""
    made, usual = _namer(namer), _belief()
    of_transition = {key: arrays.pop(key) for key in TRANSITION if key in arrays}
    if of_transition:
        arrays["transition"] = usual.transition._replace(**of_transition)
    made.reset(seed=0)
    posteriors = [made.update(usual)]
    try:
        posteriors.append(made.update(replace(usual, **arrays)))
    except ValueError:
        left = made.update(usual)
        made.reset(seed=0)
        assert np.array_equal([made.update(usual), made.update(usual)][-1], left)
        raise
    return [*posteriors, made.update(usual), made.update(usual), made.log_likelihood, made.hypotheses.log_probability]


TRANSITION = {"mean": ANGLES, "follow": array((J, J)), "before": ANGLES, "rest": array((J, J), 0.0, 1e-6)}
REPLACED: dict[str, Parameter] = {
    "namer": one_of_these(*NAMERS),
    "lagged_joint_angles": ANGLES,
    "lagged_covariance": array((J, J), 0.0, 1e-3),
    "lagged_contacts": CONTACTS,
    "lagged_root": ROOT,
    **TRANSITION,
}

ENTRIES: dict[str, Entry] = {
    "observer.ShapePosterior.update[arrays replaced]": Entry(
        _replaced, REPLACED, Allowed(words=("belief", "root")), weight=4
    ),
}
