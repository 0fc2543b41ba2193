"""Contact patches: a probe at a known place lights exactly the patch that is there."""

from __future__ import annotations

import re

import mujoco
import numpy as np
import pytest
from scipy.spatial import cKDTree

import haptic_env
from haptic_env import hands, scene, shapes
from haptic_env.hands import two_finger
from haptic_env.patches import Link, Patches

PROBE = 0.0025  # radius (m)
LAYOUTS = [(1, 1), (2, 4), (3, 5), (12, 16)]


@pytest.fixture(params=sorted(set(haptic_env.ENVIRONMENTS.values())))
def hand(request: pytest.FixtureRequest):
    """Every hand that an environment is registered for."""
    return hands.make(request.param)


def _rest_frames(hand) -> tuple[np.ndarray, np.ndarray]:
    """World position (L, 3) and rotation (L, 3, 3) of every link at the rest pose."""
    data = mujoco.MjData(hand.model)
    data.qpos[:] = hand.rest_pose
    mujoco.mj_kinematics(hand.model, data)
    return data.xpos[hand.link_bodies], data.xmat[hand.link_bodies].reshape(-1, 3, 3)


def _links_within(hand, centre: np.ndarray, radius: float) -> list[int]:
    """Which links' skins come within `radius` of the world point `centre`, from their bones alone."""
    near = []
    for index, (link, origin, frame) in enumerate(zip(hand.links, *_rest_frames(hand), strict=True)):
        local = (centre - origin) @ frame
        bone = np.array([0.0, 0.0, np.clip(local[2], 0.0, link.length)])
        if np.linalg.norm(local - bone) < link.radius + radius:
            near.append(index)
    return near


def _probes(hand, radius: float):
    """Each patch that a probe at its middle reaches without touching another link, and the probe's centre."""
    position, frame = _rest_frames(hand)
    link = hand.patches.link
    touching = hand.patches.position + (radius - 0.0002) * hand.patches.normal
    world = position[link] + np.einsum("pij,pj->pi", frame[link], touching)
    for patch, centre in enumerate(world):
        if _links_within(hand, centre, radius) == [link[patch]]:
            yield patch, centre


def test_a_probe_lights_exactly_the_patch_that_is_there(env_id, make):
    """The environment names the patches that an object touches at the start."""
    env = make(env_id, shape="sphere")
    hand = env.unwrapped.hand
    reach = hand.workspace / 2
    reached = 0
    for patch, centre in _probes(hand, PROBE):
        if (np.abs(centre - hand.grasp_centre) > reach).any():
            continue
        with pytest.raises(ValueError, match="lies where the hand rests") as error:
            env.reset(seed=0, options={"size": [2 * PROBE] * 3, "position": centre})
        named = re.search(r"it touches ([^)]*)\)", str(error.value))
        assert named is not None
        assert named[1] == hand.patches.names[patch]
        reached += 1
    assert reached > 0.3 * len(hand.patches), "the workspace holds the palmar side at least"


def test_the_observation_feels_the_probe_where_it_is(env_id, make):
    """The same through the observation and for every patch: the probe is put there while the hand rests."""
    env = make(env_id, shape="sphere").unwrapped
    env.reset(seed=0, options={"size": [2 * PROBE] * 3})
    probed = list(_probes(env.hand, PROBE))
    assert len(probed) > 0.7 * len(env.hand.patches), "bones side by side hide some patches of a palm"
    for patch, centre in probed:
        env._data.mocap_pos[:] = centre
        mujoco.mj_forward(env._model, env._data)
        env._touched = env._feel()
        np.testing.assert_array_equal(np.flatnonzero(env._observe()["contacts"]), [patch])


@pytest.mark.parametrize(("along", "around"), LAYOUTS)
def test_a_probe_lights_one_of_a_thousand_receptors(along, around):
    """The same through the scene for every layout, with a probe smaller than a receptor."""
    hand = two_finger.make(along, around)
    radius = 0.0004
    solid = shapes.Solid("sphere", shapes.SHAPES["sphere"], (2 * radius,) * 3)
    model = scene.compose(hand, solid)
    data = mujoco.MjData(model)
    data.qpos[:] = hand.rest_pose
    bodies = [model.body(link.body).id for link in hand.links]
    probed = list(_probes(hand, radius))
    for patch, centre in probed[:: max(1, len(probed) // 200)]:
        data.mocap_pos[:] = centre
        mujoco.mj_forward(model, data)
        assert data.ncon == 1
        body = data.xmat[bodies[hand.patches.link[patch]]].reshape(3, 3)
        local = (data.contact.pos[0] - data.xpos[bodies[hand.patches.link[patch]]]) @ body
        assert hand.patches.locate(hand.patches.link[[patch]], local[None]) == [patch]
    assert len(probed) > 0.6 * len(hand.patches)


def test_default_layout_is_two_along_and_four_around_and_the_tips():
    hand = two_finger.make()
    assert len(hand.patches) == 2 * (3 * 2 * 4 + 1)
    assert len(set(hand.patches.names)) == len(hand.patches)
    assert "index_distal_tip" in hand.patches.names
    assert "thumb_proximal_0_palmar" in hand.patches.names


def test_palmar_patches_face_the_object():
    hand = two_finger.make()
    position, frame = _rest_frames(hand)
    link = hand.patches.link
    normal = np.einsum("pij,pj->pi", frame[link], hand.patches.normal)
    inward = np.sign(hand.grasp_centre - position[link])[:, 0] * normal[:, 0]
    palmar = np.array([name.endswith("palmar") for name in hand.patches.names])
    dorsal = np.array([name.endswith("dorsal") for name in hand.patches.names])
    assert (inward[palmar] > 0.7).all()
    assert (inward[dorsal] < -0.7).all()


def test_a_thousand_patches_and_more(make):
    env = make("HapticSLAM/TwoFinger-v0", patches_along=12, patches_around=16)
    assert env.observation_space["contacts"].n > 1000
    observation, _ = env.reset(seed=0)
    for _ in range(60):
        observation = env.step(np.array([0, 1, 0.5, 0.5] * 2, np.float32))[0]
    assert observation in env.observation_space
    assert observation["contacts"].any()


@pytest.mark.parametrize(("along", "around"), LAYOUTS)
def test_areas_add_up_to_the_surface_of_each_link(along, around):
    hand = two_finger.make(along, around)
    for index, link in enumerate(hand.links):
        area = hand.patches.area[hand.patches.link == index].sum()
        expected = 2 * np.pi * link.radius * (link.length + link.radius)  # its cylinder and the cap at its end
        assert area == pytest.approx(expected, rel=1e-9)


@pytest.mark.parametrize(("along", "around"), LAYOUTS)
def test_patches_of_the_side_have_equal_areas(along, around):
    link = Link("link", "link", radius=0.008, length=0.03, tip=True)
    patches = Patches((link,), along, around)
    side = patches.area[: along * around]
    np.testing.assert_allclose(side, 2 * np.pi * link.radius * link.length / (along * around), rtol=1e-9)


@pytest.mark.parametrize(("along", "around"), LAYOUTS)
def test_locate_is_consistent_with_the_surface(along, around):
    hand = two_finger.make(along, around)
    for spacing in (0.0007, 0.002):
        skin = hand.patches.surface(spacing)
        np.testing.assert_array_equal(hand.patches.locate(skin.link, skin.points), skin.patch)
        np.testing.assert_array_equal(hand.patches.link[skin.patch], skin.link)
        assert set(skin.patch) == set(range(len(hand.patches))), "every patch has a point"


@pytest.mark.parametrize(("along", "around"), LAYOUTS)
def test_the_middle_of_a_patch_lies_in_it(along, around):
    patches = two_finger.make(along, around).patches
    np.testing.assert_array_equal(patches.locate(patches.link, patches.position), np.arange(len(patches)))


def test_middles_and_surface_lie_on_the_skin(hand):
    patches = hand.patches
    skin = patches.surface(0.001)
    for points, normals, links in (
        (skin.points, skin.normals, skin.link),
        (patches.position, patches.normal, patches.link),
    ):
        length = np.array([link.length for link in hand.links])[links]
        radius = np.array([link.radius for link in hand.links])[links]
        bone = np.clip(points[:, 2], 0.0, length)[:, None] * [0, 0, 1]
        np.testing.assert_allclose(np.linalg.norm(points - bone, axis=1), radius, atol=1e-12)
        np.testing.assert_allclose(points - bone, radius[:, None] * normals, atol=1e-12)


@pytest.mark.parametrize("spacing", [0.001, 0.003])
def test_surface_is_as_dense_as_asked(hand, spacing):
    skin = hand.patches.surface(spacing)
    for index in range(len(hand.links)):
        points = skin.points[skin.link == index]
        nearest = cKDTree(points).query(points, k=2)[0][:, 1]
        assert nearest.max() <= spacing * 1.01


def test_volume_fills_the_links(hand):
    spacing, depth = 0.001, 0.002
    inside = hand.patches.volume(spacing)
    for index, link in enumerate(hand.links):
        volume = np.pi * link.radius**2 * (link.length + 4 / 3 * link.radius)
        assert (inside.link == index).sum() * spacing**3 == pytest.approx(volume, rel=0.05)
    deep = hand.patches.volume(spacing, depth)
    length = np.array([link.length for link in hand.links])[deep.link]
    radius = np.array([link.radius for link in hand.links])[deep.link]
    bone = np.clip(deep.points[:, 2], 0.0, length)[:, None] * [0, 0, 1]
    assert (np.linalg.norm(deep.points - bone, axis=1) < radius - depth).all()


@pytest.mark.parametrize("keyword", ["patches_along", "patches_around"])
@pytest.mark.parametrize("value", [0, -1, 2.5, "4", None, True, 101])
def test_impossible_layouts_are_refused(keyword, value):
    with pytest.raises(ValueError, match=rf"{keyword} must be an integer in \[1, 100\], got {re.escape(repr(value))}"):
        hands.make("two_finger", **{keyword: value})
