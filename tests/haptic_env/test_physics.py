"""The body: human speeds, an object that nothing enters, fingers that do not feel each other."""

from __future__ import annotations

import functools
import itertools
from typing import Any, NamedTuple

import gymnasium as gym
import mujoco
import numpy as np
import pytest

import agents
from haptic_env import shapes
from haptic_env.scene import PHYSICS_SECONDS
from haptic_env.touch import Touch

DEEPEST = 0.001  # metres
DEEPEST_WHOLE_HAND = 0.0015  # whose joints are stronger
JITTER = {"size_jitter": 0.1, "position_jitter": 0.003, "yaw_jitter": 180.0}


def _depth(hand, place, turn, solid) -> np.ndarray:
    """(…) how deep (m) the skin of any link lies in `solid`: along its bone, radius less signed distance.

    Of bodies at `place` (…, B, 3) m, turned by `turn` (…, B, 3, 3).
    """
    length, radius = (np.array([getattr(link, name) for link in hand.links]) for name in ("length", "radius"))
    along = np.linspace(0.0, length, 40)[..., None]  # (40, B, 1)
    points = place[..., None, :, :] + along * turn[..., None, :, :, 2]
    return (radius - solid.signed_distance(points)).max(axis=(-2, -1))


def _depth_now(env) -> float:
    data, bodies = env._data, env._touch.bodies
    return float(_depth(env.hand, data.xpos[bodies], data.xmat[bodies].reshape(-1, 3, 3), env.solid))


def _objects(shape: str):
    """Poses and sizes of `shape` as `reset` options."""
    size = np.asarray(shapes.SHAPES[shape].default_size)
    yield {}
    yield {"size": 0.8 * size, "quaternion": [1.0, 0.2, 0.3, 0.5]}


@pytest.mark.parametrize("shape", shapes.SHAPES)
def test_full_torque_does_not_push_a_finger_into_the_object(env_id, make, shape):
    env = make(env_id, shape=shape, motor_noise=0.0).unwrapped
    joints = env.hand.joints
    rng = np.random.default_rng(0)
    if joints <= 8:
        pushes = [np.array(signs * (joints // 4)) for signs in itertools.product((-1.0, 1.0), repeat=4)]
    else:
        pushes = list(rng.choice((-1.0, 1.0), (8, joints)))
    touched = False
    for options in _objects(shape):
        for push in pushes:
            env.reset(seed=0, options=options)
            places, turns, bodies = [], [], env._touch.bodies
            for _ in range(60):
                touched |= env.step(push.astype(np.float32))[0]["contacts"].any()
                places.append(env._data.xpos[bodies])
                turns.append(env._data.xmat[bodies].reshape(-1, 3, 3))
            deepest = _depth(env.hand, np.array(places), np.array(turns), env.solid)
            assert deepest.max() < (DEEPEST if joints <= 8 else DEEPEST_WHOLE_HAND)
    assert touched


class Explored(NamedTuple):
    """What was felt and true at each of T steps of random torque, the rest pose included; B bodies that have skin.

    `angles`, `velocities` (T, J) rad, `touched` (T, P), `place` (T, B, 3) m, `turn` (T, B, 3, 3).
    """

    env: Any
    angles: np.ndarray
    velocities: np.ndarray
    touched: np.ndarray
    place: np.ndarray
    turn: np.ndarray


@functools.cache
def explored(env_id: str, shape: str, seed: int = 1) -> Explored:
    """Each exploration once."""
    env = gym.make(env_id, shape=shape, reveal_truth=True, **JITTER)
    inner, rows = env.unwrapped, []
    observation, info = env.reset(seed=seed)
    policy, state = agents.make("random_torque", env, seed=seed), None
    for step in range(501):
        truth, data, bodies = info["truth"], inner._data, inner._touch.bodies
        place, turn = data.xpos[bodies], data.xmat[bodies].reshape(-1, 3, 3)
        rows.append((truth["joint_angles"], truth["joint_velocities"], observation["contacts"], place, turn))
        if step < 500:
            action, state = policy.predict(observation, state)
            observation, *_, info = env.step(action)
    return Explored(inner, *(np.array(each) for each in zip(*rows, strict=True)))


@pytest.mark.parametrize("shape", shapes.SHAPES)
def test_random_torque_does_not_push_a_finger_into_the_object(env_id, shape):
    seeds = (1, 25) if shape == "pyramid" else (1,)  # the second lets a fingertip strike the apex
    for seed in seeds:
        one = explored(env_id, shape, seed)
        deepest = _depth(one.env.hand, one.place, one.turn, one.env.solid)
        assert len(deepest) == 501
        assert deepest.max() < DEEPEST
        assert deepest.max() > -0.001, "nothing was touched"


@pytest.mark.parametrize("shape", shapes.SHAPES)
def test_contacts_ring_only_where_the_skin_is_at_the_object(env_id, shape):
    one = explored(env_id, shape)
    patches = one.env.hand.patches
    skin = patches.surface(spacing=0.001)
    some = one.touched.any(axis=1)
    for touched, place, turn in zip(one.touched[some].astype(bool), one.place[some], one.turn[some], strict=True):
        mine = np.flatnonzero(touched[skin.patch])
        link = skin.link[mine]
        world = place[link] + np.einsum("mij,mj->mi", turn[link], skin.points[mine])
        nearest = np.full(len(patches), np.inf)
        np.minimum.at(nearest, skin.patch[mine], one.env.solid.signed_distance(world))
        assert (nearest[touched] < 0.001).all()
    assert one.touched.sum() > 40


@pytest.mark.parametrize("shape", shapes.SHAPES)
def test_random_torques_move_the_joints_at_human_speeds(env_id, shape):
    assert 30.0 < np.rad2deg(np.median(np.abs(explored(env_id, shape).velocities))) < 80.0


def test_joints_yield_only_a_little_at_their_limits(env_id):
    """Limits are as soft as ligaments: an object that a finger is pressed on may bend it somewhat further."""
    every = [explored(env_id, shape) for shape in shapes.SHAPES]
    low, high = every[0].env.hand.joint_limits.T
    angles = np.concatenate([each.angles for each in every])
    beyond = np.rad2deg(np.maximum(low - angles, angles - high))
    assert beyond.max() < 15.0
    assert (beyond > 5.0).mean() < 0.02


def test_fingers_pass_through_each_other(make):
    env = make("HapticSLAM/TwoFinger-v0", shape="sphere", motor_noise=0.0).unwrapped
    env.reset(seed=0, options={"size": [0.005] * 3, "position": [0.0, 0.06, -0.06]})
    model, data = env._model, env._data
    fingers = [[link.name for link in env.hand.links if link.name.startswith(name)] for name in ("thumb", "index")]
    gap = np.inf
    for _ in range(100):
        env.step(np.array([0.0, 1.0, 0.3, 0.3] * 2, np.float32))
        assert data.ncon == 0
        for thumb, index in itertools.product(*fingers):
            gap = min(gap, mujoco.mj_geomDistance(model, data, model.geom(thumb).id, model.geom(index).id, 1.0, None))
    assert gap < -0.002


def test_links_of_a_finger_do_not_feel_each_other(make):
    env = make("HapticSLAM/TwoFinger-v0", shape="sphere").unwrapped
    env.reset(seed=0, options={"size": [0.005] * 3, "position": [0.0, 0.06, -0.06]})
    for _ in range(100):
        env.step(np.ones(8, np.float32))
        assert env._data.ncon == 0


def test_object_is_fixed_in_space(env_id, make, play):
    env = make(env_id, shape="cube", reveal_truth=True)
    record = play(env, seed=0, steps=200)
    for step in record:
        truth = step[4]["truth"]
        np.testing.assert_array_equal(truth["object_position"], record[0][4]["truth"]["object_position"])
    np.testing.assert_allclose(env.unwrapped._data.body("object").xpos, truth["object_position"])


def test_motor_noise_is_drawn_once_per_control_step(make):
    """The same commands at zero noise follow the same path; with noise the paths part."""
    quiet = make("HapticSLAM/TwoFinger-v0", shape="cube", motor_noise=0.0, reveal_truth=True)
    noisy = make("HapticSLAM/TwoFinger-v0", shape="cube", motor_noise=0.3, reveal_truth=True)
    action = np.array([0.0, 0.5, 0.0, 0.0, 0.0, 0.5, 0.0, 0.0], np.float32)
    ends = {}
    for name, env in (("quiet", quiet), ("noisy", noisy)):
        ends[name] = []
        for seed in range(3):
            env.reset(seed=seed)
            for _ in range(10):
                info = env.step(action)[4]
            ends[name].append(info["truth"]["joint_angles"])
    np.testing.assert_array_equal(ends["quiet"][0], ends["quiet"][1])
    assert np.ptp(ends["noisy"], axis=0).max() > 1e-3


def test_one_step_is_one_control_period(env_id, make):
    for control_hz in (20.0, 50.0, 100.0):
        env = make(env_id, control_hz=control_hz).unwrapped
        env.reset(seed=0)
        env.step(np.zeros(env.hand.joints, np.float32))
        assert env._data.time == pytest.approx(1.0 / control_hz)
        assert env.substeps * PHYSICS_SECONDS == pytest.approx(1.0 / control_hz)


@pytest.mark.parametrize("control_hz", [50.0, 500.0])
def test_a_control_step_is_mujocos_own_steps_bit_for_bit(env_id, make, control_hz):
    """And what is felt are the contacts of the state that is reached."""
    env = make(env_id, shape="cube", control_hz=control_hz).unwrapped
    env.reset(seed=2)
    rng, torque, felt = np.random.default_rng(0), np.zeros(env.hand.joints), 0
    spec = mujoco.mjtState.mjSTATE_INTEGRATION
    state = np.empty(mujoco.mj_stateSize(env._model, spec))
    data = mujoco.MjData(env._model)
    for _ in range(int(4 * control_hz)):
        torque = 0.9 * torque + 0.3 * rng.standard_normal(env.hand.joints)
        mujoco.mj_getState(env._model, env._data, state, spec)
        contacts = env.step(np.tanh(torque).astype(np.float32))[0]["contacts"]
        mujoco.mj_setState(env._model, data, state, spec)
        data.ctrl[:] = env._data.ctrl
        mujoco.mj_step(env._model, data, env.substeps)
        assert data.qpos.tobytes() == env._data.qpos.tobytes()
        assert data.qvel.tobytes() == env._data.qvel.tobytes()
        mujoco.mj_forward(env._model, data)
        np.testing.assert_array_equal(contacts, Touch(env.hand, env._model, data).feel())
        felt += int(contacts.sum())
    assert felt > 20


def test_touch_is_that_of_each_contact_point(env_id, make):
    """Point by point in plain NumPy, for as many points as there are."""
    env = make(env_id, shape="cube")
    inner, counts = env.unwrapped, set()
    feel = inner._feel

    def check():
        data, patches, expected = inner._data, inner.hand.patches, np.zeros(len(inner.hand.patches), dtype=bool)
        for contact in data.contact:
            body = inner._model.geom_bodyid[list(contact.geom)].min()  # the object comes last
            link = int(np.flatnonzero(inner._touch.bodies == body)[0])
            local = (contact.pos - data.xpos[body]) @ data.xmat[body].reshape(3, 3)
            if contact.dist < 0:
                expected[patches.locate(np.array([link]), local[None])] = True
        touched = feel()
        np.testing.assert_array_equal(touched, expected)
        counts.add(data.ncon)
        return touched

    env.reset(seed=2)
    inner._feel = check
    for action in np.random.default_rng(1).uniform(-1, 1, (30, env.action_space.shape[0])).astype(np.float32):
        action[inner.hand.wrist] = 0.0  # so that the hand stays about the object
        for _ in range(10):
            env.step(action)
    assert {0, 1, 2} <= counts


@pytest.mark.statistical
@pytest.mark.parametrize("shape", shapes.SHAPES)
def test_many_explorations_are_human_and_stay_outside(env_id, make, play, shape):
    """Sizes, places and turns drawn anew: speeds and depth as above, over a hundred episodes."""
    env = make(env_id, shape=shape, reveal_truth=True, **JITTER)
    inner = env.unwrapped
    deepest, feel = [], inner._feel
    inner._feel = lambda: deepest.append(_depth_now(inner)) or feel()
    speeds = [
        np.abs(step[4]["truth"]["joint_velocities"]) for seed in range(100) for step in play(env, seed=seed, steps=500)
    ]
    assert 30.0 < np.rad2deg(np.median(speeds)) < 80.0
    assert max(deepest) < DEEPEST
