"""Objects learnt from one exploration by a whole hand: how often they are recognised as they lie another time."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import gymnasium as gym
import numpy as np
import pytest
from scipy import stats

import agents
from haptic_env import shapes
from haptic_env.hand import Hand
from observer import HapticSLAM, Library, ObserverWrapper, ShapePosterior
from observer.belief import Belief
from observer.brackets import DeadReckoning, TruePose
from tests.observer.shape.test_any_way_long import NAMES

LEARNT, FELT = 20.0, 10.0  # s
LIES = {"position_jitter": 0.02, "rotation_jitter": 180.0}
SIZES = 0.2  # plus or minus, of which the namer knows as much
SEEDS = range(70_000, 70_024)  # two of each solid; nothing was tuned on them
LATER = 1_000_000  # added to the seed of the second exploration
WHO = ("raw angles", "observer", "true pose")
GOAL = 0.9

pytestmark = [pytest.mark.statistical, pytest.mark.timeout(14_400)]


def _explore(
    seed: int, name: str, size: np.ndarray, seconds: float, who: tuple[str, ...]
) -> tuple[Hand, dict[str, list[Belief]]]:
    """The beliefs of `who` in one exploration of a solid that lies any way."""
    with gym.make("HapticSLAM/AdroitHand-v0", shape=name, episode_seconds=seconds, reveal_truth=True, **LIES) as bare:
        hand: Hand = bare.unwrapped.hand
        env = ObserverWrapper(bare, HapticSLAM(hand, particles=1))
        others: dict[str, Any] = {"raw angles": DeadReckoning(hand), "true pose": TruePose(hand)}
        others = {each: others[each] for each in who if each in others}
        policy, state = agents.make("enclosure", env, seed=seed), None
        seen, info = env.reset(seed=seed, options={"size": size})
        told = {"raw angles": seen["joint_angles"], "true pose": info["truth"]["joint_angles"]}
        beliefs = {who: [each.reset(seed, told[who])] for who, each in others.items()} | {"observer": [info["belief"]]}
        over = False
        while not over:
            action, state = policy.predict(seen, state)
            seen, _, _, over, info = env.step(action)
            told = {"raw angles": seen["joint_angles"], "true pose": info["truth"]["joint_angles"]}
            beliefs["observer"].append(info["belief"])
            for who, each in others.items():
                beliefs[who].append(each.step(action, told[who], seen["contacts"]))
    for who, each in others.items():
        beliefs[who] += each.flush()
    return hand, beliefs


def _recognise(seed: int, folder: Path, who: tuple[str, ...] = WHO) -> dict[str, dict[str, float]]:
    """The posterior over eleven known solids and the twelfth, which was learnt."""
    name = NAMES[seed % len(NAMES)]
    size = (1 + SIZES * np.random.default_rng([8, seed]).uniform(-1, 1)) * shapes.default_size(name)
    hand, learnt = _explore(seed, name, size, LEARNT, who)
    _, felt = _explore(LATER + seed, name, size, FELT, who)
    known = {each: [shapes.usual(each, hand)] for each in NAMES if each != name}
    result = {}
    for each in who:
        library = Library(folder / each)
        library.add("mine", learnt[each][-1], replace=True)
        namer = ShapePosterior(hand, {**known, **library.candidates(hand)}, size_jitter=SIZES, **LIES)
        namer.reset(seed)
        for belief in felt[each]:
            namer.update(belief)
        result[each] = dict(zip(namer.labels, map(float, namer.posterior), strict=True))
    return result


def test_what_was_learnt_is_recognised(tmp_path: Path) -> None:
    trials = [_recognise(seed, tmp_path) for seed in SEEDS]
    right = {}
    for who in WHO:
        hits = [max(trial[who], key=lambda each: trial[who][each]) == "mine" for trial in trials]
        low, high = stats.binomtest(sum(hits), len(hits)).proportion_ci(method="wilson")
        sure = sum(trial[who]["mine"] > 0.95 for trial in trials)
        print(f"{who}: {sum(hits)} of {len(hits)} [{low:.2f}, {high:.2f}], sure {sure}")
        right[who] = np.mean(hits)
    assert right["observer"] >= GOAL
    assert right["raw angles"] <= right["observer"]
