"""What names objects that lie any way, anywhere: how soon much is touched, and what a true pose would be worth."""

from __future__ import annotations

from dataclasses import replace
from functools import partial

import numpy as np
import pytest

from haptic_env import hand_of
from haptic_lab.learning.covering import LEAST, Touched
from haptic_lab.sweeps.worker import GUIDE_VARIANTS
from haptic_lab.tasks import judging
from haptic_lab.tasks.registry import world_of
from haptic_lab.tasks.worlds import as_drawn
from haptic_lab.trial import GUIDE, TRUE_POSE, Trial, guided, make_observers
from tests.kept import Arrays, folder_of, once

POLICIES = ("random_torque", "enclosure", "reflexes", "information_gain", "searched")
WORLDS, FIRST_SEED = 10, 79_400
SECONDS, HOLD = 5.0, 2
VARIANTS = 48  # as many as training has
RESAMPLED = 2000


def explored(policy: str, seed: int) -> Arrays:
    """Share of the steps in which the name is right by the observer and by who is told the true pose, nats of log share
    touched as a mean through time, and the first touch, s."""
    sigma = (3.0, 5.0)[seed % 2]
    world = replace(world_of("NameUnknown"), sigma_deg=(sigma, sigma), seconds=SECONDS)
    env = as_drawn(world)
    hand = hand_of(env)
    told = world.told(world.noise, hand)
    env = guided(env, policy, sigma, judging.namer(world, GUIDE_VARIANTS), **told)
    observers = make_observers((GUIDE, TRUE_POSE), hand, sigma, 1, **told)
    trial = Trial(env, policy, observers, judging.namer(world, VARIANTS), seed)
    trial.run()
    exploration, traces = trial.finish()
    env.close()
    truth = world.shapes.index(exploration.solid.name)
    right = [(traces[name].posterior.argmax(axis=1) == truth).mean() for name in (GUIDE, TRUE_POSE)]
    touched = Touched(hand)
    for step in range(HOLD - 1, len(exploration.seconds), HOLD):
        touched.take(exploration.true_angles[step], exploration.contacts[step], exploration.solid)
    soon = np.log(np.maximum(touched.shares(exploration.solid), LEAST)).mean()
    first = exploration.seconds[np.argmax(exploration.contacts.any(axis=1))]
    return {"found": np.array([*right, soon, first])}


@pytest.mark.statistical
@pytest.mark.timeout(3600)
def test_who_soon_touches_much_names_objects_that_lie_any_way(tmp_path_factory: pytest.TempPathFactory) -> None:
    """Correlations within worlds, with intervals by bootstrap over them."""
    kept = folder_of("unknown", tmp_path_factory)
    found = np.array(
        [
            [once(kept / f"{policy}_{seed}.npz", partial(explored, policy, seed))["found"] for policy in POLICIES]
            for seed in range(FIRST_SEED, FIRST_SEED + WORLDS)
        ]
    )  # (world, policy, what)
    rng = np.random.default_rng(0)
    drawn = rng.integers(0, WORLDS, (RESAMPLED, WORLDS))
    for index, policy in enumerate(POLICIES):
        observed, true_pose, soon, first = found[:, index].mean(axis=0)
        ends = np.percentile(found[:, index][drawn].mean(axis=1), (2.5, 97.5), axis=0)
        print(
            f"{policy}: right {observed:.0%} [{ends[0, 0]:.0%}, {ends[1, 0]:.0%}], with the true pose {true_pose:.0%} "
            f"[{ends[0, 1]:.0%}, {ends[1, 1]:.0%}]; touched {np.exp(soon):.1%}, first after {first:.2f} s"
        )
    within = found - found.mean(axis=1, keepdims=True)
    for name, of in (("the observer", 0), ("who is told the true pose", 1)):

        def correlation(worlds: np.ndarray, of: int = of) -> float:
            return float(np.corrcoef(within[worlds][..., of].ravel(), within[worlds][..., 2].ravel())[0, 1])

        low, high = np.percentile([correlation(each) for each in drawn], (2.5, 97.5))
        mean = correlation(np.arange(WORLDS))
        print(f"how soon much is touched, and how often {name} is right: {mean:.2f} [{low:.2f}, {high:.2f}]")
        assert low > 0.0
