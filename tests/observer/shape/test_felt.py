"""All that was felt, held against hypotheses again: as look by look, whatever is left out or stopped early."""

from __future__ import annotations

import numpy as np
import pytest

from haptic_env import shapes
from observer.kinematics import link_frames, tree_of
from observer.shape.contact_likelihood import PoseSamples, TouchModel, contact_likelihood
from observer.shape.felt import FIRST_ROOM, Felt, Look
from observer.shape.hypotheses import Variants
from observer.shape.skin import skin_of
from observer.shape.subchains import parts_of

TEMPER, LOOKS = 0.3, 400  # more records than there is room for at first
UNKNOWN = {"size_jitter": 0.2, "position_jitter": 0.02, "rotation_jitter": 180.0, "yaw_jitter": 0.0, "far": 0.03}


@pytest.fixture(scope="module")
def told(two_finger):
    """What was felt at random poses, the hypotheses, and the log likelihood of each, look by look."""
    hand, rng = two_finger, np.random.default_rng(0)
    solids = [shapes.make(name, position=hand.grasp_centre) for name in ("cube", "torus(0.3)")]
    variants = Variants(solids, 60, **UNKNOWN)
    hypotheses = variants.place(variants.draw(rng))
    skin, tree, column = skin_of(hand), tree_of(hand), parts_of(hand).column
    felt, expected = Felt(skin, *variants.balls()), np.zeros(variants.hypotheses)
    likelihood = np.empty((len(column), variants.hypotheses, 1))
    model = TouchModel(rng.uniform(0.001, 0.003, len(hand.links)), 0.0, 0.001)
    for _ in range(LOOKS):
        pose = rng.uniform(*hand.joint_limits.T)
        contacts = rng.random(len(hand.patches)) < 0.02
        exponent = np.where(rng.random(len(hand.links)) < 0.2, 0.0, rng.random(len(hand.links)))
        felt.take(Look(*link_frames(tree, pose), contacts, exponent, model))
        samples = PoseSamples(pose[None, :], column)
        contact_likelihood(tree, skin, hypotheses, samples, contacts, exponent, model, likelihood)
        expected += TEMPER * np.log(likelihood).sum(axis=(0, 2))
    return felt, hypotheses, expected


def test_records_tell_what_looks_did(told):
    """Links that no hypothesis comes near are left out, and nothing else is."""
    felt, hypotheses, expected = told
    kept, looked = felt.log_likelihood(hypotheses, TEMPER)
    np.testing.assert_allclose(kept, expected, rtol=1e-9)
    records = looked / len(expected)
    assert FIRST_ROOM < records < LOOKS * len(felt._skin.body)


def test_what_is_refused_early_would_be_refused_in_the_end(told):
    felt, hypotheses, expected = told
    rng = np.random.default_rng(1)
    least = expected + rng.uniform(-5.0, 5.0, len(expected))
    kept, looked = felt.log_likelihood(hypotheses, TEMPER, least)
    good = expected > least
    np.testing.assert_allclose(kept[good], expected[good], rtol=1e-9)
    np.testing.assert_array_equal(kept[~good], -np.inf)
    assert 0 < good.sum() < len(good)
    assert looked < felt.log_likelihood(hypotheses, TEMPER)[1]
