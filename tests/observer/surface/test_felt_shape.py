"""What was felt as a candidate: a distance where it is known, next to nothing where it is not."""

from __future__ import annotations

import gymnasium as gym
import numpy as np
import pytest
import trimesh

from haptic_env import shapes
from observer import PoseOnly, ShapePosterior
from observer.surface import Surface
from observer.surface.felt_shape import FeltShape
from observer.surface.mesh import EMPTY

AROUND = np.random.default_rng(0).uniform(-0.05, 0.05, (200, 3))


def _surface(std, shift=(0.0, 0.0, 0.0), extents=(0.04, 0.05, 0.06)) -> Surface:
    box = trimesh.creation.box(extents).subdivide().subdivide()
    return Surface(np.array(box.vertices) + shift, np.array(box.faces), np.full(len(box.vertices), std))


@pytest.mark.parametrize("shift", [(0.0, 0.0, 0.0), (0.1, -0.02, 0.3)])
def test_where_it_is_known_the_distance_is_that_of_the_solid(shift):
    felt = FeltShape(_surface(0.0, shift))
    np.testing.assert_allclose(felt.default_size, (0.04, 0.05, 0.06))
    for scale in (1.0, 1.3):
        size = scale * np.array(felt.default_size)
        cuboid = shapes.make("cuboid", size)
        got = felt.signed_distance(AROUND.reshape(20, 10, 3), felt.check_size(size))
        np.testing.assert_allclose(got.ravel(), cuboid.signed_distance(AROUND), atol=1e-6)


def test_where_it_is_known_badly_is_told_beside_the_distance():
    box = _surface(0.001)
    felt = FeltShape(box._replace(std=np.where(box.vertices[:, 2] > 0.0, 0.008, 0.001)))
    above, below = np.array([[0.0, 0.0, 0.04]]), np.array([[0.0, 0.0, -0.04]])
    for scale in (1.0, 1.3):
        size = scale * np.array(felt.default_size)
        np.testing.assert_allclose(felt.signed_distance(above, size), 0.04 - scale * 0.03, atol=1e-6)
        np.testing.assert_allclose(felt.spread(scale * above, size), scale * 0.008)
        np.testing.assert_allclose(felt.spread(scale * below, size), scale * 0.001)
    assert shapes.make("cube").shape.spread(above, size) is None


@pytest.mark.parametrize(
    ("surface", "said"),
    [
        (EMPTY, "empty"),
        (_surface(0.0, extents=(0.5, 0.5, 0.5)), "0.5"),
        (_surface(0.0, extents=(0.001, 0.01, 0.01)), "0.001"),
    ],
)
def test_what_cannot_be_an_object_is_refused(surface, said):
    with pytest.raises(ValueError, match=said):
        FeltShape(surface)


def test_it_is_scaled_as_a_whole():
    with pytest.raises(ValueError, match="as a whole"):
        FeltShape(_surface(0.0)).check_size([0.04, 0.04, 0.04])


def test_candidates_of_the_same_content_share_a_field_on_disk_and_others_do_not():
    one, same, other = (FeltShape(_surface(std)) for std in (0.001, 0.001, 0.002))
    assert one.content == same.content != other.content


def test_what_is_known_exactly_is_as_probable_as_the_solid_itself():
    """A felt cube without any uncertainty, beside the solid: the same evidence."""
    box = trimesh.creation.box((0.05, 0.05, 0.05)).subdivide()
    felt = FeltShape(Surface(np.array(box.vertices), np.array(box.faces), np.zeros(len(box.vertices))))
    with gym.make("HapticSLAM/TwoFinger-v0", shape="cube", episode_seconds=3.0) as env:
        hand = env.unwrapped.hand
        slam = PoseOnly(hand)
        known = {name: [shapes.usual(name, hand)] for name in ("cube", "sphere")}
        posterior = ShapePosterior(hand, {**known, "felt": [felt.solid("felt", hand)]})
        seen, _ = env.reset(seed=1)
        slam.reset(1, seen["joint_angles"])
        env.action_space.seed(1)
        over = False
        while not over:
            action = env.action_space.sample()
            seen, _, _, over, _ = env.step(action)
            posterior.update(slam.step(action, seen["joint_angles"], seen["contacts"]))
    of_cube, of_ball, mine = posterior.log_likelihood
    assert mine == pytest.approx(of_cube, abs=0.2)
    assert abs(of_ball - of_cube) > 0.5
