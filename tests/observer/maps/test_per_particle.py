"""The compiled kernels against the plain reference, at random and at extreme inputs."""

from __future__ import annotations

import numpy as np
import pytest

from haptic_env import hands
from haptic_env.grid import Grid
from haptic_lab.benchmarks import reference
from haptic_lab.benchmarks.reference import full_weight
from observer import threads
from observer.kinematics import body_frames, tree_of
from observer.maps import capsules, per_particle
from observer.maps.contact_model import QUANTUM, ContactModel, reach_of
from observer.maps.occupancy import Maps
from observer.maps.scan_matching import Candidates, Matched
from tests.observer.hands import many_patches, random_tree

HANDS = {**hands.HANDS, "many_patches": many_patches, "tree": lambda: random_tree(0)}
MODEL = ContactModel(prior=0.2, hit=0.3, false_alarm=0.07, free=0.31, shell=0.8, fall=0.4, temper=0.7)
PROBABILITY = MODEL.evidence(0.004).probability


@pytest.fixture(scope="module", params=HANDS)
def hand(request: pytest.FixtureRequest):
    """Every registered hand, one of a thousand patches, and a random tree."""
    return HANDS[request.param]()


def _grid(hand) -> Grid:
    """Small enough that much of the hand lies outside it."""
    return Grid.around(hand.grasp_centre + 0.01, (0.08, 0.07, 0.09), 0.004)


class Inputs:
    """Random arguments of the kernels."""

    def __init__(self, hand, grid, seed=0, particles=3, candidates=4, touches=0.15, maps=None):
        rng = np.random.default_rng(seed)
        joints, patches = hand.joints, len(hand.patches)
        self.hand, self.grid = hand, grid
        self.contacts = rng.random(patches) < touches
        self.touch = rng.uniform(0, 1, patches)
        self.watched = rng.random(len(hand.links)) < 0.7
        self.watched[0] = True
        self.place = rng.uniform(0, 0.006, len(hand.links))
        self.place[-1] = 0.05  # more than any radius
        self.centres = rng.uniform(*hand.joint_limits.T, (particles, joints))
        self.spread = np.linalg.cholesky(0.01 * np.eye(joints) + 0.002)
        self.normals = rng.standard_normal((particles, candidates, joints))
        self.uniform = rng.random(particles)
        self.maps = rng.integers(-127, 128, (particles, *grid.shape)).astype(np.int8) if maps is None else maps

    def advance(self, model=MODEL, number=1):
        """What the kernel makes of it, in the order of `reference.advance`."""
        maps = Maps(len(self.maps), self.grid, PROBABILITY, dense=True)
        maps.own[:] = self.maps.reshape(len(self.maps), -1)
        body, tables = capsules.body_of(self.hand.patches, self.grid.resolution), model.evidence(self.grid.resolution)
        world = (tree_of(self.hand), body, capsules.lattice_of(self.grid), tables, reach_of(body, tables, self.place))
        poses = np.full(self.centres.shape, np.nan)
        matched = Matched(poses, np.full(len(poses), np.nan), np.zeros(len(poses), dtype=bool))
        threads.run(
            per_particle.advance,
            len(poses),
            number,
            capsules.MapInput(*world, self.contacts, self.touch, self.watched),
            Candidates(self.normals.shape[1], self.centres, self.spread, self.normals),
            self.uniform,
            maps.arrays,
            matched,
        )
        written = maps.own.reshape(self.maps.shape), maps.stale.reshape(self.grid.shape)
        return matched.log_likelihood, matched.moved, poses, *written

    def expected(self, model=MODEL):
        """What the reference makes of it."""
        felt = (self.contacts, self.touch, self.watched)
        rest = (self.place, self.centres, self.spread, self.normals, self.uniform, self.maps)
        return reference.advance(self.hand, self.grid, model, *felt, *rest)

    def agree(self, model=MODEL):
        """Check the one against the other; returns the new maps."""
        got, expected = self.advance(model), self.expected(model)
        np.testing.assert_allclose(got[0], expected[0], rtol=1e-9, atol=1e-9)
        np.testing.assert_array_equal(got[1], expected[1])
        np.testing.assert_allclose(got[2], expected[2], atol=1e-12)
        np.testing.assert_array_equal(got[3], expected[3])
        np.testing.assert_array_equal(got[4], expected[4])
        return got[3]


@pytest.mark.parametrize("seed", range(2))
def test_random_steps_agree(hand, seed):
    Inputs(hand, _grid(hand), seed).agree()


@pytest.mark.parametrize("seed", range(3))
def test_random_steps_of_the_two_finger_hand_agree(two_finger, seed):
    inputs = Inputs(two_finger, Grid.around(np.zeros(3), np.full(3, 0.128), 0.004), 100 + seed)
    inputs.centres = np.deg2rad([0, 15, 40, 30] * 2) + 0.1 * inputs.centres
    new = inputs.agree()
    assert (new != inputs.maps).any()


def test_an_empty_map_agrees(hand):
    grid = _grid(hand)
    Inputs(hand, grid, maps=np.zeros((3, *grid.shape), dtype=np.int8)).agree()


@pytest.mark.parametrize("entry", [-127, 127])
def test_maps_saturate(two_finger, entry):
    grid = _grid(two_finger)
    maps = np.full((2, *grid.shape), entry, dtype=np.int8)
    strong = ContactModel(hit=0.9, false_alarm=0.01, free=6.0)
    for seed in range(5):
        inputs = Inputs(two_finger, grid, seed, particles=2, touches=0.5, maps=maps)
        inputs.touch[:] = 3.0
        maps = inputs.agree(strong)
    assert maps.min() == -127
    assert maps.max() == 127


def test_a_single_particle_and_candidate_agree(two_finger):
    Inputs(two_finger, _grid(two_finger), particles=1, candidates=1).agree()


@pytest.mark.parametrize("touches", [0.0, 1.0])
def test_no_touch_and_touch_everywhere_agree(two_finger, touches):
    Inputs(two_finger, _grid(two_finger), touches=touches).agree()


def test_nothing_watched_is_no_evidence(two_finger):
    inputs = Inputs(two_finger, _grid(two_finger))
    inputs.watched[:] = False
    assert (inputs.advance()[0] == 0.0).all()
    assert not inputs.advance()[1].any()


def test_a_hand_beside_the_grid_leaves_the_map_alone(two_finger):
    grid = Grid.around((1.0, 1.0, 1.0), (0.05, 0.05, 0.05), 0.004)
    inputs = Inputs(two_finger, grid)
    _, _, _, maps, known = inputs.advance()
    np.testing.assert_array_equal(maps, inputs.maps)
    assert not known.any()
    inputs.agree()


def test_a_thousand_patches_are_a_thousand():
    assert len(many_patches().patches) >= 1000


def test_the_likelihood_agrees(hand):
    grid = _grid(hand)
    tree, body = tree_of(hand), capsules.body_of(hand.patches, grid.resolution)
    lattice, evidence = capsules.lattice_of(grid), MODEL.evidence(grid.resolution)
    position, rotation = np.empty((len(tree.parent), 3)), np.empty((len(tree.parent), 3, 3))
    for seed in range(10):
        inputs = Inputs(hand, grid, seed, particles=1)
        q = inputs.centres[0]
        body_frames(tree, q, position, rotation)
        reach = reach_of(body, evidence, inputs.place)
        felt = capsules.MapInput(tree, body, lattice, evidence, reach, inputs.contacts, inputs.touch, inputs.watched)
        frames = capsules.BodyFrames(position, rotation)
        got = per_particle._log_likelihood(felt, frames, inputs.maps[0].ravel())
        expected = reference.log_likelihood(hand, grid, MODEL, q, inputs.contacts, inputs.watched, inputs.maps[0])
        assert got == pytest.approx(expected, rel=1e-9, abs=1e-9)


def test_one_touch_is_bayes_rule(two_finger):
    """From an empty map, one touch with full weight: the marginals of the noisy-OR's posterior, by enumeration."""
    grid = Grid.around(np.zeros(3), np.full(3, 0.128), 0.004)
    model = full_weight(hit=0.6, false_alarm=0.1, free=0.0)
    inputs = Inputs(two_finger, grid, particles=1, candidates=1, maps=np.zeros((1, *grid.shape), dtype=np.int8))
    inputs.centres[:], inputs.normals[:], inputs.place[:] = np.deg2rad([0, 15, 40, 30] * 2), 0.0, 0.0
    inputs.touch[:] = 1.0
    tried = 0
    for patch in range(len(two_finger.patches)):
        inputs.contacts[:] = np.arange(len(two_finger.patches)) == patch
        new = inputs.advance(model)[3][0]
        suspects = np.argwhere(new != 0)
        if not 1 <= len(suspects) <= 12:
            continue
        worlds = np.array(np.unravel_index(np.arange(2 ** len(suspects)), (2,) * len(suspects)))
        rings = 1 - (1 - model.false_alarm) * (1 - model.hit) ** worlds.sum(axis=0)
        marginal = (worlds * rings).sum(axis=1) / rings.sum()
        written = reference.probability(model, [new[tuple(cell)] for cell in suspects])
        np.testing.assert_allclose(written, marginal, atol=0.25 * QUANTUM)
        tried += 1
    assert tried >= 5


def test_points_of_the_skin_are_sorted_by_patch(hand):
    body = capsules.body_of(hand.patches, 0.004)
    skin = hand.patches.surface(0.008)
    assert body.begin[0] == 0
    assert body.begin[-1] == len(body.points) == len(skin.points)
    np.testing.assert_array_equal(np.diff(body.begin), np.bincount(skin.patch, minlength=len(hand.patches)))
    assert (np.diff(body.begin) > 0).all(), "a patch without a point could never be explained"
    np.testing.assert_allclose(np.linalg.norm(body.points - body.core, axis=1), 0.004)
    np.testing.assert_array_equal(body.patch_link, hand.patches.link)


def test_the_table_of_probabilities():
    entries = np.arange(-128, 128)
    np.testing.assert_allclose(PROBABILITY[entries + 128], reference.probability(MODEL, entries))
    assert PROBABILITY[128] == pytest.approx(MODEL.prior)


def test_any_number_of_threads_gives_the_same_bits(two_finger):
    inputs = Inputs(two_finger, _grid(two_finger), particles=33)
    results = [[np.asarray(each).tobytes() for each in inputs.advance(number=number)] for number in (1, 2, 40)]
    assert results[0] == results[1] == results[2]
