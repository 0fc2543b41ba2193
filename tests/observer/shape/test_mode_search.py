"""Modes of what an object's place may be are found from the touches, and their evidence is right."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from haptic_env import shapes
from observer.kinematics import link_frames, tree_of
from observer.shape.contact_likelihood import TouchModel
from observer.shape.felt import Felt, Look
from observer.shape.hypotheses import RANGES, Variants
from observer.shape.mode_search import ModeSearch
from observer.shape.posterior import ShapePosterior
from observer.shape.skin import skin_of

KNOWN = {"yaw_jitter": 0.0, "far": 0.03}


def _felt(hand, variants: Variants, solid, looks: int) -> Felt:
    """What a hand would feel of a solid, of random poses in which no link lies inside."""
    skin, rng, felt = skin_of(hand), np.random.default_rng(3), None
    surface = hand.patches.surface(0.006)
    felt, tree = Felt(skin, *variants.balls()), tree_of(hand)
    model = TouchModel(np.full(len(hand.links), 0.002), 0.0, 0.001)
    low, high = hand.joint_limits.T
    while felt.looks < looks:
        frames = link_frames(tree, rng.uniform(low, high))
        points = frames[0][surface.link] + np.einsum("nij,nj->ni", frames[1][surface.link], surface.points)
        gap = np.full(len(hand.patches), np.inf)
        np.minimum.at(gap, surface.patch, solid.signed_distance(points))
        if -0.001 < gap.min() < 0.001:
            felt.take(Look(*frames, gap < 0.0015, np.ones(len(hand.links)), model))
    return felt


@pytest.mark.parametrize("name", ["cube", "cuboid(1, 1, 2)"])
def test_modes_explain_what_the_truth_does(two_finger, name):
    told = {"size_jitter": 0.2, "position_jitter": 0.01, "rotation_jitter": 180.0}
    variants = Variants([shapes.make(name, position=two_finger.grasp_centre)], 20, **KNOWN, **told)
    units = np.zeros((1, RANGES + 4))
    units[0, [0, 2, 3]] = 0.4, -0.5, 0.7
    units[0, RANGES:] = Rotation.from_rotvec([0.4, 0.9, -0.3]).as_quat()
    truth = variants.place(units, np.zeros(1, dtype=np.int64))
    solid = shapes.make(
        name, truth.scale[0] * shapes.default_size(name), truth.position[0],
        np.roll(Rotation.from_matrix(truth.rotation[0]).as_quat(), 1),
    )  # fmt: skip
    felt = _felt(two_finger, variants, solid, 40)
    modes = ModeSearch(variants, 0.2).modes(felt, 0, np.empty((0, RANGES + 4)), np.random.default_rng(0))
    assert modes.fit.max() > felt.log_likelihood(truth, 0.2)[0][0] - 1.0


@pytest.mark.parametrize("turned", [30.0, 180.0])
def test_evidence_is_the_mean_of_the_likelihood(two_finger, turned):
    """Of draws about the modes as of very many from the prior."""
    told = {"size_jitter": 0.1, "position_jitter": 0.005, "rotation_jitter": turned}
    solids = [shapes.make("cuboid(1, 1, 2)", position=two_finger.grasp_centre)]
    variants = Variants(solids, 40_000, **KNOWN, **told)
    felt = _felt(two_finger, variants, solids[0], 4)
    rng, temper = np.random.default_rng(0), 0.1
    fit, _ = felt.log_likelihood(variants.place(variants.draw(rng)), temper)
    expected = np.logaddexp.reduce(fit) - np.log(len(fit))
    search = ModeSearch(variants, temper)
    modes = search.modes(felt, 0, np.empty((0, RANGES + 4)), rng)
    found = [search.posterior(felt, 0, modes, rng, 500) for _ in range(4)]
    np.testing.assert_allclose(
        np.logaddexp.reduce([np.logaddexp.reduce(each.log_weight) for each in found]) - np.log(4), expected, atol=0.35
    )


def test_variants_that_all_missed_the_place_are_drawn_anew(two_finger):
    """However few there are, and however wrong."""
    names = ["cube", "sphere"]
    posterior = ShapePosterior(
        two_finger, names, variants=2, size_jitter=0.1, position_jitter=0.01, rotation_jitter=180
    )
    posterior.reset(seed=0)
    solid = shapes.usual("cube", two_finger)
    moves = posterior._rejuvenation
    felt = _felt(two_finger, posterior.variants, solid, 30)
    moves._felt, before = felt, posterior._log_evidence.copy()
    moves._fit, _ = felt.log_likelihood(posterior._solids, posterior.temper)
    posterior._log_evidence += moves._fit
    before = np.logaddexp.reduce(posterior._log_evidence[:2])
    for _ in range(2):
        moves.move(posterior._units, posterior._log_evidence, np.random.default_rng(0))
    after = np.logaddexp.reduce(posterior._log_evidence[:2])
    assert after > before + 3.0
