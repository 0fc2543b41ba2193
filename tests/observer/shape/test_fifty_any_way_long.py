"""Fifty objects that lie any way, of unknown size and place, enclosed by a whole hand: how often they are named."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import gymnasium as gym
import numpy as np
import pytest
from scipy import stats

import agents
from haptic_env import hand_of, hands
from haptic_lab.analysis.novelty import ece
from observer import ObserverWrapper, ShapePosterior
from observer.brackets import DeadReckoning, TruePose
from observer.pose_only import PoseOnly

MESHES = sorted(map(str, (Path(__file__).parents[4] / "shared" / "objects").glob("*.*")))
SOLIDS = (
    "cube", "sphere", "pyramid", "cylinder", "ellipsoid(1, 1, 1.6)", "ellipsoid(1, 1, 0.6)", "ellipsoid(1, 1.5, 2)",
    "cuboid(1, 1, 2)", "cuboid(1, 2, 3)", "cuboid(1, 1, 0.5)", "cone(1.5)", "cone(1)", "frustum(0.5, 1)", "torus(0.4)",
    "torus(0.3)", "prism(3)", "prism(6)", "L", "capsule", "superquadric(0.5, 0.5)", "superquadric(1.5, 1.5)",
    "noise(1)", "noise(2)",
)  # fmt: skip
NAMES = [each for pair in zip(MESHES, [*SOLIDS, *[""] * len(MESHES)], strict=False) for each in pair if each]
JITTER = {"size_jitter": 0.2, "position_jitter": 0.02, "rotation_jitter": 180.0}
SIGMA, SECONDS, AFTER = 3.0, 10.0, (2, 5, 10)
FIRST = 78_000  # nothing was tuned on these seeds; names were tuned on the first thirteen objects, and on hollow ones
GOAL = 0.9

pytestmark = [
    pytest.mark.statistical,
    pytest.mark.timeout(4 * 3600),
    pytest.mark.skipif(not MESHES, reason="needs ../shared/objects"),
]


def _explore(seed: int, name: str, namer: ShapePosterior) -> dict[str, Any]:
    """The posterior (C,) of each observer after each of `AFTER`."""
    told = {"sigma_deg": SIGMA, "episode_seconds": SECONDS, "reveal_truth": True, **JITTER}
    with gym.make("HapticSLAM/MyoHand-v0", shape=name, **told) as bare:
        hand = hand_of(bare)
        env = ObserverWrapper(bare, PoseOnly(hand, SIGMA))
        policy, state = agents.make("enclosure", env, seed=seed), None
        seen, info = env.reset(seed=seed)
        known, raw = TruePose(hand), DeadReckoning(hand, SIGMA)
        felt = {
            "observer": [info["belief"]],
            "true pose": [known.reset(0, info["truth"]["joint_angles"])],
            "raw angles": [raw.reset(0, seen["joint_angles"])],
        }
        over = False
        while not over:
            action, state = agents.act(policy, seen, state)
            seen, _, _, over, info = env.step(action)
            felt["observer"].append(info["belief"])
            felt["true pose"].append(known.step(action, info["truth"]["joint_angles"], seen["contacts"]))
            felt["raw angles"].append(raw.step(action, seen["joint_angles"], seen["contacts"]))
    named = {}
    for who, beliefs in felt.items():
        namer.reset(seed=seed)
        course = [namer.update(belief) for belief in beliefs]
        named[who] = [course[min(50 * seconds, len(course) - 1)] for seconds in AFTER]
    return named


def _scattered(sure: np.ndarray) -> tuple[float, float]:
    """Calibration errors of a namer that is right as often as it says: the mean, and what 95 % are below."""
    rng = np.random.default_rng(0)
    honest = [ece(sure, rng.random(len(sure)) < sure) for _ in range(2000)]
    return float(np.mean(honest)), float(np.quantile(honest, 0.95))


def test_fifty_objects_that_lie_any_way_are_named() -> None:
    namer, trials = ShapePosterior(hands.make("myo"), NAMES, **JITTER), []
    for i, name in enumerate(NAMES):
        try:
            trials.append((name, _explore(FIRST + i, name, namer)))
        except ValueError as refused:  # not cut for the physics in time
            print(f"{name} is left out: {refused}")
    share = {}
    for who in trials[0][1]:
        for at, seconds in enumerate(AFTER):
            posteriors = np.array([named[who][at] for _, named in trials])
            right = np.array([NAMES[p.argmax()] == name for p, (name, _) in zip(posteriors, trials, strict=True)])
            sure = posteriors.max(axis=1)
            honest, most = _scattered(sure)
            low, high = stats.binomtest(int(right.sum()), len(right)).proportion_ci(method="wilson")
            print(
                f"{who}, {seconds} s: {right.sum()} of {len(right)} [{low:.2f}, {high:.2f}], mean probability of the "
                f"name {sure.mean():.2f}, sure (0.95) and wrong {(~right & (sure > 0.95)).sum()}, calibration error "
                f"{ece(sure, right):.3f}, of an honest namer {honest:.3f}, in 95 % below {most:.3f}"
            )
            share[who, seconds] = right.mean()
    assert share["observer", AFTER[-1]] >= GOAL
    assert share["observer", AFTER[-1]] >= 0.9 * share["true pose", AFTER[-1]]
