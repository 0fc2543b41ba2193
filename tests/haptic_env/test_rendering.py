"""Pictures: offscreen everywhere, in a window where there is a display."""

from __future__ import annotations

import copy
import functools
import os

import gymnasium as gym
import numpy as np
import pytest

import agents
import haptic_env
from haptic_env import scene


@functools.cache
def _coarse(model):
    """Its like, of which shadows and round things are drawn coarsely: with a tenth of the work."""
    model = copy.copy(model)
    quality = model.vis.quality
    quality.shadowsize, quality.numslices, quality.numstacks, quality.numquads = 256, 8, 6, 2
    return model


@pytest.fixture
def coarse(monkeypatch: pytest.MonkeyPatch) -> None:
    """Pictures are coarse, where it matters only whether they are the same."""
    compose = scene.compose
    monkeypatch.setattr(scene, "compose", lambda *given, **keywords: _coarse(compose(*given, **keywords)))


@pytest.fixture(scope="session", autouse=True)
def offscreen() -> None:
    """Skip where nothing can be drawn, but never in CI."""
    env = gym.make(next(iter(haptic_env.ENVIRONMENTS)), render_mode="rgb_array")
    env.reset(seed=0)
    try:
        env.render()
    except Exception as error:
        if os.environ.get("CI"):
            raise
        pytest.skip(f"no offscreen rendering here: {error!r}")
    env.close()


def _red(picture: np.ndarray) -> int:
    """How many pixels are as red as a lit patch."""
    red, green, blue = np.moveaxis(picture.astype(int), -1, 0)
    return int(((red > 120) & (green < 60) & (blue < 60)).sum())


def _explore_until_lit(env) -> None:
    """Explore by random torques until a lit patch is seen; nothing is lit before something is touched."""
    observation, _ = env.reset(seed=0)
    policy, state = agents.make("random_torque", env, seed=0), None
    for _ in range(500):
        torque, state = policy.predict(observation, state)
        observation = env.step(torque)[0]
        if observation["contacts"].any() and _red(env.render()) > 20:
            return
    raise AssertionError("no lit patch was seen")


def test_picture_shows_hand_and_object(env_id, make):
    env = make(env_id, shape="cube", render_mode="rgb_array")
    env.reset(seed=0)
    picture = env.render()
    assert picture.dtype == np.uint8
    assert picture.shape == (480, 640, 3)
    assert 0.05 < (picture < 240).any(axis=-1).mean() < 0.9
    assert not picture[0].min() < 250, "the background is white"


@pytest.mark.usefixtures("coarse")
def test_picture_follows_the_hand(env_id, make):
    env = make(env_id, shape="cube", render_mode="rgb_array")
    env.reset(seed=0)
    before = env.render()
    np.testing.assert_array_equal(before, env.render())
    for _ in range(10):
        env.step(np.ones(env.action_space.shape, np.float32))
    assert (before != env.render()).any(axis=-1).mean() > 0.02


@pytest.mark.usefixtures("coarse")
def test_active_patches_are_lit(env_id, make):
    env = make(env_id, shape="sphere", render_mode="rgb_array", contact_miss=0.0)
    env.reset(seed=0)
    assert _red(env.render()) == 0
    _explore_until_lit(env)
    env.reset(seed=0)
    assert _red(env.render()) == 0


@pytest.mark.usefixtures("coarse")
def test_picture_follows_a_change_of_object(env_id, make):
    env = make(env_id, render_mode="rgb_array")
    env.reset(seed=0, options={"shape": "sphere"})
    sphere = env.render()
    for shape in ("cube", "pyramid"):
        env.reset(seed=0, options={"shape": shape})
        assert (sphere != env.render()).any(axis=-1).mean() > 0.01, shape
    env.reset(seed=0, options={"shape": "sphere"})
    np.testing.assert_array_equal(sphere, env.render())


@pytest.mark.usefixtures("coarse")
def test_picture_follows_a_change_of_pose(env_id, make):
    env = make(env_id, shape="cube", render_mode="rgb_array")
    env.reset(seed=0)
    straight = env.render()
    env.reset(seed=0, options={"quaternion": [1.0, 0.0, 0.0, 0.4]})
    assert (straight != env.render()).any(axis=-1).mean() > 0.002


@pytest.mark.usefixtures("coarse")
def test_two_environments_draw_apart(env_id, make):
    first, second = (make(env_id, shape=shape, render_mode="rgb_array") for shape in ("cube", "sphere"))
    first.reset(seed=0)
    cube = first.render()
    second.reset(seed=0)
    sphere = second.render()
    np.testing.assert_array_equal(cube, first.render())
    np.testing.assert_array_equal(sphere, second.render())
    assert (cube != sphere).any()


@pytest.mark.usefixtures("coarse")
def test_rendering_leaves_the_exploration_as_it_is(env_id, make, play, same):
    seen = make(env_id, render_mode="rgb_array")
    assert same(play(make(env_id), 0, 50), play(seen, 0, 50))
    seen.render()
    assert same(play(make(env_id), 1, 50), play(seen, 1, 50))


@pytest.mark.usefixtures("coarse")
def test_hundreds_of_patches_can_be_drawn(env_id, make):
    env = make(env_id, render_mode="rgb_array", patches_along=6, patches_around=10)
    env.reset(seed=0)
    assert env.render().shape == (480, 640, 3)


@pytest.mark.usefixtures("coarse")
def test_closing_twice_is_allowed(env_id, make):
    env = make(env_id, render_mode="rgb_array")
    env.reset(seed=0)
    env.render()
    env.close()
    env.close()


def test_window_opens_where_there_is_a_display(env_id, make, display):
    if not display:
        pytest.skip("no display")
    env = make(env_id, render_mode="human")
    env.reset(seed=0)
    env.step(env.action_space.sample())


def test_rendering_without_a_mode_warns_and_draws_nothing(env_id, make):
    env = make(env_id).unwrapped
    env.reset(seed=0)
    with pytest.warns(UserWarning, match="render_mode"):
        assert env.render() is None


@pytest.mark.usefixtures("coarse")
@pytest.mark.filterwarnings("ignore::pytest.PytestUnraisableExceptionWarning")  # of a viewer that was never made
@pytest.mark.parametrize("kind", ["disabled", "nonsense"])
def test_without_opengl_a_picture_says_what_to_do_and_exploring_goes_on(make, monkeypatch, kind):
    env = make("HapticSLAM/TwoFinger-v0", render_mode="rgb_array")
    env.reset(seed=0)
    with monkeypatch.context() as without:
        without.setenv("MUJOCO_GL", kind)
        with pytest.raises(RuntimeError, match=rf"draws with OpenGL, .*MUJOCO_GL='{kind}' .*set MUJOCO_GL=egl"):
            env.render()
    env.step(np.zeros(8))
    assert env.render().shape == (480, 640, 3)
