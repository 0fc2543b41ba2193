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
from observer.maps.hindsight import BATCH, ROUNDS, WEIGHT, Moment, look_back, share
from observer.maps.occupancy import ParticleMaps
from observer.sensing import Sensing
from observer.variants import NAMES, WITHOUT_MAP, make_observer

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


KINDS: dict[str, dict] = {  # of what a flush depends on
    "default": {},
    "without a lag": {"lag": 0},
    "offsets": {"bias_deg": 2.0, "drift_deg": 2.0, "start_std_deg": 2.0},
    "patches that lie": {"contact_miss": 0.1, "contact_false_alarm": 0.002, "patches_stuck": 0.02},
    "no repeats": {"contact_model": ContactModel(repeats=0.0)},
    "raw angles": {"motion": "raw_angles"},
    "smooth": {"motion": "kinematic"},
    "as it grew": {"in_hindsight": False, "lag": 0},
    "sampled": {"matching": "sample", "lag": 0},
}


def _asked(trial, every, **keywords):
    """All beliefs of a trial, the maps that were asked for at every so many steps (0: none), and the last one."""
    slam = HapticSLAM(trial.hand, 3.0, 4, **keywords)
    beliefs, maps, kept = [slam.reset(seed=0)], [slam.map_now()], []
    for step, each in enumerate(zip(trial.torque, trial.felt, trial.contacts, strict=True), 1):
        beliefs.append(slam.step(*each))
        if every and step % every == 0:
            maps.append(slam.map_now())
            kept.append(maps[-1].copy())
    last = slam.map_now()
    flushed = slam.flush()
    for before, after in zip(kept, maps[1:], strict=True):
        np.testing.assert_array_equal(before, after)
    return beliefs + flushed, maps, last


@pytest.mark.parametrize("kind", KINDS)
def test_the_map_now_is_that_of_the_flush_and_ends_nothing(trial, kind):
    """Asked for at any step, or never: what it says at the end, and all beliefs, are the same bits."""
    never, (empty,), last = _asked(trial, 0, **KINDS[kind])
    np.testing.assert_array_equal(empty, 0.5)
    assert (last != 0.5).any()
    np.testing.assert_array_equal(never[-1].occupancy, last)
    beliefs, growing, again = _asked(trial, 7, **KINDS[kind])
    for one, other in zip(beliefs, never, strict=True):
        assert one == other
        assert len(one.snapshot.touches) == len(other.snapshot.touches)
    np.testing.assert_array_equal(again, last)
    assert not np.array_equal(growing[-1], last)
    assert last.flags.writeable, "it is the caller's own"


@pytest.mark.parametrize(
    "told", [{"lag": 0}, {"lag": 3}, {"lag": STEPS, "contact_false_alarm": 0.3, "contact_miss": 0.3}], ids=str
)
def test_the_map_now_is_of_the_steps_so_far(trial, told):
    """As if the trial had ended there, however many steps were gathered before or wait."""
    asked = HapticSLAM(trial.hand, 3.0, 4, **told)
    asked.reset(seed=0)
    steps = list(zip(trial.torque, trial.felt, trial.contacts, strict=True))
    for step, each in enumerate(steps, 1):
        asked.step(*each)
        if step in (1, BATCH, BATCH + 3, 2 * BATCH + 1):
            ended = HapticSLAM(trial.hand, 3.0, 4, **told)
            ended.reset(seed=0)
            for one in steps[:step]:
                ended.step(*one)
            np.testing.assert_array_equal(asked.map_now(), ended.flush()[-1].occupancy)


def test_what_waits_to_be_gathered_is_bounded(trial):
    """However long nobody asks: memory, and how long the first one who asks has to wait."""
    hindsight = Sensing(trial.hand, HapticSLAM(trial.hand).grid, ContactModel(), in_hindsight=True).hindsight()
    links, patches, bodies = len(trial.hand.links), len(trial.hand.patches), len(tree_of(trial.hand).parent)
    flags = np.ones(links, dtype=bool), np.zeros(patches, dtype=bool)
    far, turned = np.full((bodies, 3), 1e3), np.tile(np.eye(3), (bodies, 1, 1))
    for _ in range(4 * BATCH - 1):
        hindsight.note(Moment(far.copy(), turned, np.full(links, 1e-3), flags[1].copy(), np.ones(patches), flags[0]))
        assert len(hindsight._fresh) < BATCH


@pytest.mark.parametrize("name", [name for name in NAMES if name not in WITHOUT_MAP])
def test_any_observer_with_a_map_has_it_now(trial, name):
    slam = make_observer(name, trial.hand, 3.0, 4)
    slam.reset(seed=0)
    for each in zip(trial.torque, trial.felt, trial.contacts, strict=True):
        belief = slam.step(*each)
    now = slam.map_now()
    assert now.shape == slam.grid.shape
    assert (now != 0.5).any()
    if slam.in_hindsight:
        belief = slam.flush()[-1]
    np.testing.assert_array_equal(now, belief.occupancy)


def test_a_map_now_needs_a_trial_and_a_map(trial):
    for told in ({}, {"in_hindsight": False}, {"matching": "sample"}):
        slam = HapticSLAM(trial.hand, 3.0, 2, **told)
        with pytest.raises(ValueError, match="not in a trial"):
            slam.map_now()
        slam.reset(seed=0)
        np.testing.assert_array_equal(slam.map_now(), 0.5)
        slam.flush()
        with pytest.raises(ValueError, match="not in a trial"):
            slam.map_now()
    for name in WITHOUT_MAP:
        assert not hasattr(make_observer(name, trial.hand, 3.0, 1), "map_now")
