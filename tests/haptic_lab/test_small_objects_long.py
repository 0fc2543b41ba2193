"""Small objects that a hand sweeps over in the simulation, whose angles are replayed as a recording's are: how good the
map is, and what they are called among eight meshes as large.

    python -m pytest -m statistical -s tests/haptic_lab/test_small_objects_long.py
"""

from __future__ import annotations

import numpy as np
import pytest
from scipy import stats

from haptic_env import hand_env
from haptic_lab.sweeps.measures import GroundTruth, measures_of
from haptic_lab.trial import Trial
from observer import HapticSLAM
from observer.brackets import DeadReckoning, TruePose
from tests.haptic_lab.recorded_hands import SIGMA, explored, mesh_of, people, session

SEEDS = range(77440, 77444)  # nothing was tuned on them
SIZE = 0.04  # m, where an object is longest
EIGHT = ("cube", "sphere", "cylinder", "apple", "mug", "doorknob", "cup", "piggybank")


def _draw(name: str, seed: int) -> dict[str, tuple[float, float, str]]:
    """Of each observer the F-score at two voxels, the share of steps with a touch, and what it named."""
    every = {each: f"{mesh_of(each)}(size={SIZE})" for each in EIGHT}
    given = session(explored(every[name], seed), every[name], list(every.values()), seed)
    hand, told = given.hand, {**given.told, "control_hz": hand_env(given.env).control_hz}
    observers = {
        "floor": DeadReckoning(hand, SIGMA, **told),
        "haptic_slam": HapticSLAM(hand, SIGMA, particles=5, **told, **given.informed),
        "ceiling": TruePose(hand, **told),
    }
    trial = Trial(given.env, given.policy, observers, given.namer, seed)
    trial.run()
    exploration, traces = trial.finish()
    truth = GroundTruth.of(exploration, traces["floor"].belief.grid)
    called = {path: each for each, path in every.items()}
    lines = {}
    for each, trace in traces.items():
        measures = measures_of(exploration, truth, trace)
        lines[each] = measures["surface_f_score_2"], measures["touching_share"], called[trace.name]
    return lines


@people
@pytest.mark.statistical
@pytest.mark.timeout(3600)
@pytest.mark.parametrize("name", EIGHT[:3])
def test_a_small_object_is_mapped_and_named(name: str) -> None:
    draws = [_draw(name, seed) for seed in SEEDS]
    f_scores = {}
    for each in draws[0]:
        score, share, names = zip(*(draw[each] for draw in draws), strict=True)
        f_scores[each] = f = np.array(score)
        half = stats.t.ppf(0.975, len(f) - 1) * f.std(ddof=1) / np.sqrt(len(f))
        told = ", ".join(f"{other} {names.count(other)}" for other in sorted(set(names)))
        print(
            f"{name} of {100 * SIZE:g} cm | {each} | F at two voxels {f.mean():.3f} ± {half:.3f} ({f.min():.2f} to "
            f"{f.max():.2f}) | touched {np.mean(share):.0%} of the time | {told} of {len(names)}"
        )
    assert f_scores["haptic_slam"].mean() >= 0.8
    assert sum(draw["haptic_slam"][2] == name for draw in draws) >= 0.9 * len(draws)
