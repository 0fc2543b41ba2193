"""None of these, where sizes and places are unknown: judged by how well loose surfaces foretell what is felt."""

from __future__ import annotations

import numpy as np
import pytest
import trimesh

from haptic_env import shapes
from observer import HapticSLAM, ShapePosterior, TruePose
from observer.kinematics import tree_of
from observer.shape.contact_likelihood import PoseSamples, TouchModel, contact_likelihood
from observer.shape.loose_fit import SPREADS, WORTH, LooseFit
from observer.shape.null_model import shares
from observer.shape.skin import skin_of
from observer.shape.subchains import parts_of
from observer.surface import Surface
from observer.surface.felt_shape import FeltShape

UNKNOWN = {"size_jitter": 0.1, "yaw_jitter": 45.0, "position_jitter": 0.005}
ANY_WAY = {"size_jitter": 0.1, "rotation_jitter": 180.0, "position_jitter": 0.005}


def _told(namer: ShapePosterior, beliefs) -> ShapePosterior:
    namer.reset(seed=0)
    for belief in beliefs:
        namer.update(belief)
    return namer


@pytest.fixture(scope="module")
def felt(explore):
    """A pyramid, felt by who knows the pose."""
    trial = explore("pyramid", 200, sigma_deg=0.0, motor_noise=0.0)
    return trial.hand, trial.beliefs(TruePose(trial.hand), truth=True)


@pytest.mark.parametrize("samples", [1, 3])
def test_it_is_the_ratio_of_what_was_foretold(two_finger, samples):
    """Bayes' rule, written out."""
    namer = ShapePosterior(two_finger, ["cube", "sphere"], variants=8, samples=samples, **UNKNOWN)
    namer.reset(seed=0)
    rng, temper, parts = np.random.default_rng(0), 0.3, parts_of(two_finger)
    low, high = two_finger.joint_limits.T
    hand = tree_of(two_finger), skin_of(two_finger)
    weights = rng.dirichlet(np.ones(samples), (len(parts.column), 16))
    log_evidence, fit = rng.normal(size=16), LooseFit(any_way=False)
    expected = np.zeros(len(SPREADS))
    for _ in range(20):
        poses = rng.uniform(low, high, (samples, len(low)))[:, parts.joint]
        contacts = (rng.random(len(two_finger.patches)) < 0.1).astype(np.int8)
        exponent = rng.random(len(two_finger.links))
        model = TouchModel(np.full(len(two_finger.links), 0.002), 0.0, 0.001)
        looks = PoseSamples(poses, parts.column), contacts, exponent
        fit.take(hand, namer._solids, (weights, log_evidence), (*looks, model), temper)
        foretold = []
        tolerances = 0.002, *np.hypot(0.002, SPREADS)
        for tolerance in tolerances:
            out = np.empty_like(weights)
            contact_likelihood(*hand, namer._solids, *looks, model._replace(tolerance=np.full(6, tolerance)), out)
            each = np.prod((weights * out).sum(axis=2), axis=0) ** temper
            foretold.append(np.exp(log_evidence) @ each)
        touches = [contacts[two_finger.patches.link == link].sum() for link in range(6)]
        paid = np.log(np.divide(tolerances[1:], 0.002)) * (exponent @ touches)
        expected += np.log(np.divide(foretold[1:], foretold[0])) - temper * paid
    np.testing.assert_allclose(fit.gained, expected, rtol=1e-9)
    candidates = np.array([-3.0, -5.0])
    mean = np.log(np.mean(np.exp(candidates)))
    assert fit.evidence(candidates, temper) == pytest.approx(mean + np.log(np.mean(np.exp(expected))))


@pytest.mark.parametrize("unknown", [UNKNOWN, ANY_WAY], ids=["yaw", "any way"])
def test_none_is_likelier_where_the_object_is_no_candidate(felt, unknown):
    hand, beliefs = felt
    known, new = (
        _told(ShapePosterior(hand, names, none=0.2, variants=60, **unknown), beliefs).posterior[-1]
        for names in (["pyramid", "cube", "sphere"], ["cube", "sphere"])
    )
    assert known < 0.3 < 0.4 < new


def test_candidates_are_weighed_against_each_other_as_without_it(felt):
    hand, beliefs = felt
    with_it, without = (
        _told(ShapePosterior(hand, ["cube", "sphere"], none=none, variants=20, **UNKNOWN), beliefs)
        for none in (0.3, 0.0)
    )
    told = with_it.posterior
    assert told.sum() == pytest.approx(1.0)
    np.testing.assert_allclose(told[:-1] / told[:-1].sum(), without.posterior, rtol=1e-9)
    np.testing.assert_array_equal(with_it.log_likelihood[:-1], without.log_likelihood)
    null = with_it.log_likelihood[-1]
    expected = shares(with_it.log_likelihood[:-1], null, 0.3, WORTH / 0.07)
    np.testing.assert_allclose(told, expected)


def test_before_a_touch_it_is_what_it_was_beforehand(explore):
    trial = explore("sphere", 30, seed=3)
    namer = ShapePosterior(trial.hand, none=0.25, variants=8, **ANY_WAY)
    silent = np.zeros_like(trial.contacts[0])
    slam = HapticSLAM(trial.hand, 3.0, 1)
    namer.update(slam.reset(seed=0))
    for torque, joint_angles in zip(trial.torque, trial.felt, strict=True):
        namer.update(slam.step(torque, joint_angles, silent))
    assert namer.labels[-1] == "none"
    assert namer.posterior[-1] == pytest.approx(0.25, abs=0.02)


def test_solids_that_are_known_have_a_null_model_of_their_own(two_finger):
    exact = ShapePosterior(two_finger, {"cube": [shapes.make("cube")]}, none=0.1)
    assert not isinstance(exact._null, LooseFit)


@pytest.mark.parametrize("unknown", [UNKNOWN, ANY_WAY], ids=["yaw", "any way"])
def test_what_no_candidate_explains_at_all_is_none_of_them(explore, unknown):
    """A cube, among solids that are too small to be it."""
    trial = explore("cube", 300, sigma_deg=0.0, motor_noise=0.0)
    beliefs, place = trial.beliefs(TruePose(trial.hand), truth=True), trial.hand.grasp_centre
    small = {name: [shapes.make(name, 0.4 * shapes.default_size(name), place)] for name in ("cube", "sphere")}
    assert _told(ShapePosterior(trial.hand, small, none=0.2, variants=60, **unknown), beliefs).posterior[-1] > 0.4


@pytest.mark.parametrize("rate", [{"temper": 0.03}, {"stride": 1}], ids=str)
def test_what_looks_say_does_not_depend_on_how_evidence_is_counted(felt, rate):
    hand, beliefs = felt
    usual, other = (
        _told(ShapePosterior(hand, ["cube", "sphere"], none=0.2, variants=60, **UNKNOWN, **each), beliefs).posterior[-1]
        for each in ({}, rate)
    )
    assert usual > 0.4
    assert other > 0.4


def test_what_it_cannot_judge_is_refused(two_finger):
    box = trimesh.creation.box((0.04, 0.04, 0.04))
    felt = FeltShape(Surface(np.array(box.vertices), np.array(box.faces), np.full(len(box.vertices), 0.003)))
    learnt = {"mug": [shapes.Solid("mug", felt, felt.default_size, tuple(two_finger.grasp_centre))]}
    with pytest.raises(
        ValueError, match=r"none with jitter needs candidates that are no learnt surfaces, got none=0\.1"
    ):
        ShapePosterior(two_finger, learnt, none=0.1, **UNKNOWN)
    with pytest.raises(ValueError, match=r"none with jitter needs press=0, got none=0\.1 and press=0\.01"):
        ShapePosterior(two_finger, none=0.1, press=0.01, **UNKNOWN)
    ShapePosterior(two_finger, learnt, **UNKNOWN)
