"""What reading the names could be worth: the shipped search, searched on for each shape alone, as if it were known."""

from __future__ import annotations

import functools

import numpy as np
import pytest

pytest.importorskip("cmaes")

import cmaes

from agents import network
from agents.sb3 import Searched
from haptic_lab.learning import presets
from haptic_lab.learning.candidates import Judge, Outcome, doubts
from haptic_lab.learning.explored import explored
from haptic_lab.learning.finger_weights import FingerWeights
from observer import BeliefFeatures

pytestmark = pytest.mark.statistical
GENERATIONS, POPULATION, WORLDS = 12, 12, 4
FIRST_TRAINING_SEED, FIRST_SEED, COUNT = 10_500_000, 76_400, 60  # no policy saw either before


def shipped_matrix() -> np.ndarray:
    """(J, 1 + D), the constant first."""
    mean = network.read(Searched.shipped).mean
    return np.concatenate([mean.bias[:, None], mean.weight], axis=1)


@functools.cache
def outcomes(shape: str) -> dict[str, list[Outcome]]:
    """Of what ships, and of what was searched on for that shape alone: other constants and rhythms, as names times
    rhythm could choose among; in worlds of sizes that neither saw."""
    preset = presets.read("searched")
    world, index = preset.world, preset.world.shapes.index(shape)
    env = explored(world)
    hand, labels = env.get_wrapper_attr("hand"), world.shapes
    env.close()
    features = BeliefFeatures(hand, labels, world.seconds, 50.0, ["rhythm"])
    weights = FingerWeights(hand, features, len(labels), None)
    begin = shipped_matrix()
    assert world.observation[0] == "rhythm"

    def candidate(chosen: np.ndarray) -> np.ndarray:
        matrix = begin.copy()
        change = weights.candidate(chosen)
        matrix[:, : change.shape[1]] += change
        return matrix

    judge = Judge(world, jobs=1)
    search = cmaes.SepCMA(np.zeros(weights.size), preset.learner["step"], seed=index, population_size=POPULATION)
    for generation in range(GENERATIONS):
        asked = [search.ask() for _ in range(POPULATION)]
        seeds = [FIRST_TRAINING_SEED + 4 * (generation * WORLDS + world) + index for world in range(WORLDS)]
        found = judge.judge((candidate(each), seed) for each in asked for seed in seeds)
        search.tell(list(zip(asked, doubts(found, (POPULATION, WORLDS)).mean(axis=1).tolist(), strict=True)))
    seeds = [FIRST_SEED + 4 * world + index for world in range(COUNT)]
    matrices = {"shipped": begin, "knows the shape": candidate(search.mean)}
    return {name: judge.judge(((each, s) for s in seeds), held_out=True) for name, each in matrices.items()}


def in_doubt(shape: str, name: str) -> np.ndarray:
    return doubts(outcomes(shape)[name], (COUNT,))


@pytest.mark.parametrize("shape", presets.FOUR)
def test_a_rhythm_for_a_shape_alone_is_hardly_better_than_the_one_for_all(shape):
    gained = in_doubt(shape, "shipped") - in_doubt(shape, "knows the shape")
    error = 1.96 * gained.std() / np.sqrt(COUNT)
    means = {name: round(float(in_doubt(shape, name).mean()), 2) for name in outcomes(shape)}
    print(f"\n{shape}: {means} s in doubt; gained {gained.mean():.2f} ({gained.mean() - error:.2f} to", end=" ")
    print(f"{gained.mean() + error:.2f}) s")
    assert gained.mean() - error < 0.2
