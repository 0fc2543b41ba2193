"""A copied or pickled environment goes on as the original would, bit for bit."""

from __future__ import annotations

import copy
import pickle

import numpy as np
import pytest

from haptic_env import shapes
from haptic_env.recordings import ObserverInputs, Recording, Track
from haptic_env.replay import KinematicReplay, Playback

COPIES = {"deepcopy": copy.deepcopy, "pickle": lambda env: pickle.loads(pickle.dumps(env))}
NOISY = {
    "bias_deg": 1.0,
    "drift_deg": 1.0,
    "proportional": 0.1,
    "contact_miss": 0.1,
    "contact_false_alarm": 0.01,
    "size_jitter": 0.1,
    "yaw_jitter": 20.0,
    "reveal_truth": True,
}
SETTINGS = {
    "default": {},
    "one shape": {"shape": "cube", "control_hz": 100.0},
    "all noises": NOISY,
    "no noise": {"sigma_deg": 0.0},
}


@pytest.fixture(params=COPIES)
def copied(request):
    """Each way to copy."""
    return COPIES[request.param]


@pytest.mark.parametrize("settings", SETTINGS)
def test_a_copy_in_mid_episode_goes_on_as_the_original(env_id, make, same, copied, settings):
    """In contact, on to the end of the episode and into the next one, of a seed that neither is told."""
    env = make(env_id, **{"shape": "sphere", "episode_seconds": 1.0, **SETTINGS[settings]})
    actions = np.random.default_rng(1).uniform(-0.3, 1.0, (60, *env.action_space.shape)).astype(np.float32)
    env.reset(seed=3)
    env.action_space.seed(3)
    contacts = sum(int(env.step(action)[0]["contacts"].sum()) for action in actions[:30])
    assert contacts > 0
    twin = copied(env)
    # One after the other: what the one does is no matter of the other's.
    told = [[each.step(action) for action in actions[30:50]] + [each.reset()] for each in (env, twin)]
    assert same(*told)
    assert same([env.step(action) for action in actions[50:]], [twin.step(action) for action in actions[50:]])
    assert env.action_space.sample().tobytes() == twin.action_space.sample().tobytes()


def test_a_copy_is_apart(make, same, copied):
    """What happens to it leaves the original as it was."""
    env = make("HapticSLAM/TwoFinger-v0", shape="cube")
    other = make("HapticSLAM/TwoFinger-v0", shape="cube")
    actions = np.random.default_rng(1).uniform(-1, 1, (40, 8))
    for each in (env, other):
        each.reset(seed=0)
        for action in actions[:20]:
            each.step(action)
    twin = copied(env)
    for _ in range(30):
        twin.step(np.ones(8))
    assert same([env.step(action) for action in actions[20:]], [other.step(action) for action in actions[20:]])


def test_a_copy_of_what_has_not_begun(make, same, copied):
    env = make("HapticSLAM/TwoFinger-v0")
    twin = copied(env)
    assert same(env.reset(seed=5), twin.reset(seed=5))
    assert same(env.step(np.ones(8)), twin.step(np.ones(8)))


def test_a_copy_draws_the_same_picture(make, copied):
    pytest.importorskip("OpenGL")
    env = make("HapticSLAM/TwoFinger-v0", shape="cube", render_mode="rgb_array")
    env.reset(seed=0)
    for _ in range(40):
        env.step(np.ones(8))
    first = env.render()
    twin = copied(env)
    np.testing.assert_array_equal(twin.render(), first)
    twin.close()


def _replays(hand):
    still = np.tile([1.0, 0, 0, 0], (9, 1))
    time, angles = 0.02 * np.arange(9), np.linspace(hand.rest_pose, hand.rest_pose + 0.3, 9)
    place = Track(np.linspace([0.0, 0.0, 0.0], [0.01, 0.0, 0.0], 9), still)
    whole = Recording("it", time, hand.joint_names, angles, root=place, object=Track(np.zeros((9, 3)), still))
    yield KinematicReplay("two_finger", whole, shapes.make("cube"))
    felt = ObserverInputs(np.zeros((9, 8)), angles + 0.01, np.random.default_rng(0).random((9, 50)) < 0.1)
    yield Playback(hand, Recording("it", time, hand.joint_names, angles, felt=felt), shapes.make("cube"))


@pytest.mark.parametrize("which", [0, 1], ids=["KinematicReplay", "Playback"])
def test_a_copied_replay_goes_on_as_the_original(make, same, copied, which):
    hand = make("HapticSLAM/TwoFinger-v0").unwrapped.hand
    env = list(_replays(hand))[which]
    env.reset(seed=0)
    for _ in range(3):
        env.step(np.zeros(8))
    twin = copied(env)
    for _ in range(5):
        for one, other in zip(env.step(np.zeros(8)), twin.step(np.zeros(8)), strict=True):
            assert repr(one) == repr(other)
