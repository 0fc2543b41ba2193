"""The kernels of the shared geometry against the plain reference: exactly at the mean pose, nearly so beside it."""

from __future__ import annotations

import dataclasses

import numpy as np
import pytest

from haptic_env import hands
from haptic_env.grid import Grid
from haptic_lab.benchmarks import reference
from observer import threads
from observer.kinematics import tree_of
from observer.maps import capsules, cells, free_space, matching_geometry, scan_matching
from observer.maps.contact_model import ContactModel, reach_of
from observer.maps.matching_geometry import TouchCauses
from observer.maps.occupancy import Maps
from tests.observer.hands import many_patches, random_tree

HANDS = {**hands.HANDS, "many_patches": many_patches, "tree": lambda: random_tree(0)}
MODEL = ContactModel(prior=0.2, hit=0.3, false_alarm=0.07, free=0.31, shell=0.8, fall=0.4, temper=0.7)
FAR = 1000  # voxels: every point of a silent patch is scored


@pytest.fixture(scope="module", params=HANDS)
def hand(request: pytest.FixtureRequest):
    """Every registered hand, one of a thousand patches, and a random tree."""
    return HANDS[request.param]()


def _grid(hand, resolution=0.004) -> Grid:
    """Small enough that much of the hand lies outside it."""
    return Grid.around(hand.grasp_centre + 0.01, (0.08, 0.07, 0.09), resolution)


class Step:
    """Random arguments of one step, at a mean pose in the middle of the joints' ranges."""

    def __init__(self, hand, grid, seed=0, particles=3, candidates=4, touches=0.15, model=MODEL, empty=False):
        rng = np.random.default_rng(seed)
        joints, patches, cells = hand.joints, len(hand.patches), int(np.prod(grid.shape))
        self.hand, self.grid, self.model, self.rng = hand, grid, model, rng
        self.tree, self.body = tree_of(hand), capsules.body_of(hand.patches, grid.resolution)
        self.lattice, self.evidence = capsules.lattice_of(grid), model.evidence(grid.resolution)
        self.contacts, self.touch = rng.random(patches) < touches, rng.uniform(0, 1, patches)
        self.watched = rng.random(len(hand.links)) < 0.7
        self.watched[0] = True
        self.place = rng.uniform(0, 0.006, len(hand.links))
        self.pose = rng.uniform(*hand.joint_limits.T)
        self.reach = reach_of(self.body, self.evidence, self.place)
        self.candidates, self.deviations = candidates, np.zeros((particles, joints))
        self.spread = np.linalg.cholesky(1e-12 * np.eye(joints))
        self.normals = rng.standard_normal((particles, candidates // 2, joints))
        self.maps = Maps(particles, grid, self.evidence.probability)
        if not empty:
            self.maps.common[:] = -rng.integers(0, 128, cells)
            self.maps.make_room(np.flatnonzero(rng.random(cells) < 0.3))
            self.maps.own[:, : len(self.maps.cells)] = rng.integers(-127, 128, (particles, len(self.maps.cells)))
            self.maps.touched[self.maps.cells] = self.maps.solid[self.maps.cells] = True

    @property
    def felt(self):
        """What the step has to say."""
        hand = (self.tree, self.body, self.lattice, self.evidence, self.reach)
        return capsules.MapInput(*hand, self.contacts, self.touch, self.watched)

    @property
    def stance(self):
        """At the mean pose."""
        known = np.zeros((self.hand.joints, self.hand.joints))
        return capsules.stand(self.tree, self.body, self.evidence, 1.0, self.pose, known)[0]

    def log_odds(self, n):
        """(X, Y, Z) the map of particle n, as the kernels read it."""
        entry = self.maps.common.astype(int) + self.maps.own[n, self.maps.slot]
        return entry.reshape(self.grid.shape)

    def match(self, number=1):
        """What `match_and_touch` makes of it: log mean likelihoods, moved, poses from the mean."""
        skin, causes = self.survey()
        return self.matched(skin, causes, number)

    def survey(self, reach=FAR):
        """What matching asks of the maps."""
        return matching_geometry.survey(self.felt, self.stance, self.maps.solid, reach, 0.002)

    def matched(self, skin, causes, number=1):
        """As `match`, for what is asked."""
        query = scan_matching.MapQuery(skin, causes, self.maps.make_room(causes.cell))
        about = scan_matching.Candidates(self.candidates, self.deviations, self.spread, self.normals)
        poses = np.empty_like(self.deviations)
        matched = scan_matching.Matched(poses, np.full(len(poses), np.nan), np.zeros(len(poses), dtype=bool))
        given = (query, self.evidence, about, self.maps.arrays, matched)
        threads.run(scan_matching.match_and_touch, len(poses), number, *given)
        return matched.log_likelihood, matched.moved, poses

    def sweep(self, carve=True):
        """Let `sweep_free` write."""
        felt = self.felt if carve else self.felt._replace(reach=self.reach.of(np.zeros_like(self.watched)))
        free_space.sweep_free(felt, self.stance, self.maps.arrays)

    def candidates_of(self, n):
        """(K, J) poses that particle n considers."""
        away = self.normals[n] @ self.spread.T
        pairs = np.stack([away, -away], axis=1).reshape(-1, self.hand.joints)
        every = np.concatenate([pairs, np.zeros((self.candidates - len(pairs), self.hand.joints))])
        return self.pose + self.deviations[n] + every

    def likelihoods(self, n):
        """(K,) of the candidates of particle n, by the reference."""
        felt = (self.contacts, self.watched, self.log_odds(n))
        logs = [reference.log_likelihood(self.hand, self.grid, self.model, q, *felt) for q in self.candidates_of(n)]
        return np.exp(self.model.temper * np.array(logs))


@pytest.mark.parametrize(("seed", "candidates"), list(enumerate([1, 4, 5])))
def test_scores_at_the_mean_pose_agree(hand, seed, candidates):
    step = Step(hand, _grid(hand), seed, candidates=candidates)
    expected = [np.log(step.likelihoods(n).mean()) for n in range(3)]
    log_mean, moved, poses = step.match()
    np.testing.assert_allclose(log_mean, expected, rtol=1e-6, atol=1e-6)
    assert not moved.any()
    np.testing.assert_allclose(poses, 0.0, atol=1e-5)


def test_scores_beside_the_mean_pose_nearly_agree(two_finger):
    """In a straight line: candidates a degree or two away, where most points fall into the voxels of the reference."""
    errors, told_apart = [], 0
    for seed in range(8):
        step = Step(two_finger, _grid(two_finger), seed, candidates=8)
        step.deviations[:] = 0.02 * step.rng.standard_normal(step.deviations.shape)
        step.spread = 0.02 * np.eye(two_finger.joints)
        likelihoods = [step.likelihoods(n) for n in range(3)]
        candidates = [step.candidates_of(n) - step.pose for n in range(3)]
        _, moved, poses = step.match()
        expected = [each @ those / each.sum() for each, those in zip(likelihoods, candidates, strict=True)]
        errors.append(np.abs(poses - expected).max(axis=1))
        told_apart += np.count_nonzero(moved)
    assert np.median(errors) < 2e-3, "radians, of some 0.02, in a map of noise"
    assert told_apart > 4


@pytest.mark.parametrize("seed", range(2))
@pytest.mark.parametrize("alone", ["touches", "sweeps"])
def test_what_is_written_at_the_mean_pose_agrees(hand, seed, alone):
    """Apart: of a cell that one link touches and another sweeps the reference takes them in turn, link by link."""
    grid = Grid.around(hand.grasp_centre, hand.workspace, 0.005)
    model = dataclasses.replace(MODEL, free=0.0 if alone == "touches" else MODEL.free)
    step = Step(hand, grid, seed, particles=2, touches=0.3 if alone == "touches" else 0.0, model=model, empty=True)
    step.pose = hand.rest_pose + 0.1 * step.rng.standard_normal(hand.joints)
    how = (step.place, step.contacts, step.touch, step.log_odds(0))
    expected = reference.write(hand, grid, model, step.pose, *how)[0].astype(int)
    step.match()
    step.sweep()
    for n in range(2):
        apart = np.abs(step.log_odds(n) - expected)
        if alone == "sweeps":
            np.testing.assert_array_equal(apart, 0)
        else:
            assert apart.max() <= 2, "the fading of a cell's part in a touch is from a table"
            assert (apart[expected > 0] == 0).mean() > 0.9
    assert (expected != 0).any()


def test_touches_beside_the_mean_pose_are_nearly_those_of_the_reference(two_finger):
    """Patch by patch alone; the kernel lets no cell change its patch as the joints turn."""
    grid, apart, from_mean = Grid.around(np.zeros(3), np.full(3, 0.128), 0.004), 0, 0
    for patch in range(0, len(two_finger.patches), 3):
        step = Step(two_finger, grid, patch, candidates=1, model=dataclasses.replace(MODEL, free=0.0), empty=True)
        step.pose, step.touch[:] = np.deg2rad([0, 15, 40, 30] * 2), 9.0
        step.contacts[:] = np.arange(len(two_finger.patches)) == patch
        step.deviations[:] = 0.003 * step.rng.standard_normal(step.deviations.shape)
        where = (two_finger, grid, step.model)
        how = (step.place, step.contacts, step.touch, step.log_odds(0))
        mean = reference.write(*where, step.pose, *how)[0].clip(0).astype(int)
        step.match()
        for n in range(3):
            expected = reference.write(*where, step.pose + step.deviations[n], *how)[0].clip(0).astype(int)
            apart += np.abs(step.log_odds(n).clip(0) - expected).sum()
            from_mean += np.abs(mean - expected).sum()
    assert apart < 0.7 * from_mean, "a particle's own pose counts"


def test_silent_points_are_left_out_only_where_nothing_is_known_to_be_occupied(two_finger):
    """With a reach of one voxel and candidates closer than that, the score is the same as with all points."""
    step = Step(two_finger, _grid(two_finger), seed=1)
    step.maps.solid[:] = False
    for n in range(3):
        step.maps.solid |= (step.log_odds(n) >= step.evidence.solid).ravel()
    (few, _), (every, _) = step.survey(1), step.survey(FAR)
    assert few.place.shape[1] < every.place.shape[1]
    nothing = matching_geometry.survey(step.felt, step.stance, np.zeros_like(step.maps.solid), 1, 0.002)[0]
    assert nothing.felt.all()
    whole = step.match()[0]
    none = TouchCauses(
        np.zeros(1, dtype=np.int64), *np.zeros((2, 0)), np.zeros(0, dtype=np.int64), np.zeros(0), np.zeros((0, 0)),
        np.zeros(0, dtype=np.int64),
    )  # fmt: skip
    part = Step(two_finger, _grid(two_finger), seed=1).matched(few, none)[0]
    np.testing.assert_allclose(part, whole, rtol=1e-9)


@pytest.mark.parametrize("entry", [-127, 127])
def test_maps_saturate(two_finger, entry):
    strong = ContactModel(hit=0.9, false_alarm=0.01, free=6.0)
    step = Step(two_finger, _grid(two_finger), touches=0.5, model=strong, empty=True)
    step.maps.make_room(np.arange(step.maps.common.size))
    step.maps.own[:, :-1] = entry
    step.touch[:] = 3.0
    for _ in range(5):
        step.match()
        step.sweep()
    assert step.log_odds(0).min() == -127
    assert step.log_odds(0).max() == 127


def test_a_hand_beside_the_grid_leaves_the_map_alone(two_finger):
    step = Step(two_finger, Grid.around((1.0, 1.0, 1.0), (0.05, 0.05, 0.05), 0.004))
    before = [step.log_odds(n) for n in range(3)]
    step.match()
    step.sweep()
    for n in range(3):
        np.testing.assert_array_equal(step.log_odds(n), before[n])
    assert not step.maps.stale[step.maps.slot < 0].any()


def test_what_is_near_is_seen(two_finger):
    """Against the signed distance of the capsules, at a pose for which a part of the hand lies outside the grid."""
    step = Step(two_finger, _grid(two_finger), empty=True)
    step.pose = np.deg2rad([0, 15, 40, 30] * 2)
    step.sweep(carve=False)
    near = reference.height(two_finger, step.grid, step.pose) < step.evidence.near
    np.testing.assert_array_equal(step.maps.seen.reshape(step.grid.shape), near)
    assert not step.maps.common.any()


def test_mean_probability_is_the_weighted_mean(two_finger):
    step = Step(two_finger, _grid(two_finger), particles=7)
    weights, some = step.rng.dirichlet(np.ones(7)), step.rng.permutation(step.maps.common.size)[:1100]
    maps = np.array([step.log_odds(n).ravel() for n in range(7)])
    expected = (weights @ reference.probability(MODEL, maps))[some]
    where = step.maps.make_room(some)
    got = cells.mean_probability(where, step.maps.own, weights, step.evidence.probability)
    np.testing.assert_allclose(got, expected, rtol=1e-12)
    assert cells.mean_probability(where[:0], step.maps.own, weights, step.evidence.probability).shape == (0,)


@pytest.mark.parametrize("size", [1, 7, 8, 125, 1000])
def test_all_flags_that_are_set_are_found(size):
    rng = np.random.default_rng(size)
    for share in (0.0, 0.02, 1.0):
        flags = rng.random(size) < share
        flags[-1] = True
        np.testing.assert_array_equal(cells.flagged(flags), np.flatnonzero(flags))


def test_any_number_of_threads_gives_the_same_bits(two_finger):
    results = []
    for number in (1, 2, 40):
        step = Step(two_finger, _grid(two_finger), particles=33, touches=0.3)
        outputs = (*step.match(number), step.maps.own, step.maps.touched, step.maps.solid)
        results.append([np.asarray(each).tobytes() for each in outputs])
    assert results[0] == results[1] == results[2]
