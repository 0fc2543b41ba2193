"""Steps, joints and patches that were not measured: NaN is no measurement."""

from __future__ import annotations

import numpy as np
import pytest

from haptic_env import hands, shapes
from haptic_env.shapes.names import NONE
from observer import HapticSLAM, PoseOnly, ShapePosterior
from observer.pose.delta_pose import DeltaPose
from observer.pose.kalman import PoseFilter
from observer.shape.null_model import NullModel
from tests.haptic_env.own_hands import gripper, taxels
from tests.haptic_env.test_own_hand import LATTICE

BEFORE, GAP, AFTER = 15, 12, 6
MOTIONS = ("forward_model", "kinematic", "delta_pose", "raw_angles")


@pytest.fixture(scope="module")
def hand():
    return hands.make("two_finger")


def path(hand, steps, seed=0):
    rng = np.random.default_rng(seed)
    sway = 0.05 * np.sin(0.3 * np.arange(steps))[:, None]
    return hand.rest_pose + sway + np.deg2rad(2.0) * rng.standard_normal((steps, hand.joints))


def made(kind, hand, **keywords):
    if kind == "pose_only":
        return PoseOnly(hand, 2.0)
    return HapticSLAM(hand, 2.0, particles=3, motion=kind, **keywords)


@pytest.mark.parametrize("kind", [*MOTIONS, "pose_only"])
@pytest.mark.parametrize("which", ["all", "one"])
def test_a_gap_is_predicted_through_and_the_belief_grows_vaguer(hand, kind, which):
    slam, felt = made(kind, hand), path(hand, BEFORE + GAP + AFTER)
    slam.reset(0, felt[0])
    missing = np.arange(hand.joints) == 2 if which == "one" else np.ones(hand.joints, dtype=bool)
    known, lost = np.zeros(len(hand.patches)), np.full(len(hand.patches), np.nan)
    spread, evidence = [], []
    for step, angles in enumerate(felt):
        gap = BEFORE <= step < BEFORE + GAP
        told = np.where(missing, np.nan, angles) if gap else angles
        belief = slam.step(np.zeros(hand.joints), told, lost if gap and which == "all" else known)
        assert np.isfinite(belief.joint_angles).all()
        assert np.isfinite(belief.occupancy).all()
        spread.append(belief.joint_std[missing].copy())
        evidence.append(belief.log_evidence)
    in_gap = np.array(spread[BEFORE - 1 : BEFORE + GAP])
    assert (np.diff(in_gap[:4], axis=0) > 0).all()  # in the end joints that are damped are as vague as they can be
    assert (in_gap[4:] > in_gap[0]).all()
    assert (spread[-1] < in_gap[-1]).all()
    assert np.isfinite(evidence).all()
    for belief in slam.flush():
        assert np.isfinite(belief.lagged_joint_angles).all()


@pytest.mark.parametrize("kind", [PoseFilter, DeltaPose])
def test_what_is_not_measured_is_what_is_measured_with_boundless_noise(hand, kind):
    told, blurred = (kind(hand, sigma=0.03, motor_noise=0.1, control_hz=50.0, lag=3) for _ in range(2))
    contacts = np.zeros(len(hand.patches), dtype=bool)
    for step, angles in enumerate(path(hand, 20)):
        missing = np.random.default_rng(step).random(hand.joints) < 0.3
        told.step(np.zeros(hand.joints), np.where(missing, np.nan, angles), contacts)
        blurred.sigma = np.where(missing, 1e4, 0.03)
        blurred.step(np.zeros(hand.joints), angles, contacts)
        np.testing.assert_allclose(told.mean, blurred.mean, atol=1e-6)
        np.testing.assert_allclose(told.covariance, blurred.covariance, atol=1e-6)
    assert not told.set_aside.any()


def test_a_joint_that_is_not_measured_is_no_odd_reading(hand, recwarn):
    slam = made("kinematic", hand)
    slam.reset(0, hand.rest_pose)
    for angles in path(hand, 10):
        slam.step(np.zeros(hand.joints), np.where(np.arange(hand.joints) == 1, np.nan, angles), np.zeros(50))
    assert not slam.set_aside.any()
    assert not len(recwarn)


@pytest.mark.parametrize("in_hindsight", [True, False])
@pytest.mark.parametrize("believed", [{}, {"contact_miss": 0.1}], ids=str)
def test_skin_that_is_not_measured_says_nothing_to_maps_and_names(hand, in_hindsight, believed):
    cube = {"cube": [shapes.usual("cube", hand)], "sphere": [shapes.usual("sphere", hand)]}
    namer = ShapePosterior(hand, cube, none=0.2)
    slam = made("forward_model", hand, in_hindsight=in_hindsight, solids=ShapePosterior(hand, cube), **believed)
    blind = made("forward_model", hand, in_hindsight=in_hindsight, **believed)
    prior = namer.reset(0)
    for each in (slam, blind):
        each.reset(0)
    beliefs = []
    for angles in path(hand, 25):
        blind.step(np.zeros(hand.joints), angles, np.full(50, np.nan))
        beliefs.append(slam.step(np.zeros(hand.joints), angles, np.full(50, np.nan)))
    for belief, other in zip([*beliefs, *slam.flush()], [None] * 25 + blind.flush(), strict=True):
        namer.update(belief)
        assert (belief.occupancy == 0.5).all()
        if other is not None:
            np.testing.assert_allclose(belief.lagged_joint_angles, other.lagged_joint_angles, atol=1e-12)
    assert belief.lagged_unmeasured.all()
    np.testing.assert_allclose(namer.posterior, prior)
    assert namer.labels[-1] == NONE


def test_a_link_that_is_not_measured_leaves_the_others_their_say(hand):
    lost = np.isin(hand.patches.link, [0, 1])
    rng, beliefs = np.random.default_rng(3), []
    touches = rng.random((30, 50)) < 0.1
    for given in (np.where(lost, np.nan, touches), np.where(lost, 0.0, touches)):
        slam = made("forward_model", hand)
        slam.reset(0)
        for angles, contacts in zip(path(hand, 30), given, strict=True):
            slam.step(np.zeros(hand.joints), angles, contacts)
        beliefs.append(slam.flush()[-1])
    told, silent = beliefs
    assert (told.occupancy > 0.5).any()
    assert ((told.occupancy == 0.5) & (silent.occupancy < 0.5)).any()  # what the silent link sweeps


def test_the_null_model_hears_nothing_of_patches_that_are_not_measured():
    told, whole = NullModel(3), NullModel(2)
    rng = np.random.default_rng(0)
    for contacts in rng.random((20, 3)) < 0.3:
        told.update(contacts, unmeasured=np.array([False, True, False]))
        whole.update(contacts[[0, 2]])
    assert told.log_likelihood == pytest.approx(whole.log_likelihood)


@pytest.mark.parametrize("kind", ["forward_model", "pose_only"])
def test_only_nan_is_no_measurement(hand, kind):
    slam = made(kind, hand)
    slam.reset(0)
    good = np.zeros(hand.joints), hand.rest_pose, np.zeros(50)
    for which, value in ((0, np.nan), (1, np.inf), (2, np.inf), (2, 0.5)):
        bad = [each.copy() for each in good]
        bad[which][1] = value
        bad[max(which, 1)][2] = np.nan
        with pytest.raises(ValueError, match="must be"):
            slam.step(*bad)
    with pytest.raises(ValueError, match="joint_angles"):
        slam.reset(0, np.full(hand.joints, np.nan))


DORSAL = "index_distal_1_dorsal"


def ball_at(hand, patch, depth=0.0005, radius=0.02):
    """A ball that touches the resting hand at the middle of a patch, `depth` m deep."""
    data, at = hand.at_rest(), hand.patches.names.index(patch)
    body = hand.link_bodies[hand.patches.link[at]]
    turn = data.xmat[body].reshape(3, 3)
    out = turn @ hand.patches.normal[at]
    centre = data.xpos[body] + turn @ hand.patches.position[at] + (radius - depth) * out
    return shapes.make("sphere", (2 * radius,) * 3, centre)


def named(hand, contacts, there, dead=0.0, **keywords):
    """Posterior of a ball that is `there` and of one far away, of a hand that rests."""
    candidates = {"there": [there], "away": [shapes.make("sphere", (0.04,) * 3, (0.4, 0.4, 0.4))]}
    namer = ShapePosterior(hand, candidates, alike=0.0, stride=1, **keywords)
    slam = PoseOnly(hand, 1.0, patches_dead=dead)
    namer.reset(0)
    slam.reset(0)
    for _ in range(80):
        namer.update(slam.step(np.zeros(hand.joints), hand.rest_pose, contacts))
    return namer.posterior


@pytest.mark.parametrize("keywords", [{}, {"none": 0.2}, {"rotation_jitter": 10.0, "variants": 20}], ids=str)
def test_a_numb_patch_is_no_untouched_one(hand, keywords):
    """Of links whose palmar sides alone are measured, or work, silence tells not whether their backs are touched."""
    touched = [link.name in ("index_middle", "index_distal") for link in hand.links]
    numb = np.array(touched)[hand.patches.link] & (hand.patches.normal[:, 0] > -0.5)
    silent = np.zeros(len(hand.patches))
    there = ball_at(hand, DORSAL)
    against = named(hand, silent, there, **keywords)
    for contacts, dead in (
        (np.where(numb, np.nan, silent), 0.0),
        (silent, [name for name, lost in zip(hand.patches.names, numb, strict=True) if lost]),
    ):
        told = named(hand, contacts, there, dead, **keywords)
        assert against[0] / against[1] < 0.1
        assert told[0] / told[1] > 0.6


def test_skin_between_taxels_is_no_untouched_one(tmp_path):
    """A ball at the back of a finger whose taxels are palmar: nothing feels it, unless the flesh would be inside."""
    everywhere = hands.make(gripper(tmp_path))
    palmar = hands.make(gripper(tmp_path, (LATTICE, ""), more=taxels()))
    assert palmar.patches.numb.all()
    back = "left_distal_1_dorsal"
    for hand, depth, low, high in (
        (everywhere, 0.0005, 0.0, 0.1),
        (palmar, 0.0005, 0.6, 2.0),
        (palmar, 0.004, 0.0, 0.1),
    ):
        there = ball_at(everywhere, back, depth)
        told = named(hand, np.zeros(len(hand.patches)), there)
        assert low <= told[0] / told[1] < high, (len(hand.patches), depth)
