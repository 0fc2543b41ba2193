"""Twelve solids that lie any way, of unknown size and place, felt by two fingers: how often they are named."""

from __future__ import annotations

import gymnasium as gym
import numpy as np
import pytest
from scipy import stats

import agents
from haptic_env import hands, shapes
from haptic_env.hand import Hand
from observer import ObserverWrapper
from observer.brackets import TruePose
from observer.pose_only import PoseOnly
from observer.shape.posterior import ShapePosterior
from tests.kept import Arrays, folder_of, once, poses, told

NAMES = (
    "cube", "sphere", "pyramid", "cylinder", "ellipsoid(1, 1, 1.6)", "cuboid(1, 1, 2)", "cone(1.5)", "torus(0.4)",
    "prism(3)", "L", "capsule", "noise(1)",
)  # fmt: skip
JITTER = {"size_jitter": 0.2, "position_jitter": 0.005, "rotation_jitter": 180.0}
SECONDS = (5, 10, 20)
SEEDS = range(64_000, 64_036)  # three of each solid; nothing was tuned on them
GOAL = 0.85
WHO = ("observer", "true pose")

pytestmark = [pytest.mark.statistical, pytest.mark.timeout(7200)]


def _name(seed: int) -> str:
    return NAMES[seed % len(NAMES)]


def _explored(seed: int) -> Arrays:
    """What a namer hears of the observer and of who knows the pose."""
    rng, name = np.random.default_rng([7, seed]), _name(seed)
    size = (1 + JITTER["size_jitter"] * rng.uniform(-1, 1)) * shapes.default_size(name)
    with gym.make("HapticSLAM/TwoFinger-v0", shape=name, episode_seconds=SECONDS[-1], reveal_truth=True) as bare:
        hand: Hand = bare.unwrapped.hand
        place = hand.grasp_centre + JITTER["position_jitter"] * rng.uniform(-1, 1, 3)
        turn = rng.standard_normal(4)
        env = ObserverWrapper(bare, PoseOnly(hand))
        policy, state = agents.make("random_torque", env, seed=seed), None
        lies = {"shape": name, "size": size, "position": place, "quaternion": turn / np.linalg.norm(turn)}
        seen, info = env.reset(seed=seed, options=lies)
        known = TruePose(hand)
        beliefs = {"observer": [info["belief"]], "true pose": [known.reset(0, info["truth"]["joint_angles"])]}
        over = False
        while not over:
            action, state = policy.predict(seen, state)
            seen, _, _, over, info = env.step(action)
            beliefs["observer"].append(info["belief"])
            beliefs["true pose"].append(known.step(action, info["truth"]["joint_angles"], seen["contacts"]))
    return told(beliefs)


def _named(seed: int, felt: Arrays) -> Arrays:
    """The posterior (3, C) of both after each of `SECONDS`."""
    hand, named = hands.make("two_finger"), {}
    for who in WHO:
        candidates = {each: [shapes.make(each, position=hand.grasp_centre)] for each in NAMES}
        posterior, heard, course = ShapePosterior(hand, candidates, **JITTER), poses(felt, who), []
        posterior.reset(seed=seed)
        for step in range(50 * SECONDS[-1] + 1):
            posterior.take(heard.get(step))
            course.append(posterior.posterior.copy())
        named[who] = np.array([course[50 * seconds] for seconds in SECONDS])
    return named


def test_twelve_solids_that_lie_any_way_are_named(tmp_path_factory) -> None:
    folder = folder_of("twelve", tmp_path_factory)
    trials, right = [], {}
    for seed in SEEDS:
        felt = once(folder / f"{seed} felt.npz", lambda: _explored(seed))  # noqa: B023
        trials.append((_name(seed), once(folder / f"{seed}.npz", lambda: _named(seed, felt))))  # noqa: B023
    for who in WHO:
        for at, seconds in enumerate(SECONDS):
            hits = [NAMES[int(np.argmax(named[who][at]))] == name for name, named in trials]
            sure = [np.max(named[who][at]) > 0.95 and not hit for (_, named), hit in zip(trials, hits, strict=True)]
            low, high = stats.binomtest(sum(hits), len(hits)).proportion_ci(method="wilson")
            print(f"{who}, {seconds} s: {sum(hits)} of {len(hits)} [{low:.2f}, {high:.2f}], sure and wrong {sum(sure)}")
            right[who, seconds] = np.mean(hits)
    assert right["observer", 20] >= GOAL
    assert right["observer", 20] >= 0.9 * right["true pose", 20]
