"""The surface of a belief."""

from __future__ import annotations

import copy
import importlib.util
import pickle

import igl
import numpy as np
import pytest
import trimesh

from haptic_env.grid import Grid
from haptic_env.pose import Pose
from observer import DeadReckoning, HapticSLAM, PoseOnly
from observer.metrics import touched_places
from observer.surface import touches
from observer.surface.metrics import mesh_score


@pytest.fixture(scope="module")
def trial(explore):
    """Two fingers about a cube, which they touch."""
    return explore("cube", 150, seed=3)


@pytest.fixture(scope="module")
def beliefs(trial):
    """Of an observer that watched it."""
    return trial.beliefs(HapticSLAM(trial.hand, particles=8))


def test_nothing_touched_is_nothing(beliefs):
    surface = beliefs[0].surface()
    vertices, faces, std = surface
    assert surface.empty
    assert (vertices.shape, faces.shape, std.shape) == ((0, 3), (0, 3), (0,))


def test_what_was_touched_is_a_closed_mesh_about_the_object(trial, beliefs):
    surface = beliefs[-1].surface()
    vertices, faces, std = surface
    assert trimesh.Trimesh(vertices, faces, process=False).is_watertight
    assert std.shape == (len(vertices),)
    assert (std > 0).all()
    places = touched_places(trial.hand, trial.true, trial.contacts, trial.solid)
    score = mesh_score(surface, trial.solid, places)
    assert score.chamfer_felt_mm < 3.0
    assert score.std_felt_mm < 0.6 * score.std_mm


def test_a_kept_belief_keeps_its_surface(trial):
    """Whatever is touched later, and in copies too."""
    slam = HapticSLAM(trial.hand, particles=8)
    slam.reset(seed=0)
    turns = list(zip(trial.torque, trial.felt, trial.contacts, strict=True))
    for turn in turns[:100]:
        kept = slam.step(*turn)
    ways = (kept.copy(), copy.deepcopy(kept), pickle.loads(pickle.dumps(kept)))
    before = kept.surface()
    for turn in turns[100:]:
        last = slam.step(*turn)
    later = pickle.loads(pickle.dumps(kept))
    for each in (kept, later, *ways):
        for mine, theirs in zip(each.surface(), before, strict=True):
            np.testing.assert_array_equal(mine, theirs)
    assert len(last.snapshot.touches) > len(kept.snapshot.touches)


@pytest.mark.parametrize("told", [{}, {"lag": 0}, {"in_hindsight": False, "lag": 0}, {"motion": "raw_angles"}], ids=str)
def test_the_surface_now_is_that_of_the_flush_and_ends_nothing(trial, told):
    """Asked for in between or never, and the same bits."""
    surfaces = []
    for asked in (True, False):
        slam = HapticSLAM(trial.hand, particles=4, **told)
        slam.reset(seed=0)
        assert slam.surface_now().empty
        for step, turn in enumerate(zip(trial.torque, trial.felt, trial.contacts, strict=True)):
            belief = slam.step(*turn)
            if asked and step == 100:
                assert not slam.surface_now().empty
        now = slam.surface_now()
        belief = ([belief] + slam.flush())[-1]
        surfaces += [now, belief.surface()]
    for each in surfaces[1:]:
        for one, other in zip(each, surfaces[0], strict=True):
            np.testing.assert_array_equal(one, other)


def test_a_hand_that_lasts_in_one_place_says_it_once(two_finger):
    """A touch that does not change is not news to a surface either."""
    slam = HapticSLAM(two_finger, particles=1)
    slam.reset(seed=0)
    contacts = np.zeros(len(two_finger.patches))
    contacts[two_finger.patches.names.index("index_distal_0_palmar")] = 1
    for _ in range(400):
        belief = slam.step(np.zeros(two_finger.joints), two_finger.rest_pose, contacts)
    assert 0 < len(belief.snapshot.touches) < 200


def test_raw_angles_are_less_sure(trial):
    """They take each felt angle for the joint's, with all of its noise."""
    raw, slam = (
        trial.beliefs(observer)[-1].surface().std.min()
        for observer in (DeadReckoning(trial.hand, 3.0), HapticSLAM(trial.hand, particles=8))
    )
    assert raw > 1.05 * slam


def test_a_belief_without_a_map_has_no_surface(two_finger):
    with pytest.raises(ValueError, match="a belief without a map has no surface"):
        PoseOnly(two_finger).reset(seed=0).surface()


def test_a_surface_is_in_the_frame_of_the_map(trial):
    """Where the hand as a whole lies elsewhere in that."""
    shift = np.array([0.16, -0.08, 0.24])
    here = HapticSLAM(trial.hand, particles=2)
    grid = here.grid
    there = HapticSLAM(
        trial.hand,
        particles=2,
        grid=Grid(tuple((np.asarray(grid.origin) + shift).tolist()), grid.resolution, grid.shape),
    )
    surfaces = []
    for observer, root in ((here, None), (there, Pose(shift, np.eye(3)))):
        observer.reset(seed=0)
        for turn in zip(trial.torque, trial.felt, trial.contacts, strict=True):
            observer.step(*turn, root)
        surfaces.append(observer.flush()[-1].surface())
    places = touched_places(trial.hand, trial.true, trial.contacts, trial.solid)
    near, far = (_distances(surface, places + moved) for surface, moved in zip(surfaces, (0.0, shift), strict=True))
    np.testing.assert_allclose(near, far, atol=5e-4)


def _distances(surface, places):
    return np.sqrt(igl.point_mesh_squared_distance(places, surface.vertices, surface.faces)[0])


@pytest.mark.parametrize("missing", ["igl", "trimesh"])
def test_who_lacks_a_library_is_told_what_to_install(beliefs, monkeypatch, missing):
    there = importlib.util.find_spec
    monkeypatch.setattr(
        importlib.util, "find_spec", lambda name, *rest: None if name == missing else there(name, *rest)
    )
    with pytest.raises(ImportError, match=rf"{missing}.*\[meshes\]"):
        beliefs[-1].surface()


def test_of_a_long_trial_some_touches_are_kept_and_all_of_a_kept_belief(trial, monkeypatch):
    """So that an hour beside a hand takes no more memory than some minutes."""
    turns = list(zip(trial.torque, trial.felt, trial.contacts, strict=True)) * 2

    def run():
        slam = HapticSLAM(trial.hand, particles=4, in_hindsight=False)
        slam.reset(seed=0)
        return [slam.step(*turn) for turn in turns]

    whole = run()
    before = whole[140].surface()
    monkeypatch.setattr(touches, "KEPT", 60)
    monkeypatch.setattr(touches, "RUN", 6)
    some = run()
    logs = [each.snapshot.touches for each in some]
    assert len(whole[-1].snapshot.touches) > 150
    assert max(map(len, logs)) < 60 + len(trial.hand.links)
    for mine, theirs in zip(some[140].surface(), before, strict=True):
        if len(whole[140].snapshot.touches) < 60:
            np.testing.assert_array_equal(mine, theirs)
    thinned = [k for k in range(1, len(logs)) if not logs[k].continues(logs[k - 1])]
    assert thinned
    kept = logs[thinned[0] - 1]
    assert len(kept.since(0)[0]) == len(kept) >= 60
    assert not some[-1].surface().empty
    links, _ = logs[-1].since(0)
    assert {int(trial.hand.patches.link[each.patches[0]]) for each in links} == {
        int(trial.hand.patches.link[each.patches[0]]) for each in whole[-1].snapshot.touches.since(0)[0]
    }
