"""What the page is told is what was believed."""

from __future__ import annotations

import base64
import json
import pickle
from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from scipy.spatial import cKDTree

from haptic_env import hands
from haptic_lab.exploration.surface_picture import LIMIT
from haptic_lab.view import encoding
from haptic_lab.view.encoding import GHOSTS, LEAST, TURN, UNIT, Encoder
from haptic_lab.view.moment import NewTouches, Pace, packed, unpacked
from haptic_lab.view.skin import skin_of
from observer.kinematics import link_frames, tree_of
from observer.maps.occupancy import OccupancySnapshot
from observer.surface.touches import MOST, TouchLog
from tests.haptic_lab.view.conftest import Shown

TYPES = {"u8": np.uint8, "i16": np.int16, "u32": np.uint32, "f32": np.float32}


def read(told: dict[str, Any]) -> np.ndarray:
    (kind,) = set(told) & set(TYPES)
    return np.frombuffer(base64.b64decode(told[kind]), TYPES[kind]) * told.get("unit", 1)


def told(shown: Shown, kind: str) -> list[dict[str, Any]]:
    return [each for each in map(json.loads, shown.history.texts()) if each["kind"] == kind]


def test_the_hand_is_where_it_is_believed_to_be(shown: Shown) -> None:
    moment, line = shown.moments[20], told(shown, "state")[20]
    places, turns = link_frames(tree_of(shown.setting.hand), moment.angles)
    assert line["step"] == moment.step
    assert read(line["places"]) == pytest.approx((places - shown.setting.grid.centre).ravel(), abs=UNIT)
    assert read(line["turns"]) == pytest.approx(turns.ravel(), abs=TURN)
    assert moment.contacts is not None
    assert (read(line["touched"]) == moment.contacts).all()


@pytest.mark.parametrize("share", [0.5, 1.3])
def test_ghosts_are_spread_as_the_belief_is_about_the_hand(shown: Shown, share: float) -> None:
    """Wherever that is: recorded hands bend further than ours can."""
    encoder, moment = Encoder(shown.setting), shown.moments[20]
    low, high = shown.setting.hand.joint_limits.T
    there = moment._replace(angles=low + share * (high - low))
    poses = encoder._ghosts(there)
    assert poses.shape == (GHOSTS, shown.setting.hand.joints)
    assert poses.mean(axis=0) == pytest.approx(there.angles, abs=1e-9)
    assert (poses.std(axis=0) / moment.std).mean() == pytest.approx(1.0, abs=0.3)
    assert encoder._ghosts(there._replace(std=0.0 * moment.std)) == pytest.approx(np.tile(there.angles, (GHOSTS, 1)))


def test_of_the_map_all_is_told_that_may_be_solid(shown: Shown) -> None:
    (moment,), line = shown.moments[-1:], told(shown, "map")[-1]
    assert moment.occupancy is not None
    flat = shown.belief.occupancy.ravel()
    cells = read(line["cells"])
    assert set(np.flatnonzero(flat > 0.51)) <= set(cells)
    assert (flat[cells] > LEAST - 0.003).all()
    assert (flat[cells] != 0.5).all()
    assert read(line["chances"]) / 255.0 == pytest.approx(flat[cells], abs=1 / 250)


def test_surfaces_and_the_truth_are_meshes(shown: Shown) -> None:
    for line in (*told(shown, "surface"), *told(shown, "truth")):
        faces, vertices = read(line["faces"]), read(line["vertices"]).reshape(-1, 3)
        assert faces.max() < len(vertices) == len(read(line["values"]))
        assert np.abs(vertices).max() < shown.setting.grid.extent.max()
    assert len(told(shown, "surface")) >= 2
    assert told(shown, "truth")[0]["label"] == 0


def test_the_last_is_the_map_in_hindsight_at_the_last_step(shown: Shown) -> None:
    assert [told(shown, kind)[-1]["step"] for kind in ("state", "map", "surface")] == [110, 110, 110]
    assert shown.moments[-1].truth is not None


@pytest.mark.parametrize("name", ["two_finger", "adroit"])
def test_every_patch_has_triangles_on_its_own_link(name: str) -> None:
    hand = hands.make(name)
    skin = skin_of(hand)
    owner = np.repeat(np.arange(len(hand.links)), np.diff([*skin["first"], len(skin["patches"])]))
    felt = skin["patches"] >= 0
    assert set(skin["patches"][felt]) == set(range(len(hand.patches)))
    assert (hand.patches.link[skin["patches"][felt]] == owner[felt]).all()
    bones = np.array([link.length for link in hand.links])[owner]
    out = skin["places"].astype(float)
    out[:, 2] -= out[:, 2].clip(0.0, bones)
    assert np.linalg.norm(out, axis=1) == pytest.approx(np.array([link.radius for link in hand.links])[owner], rel=1e-3)
    corners = skin["places"].reshape(-1, 3, 3)
    across = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    assert (np.einsum("fi,fi->f", across, skin["normals"].reshape(-1, 3, 3).mean(axis=1)) > -1e-12).all()


@pytest.mark.parametrize("rate", [1.0, 20.0, 50.0, 60.0, 100.0, 500.0])
def test_frames_come_at_one_pace_whatever_the_rate(rate: float) -> None:
    pace = Pace(rate)
    steps = [step for step in range(1, 2001) if pace.frame(step)]
    assert len(steps) == pytest.approx(2000 / rate * min(rate, 25.0), rel=0.3)


def test_a_moment_comes_over_as_it_was(shown: Shown) -> None:
    for moment in (shown.moments[0], shown.moments[20], shown.moments[-1]):
        told = pickle.loads(pickle.dumps(packed(moment)))
        assert same(unpacked(told), moment)


def same(one: Any, other: Any) -> bool:
    if isinstance(one, tuple):
        return len(one) == len(other) and all(map(same, one, other))
    return type(one) is type(other) and bool(np.array_equal(one, other))


def test_the_surface_is_that_of_the_belief(shown: Shown) -> None:
    """Touches that were told bit by bit, and maps in bytes, are enough to draw it."""
    last, surface = told(shown, "surface")[-1], shown.belief.surface()
    vertices = read(last["vertices"]).reshape(-1, 3) + shown.setting.grid.centre
    away, _ = cKDTree(surface.vertices).query(vertices)
    assert np.median(away) < 5e-4
    assert read(last["values"]).mean() == pytest.approx(255.0 * (1e3 * surface.std / LIMIT).clip(0, 1).mean(), rel=0.05)


@pytest.mark.parametrize("times", [1, 40])
def test_the_surface_is_drawn_of_the_touches_that_a_belief_draws_it_of(
    shown: Shown, times: int, monkeypatch: pytest.MonkeyPatch
) -> None:
    """However many there are: they are chosen once."""
    links, rate = shown.belief.snapshot.touches.since(0)  # type: ignore[union-attr]
    log, given = TouchLog(shown.setting.hand.patches, rate, links * times), []
    assert (len(log) > MOST) == (times > 1)
    (moment,) = shown.moments[-1:]
    encoder = Encoder(shown.setting)
    encoder.touched(NewTouches.of(log, 0))
    surface_of = encoding.surface_of
    monkeypatch.setattr(encoding, "surface_of", lambda log, *rest: given.append(log) or surface_of(log, *rest))
    encoder.surface(moment._replace(touches=NewTouches.of(log, len(log))))
    for mine, theirs in zip(given[0].skin(), log.skin(), strict=True):
        np.testing.assert_array_equal(mine, theirs)


def test_touches_are_told_anew_where_not_all_were_kept(shown: Shown) -> None:
    links, rate = shown.belief.snapshot.touches.since(0)  # type: ignore[union-attr]
    pace, every, patches = Pace(50.0), list(links), shown.setting.hand.patches

    def told(of: list[Any], step: int) -> NewTouches:
        snapshot = OccupancySnapshot(lambda: shown.belief.occupancy, TouchLog(patches, rate, of))
        belief = replace(shown.belief, snapshot=snapshot)
        return pace.take(step, belief, np.ones(1), None, whole=True).touches  # type: ignore[return-value]

    assert told(every, 1).begin == 0
    every.append(links[0])
    assert (told(every, 2).begin, len(told(every, 3).counts)) == (len(links), 0)
    some = [*every[::2], *links, *links]
    new = told(some, 4)
    assert (new.begin, len(new.counts)) == (0, len(some))
