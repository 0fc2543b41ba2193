"""What steering could do at all: an oracle that reads the truth beside policies that do not, in worlds that nothing was
tuned on. It bounds from below what a policy could reach, for what it does is not the best that is possible."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from functools import partial
from typing import Any

import numpy as np
import pytest

from haptic_env import hand_env
from haptic_lab.analysis.statistics import bootstrapped
from haptic_lab.learning.covering import LEAST, Touched
from haptic_lab.learning.presets import NAME
from haptic_lab.sweeps.worker import GUIDE_VARIANTS
from haptic_lab.tasks import judging
from haptic_lab.tasks.worlds import as_drawn, evaluation_set
from haptic_lab.trial import GUIDE, TRUE_POSE, Trial, guided, make_observers
from observer import metrics
from tests.haptic_lab.oracle import Oracle
from tests.kept import Arrays, folder_of, once

ORACLE, BY_HAND = "oracle", "enclosure"
POLICIES = {"Map": (BY_HAND, "reflexes", ORACLE), "NameUnknown": ("random_torque", BY_HAND, "searched", ORACLE)}
SECONDS = {"Map": 20.0, "NameUnknown": 5.0}
SEEDS = {"Map": range(79_400, 79_424), "NameUnknown": range(79_412, 79_424)}
HOLD = 2  # control steps from touch to touch, as searches have it


def explored(task: str, policy: str, seed: int) -> Arrays:
    """What a policy finds in a world: the `share` of the surface that it touched in the end, and `soon`, the nats of it
    as a mean through time; of maps what is `covered`; of names how often the observer is `right`, and who is told the
    `true_pose`; of the oracle the share that it knows how to touch, `reached`."""
    worlds = replace(evaluation_set(task), first_seed=0, count=seed + 1)
    world = replace(worlds.world(seed)[0], seconds=SECONDS[task])
    env, (sigma, _), names = as_drawn(world), world.sigma_deg, world.task == NAME
    base = hand_env(env)
    hand, told = base.hand, world.told(world.noise, base.hand)
    chooses: Any = policy
    if policy == ORACLE:
        chooses = Oracle(env, int(np.random.SeedSequence(seed).generate_state(2)[0]))  # as `Trial` would have it
    else:
        env = guided(env, policy, sigma, judging.namer(world, GUIDE_VARIANTS), **told)
    observers = make_observers((GUIDE, TRUE_POSE) if names else (GUIDE,), hand, sigma, 1, **told)
    namer = judging.namer(world, judging.VARIANTS if names else 1)
    trial = Trial(env, chooses, observers, namer, seed, naming=None if names else ())
    trial.run()
    exploration, traces = trial.finish()
    env.close()
    solid, touched = exploration.solid, Touched(hand)
    for step in range(HOLD - 1, len(exploration.seconds), HOLD):
        touched.take(exploration.true_angles[step], exploration.contacts[step], solid)
    shares = touched.shares(solid)
    found: dict[str, Any] = {"share": shares[-1], "soon": np.log(np.maximum(shares, LEAST)).mean()}
    if policy == ORACLE:
        found["reached"] = chooses.reached.mean()
    if names:
        truth = world.shapes.index(solid.name)
        for name, of in (("right", GUIDE), ("true_pose", TRUE_POSE)):
            found[name] = (traces[of].posterior.argmax(axis=1) == truth).mean()
    else:
        belief = traces[GUIDE].belief
        found["covered"] = metrics.surface_coverage(belief.occupancy, belief.grid, solid)
    return {name: np.array(value) for name, value in found.items()}


def tables(task: str, kept: Any) -> dict[str, np.ndarray]:
    """(world, policy) of each thing that is found, in the order of `POLICIES`."""
    rows = [
        [once(kept / f"{task}_{policy}_{seed}.npz", partial(explored, task, policy, seed)) for policy in POLICIES[task]]
        for seed in SEEDS[task]
    ]
    reached = np.array([[row[-1]["reached"]] for row in rows])
    told(f"{task}, {ORACLE}: share that it knows how to touch", reached, np.mean)
    return {name: np.array([[each[name] for each in row] for row in rows]) for name in rows[0][0]}


def told(what: str, table: np.ndarray, estimate: Callable[[np.ndarray], Any]) -> float:
    """Print an estimate with its interval by bootstrap over the worlds, of which the lower end is returned."""
    value, low, high = bootstrapped(table, estimate)
    print(f"{what}: {value:.3f} [{low:.3f}, {high:.3f}]")
    return low


def more(what: str, pair: np.ndarray) -> float:
    """Print how much more the second of two policies came to in the same worlds (worlds, 2); the lower end of it."""
    if pair.min() >= 0.0:  # nats are not
        told(f"{what}, as many times", pair, lambda both: both[:, 1].sum() / both[:, 0].sum())
    return told(f"{what}, more by", pair, lambda both: (both[:, 1] - both[:, 0]).mean())


def beside(task: str, name: str, table: np.ndarray) -> dict[tuple[str, str], float]:
    """Print what each policy came to, and how much more it was than with each one before; the lower ends of that."""
    policies, low = POLICIES[task], {}
    for index, policy in enumerate(policies):
        told(f"{task}, {policy}: {name}", table[:, [index]], np.mean)
        for before in range(index):
            what = f"{task}, {policy} beside {policies[before]}: {name}"
            low[policy, policies[before]] = more(what, table[:, [before, index]])
    return low


@pytest.mark.statistical
@pytest.mark.timeout(3600)
def test_a_hand_that_is_steered_by_the_truth_covers_more(tmp_path_factory: pytest.TempPathFactory) -> None:
    """Maps: how far steering goes beyond the best that is made by hand, and what is learnt."""
    found = tables("Map", folder_of("oracle", tmp_path_factory))
    low = {name: beside("Map", name, found[name]) for name in ("covered", "share")}
    assert low["covered"][ORACLE, BY_HAND] > 0.0
    assert low["share"][ORACLE, BY_HAND] > 0.0


@pytest.mark.statistical
@pytest.mark.timeout(3600)
def test_a_hand_that_is_steered_by_the_truth_touches_sooner_objects_that_lie_any_way(
    tmp_path_factory: pytest.TempPathFactory,
) -> None:
    """Names: whether who touches more is right more often, and what the true pose would be worth."""
    found = tables("NameUnknown", folder_of("oracle", tmp_path_factory))
    low = {name: beside("NameUnknown", name, found[name]) for name in ("soon", "share", "right", "true_pose")}
    both = np.stack([found["soon"], found["right"], found["true_pose"]], axis=2)
    within = both - both.mean(axis=1, keepdims=True)
    for of, who in ((1, "the observer"), (2, "who is told the true pose")):
        told(
            f"correlation within worlds of how soon much is touched, and how often {who} is right",
            within[..., [0, of]].reshape(len(within), -1),
            lambda drawn: np.corrcoef(drawn.reshape(-1, 2).T)[0, 1],
        )
    gained = found["true_pose"].mean(axis=1) - found["right"].mean(axis=1)
    assert told("told the true pose, right more often by", gained[:, None], np.mean) > 0.0
    assert low["soon"][ORACLE, BY_HAND] > 0.0
