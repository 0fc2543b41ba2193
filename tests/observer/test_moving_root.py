"""A hand that moves as a whole: its map lies in another frame, and its root says where it is in that."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from haptic_env import shapes
from haptic_env.grid import Grid
from haptic_env.pose import Pose
from haptic_env.recordings import Recording, Track
from haptic_env.replay import KinematicReplay
from observer import DeadReckoning, HapticSLAM, ObserverWrapper, ShapePosterior, metrics
from observer.kinematics import link_frames, placed, tree_of
from tests.observer.hands import random_tree

TURN = Pose(np.array([0.1, -0.2, 0.3]), Rotation.from_rotvec([0.5, 1.0, -0.4]).as_matrix())


def test_poses_compose_as_matrices() -> None:
    other = Pose.of([1.0, 2.0, 3.0], [0.5, 0.5, -0.5, 0.5])
    both = TURN @ other
    point = np.array([0.3, -0.1, 0.7])
    inner = other.position + other.rotation @ point
    np.testing.assert_allclose(both.position + both.rotation @ point, TURN.position + TURN.rotation @ inner)
    back = both @ both.inverse()
    np.testing.assert_allclose(back.position, 0.0, atol=1e-12)
    np.testing.assert_allclose(back.rotation, np.eye(3), atol=1e-12)


def test_a_placed_tree_is_moved_as_a_whole() -> None:
    hand = random_tree(3)
    angles = np.random.default_rng(0).uniform(-1, 1, hand.joints)
    tree = tree_of(hand)
    position, rotation = link_frames(tree, angles)
    moved, turned = link_frames(placed(tree, TURN), angles)
    np.testing.assert_allclose(moved, TURN.position + position @ TURN.rotation.T, atol=1e-12)
    np.testing.assert_allclose(turned, TURN.rotation @ rotation, atol=1e-12)
    assert placed(tree, None) is tree


@pytest.mark.parametrize("make", [HapticSLAM, DeadReckoning])
def test_a_map_moves_with_its_frame(explore, make) -> None:
    exploration = explore("cube", 60, sigma_deg=3.0)
    observer = make(exploration.hand, **({"particles": 5} if make is HapticSLAM else {}))
    shift = Pose(16 * np.full(3, observer.grid.resolution), np.eye(3))
    grid = replace(observer.grid, origin=tuple(np.asarray(observer.grid.origin) + shift.position))
    moved = make(exploration.hand, grid=grid, **({"particles": 5} if make is HapticSLAM else {}))
    first, second = observer.reset(seed=1), moved.reset(seed=1)
    names = [ShapePosterior(exploration.hand), ShapePosterior(exploration.hand, shifted(exploration.hand, shift))]
    for each in zip(exploration.torque, exploration.felt, exploration.contacts, strict=True):
        first, second = observer.step(*each), moved.step(*each, shift)
        for name, belief in zip(names, (first, second), strict=True):
            name.update(belief)
    assert np.abs(first.occupancy - second.occupancy).mean() < 1e-4  # voxels at the edge may round either way
    np.testing.assert_allclose(first.lagged_joint_angles, second.lagged_joint_angles, atol=1e-3)
    # Distances are looked up in lattices that lie differently about the two objects.
    np.testing.assert_allclose(names[0].posterior, names[1].posterior, atol=0.1)
    assert second.lagged_root is not None
    np.testing.assert_array_equal(second.lagged_root.position, shift.position)
    assert first.lagged_root is None


def shifted(hand, shift: Pose) -> dict:
    return {name: [shapes.make(name, position=hand.grasp_centre + shift.position)] for name in shapes.SHAPES}


def test_the_root_of_a_step_is_used_when_its_contacts_are(explore) -> None:
    exploration = explore("cube", 60, sigma_deg=3.0)
    slam = HapticSLAM(exploration.hand, particles=1, lag=3)
    slam.reset(seed=0)
    given = [Pose(np.array([0.001 * step, 0.0, 0.0]), np.eye(3)) for step in range(20)]
    beliefs = []
    for root, *felt in zip(given, exploration.torque, exploration.felt, exploration.contacts, strict=False):
        beliefs.append(slam.step(*felt, root))
    beliefs += slam.flush()
    roots = [belief.lagged_root for belief in beliefs if belief.lagged_contacts is not None]
    assert [root.position[0] for root in roots if root is not None] == [root.position[0] for root in given]


def test_a_belief_keeps_its_root_when_the_caller_changes_it(explore) -> None:
    exploration = explore("cube", 60, sigma_deg=3.0)
    floor = DeadReckoning(exploration.hand)
    floor.reset()
    root = Pose(np.zeros(3), np.eye(3))
    belief = floor.step(exploration.torque[0], exploration.felt[0], exploration.contacts[0], root)
    root.position[:] = 7.0
    assert belief.lagged_root is not None
    assert not belief.lagged_root.position.any()


@pytest.mark.parametrize(
    ("position", "rotation", "told"),
    [
        ([np.nan, 0, 0], np.eye(3), "position of root must be finite .*nan"),
        ([0, 1e17, 0], np.eye(3), r"position of root must lie in \[-100, 100\] m, got .*1e\+17"),
        ([0, 0, 0], np.full((3, 3), np.inf), "rotation of root must be finite .*inf"),
        ([0, 0, 0], np.diag([1.0, 1.0, -1.0]), "rotation of root must be a rotation matrix"),
    ],
)
def test_a_root_that_became_none_is_refused(two_finger, position, rotation, told: str) -> None:
    """A pose is checked when it is made; its arrays may be written to."""
    slam = HapticSLAM(two_finger, particles=1)
    slam.reset()
    root = Pose(np.zeros(3), np.eye(3))
    root.position[:], root.rotation[:] = position, rotation
    with pytest.raises(ValueError, match=told):
        slam.step(np.zeros(8), np.zeros(8), np.zeros(50), root)


@pytest.mark.parametrize("root", ["here", (np.zeros(3), np.eye(3)), 0])
def test_a_root_that_is_no_pose_is_refused(two_finger, root) -> None:
    slam = HapticSLAM(two_finger, particles=1)
    slam.reset()
    with pytest.raises(ValueError, match=r"root must be a haptic_env\.pose\.Pose, or None .*, got"):
        slam.step(np.zeros(8), np.zeros(8), np.zeros(50), root)


@pytest.mark.parametrize("far", [100.0, -100.0])
@pytest.mark.parametrize("matching", ["mean", "sample"])
@pytest.mark.parametrize("where", ["hand", "grid", "both", "opposite"])
def test_a_hand_as_far_away_as_it_may_be_maps_what_is_there(two_finger, far: float, matching: str, where: str) -> None:
    """Nothing where the grid is elsewhere, and no voxel beyond it."""
    grid_at, root_at = {"hand": (0, far), "grid": (far, 0), "both": (far, far), "opposite": (-far, far)}[where]
    at = 0.999 * np.full(3, grid_at)
    grid = Grid.around(at, (0.1, 0.1, 0.1), 0.004)
    slam = HapticSLAM(two_finger, particles=2, lag=0, matching=matching, grid=grid)
    slam.reset(seed=0)
    root = Pose(0.999 * np.full(3, root_at), np.eye(3))
    for _ in range(6):
        belief = slam.step(np.zeros(8), two_finger.rest_pose, np.arange(50) < 4, root)
    met = (belief.occupancy != 0.5).any()
    assert met == (where == "both")
    assert ((slam.flush() or [belief])[-1].occupancy != 0.5).any() == (where == "both")


def test_metrics_follow_the_root(explore) -> None:
    exploration = explore("cube", 60, sigma_deg=3.0)
    hand, solid, steps = exploration.hand, exploration.solid, len(exploration.true)
    position = TURN.position + TURN.rotation @ np.asarray(solid.position)
    quaternion = Rotation.from_matrix(TURN.rotation).as_quat(scalar_first=True)
    moved = shapes.make(solid.name, solid.size, position, quaternion)
    here = metrics.touched_places(hand, exploration.true, exploration.contacts, solid)
    there = metrics.touched_places(hand, exploration.true, exploration.contacts, moved, roots=[TURN] * steps)
    assert len(here) > 0
    assert np.abs(moved.signed_distance(there)).max() < metrics.TOUCH_TOLERANCE
    slam = HapticSLAM(hand, particles=1)
    swept = metrics.reachable(hand, exploration.true, slam.grid)
    shift = Pose(np.array([2 * slam.grid.resolution, 0.0, 0.0]), np.eye(3))
    again = metrics.reachable(hand, exploration.true, slam.grid, [shift] * steps)
    assert (swept[:-4] == again[2:-2]).mean() > 0.99


def test_samples_start_where_the_pose_was_found(explore) -> None:
    """A motion that knows nothing of the start: the rest pose must not linger in the samples."""
    exploration = explore("cube", 60, sigma_deg=3.0)
    slam = HapticSLAM(exploration.hand, particles=1, motion="kinematic", lag=0)
    slam.reset(seed=0)
    name = ShapePosterior(exploration.hand, samples=16, stride=1)
    angles = exploration.hand.rest_pose + 0.5
    belief = slam.step(exploration.torque[0], angles, np.zeros(len(exploration.hand.patches)))
    name.update(belief)
    spread = np.sqrt(np.diag(belief.lagged_covariance))
    assert np.abs(name._poses - angles).max() < 6 * spread.max()


def test_the_wrapper_passes_the_root_on(two_finger) -> None:
    still = np.tile([1.0, 0, 0, 0], (9, 1))
    away = Track(np.tile([0.1, 0.2, 0.3], (9, 1)), still)
    angles = np.tile(two_finger.rest_pose, (9, 1))
    recording = Recording(
        "still", 0.02 * np.arange(9), two_finger.joint_names, angles, root=away, object=Track(np.zeros((9, 3)), still)
    )
    replay = KinematicReplay("two_finger", recording, shapes.make("cube"))
    env = ObserverWrapper(replay, HapticSLAM(two_finger, particles=1, motion="kinematic", lag=0))
    env.reset(seed=0)
    belief = env.step(np.zeros(two_finger.joints))[-1]["belief"]
    np.testing.assert_allclose(belief.lagged_root.position, [0.1, 0.2, 0.3])
