"""None of these, where sizes and places are unknown: each object is felt once, and named by who knows it and by who
does not.

All of it takes an hour, and may be done in pieces (`tests.kept`).
"""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import gymnasium as gym
import numpy as np
import pytest

import agents
from haptic_env import hand_of, hands, shapes
from haptic_env.shapes.sets import SETS
from haptic_lab.analysis.novelty import auroc, ece
from haptic_lab.analysis.statistics import bootstrapped
from observer import ObserverWrapper, PoseOnly, ShapePosterior
from tests.kept import Arrays, folder_of, once, poses, told
from tests.observer.shape import test_fifty_any_way_long as fifty

PRIOR, SECONDS, AFTER = 0.5, 10.0, (2, 5, 10)
FOUR = {"size_jitter": 0.2, "yaw_jitter": 45.0, "position_jitter": 0.005}
WORLDS = {  # hand, names, what is not known of them, and seeds that nothing was tuned on
    "four shapes": ("two_finger", tuple(shapes.SHAPES), FOUR, range(79_500, 79_580)),
    "twelve solids": ("two_finger", SETS["twelve"], fifty.JITTER, range(79_600, 79_648)),
    "fifty objects": ("myo", tuple(fifty.NAMES), fifty.JITTER, range(78_700, 78_700 + len(fifty.NAMES))),
}

pytestmark = [pytest.mark.statistical, pytest.mark.timeout(4 * 3600)]


def _explored(seed: int, name: str, jitter: dict[str, float]) -> Arrays:
    """What two fingers feel by chance."""
    with gym.make("HapticSLAM/TwoFinger-v0", shape=name, episode_seconds=SECONDS, **jitter) as bare:
        env = ObserverWrapper(bare, PoseOnly(hand_of(bare)))
        policy, state = agents.make("random_torque", env, seed=seed), None
        seen, info = env.reset(seed=seed)
        beliefs, over = [info["belief"]], False
        while not over:
            action, state = agents.act(policy, seen, state)
            seen, _, _, over, info = env.step(action)
            beliefs.append(info["belief"])
    return told({"observer": beliefs})


def _felt(world: str, folder: Path, seed: int, name: str) -> Arrays:
    hand, _, jitter, _ = WORLDS[world]
    if hand == "myo":
        return once(folder / f"{seed}.npz", lambda: fifty._explored(seed, name))
    return once(folder / f"{seed}.npz", lambda: _explored(seed, name, jitter))


def _named(felt: Arrays, namer: ShapePosterior, seed: int) -> Arrays:
    """The posterior (3, C) after each of `AFTER`."""
    namer.reset(seed=seed)
    heard, course = poses(felt, "observer"), []
    for step in range(int(50 * SECONDS) + 1):
        namer.take(heard.get(step))
        course.append(namer.posterior)
    return {"posterior": np.array([course[50 * seconds] for seconds in AFTER])}


def _probabilities(world: str, felt_in: Path, folder: Path) -> tuple[np.ndarray, np.ndarray]:
    """That of "none" (n, 2, 3) by who knows the object and by who does not, and whether the first names it right."""
    hand, names, jitter, seeds = WORLDS[world]
    namers: dict[str, ShapePosterior] = {}

    def namer(left_out: str) -> ShapePosterior:
        if left_out not in namers:
            among = [each for each in names if each != left_out]
            namers[left_out] = ShapePosterior(hands.make(hand), among, none=PRIOR, **jitter)
        return namers[left_out]

    said, right = [], []
    for seed in seeds:
        name = names[seed % len(names)] if hand != "myo" else names[seed - seeds[0]]
        felt = _felt(world, felt_in, seed, name)
        if fifty.NEITHER in felt:
            continue
        both = []
        for arm, left_out in (("known", ""), ("new", name)):
            make: Callable[[], Arrays] = lambda: _named(felt, namer(left_out), seed)  # noqa: B023, E731
            both.append(once(folder / f"{seed} {arm}.npz", make)["posterior"])
        if hand == "myo":
            namers.pop(name, None)
        said.append([each[:, -1] for each in both])
        right.append([names[each.argmax()] == name for each in both[0][:, :-1]])
    return np.array(said), np.array(right)


@pytest.mark.parametrize("world", WORLDS)
def test_new_objects_are_told_from_known_ones(world, tmp_path_factory) -> None:
    if world == "fifty objects" and not fifty.MESHES:
        pytest.skip("needs ../shared/objects")
    felt_in = folder_of("fifty" if world == "fifty objects" else f"none {world} felt", tmp_path_factory)
    said, right = _probabilities(world, felt_in, folder_of(f"none {world}", tmp_path_factory))
    is_new = np.repeat([[False, True]], len(said), axis=0)
    for at, seconds in enumerate(AFTER):
        none = said[..., at]
        found = bootstrapped(none, lambda rows: auroc(rows.ravel(), is_new[: len(rows)].ravel()))
        loss = bootstrapped(none, lambda rows: -np.mean(np.log([1.0 - rows[:, 0], rows[:, 1]])))
        sure, hit = np.maximum(none, 1.0 - none).ravel(), ((none > 0.5) == is_new).ravel()
        honest, most = fifty._scattered(sure)
        print(
            f"{world}, {seconds} s: AUROC {found[0]:.2f} [{found[1]:.2f}, {found[2]:.2f}] of {len(said)} each way, "
            f"probability of none {none[:, 0].mean():.2f} where it is known and {none[:, 1].mean():.2f} where not, log "
            f"loss {loss[0]:.2f} [{loss[1]:.2f}, {loss[2]:.2f}] (a guess: 0.69), known ones named right "
            f"{right[:, at].sum()}, ECE {ece(sure, hit):.3f}, honest {honest:.3f}, in 95 % below {most:.3f}"
        )
    assert loss[0] < np.log(2.0)
    assert found[1] > 0.5
