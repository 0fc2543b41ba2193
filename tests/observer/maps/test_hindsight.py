"""Maps in hindsight: exact where the touches form a tree, and the last belief's alone."""

from __future__ import annotations

from itertools import product

import numpy as np
import pytest
from scipy.special import expit, logit

from observer.fastslam import HapticSLAM
from observer.kinematics import tree_of
from observer.maps import capsules, free_space, matching_geometry
from observer.maps.contact_model import LIMIT, ContactModel
from observer.maps.hindsight import ROUNDS, WEIGHT, Moment, look_back, share
from observer.maps.occupancy import ParticleMaps

STEPS = 60
NO_ALARM = 0.97


@pytest.fixture(scope="module")
def trial(explore):
    """Two fingers about a cube, which they touch."""
    return explore("cube", STEPS, seed=3)


def _shared(log_odds, touches, weight=1.0, rounds=ROUNDS):
    """`log_odds` after `touches`, each the cells that it may be due to with how probably they ring."""
    result = np.array(log_odds)
    cells = np.array([cell for touch in touches for cell in touch])
    hits = np.array([hit for touch in touches for hit in touch.values()])
    count = np.array([len(touch) for touch in touches])
    share(
        count,
        np.full(len(touches), weight),
        cells,
        hits,
        NO_ALARM,
        rounds,
        result,
    )
    return result


def _enumerated(log_odds, touches):
    """The same by going through all maps."""
    total, occupied = 0.0, np.zeros(len(log_odds))
    for map in product((0, 1), repeat=len(log_odds)):
        each = np.array(map)
        p = np.where(each, expit(log_odds), expit(-np.array(log_odds))).prod()
        for touch in touches:
            p *= 1 - NO_ALARM * np.prod([1 - hit * each[cell] for cell, hit in touch.items()])
        total, occupied = total + p, occupied + p * each
    return logit(occupied / total)


TREES = {
    "one touch": [{0: 0.5, 1: 0.2, 2: 0.9}],
    "a chain": [{0: 0.5, 1: 0.3}, {1: 0.7, 2: 0.4}, {2: 0.2, 3: 0.6}],
    "a star": [{0: 0.5, 1: 0.3}, {0: 0.2, 2: 0.4}, {0: 0.7, 3: 0.6}],
    "one suspect": [{2: 0.4}],
}


@pytest.mark.parametrize("tree", TREES)
def test_it_is_exact_on_a_tree(tree):
    log_odds = [-2.0, -1.0, -3.0, 0.5]
    np.testing.assert_allclose(_shared(log_odds, TREES[tree]), _enumerated(log_odds, TREES[tree]), atol=1e-9)


def test_the_order_of_touches_does_not_matter():
    rng = np.random.default_rng(0)
    touches = [dict(zip(rng.permutation(12)[:4].tolist(), rng.uniform(0.05, 0.2, 4), strict=True)) for _ in range(20)]
    log_odds = rng.normal(-3.0, 1.0, 12)
    forth, back = (_shared(log_odds, each, rounds=100) for each in (touches, touches[::-1]))
    np.testing.assert_allclose(forth, back, atol=1e-6)


def test_nobody_asked_weighs_nothing():
    np.testing.assert_array_equal(_shared([-2.0, 1.0], [{0: 0.5, 1: 0.5}], weight=0.0), [-2.0, 1.0])


def test_the_last_belief_alone_has_the_map_in_hindsight(trial):
    def beliefs(**keywords):
        return trial.beliefs(HapticSLAM(trial.hand, 3.0, particles=4, **keywords))

    after, before = beliefs(), beliefs(in_hindsight=False)
    assert len(after) == len(before)
    for one, other in zip(after[:-1], before[:-1], strict=True):
        assert one == other
    assert (after[-1].occupancy != before[-1].occupancy).any()
    np.testing.assert_array_equal(after[-1].lagged_joint_angles, before[-1].lagged_joint_angles)
    assert (after[-1].occupancy[before[-1].occupancy == 0.5] == 0.5).all(), "nothing is said of what was not felt"
    assert not after[-1].occupancy.flags.writeable


def test_looking_back_finds_what_each_step_found(trial):
    """The suspects and the sweeps of all steps, in one kernel: those of the kernels that follow the trial."""
    model = ContactModel()
    grid, tree = HapticSLAM(trial.hand).grid, tree_of(trial.hand)
    body, lattice = capsules.body_of(trial.hand.patches, grid.resolution), capsules.lattice_of(grid)
    evidence, cells = model.evidence(grid.resolution), int(np.prod(grid.shape))
    known = 1e-4 * np.eye(trial.hand.joints)
    steps, suspected, rings, touch = [], [], [], np.full(len(trial.hand.patches), 0.5)
    common, seen, stale = np.zeros(cells, dtype=np.int8), *np.zeros((2, cells), dtype=bool)
    unkept, every = np.full(cells, -1, dtype=np.int32), np.ones(len(trial.hand.links), dtype=bool)
    nobody = np.zeros((0, 1), dtype=np.int8)
    maps = ParticleMaps(lattice.shape, common, unkept, nobody, stale, stale, seen, stale)
    for felt, contacts in zip(trial.felt, trial.contacts.astype(bool), strict=True):
        stance, reach = capsules.stand(tree, body, evidence, 1.0, felt, known)
        step = capsules.MapInput(tree, body, lattice, evidence, reach, contacts, touch, every)
        _, found = matching_geometry.survey(step, stance, unkept >= 0, 1, 0.0)
        beyond = np.maximum(found.height - evidence.shell, 0.0) / np.repeat(found.fall, np.diff(found.begin))
        suspected.append(found.cell)
        rings.append(evidence.hit * np.exp(-0.5 * beyond**2))
        seen[found.cell] = True
        free_space.sweep_free(step, stance, maps)
        steps.append((stance.position, stance.rotation, reach.place, contacts, touch, every))
    swept, near = np.zeros(cells, dtype=np.int64), np.zeros(cells, dtype=bool)
    several = Moment(*(np.stack(each) for each in zip(*steps, strict=True)))
    number, weight, cell, hits = look_back((tree, body, lattice, evidence), several, swept, near)
    np.testing.assert_array_equal(cell, np.concatenate(suspected))
    np.testing.assert_allclose(hits, np.concatenate(rings), rtol=1e-12)
    np.testing.assert_array_equal(np.maximum(swept, -LIMIT), common)
    np.testing.assert_array_equal(near, seen)
    assert number.sum() == len(cell) > 100
    np.testing.assert_array_equal(weight, 0.5 * WEIGHT)
    assert len(weight) == trial.contacts.sum()


def test_without_a_lag_one_belief_is_flushed_which_felt_nothing_new(trial):
    slam = HapticSLAM(trial.hand, 3.0, particles=4, lag=0)
    slam.reset(seed=0)
    assert slam.flush() == [], "nothing was felt"
    beliefs = trial.beliefs(slam)
    assert len(beliefs) == STEPS + 2
    assert beliefs[-1].lagged_contacts is None
    assert beliefs[-1].transition is None
    assert (beliefs[-1].occupancy != beliefs[-2].occupancy).any()


def test_sampled_particles_keep_their_maps(trial):
    assert not HapticSLAM.paper(trial.hand, 3.0, particles=4).in_hindsight
    assert not HapticSLAM(trial.hand, 3.0, particles=4, matching="sample").in_hindsight


def test_a_map_without_touches_is_swept(trial):
    slam = HapticSLAM(trial.hand, 3.0, particles=4)
    slam.reset(seed=0)
    for torque, felt in zip(trial.torque, trial.felt, strict=True):
        slam.step(torque, felt, np.zeros(len(trial.hand.patches), dtype=bool))
    occupancy = slam.flush()[-1].occupancy
    assert occupancy.min() < 0.001
    assert occupancy[occupancy != 0.5].max() < 0.05


def test_a_touch_with_a_single_suspect_and_no_false_alarms_stays_finite():
    log_odds = np.array([-2.0, -1.0])
    one = np.ones(1)
    share(np.ones(1, dtype=np.int64), one, np.zeros(1, dtype=np.int64), 0.4 * one, 1.0, ROUNDS, log_odds)
    assert np.isfinite(log_odds).all()
    assert log_odds[0] > 10.0
    assert log_odds[1] == -1.0


def test_a_switch_is_true_or_false(trial):
    with pytest.raises(ValueError, match="in_hindsight must be True or False, got 'no'"):
        HapticSLAM(trial.hand, in_hindsight="no")


def test_the_map_now_is_that_of_the_flush_and_ends_nothing(trial):
    """Asked for at any step, or never: what it says at the end, and all beliefs, are the same bits."""
    asked, never = (HapticSLAM(trial.hand, 3.0, 4, lag=0) for _ in range(2))
    for slam in (asked, never):
        slam.reset(seed=0)
    growing = []
    for step, each in enumerate(zip(trial.torque, trial.felt, trial.contacts, strict=True)):
        mine, theirs = asked.step(*each), never.step(*each)
        if step % 7 == 0:
            growing.append(asked.map_now())
        assert mine == theirs
    kept = [each.copy() for each in growing]
    at_last = asked.map_now()
    np.testing.assert_array_equal(at_last, never.map_now())
    last = [slam.flush() for slam in (asked, never)]
    for before, after in zip(kept, growing, strict=True):
        np.testing.assert_array_equal(before, after)
    assert (at_last > 0.5).any()
    np.testing.assert_array_equal(last[0][-1].occupancy, at_last)
    np.testing.assert_array_equal(last[1][-1].occupancy, at_last)


def test_a_map_now_needs_a_trial_and_a_map_in_hindsight(two_finger):
    slam = HapticSLAM(two_finger, 3.0, 2)
    with pytest.raises(ValueError, match="not in a trial"):
        slam.map_now()
    slam.reset(seed=0)
    np.testing.assert_array_equal(slam.map_now(), 0.5)
    for told in ({"in_hindsight": False}, {"matching": "sample"}):
        other = HapticSLAM(two_finger, 3.0, 2, **told)
        other.reset(seed=0)
        with pytest.raises(ValueError, match=f"map_now needs .*{next(iter(told))}={next(iter(told.values()))!r}"):
            other.map_now()
