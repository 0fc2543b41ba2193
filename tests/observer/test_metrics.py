"""Measures against cases worked out by hand."""

from __future__ import annotations

import re

import numpy as np
import pytest
from scipy import stats
from sklearn.metrics import log_loss

from haptic_env import hands, shapes
from haptic_env.grid import Grid
from haptic_env.pose import Pose
from observer import metrics
from observer.kinematics import link_frames, tree_of

GRID = Grid((-0.04, -0.04, -0.04), 0.004, (20, 20, 20))  # voxel centres at ±2, ±6, … ±38 mm
CUBE = shapes.make("cube", (0.04, 0.04, 0.04))  # its faces at ±20 mm, between the centres at 18 and 22 mm


def test_pose_error_is_the_rms_over_joints_then_over_steps() -> None:
    truth = np.zeros((2, 2))
    estimate = np.deg2rad([[3.0, 4.0], [0.0, 0.0]])
    np.testing.assert_allclose(metrics.pose_error_deg(estimate, truth), [np.sqrt(12.5), 0.0])
    assert metrics.pose_rmse_deg(estimate, truth) == pytest.approx(2.5)
    assert np.isnan(metrics.pose_rmse_deg(np.empty((0, 2)), np.empty((0, 2))))


def test_credible_coverage_counts_what_lies_within_the_interval() -> None:
    truth = np.array([0.0, 1.6, 1.7, -1.6, 3.0])  # the 90 % interval of a standard normal ends at 1.645
    assert metrics.credible_coverage(np.zeros(5), np.ones(5), truth) == pytest.approx(0.6)
    assert metrics.credible_coverage(np.zeros(5), np.ones(5), truth, level=0.5) == pytest.approx(0.2)
    truth = np.random.default_rng(0).normal(2.0, 0.3, 20_000)
    assert metrics.credible_coverage(2.0, np.full(20_000, 0.3), truth) == pytest.approx(0.9, abs=0.01)


def occupied(*cells: tuple[int, int, int]) -> np.ndarray:
    """A map that knows nothing but that `cells` are occupied."""
    occupancy = np.full(GRID.shape, 0.5)
    for cell in cells:
        occupancy[cell] = 0.9
    return occupancy


def test_precision_is_the_share_of_occupied_voxels_near_the_surface() -> None:
    # Along x: centres at 22 (2 mm outside), 26 (6 mm outside), 2 mm (18 mm inside) and 30 mm (10 mm outside).
    occupancy = occupied((15, 10, 10), (16, 10, 10), (10, 10, 10), (17, 10, 10))
    assert metrics.surface_precision(occupancy, GRID, CUBE, voxels=1) == pytest.approx(1 / 4)
    assert metrics.surface_precision(occupancy, GRID, CUBE, voxels=2) == pytest.approx(2 / 4)
    assert metrics.surface_precision(np.full(GRID.shape, 0.5), GRID, CUBE) == 0.0


def test_recall_is_the_share_of_touched_places_near_an_occupied_voxel() -> None:
    occupancy = occupied((15, 10, 10))  # centre (22, 2, 2) mm
    places = np.array([[0.020, 0.002, 0.002], [0.020, 0.009, 0.002], [-0.020, 0.0, 0.0]])  # 2, 7.3 and 42 mm away
    assert metrics.surface_recall(occupancy, GRID, places, voxels=1) == pytest.approx(1 / 3)
    assert metrics.surface_recall(occupancy, GRID, places, voxels=2) == pytest.approx(2 / 3)
    assert metrics.surface_recall(np.full(GRID.shape, 0.5), GRID, places) == 0.0
    assert np.isnan(metrics.surface_recall(occupancy, GRID, np.empty((0, 3))))


def test_the_f_score_is_the_harmonic_mean() -> None:
    occupancy = occupied((15, 10, 10), (10, 10, 10))
    places = np.array([[0.020, 0.002, 0.002], [-0.020, 0.0, 0.0], [0.0, -0.020, 0.0]])
    score = metrics.surface_score(occupancy, GRID, CUBE, places)
    assert score == pytest.approx((1 / 2, 1 / 3, 2 * (1 / 2) * (1 / 3) / (1 / 2 + 1 / 3)))
    assert metrics.surface_score(np.full(GRID.shape, 0.5), GRID, CUBE, places) == (0.0, 0.0, 0.0)


def test_the_true_map_scores_in_full() -> None:
    shell = np.abs(CUBE.signed_distance(GRID.centres())) <= 0.5001 * GRID.resolution
    occupancy = np.where(shell, 0.9, 0.1)
    places = GRID.centres()[shell]
    assert metrics.surface_score(occupancy, GRID, CUBE, places) == (1.0, 1.0, 1.0)
    assert metrics.surface_coverage(occupancy, GRID, CUBE) == 1.0
    half = occupancy.copy()
    half[10:] = 0.5
    # The other half is found only where it borders on this one: the ring of voxels next to the middle.
    rim = shell[10].sum() / shell.sum()
    assert metrics.surface_coverage(half, GRID, CUBE) == pytest.approx(0.5 + rim)


def test_touched_places_lie_on_the_surface_under_the_patch_that_rang() -> None:
    hand = hands.make("two_finger")
    tip = hand.patches.names.index("index_distal_tip")
    contacts = np.zeros((2, len(hand.patches)), dtype=bool)
    contacts[1, tip] = True
    angles = np.tile(hand.rest_pose, (2, 1))
    skin = hand.patches.surface(0.002)
    position, rotation = link_frames(tree_of(hand), hand.rest_pose)
    mine = skin.patch == tip
    points = np.einsum("mij,mj->mi", rotation[skin.link], skin.points)[mine] + position[skin.link][mine]
    top = points[points[:, 2].argmax()]
    ball = shapes.make("sphere", (0.02, 0.02, 0.02), top + [0, 0, 0.010])  # it rests on the fingertip
    places = metrics.touched_places(hand, angles, contacts, ball)
    np.testing.assert_allclose(places, [top], atol=1e-9)
    far = shapes.make("sphere", (0.02, 0.02, 0.02), top + [0, 0, 0.020])
    assert metrics.touched_places(hand, angles, contacts, far).shape == (0, 3)  # it rang falsely
    assert len(metrics.touched_places(hand, np.tile(angles, (5, 1)), np.tile(contacts, (5, 1)), ball)) == 1


def test_reachable_voxels_are_those_of_the_fingers_and_their_neighbours() -> None:
    hand = hands.make("two_finger")
    grid = Grid.around(hand.grasp_centre, hand.workspace, 0.004)
    cells = metrics.reachable(hand, hand.rest_pose[None], grid)
    distance = np.full(grid.shape, np.inf)
    position, rotation = link_frames(tree_of(hand), hand.rest_pose)
    for index, link in enumerate(hand.links):  # distance of every voxel's centre to the capsule
        local = (grid.centres() - position[index]) @ rotation[index]
        bone = np.clip(local[..., 2], 0.0, link.length)[..., None] * [0, 0, 1]
        distance = np.minimum(distance, np.linalg.norm(local - bone, axis=-1) - link.radius)
    assert cells[distance < 0].all()
    assert not cells[distance > 2 * np.sqrt(3) * grid.resolution].any()


def test_swept_voxels_are_those_that_points_inside_fall_into() -> None:
    """At any of several poses, where they are in the grid, which some are not."""
    hand = hands.make("two_finger")
    grid = Grid.around(hand.grasp_centre, 0.7 * hand.workspace, 0.004)
    path = hand.rest_pose + np.linspace(0.0, 0.6, 3)[:, None]
    inside, expected = hand.patches.volume(0.75 * grid.resolution), np.zeros(grid.shape, dtype=bool)
    for pose in path:
        position, rotation = link_frames(tree_of(hand), pose)
        points = position[inside.link] + np.einsum("mik,mk->mi", rotation[inside.link], inside.points)
        cells, within = grid.index(points)
        expected[tuple(cells[within].T)] = True
    assert expected.any()
    assert not within.all()
    np.testing.assert_array_equal(metrics.swept(hand, path, grid), expected)


def test_reliability_by_hand() -> None:
    occupancy = np.array([0.05, 0.05, 0.95, 0.95, 0.5]).reshape(5, 1, 1)
    truth = np.array([False, True, True, True, True]).reshape(5, 1, 1)
    cells = np.array([True, True, True, True, False]).reshape(5, 1, 1)
    result = metrics.reliability(occupancy, truth, cells, bins=2)
    np.testing.assert_allclose(result.predicted, [0.05, 0.95])
    np.testing.assert_allclose(result.observed, [0.5, 1.0])
    assert result.cells.tolist() == [2, 2]
    assert result.ece == pytest.approx((2 * 0.45 + 2 * 0.05) / 4)
    assert result.brier == pytest.approx((0.05**2 + 0.95**2 + 2 * 0.05**2) / 4)
    assert result.log_loss == pytest.approx(log_loss(truth[cells], occupancy[cells]))


def test_reliability_of_what_is_calibrated_and_of_nothing() -> None:
    rng = np.random.default_rng(1)
    p = rng.random((40, 40, 40))
    every = np.ones(p.shape, dtype=bool)
    result = metrics.reliability(p, rng.random(p.shape) < p, every)
    assert result.ece < 0.01
    assert result.brier == pytest.approx(1 / 6, abs=0.005)  # E[p (1 - p)] for p uniform
    assert np.isnan(metrics.reliability(p, p > 0.5, ~every).ece)
    edges = metrics.reliability(np.array([[[0.0, 1.0]]]), np.array([[[False, True]]]), np.ones((1, 1, 2), bool))
    assert edges.cells.tolist() == [1] + [0] * 8 + [1]
    assert edges.ece == edges.log_loss == 0.0


def test_accuracy_has_wilsons_interval() -> None:
    share = metrics.accuracy([True] * 8 + [False] * 2)
    # Newcombe 1998 (Stat. Med. 17, 857): (2np + z² ± z √(z² + 4np(1 - p))) / (2(n + z²)), z = 1.96.
    z, n, p = 1.959964, 10, 0.8
    spread = z * np.sqrt(z**2 + 4 * n * p * (1 - p))
    expected = [(2 * n * p + z**2 + sign * spread) / (2 * (n + z**2)) for sign in (-1, 1)]
    assert share.mean == pytest.approx(0.8)
    assert (share.low, share.high) == pytest.approx(expected, abs=1e-6)
    assert share.trials == 10
    assert metrics.accuracy([0.5, 0.5]).mean == 0.5
    assert np.isnan(metrics.accuracy([]).mean)


def test_time_to_decision_is_when_the_doubts_end() -> None:
    seconds = np.array([0.1, 0.2, 0.3, 0.4])
    chain = np.array([[0.96, 0.04], [0.5, 0.5], [0.97, 0.03], [0.99, 0.01]])
    assert metrics.time_to_decision(seconds, chain) == pytest.approx(0.3)
    assert metrics.time_to_decision(seconds, chain[[0, 0, 2, 3]]) == pytest.approx(0.1)
    assert np.isnan(metrics.time_to_decision(seconds, chain[[2, 3, 0, 1]]))  # in doubt at the end
    assert np.isnan(metrics.time_to_decision([], np.empty((0, 2))))


def test_closure_is_zero_at_the_floor_and_one_at_the_ceiling() -> None:
    assert metrics.closure(0.8, 0.4, 0.9) == pytest.approx(0.8)
    assert metrics.closure(1.2, 3.0, 0.0) == pytest.approx(0.6)  # errors: less is better, the same formula
    assert np.isnan(metrics.closure(0.5, 0.5, 0.5))


def test_ranks_of_an_honest_belief_are_flat_and_of_a_sure_one_at_the_ends():
    rng = np.random.default_rng(0)
    mean, std = rng.standard_normal((400, 50)), rng.uniform(0.5, 2.0, (400, 50))
    truth = mean + std * rng.standard_normal((400, 50))
    honest = metrics.rank_counts(mean, std, truth, 20)
    assert honest.sum() == 20_000
    assert stats.chisquare(honest).pvalue > 1e-3
    sure, modest = metrics.rank_counts(mean, 0.5 * std, truth, 20), metrics.rank_counts(mean, 2 * std, truth, 20)
    assert min(sure[0], sure[-1]) > 3 * sure[5:15].max()
    assert max(modest[0], modest[-1]) < 0.5 * modest[5:15].min()


def test_ranks_give_the_coverage_of_every_interval():
    rng = np.random.default_rng(1)
    mean, truth = rng.standard_normal((2, 500))
    counts = metrics.rank_counts(mean, 1.3, truth, 40)
    for level in (0.1, 0.5, 0.9, 0.95):
        beyond = round(0.5 * (1 - level) * 40)
        assert counts[beyond : 40 - beyond].sum() / 500 == metrics.credible_coverage(mean, 1.3, truth, level)
    assert metrics.rank_counts(0.0, 1.0, [1.0, 1.0, -3.0], 4).tolist() == [1, 0, 0, 2], "above the mean is a high rank"


def test_what_is_exact_and_said_to_be_is_in_the_middle():
    assert metrics.rank_counts(np.ones(3), np.zeros(3), np.ones(3), 5).tolist() == [0, 0, 3, 0, 0]


HAND = hands.make("two_finger")
REST, SILENT = HAND.rest_pose[None], np.zeros((1, 50))
UNKNOWN = np.full(GRID.shape, 0.5)
ONE = np.ones(GRID.shape, bool)
CALLS = {  # each with arguments that are right, by the names that they have
    metrics.pose_error_deg: {"estimate": np.zeros((2, 8)), "truth": np.zeros((2, 8))},
    metrics.pose_rmse_deg: {"estimate": np.zeros((2, 8)), "truth": np.zeros((2, 8))},
    metrics.credible_coverage: {"mean": np.zeros(3), "std": np.ones(3), "truth": np.zeros(3), "level": 0.9},
    metrics.rank_counts: {"mean": np.zeros(3), "std": np.ones(3), "truth": np.zeros(3), "bins": 4},
    metrics.touched_places: {
        "hand": HAND,
        "joint_angles": REST,
        "contacts": SILENT,
        "solid": CUBE,
        "spacing": 0.002,
    },
    metrics.surface_precision: {"occupancy": UNKNOWN, "grid": GRID, "solid": CUBE, "voxels": 1.0},
    metrics.surface_recall: {"occupancy": UNKNOWN, "grid": GRID, "places": np.zeros((2, 3)), "voxels": 1.0},
    metrics.surface_score: {
        "occupancy": UNKNOWN,
        "grid": GRID,
        "solid": CUBE,
        "touched": np.zeros((2, 3)),
        "voxels": 1.0,
    },
    metrics.surface_coverage: {"occupancy": UNKNOWN, "grid": GRID, "solid": CUBE, "voxels": 1.0},
    metrics.reachable: {"hand": HAND, "joint_angles": REST, "grid": GRID},
    metrics.swept: {"hand": HAND, "joint_angles": REST, "grid": GRID},
    metrics.neighbourhood: {"cells": ONE},
    metrics.reliability: {"occupancy": UNKNOWN, "truth": ONE, "cells": ONE, "bins": 4},
    metrics.accuracy: {"correct": np.ones(3), "level": 0.95},
    metrics.time_to_decision: {"seconds": np.arange(2.0), "posterior": np.full((2, 4), 0.25), "threshold": 0.9},
    metrics.closure: {"slam": 0.5, "floor": 0.0, "ceiling": 1.0},
}
SPOILT = {
    "NaN": lambda value: value * np.nan,
    "infinite": lambda value: np.where(np.arange(value.size).reshape(value.shape) == 1, np.inf, value),
    "complex": lambda value: value + 0j,
    "masked": lambda value: np.ma.array(value, mask=np.arange(value.size).reshape(value.shape) == 1),
    "objects": lambda value: np.full(value.shape, None),
    "text": lambda value: np.full(value.shape, "1"),
    "nothing": lambda value: None,
}
NUMBERS = [
    (np.nan, "got nan"),
    (np.inf, "got inf"),
    ("1", "got '1'"),
    (None, "got None"),
    (1j, "got 1j"),
    (-1e308, "got"),
]
ARRAYS = [
    (call, name) for call, given in CALLS.items() for name, value in given.items() if isinstance(value, np.ndarray)
]
SINGLE = [
    (call, name) for call, given in CALLS.items() for name, value in given.items() if isinstance(value, float | int)
]


def _named(case) -> str | None:
    return getattr(case, "__name__", None)


@pytest.mark.parametrize("kind", SPOILT)
@pytest.mark.parametrize(("call", "name"), ARRAYS, ids=_named)
def test_arrays_that_are_not_finite_and_real_are_refused(call, name, kind):
    given = CALLS[call]
    call(**given)
    with pytest.raises(ValueError, match=r"must be .*got"):
        call(**{**given, name: SPOILT[kind](given[name].astype(np.float64))})


@pytest.mark.parametrize("value", NUMBERS)
@pytest.mark.parametrize(("call", "name"), SINGLE, ids=_named)
def test_numbers_that_are_none_are_refused(call, name, value):
    if call is metrics.closure and isinstance(value, float) and np.isnan(value):
        assert np.isnan(call(**{**CALLS[call], name: value}))  # of what could not be said
        return
    with pytest.raises(ValueError, match=rf"{name} must be .*got {re.escape(repr(value))}"):
        call(**{**CALLS[call], name: value})


@pytest.mark.parametrize(("call", "name"), ARRAYS, ids=_named)
def test_arrays_of_another_shape_are_refused(call, name):
    """Too long for the others, or of too many dimensions: what kernels read lies inside their arrays."""
    given = CALLS[call]
    for other in (np.zeros((7, 9, 4, 2)), np.zeros((7, 7))):
        if call in (metrics.neighbourhood, metrics.accuracy) and other.ndim == given[name].ndim:
            continue
        with pytest.raises(ValueError, match=r"must .*shape|must be an array"):
            call(**{**given, name: other})


def test_a_spread_below_zero_is_refused():
    for call in (metrics.credible_coverage, metrics.rank_counts):
        with pytest.raises(ValueError, match="std must not be negative, got -1"):
            call(np.zeros(3), [1.0, -1.0, 1.0], np.zeros(3))


def test_a_whole_interval_holds_what_is_exact():
    assert metrics.credible_coverage(np.zeros(2), [0.0, 1.0], [0.0, 5.0], level=1.0) == 1.0


def test_roots_are_as_many_as_steps():
    with pytest.raises(ValueError, match="roots must be as many as steps, 1, got 2"):
        metrics.swept(HAND, REST, GRID, roots=[Pose(np.zeros(3), np.eye(3))] * 2)


@pytest.mark.parametrize("what", ["hand", "grid", "solid"])
def test_what_is_no_part_of_a_world_is_named(what):
    hand = hands.make("two_finger")
    angles, map_ = np.zeros((2, hand.joints)), np.zeros(GRID.shape)
    asked = {
        "hand": [
            lambda it: metrics.swept(it, angles, GRID),
            lambda it: metrics.touched_places(it, angles, np.zeros((2, 50)), CUBE),
        ],
        "grid": [
            lambda it: metrics.surface_recall(map_, it, np.zeros((1, 3))),
            lambda it: metrics.surface_places(CUBE, it),
            lambda it: metrics.reached_into(CUBE, it),
        ],
        "solid": [lambda it: metrics.surface_precision(map_, GRID, it), lambda it: metrics.surface_places(it, GRID)],
    }
    for ask in asked[what]:
        for wrong in (None, 3, "cube", np.zeros(3)):
            with pytest.raises(ValueError, match=f"{what} must be a .*, got"):
                ask(wrong)


@pytest.mark.parametrize("roots", [3, "x", [None], [3, 3], {}])
def test_roots_that_are_no_poses_are_refused(roots):
    hand = hands.make("two_finger")
    with pytest.raises(ValueError, match="root"):
        metrics.swept(hand, np.zeros((2, hand.joints)), GRID, roots)


def test_which_neighbours_are_meant_is_said_by_a_truth_value() -> None:
    with pytest.raises(ValueError, match=r"^faces must be True or False, got array"):
        metrics.neighbourhood(np.zeros((2, 2, 2), dtype=bool), faces=np.array([]))  # type: ignore[arg-type]
