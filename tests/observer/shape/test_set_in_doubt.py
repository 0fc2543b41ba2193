"""Whether what the object may be pulls the pose further than it should."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.special import logit

from haptic_env import hands, shapes
from observer import HapticSLAM, ShapePosterior
from observer.shape.null_model import NullModel
from observer.shape.pose_correction import LASTING, MOST, PoseCorrection
from tests.observer.shape.test_pose_correction import beside

PRIOR = 0.1


@pytest.fixture(scope="module")
def hand():
    return hands.make("two_finger")


def corrections(hand, factor: float, steps: int = 60, seed: int = 0) -> float:
    """The doubt after steps at which three joints become surer, and move `factor` times as far as that lets expect."""
    correction = PoseCorrection(ShapePosterior(hand, none=PRIOR), 50.0, hand)
    correction.reset(0)
    rng, joints = np.random.default_rng(seed), hand.joints
    covariance = np.diag(rng.uniform(0.01, 0.04, joints) ** 2)
    for _ in range(steps):
        lost = np.where(np.arange(joints) < 3, 0.4, 0.0) * np.diag(covariance)
        shift = factor * np.sqrt(lost) * rng.standard_normal(joints)
        after = covariance - np.diag(lost)
        doubt = correction._doubt(np.ones(1), shift[None], after[None], np.zeros(joints), covariance)
    return doubt


@pytest.mark.parametrize("seed", range(5))
def test_a_set_that_pulls_too_far_is_doubted_and_one_that_does_not_is_believed(hand, seed) -> None:
    assert corrections(hand, 1.0, seed=seed) < 0.02
    assert corrections(hand, 5.0, seed=seed) > 0.9


def test_what_tells_nothing_leaves_the_doubt_as_it_was(hand) -> None:
    assert corrections(hand, 1.0, steps=1) < PRIOR < corrections(hand, 6.0, steps=1)
    correction = PoseCorrection(ShapePosterior(hand, none=PRIOR), 50.0, hand)
    correction.reset(0)
    same = np.eye(hand.joints)
    assert correction._doubt(np.ones(1), np.zeros((1, 8)), same[None], np.zeros(8), same) == pytest.approx(PRIOR)


def doubted(hand, solid, contacts: np.ndarray) -> tuple[float, float]:
    """Of a hand that rests and feels contacts (T, P): the doubt in the end, and the log odds of what the pull tells."""
    known = ShapePosterior(hand, {"it": [solid]}, none=PRIOR, press=0.05)
    slam = HapticSLAM(hand, 2.0, particles=1, motion="kinematic", solids=known)
    slam.reset(0, hand.rest_pose)
    for each in contacts:
        belief = slam.step(np.zeros(hand.joints), hand.rest_pose, each)
    return belief.unfit, slam._known._against


def test_touches_that_no_solid_explains_are_doubted_though_they_pull_at_nothing(hand) -> None:
    tip = hand.patches.link == len(hand.links) - 1
    contacts = np.zeros((80, len(hand.patches)))
    contacts[30:, np.flatnonzero(tip)[0]] = 1.0
    size = 0.05
    away = shapes.make("sphere", (size, size, size), hand.grasp_centre + [0.0, 0.0, 0.4])
    doubt, pull = doubted(hand, away, contacts)
    assert doubt > 0.9
    assert pull == pytest.approx(0.0, abs=1e-9)
    contacts[:30] = contacts[30:60]
    doubt, _ = doubted(hand, beside(hand, -0.002), contacts)
    assert doubt < 0.5 * PRIOR


def test_contacts_are_weighed_against_those_of_no_object(hand) -> None:
    correction = PoseCorrection(ShapePosterior(hand, none=PRIOR), 50.0, hand)
    correction.reset(0)
    alone, rng = NullModel(len(hand.links), NullModel.LINK_BEGINS), np.random.default_rng(0)
    for _ in range(20):
        touches = rng.random(len(hand.links)) < 0.2
        alone.update(touches)
        doubt = correction._missing(-3.0, touches)
    against = logit(doubt) - logit(PRIOR)
    assert against == pytest.approx(LASTING * (alone.log_likelihood + 20 * 3.0), abs=1e-9)
    assert abs(against) < MOST


def test_a_belief_tells_of_the_doubt_and_the_name_hears_of_it(hand) -> None:
    cube = {"cube": [shapes.usual("cube", hand)]}
    slam = HapticSLAM(hand, 2.0, particles=1, motion="kinematic", solids=ShapePosterior(hand, cube, none=PRIOR))
    sure = HapticSLAM(hand, 2.0, particles=1, motion="kinematic", solids=ShapePosterior(hand, cube))
    namer = ShapePosterior(hand, cube, none=PRIOR)
    for each in (slam, sure):
        each.reset(0, hand.rest_pose)
    namer.reset(0)
    nothing = np.zeros(hand.joints), hand.rest_pose, np.zeros(50)
    for _ in range(20):
        belief, other = slam.step(*nothing), sure.step(*nothing)
        namer.update(belief)
    assert other.unfit is None
    assert 0.0 < belief.unfit < 1.0
    assert namer.posterior[-1] >= belief.unfit - 1e-12
