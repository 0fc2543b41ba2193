"""The worlds of evaluation are what their file says, now and in every version to come."""

from __future__ import annotations

from dataclasses import replace

import pytest

from haptic_lab.tasks.registry import TASKS
from haptic_lab.tasks.worlds import FIRST, digest, drawn, evaluation_set


@pytest.mark.parametrize("task", TASKS)
def test_seeds_draw_the_worlds_of_the_file(task):
    worlds = evaluation_set(task)
    assert digest(worlds, FIRST) == worlds.sha256_first


@pytest.mark.statistical
@pytest.mark.parametrize("task", TASKS)
def test_seeds_draw_all_worlds_of_the_file(task):
    worlds = evaluation_set(task)
    assert digest(worlds, worlds.count) == worlds.sha256


def test_another_seed_or_noise_is_another_digest():
    worlds = evaluation_set("Name")
    found = digest(worlds, 2)
    assert found != digest(replace(worlds, first_seed=worlds.first_seed + 1), 2)
    assert found != digest(replace(worlds, sigmas_deg=(3.0, 4.0)), 2)


def test_sets_share_no_world():
    sets = [evaluation_set(task) for task in TASKS]
    seeds = [seed for each in sets for seed in range(each.first_seed, each.first_seed + each.count)]
    assert len(set(seeds)) == len(seeds)
    assert all(each.count >= 400 for each in sets)


def test_noises_take_turns():
    assert [each["sigma_deg"] for each in drawn(evaluation_set("Map"), 4)] == [3.0, 5.0, 3.0, 5.0]
    with pytest.raises(ValueError, match=r"index of a world must be an integer in \[0, 399\], got 400"):
        evaluation_set("Map").world(400)
