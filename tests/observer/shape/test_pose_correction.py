"""What contacts say of the pose where the object is known: against sampling, and what it leaves alone."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.special import ndtr

from haptic_env import shapes
from observer import HapticSLAM, ShapePosterior
from observer.kinematics import body_frames, tree_of
from observer.shape.contact_likelihood import TouchModel
from observer.shape.distance_fields import solids_of
from observer.shape.skin import skin_of
from observer.shape.surface_conditioning import nearest, take_in
from tests.observer.hands import random_tree

TOLERANCE, SURPRISE = 0.0015, 0.01
SINKING = 0.05  # m: as deep as hands in recordings may be
SPREAD = 0.02  # rad: SD of each joint


def skin_in_world(tree, skin, angles: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Points (M, 3) m of the skin at `angles` (J,), and the link (M,) of each."""
    position, rotation = np.empty((len(tree.parent), 3)), np.empty((len(tree.parent), 3, 3))
    body_frames(tree, angles, position, rotation)
    link = np.repeat(np.arange(len(skin.body)), np.diff(skin.begin[skin.first_bead]))
    body = skin.body[link]
    return position[body] + np.einsum("mij,mj->mi", rotation[body], skin.points), link


def tip_gap(tree, skin, solid, angles: np.ndarray) -> float:
    """m: how far the skin of the last link is from `solid`."""
    points, link = skin_in_world(tree, skin, angles)
    return float(solid.signed_distance(points[link == link[-1]]).min())


def beside(hand, gap: float):
    """A sphere that the last link of the hand at rest is `gap` m away from."""
    points, link = skin_in_world(tree_of(hand), skin_of(hand), hand.rest_pose)
    of_tip = points[link == len(hand.links) - 1]
    out = of_tip.mean(axis=0) - points.mean(axis=0)
    out /= np.linalg.norm(out)
    size = 0.05
    reach = (of_tip @ out).max()
    centre = of_tip[np.argmax(of_tip @ out)] + (0.5 * size + gap) * out
    assert (points[link != len(hand.links) - 1] @ out).max() < reach
    return shapes.make("sphere", (size, size, size), centre)


@pytest.mark.parametrize("gap", [-0.004, 0.001, 0.006])
def test_the_nearest_spot_and_the_way_out_of_a_solid(two_finger, gap: float) -> None:
    hand, solid = two_finger, beside(two_finger, gap)
    tree, skin, solids = tree_of(hand), skin_of(hand), solids_of([solid], far=0.03)
    position, rotation = np.empty((len(tree.parent), 3)), np.empty((len(tree.parent), 3, 3))
    body_frames(tree, hand.rest_pose, position, rotation)
    spot, normal, tip = np.empty(3), np.empty(3), len(hand.links) - 1
    body = skin.body[tip]
    found = nearest(solids, 0, skin, tip, (position[body], rotation[body]), spot, normal)
    assert found == pytest.approx(tip_gap(tree, skin, solid, hand.rest_pose), abs=2e-4)
    away = spot - solid.position
    np.testing.assert_allclose(normal, away / np.linalg.norm(away), atol=0.02)


def likelihood(gap: np.ndarray, touching: bool, press: float) -> np.ndarray:
    """Of a link's `gap` m: it lies between two depths, ± `TOLERANCE`."""
    low, high = (-press, 0.0) if touching else (0.0, np.inf)
    most = ndtr(0.5 * (high - low) / TOLERANCE) - ndtr(0.5 * (low - high) / TOLERANCE)
    return SURPRISE + (1.0 - SURPRISE) * (ndtr((gap - low) / TOLERANCE) - ndtr((gap - high) / TOLERANCE)) / most


@pytest.mark.parametrize(
    ("gap", "touching", "press"),
    [(0.001, True, SINKING), (0.003, True, SINKING), (0.002, True, 0.001), (-0.001, False, 0.0), (0.0, False, 0.0)],
)
def test_contacts_give_the_moments_of_samples(two_finger, gap: float, touching: bool, press: float) -> None:
    hand, solid = two_finger, beside(two_finger, gap)
    touches = np.zeros(len(hand.links), dtype=bool)
    touches[-1] = touching
    mean, covariance = hand.rest_pose.astype(float), SPREAD**2 * np.eye(hand.joints)
    samples = np.random.default_rng(0).multivariate_normal(mean, covariance, 4000)
    of_hand = tree_of(hand), skin_of(hand), solids_of([solid], far=0.03)
    told = take_in(*of_hand, 0, touches, (mean, covariance), (0, -1), TouchModel(TOLERANCE, press, SURPRISE))
    assert np.abs(mean - hand.rest_pose).max() > 0.1 * SPREAD
    weights = likelihood(np.array([tip_gap(*of_hand[:2], solid, each) for each in samples]), touching, press)
    assert told == pytest.approx(np.log(weights.mean()), abs=0.08)
    weights /= weights.sum()
    expected = weights @ samples
    np.testing.assert_allclose(mean, expected, atol=0.08 * SPREAD)
    apart = samples - expected
    np.testing.assert_allclose(covariance, (weights[:, None] * apart).T @ apart, atol=0.08 * SPREAD**2)


def test_where_contacts_must_not_leave_the_surface_a_gap_is_measured(two_finger) -> None:
    hand, solid = two_finger, beside(two_finger, 0.002)
    touches = np.zeros(len(hand.links), dtype=bool)
    touches[-1] = True
    mean, covariance = hand.rest_pose.astype(float), SPREAD**2 * np.eye(hand.joints)
    of_hand = tree_of(hand), skin_of(hand), solids_of([solid], far=0.03)
    for _ in range(200):
        take_in(*of_hand, 0, touches, (mean, covariance), (0, -1), TouchModel(TOLERANCE, 0.0, SURPRISE))
    assert tip_gap(*of_hand[:2], solid, mean) == pytest.approx(0.0, abs=3e-4)
    assert np.linalg.eigvalsh(covariance).min() > 0.0


def test_a_step_tells_of_those_that_err_with_it(two_finger) -> None:
    hand, solid, joints = two_finger, beside(two_finger, 0.002), two_finger.joints
    touches = np.zeros(len(hand.links), dtype=bool)
    touches[-1] = True
    mean = np.tile(hand.rest_pose, 2).astype(float)
    covariance = SPREAD**2 * np.kron([[1.0, 0.5], [0.5, 1.0]], np.eye(joints))
    take_in(
        *(tree_of(hand), skin_of(hand), solids_of([solid], far=0.03), 0, touches),
        *((mean, covariance), (joints, -1), TouchModel(TOLERANCE, SINKING, SURPRISE)),
    )
    moved = (mean - np.tile(hand.rest_pose, 2)).reshape(2, joints)
    assert np.abs(moved[1]).max() > 0.1 * SPREAD
    np.testing.assert_allclose(moved[0], 0.5 * moved[1], atol=1e-12)


def test_what_lasts_of_a_gap_is_told_by_all_looks_at_it(two_finger) -> None:
    hand, solid, joints, links = two_finger, beside(two_finger, 0.002), two_finger.joints, len(two_finger.links)
    anew, lasting = 0.0005, 0.003  # m
    touches = np.zeros((2, links), dtype=bool)
    touches[0, -1] = True  # the first time; the second it is silent
    mean = np.append(np.tile(hand.rest_pose, 2), np.zeros(links))
    covariance = np.zeros((len(mean), len(mean)))
    covariance[: 2 * joints, : 2 * joints] = SPREAD**2 * np.kron([[1.0, 0.5], [0.5, 1.0]], np.eye(joints))
    np.fill_diagonal(covariance[2 * joints :, 2 * joints :], lasting**2)
    samples = np.random.default_rng(0).multivariate_normal(mean, covariance, 8000)
    of_hand, model = (tree_of(hand), skin_of(hand)), TouchModel(anew, SINKING, SURPRISE)
    solids = solids_of([solid], far=0.03)
    told = [
        take_in(*of_hand, solids, 0, touches[k], (mean, covariance), (k * joints, 2 * joints), model) for k in (0, 1)
    ]
    gaps = np.array([[tip_gap(*of_hand, solid, row[k * joints : (k + 1) * joints]) for k in (0, 1)] for row in samples])
    touch = ndtr(-(gaps + samples[:, -1:]) / anew)
    first = SURPRISE + (1.0 - SURPRISE) * touch[:, 0]
    both = first * (SURPRISE + (1.0 - SURPRISE) * (1.0 - touch[:, 1]))
    expected = [np.log(first.mean()), np.log(both.mean() / first.mean())]
    np.testing.assert_allclose(told, expected, atol=0.1)
    np.testing.assert_allclose(mean[-1], both @ samples[:, -1] / both.sum(), atol=0.1 * lasting)
    angles = both @ samples[:, : 2 * joints] / both.sum()
    np.testing.assert_allclose(mean[: 2 * joints], angles, atol=0.1 * SPREAD)


def test_who_knows_what_the_object_may_be_knows_the_pose_better(explore) -> None:
    ratios = []
    for shape in ("sphere", "cylinder", "cube"):
        exploration = explore(shape, 200, sigma_deg=5.0)
        namer = ShapePosterior(exploration.hand)
        beliefs = {}
        for solids in (None, namer):
            observer = HapticSLAM(exploration.hand, 5.0, particles=3, solids=solids)
            beliefs[solids is not None] = exploration.beliefs(observer)
        for blind, told in zip(beliefs[False], beliefs[True], strict=True):  # maps and naming know nothing of it
            assert np.array_equal(blind.particles, told.particles)
            assert np.array_equal(blind.lagged_covariance, told.lagged_covariance)
        assert np.array_equal(beliefs[False][-1].occupancy, beliefs[True][-1].occupancy)
        assert np.ptp(namer.posterior) == 0.0  # the observer's own copy has named it
        ratios.append(exploration.lagged_rmse(beliefs[True]) / exploration.lagged_rmse(beliefs[False]))
    assert np.mean(ratios) < 0.98


def test_it_starts_anew_with_every_trial(explore, bits) -> None:
    exploration = explore("sphere", 200, sigma_deg=5.0)
    observer = HapticSLAM(exploration.hand, 5.0, particles=1, lag=2, solids=ShapePosterior(exploration.hand))
    first, second = (exploration.beliefs(observer) for _ in range(2))
    assert [bits(each) for each in first] == [bits(each) for each in second]


def test_without_a_lag_it_knows_nothing_of_later_contacts(explore) -> None:
    exploration = explore("sphere", 120, sigma_deg=5.0)
    namer = ShapePosterior(exploration.hand)
    online = HapticSLAM(exploration.hand, 5.0, particles=1, lag=0, in_hindsight=False, solids=namer)
    beliefs = exploration.beliefs(online)
    assert all(belief.lag_steps == 0 for belief in beliefs)
    assert np.isfinite([belief.lagged_joint_std for belief in beliefs]).all()


def test_what_is_no_posterior_is_refused(two_finger) -> None:
    with pytest.raises(ValueError, match="solids must be a ShapePosterior of what the object may be, got 'cube'"):
        HapticSLAM(two_finger, solids="cube")


def test_solids_of_another_hand_are_refused(two_finger) -> None:
    with pytest.raises(ValueError, match="solids must be told of hand 'tree', got those of 'two_finger'"):
        HapticSLAM(random_tree(3), solids=ShapePosterior(two_finger))


OFFSET = 0.05 * np.array([1, -1, 1, -1, 1, 1, -1, 1])


def _held_offset(hand, solids, **believed):
    """The last belief about a hand that stands still where it touches a sphere, felt with `OFFSET` and no noise."""
    solid = beside(hand, 0.0)
    places = {"there": [solid], "farther": [beside(hand, 0.02)]}
    known = ShapePosterior(hand, {name: places[name] for name in solids}) if solids else None
    slam = HapticSLAM(hand, 0.3, 1, candidates=1, lag=0, motion="delta_pose", solids=known, **believed)
    contacts = hand.patches.link == len(hand.links) - 1
    belief = slam.reset(0)
    for _ in range(10):
        belief = slam.step(np.zeros(hand.joints), hand.rest_pose + OFFSET, contacts)
    return belief


WHERE_UNKNOWN = {"bias_deg": 3.0, "start_std_deg": 10.0}


def test_a_solid_that_is_certain_tells_of_the_offsets(two_finger) -> None:
    """Of what the felt angles cannot tell, contact tells what moves the finger to and from the solid, and next to
    nothing of the other finger."""
    untold, told = (_held_offset(two_finger, solids, **WHERE_UNKNOWN) for solids in ((), ("there",)))
    finger = two_finger.stopped_by[-1]
    assert (told.joint_offset_std[finger] <= untold.joint_offset_std[finger]).all()
    assert told.joint_offset_std[finger].min() < 0.9 * untold.joint_offset_std[finger].min()
    moved = np.abs(told.joint_offset - untold.joint_offset)
    assert moved[~finger].max() < 0.1 * moved[finger].max()
    away = [np.linalg.norm((each.joint_offset - OFFSET)[finger]) for each in (untold, told)]
    assert away[1] < away[0]


def test_solids_of_which_one_is_to_be_named_tell_nothing_for_good(two_finger) -> None:
    """What is named from such poses would confirm itself."""
    untold, told = (_held_offset(two_finger, solids, **WHERE_UNKNOWN) for solids in ((), ("there", "farther")))
    np.testing.assert_array_equal(told.joint_offset, untold.joint_offset)
    np.testing.assert_array_equal(told.joint_angles, untold.joint_angles)


def test_a_solid_that_may_be_none_tells_nothing_for_good(two_finger) -> None:
    solid = beside(two_finger, 0.0)
    beliefs = []
    for known in (None, ShapePosterior(two_finger, {"it": [solid]}, none=0.5)):
        slam = HapticSLAM(two_finger, 0.3, 1, lag=0, motion="delta_pose", solids=known, **WHERE_UNKNOWN)
        slam.reset(0)
        contacts = two_finger.patches.link == len(two_finger.links) - 1
        beliefs.append(slam.step(np.zeros(8), two_finger.rest_pose + OFFSET, contacts))
    np.testing.assert_array_equal(beliefs[0].joint_offset, beliefs[1].joint_offset)


def test_a_touch_that_lasts_tells_of_the_offsets_once(two_finger, monkeypatch) -> None:
    told = []
    monkeypatch.setattr("observer.shape.pose_correction.take_in", lambda *_: told.append(1))
    _held_offset(two_finger, ("there",), **WHERE_UNKNOWN)
    assert len(told) == 1


def test_a_certain_solid_is_asked_as_before_where_there_are_no_offsets(two_finger) -> None:
    untold, told = (_held_offset(two_finger, solids) for solids in ((), ("there",)))
    np.testing.assert_array_equal(told.joint_angles, untold.joint_angles)
    np.testing.assert_array_equal(told.joint_offset_std, 0.0)
    assert not np.array_equal(told.lagged_joint_std, untold.lagged_joint_std)
