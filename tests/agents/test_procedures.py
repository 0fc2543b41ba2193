"""What each policy is known for: synergies, the exploratory procedures, and looking ahead."""

from __future__ import annotations

import gymnasium as gym
import mujoco
import numpy as np
import pytest

import agents
from agents import lookahead, rollouts
from agents.finger_kinematics import FingerKinematics
from agents.map_lookahead import MapLookahead
from agents.synergy import opposition_basis
from haptic_env import shapes
from haptic_env.hands import HANDS
from observer import HapticSLAM, ObserverWrapper, ShapePosterior
from observer.kinematics import link_frames, tree_of
from observer.novelty import BY_PLACE, note
from observer.pose.forward_model import ForwardModel
from observer.shape.skin import SKIN_SPACING


@pytest.fixture(scope="module", params=list(HANDS))
def hand(request: pytest.FixtureRequest):
    """Every registered hand."""
    return HANDS[request.param]()


@pytest.fixture
def env():
    """The two-finger hand about a cube, an observer beside it."""
    made = gym.make("HapticSLAM/TwoFinger-v0", shape="cube", sigma_deg=1.0)
    hand = made.unwrapped.hand
    wrapped = ObserverWrapper(made, HapticSLAM(hand, 1.0, particles=1), ShapePosterior(hand))
    yield wrapped
    wrapped.close()


def _contacts(env: gym.Env, policy: agents.Policy, steps: int) -> np.ndarray:
    """(steps, P)."""
    observation, _ = env.reset(seed=0)
    state, felt = None, []
    for _ in range(steps):
        action, state = agents.act(policy, observation, state)
        observation = env.step(action)[0]
        felt.append(observation["contacts"])
    return np.array(felt, dtype=bool)


def _touching(hand, pose: np.ndarray, solid) -> np.ndarray:
    """(P,): the patches with a point of their skin as near to `solid` as lookahead takes for a contact."""
    skin, (position, rotation) = hand.patches.surface(SKIN_SPACING), link_frames(tree_of(hand), pose)
    world = position[skin.link] + np.einsum("mij,mj->mi", rotation[skin.link], skin.points)
    gaps = np.full(len(hand.patches), np.inf)
    np.minimum.at(gaps, skin.patch, solid.signed_distance(world))
    return gaps < lookahead.FELT


# FingerKinematics


def test_every_joint_that_moves_a_tip_belongs_to_its_finger(hand):
    kinematics, tree = FingerKinematics(hand), tree_of(hand)
    tips = [index for index, link in enumerate(hand.links) if link.tip]
    assert kinematics.fingers == len(tips)
    for joint in range(hand.joints):
        angles = np.array(hand.rest_pose, dtype=np.float64)
        before = [each.copy() for each in link_frames(tree, angles)]
        angles[joint] += 0.1
        after = link_frames(tree, angles)
        for finger, link in enumerate(tips):
            same = np.allclose(before[0][link], after[0][link]) and np.allclose(before[1][link], after[1][link])
            assert kinematics.moves[finger, joint] == (not same)


def test_closing_brings_the_links_of_each_finger_nearer(hand):
    kinematics, tree = FingerKinematics(hand), tree_of(hand)
    rest = np.array(hand.rest_pose, dtype=np.float64)
    close = kinematics.strokes(rest, hand.grasp_centre).close
    assert np.abs(close).max() <= 1.0 + 1e-9

    def away(angles: np.ndarray) -> np.ndarray:
        position, rotation = link_frames(tree, angles)
        middle = position + 0.5 * np.array([link.length for link in hand.links])[:, None] * rotation[:, :, 2]
        return np.linalg.norm(middle - hand.grasp_centre, axis=1)

    for finger in range(kinematics.fingers):
        mine = kinematics.links[finger]
        assert away(rest + 0.05 * close[finger])[mine].mean() < away(rest)[mine].mean()


# Synergies


def test_without_recordings_all_fingers_close_first(hand):
    basis = opposition_basis(hand)
    assert np.abs(basis).max(axis=1) == pytest.approx(1.0)
    kinematics = FingerKinematics(hand)
    close = kinematics.strokes(hand.rest_pose, hand.grasp_centre).close
    assert (np.einsum("fj,j->f", close, basis[0]) > 0).all()


@pytest.mark.parametrize("ending", [".npy", ".csv"])
def test_synergies_are_the_principal_components_of_recordings(env, tmp_path, ending):
    rng = np.random.default_rng(0)
    ways = np.array([[0, 1, 1, 1, 0, 1, 1, 1], [1, 0, 0, 0, -1, 0, 0, 0.0]])
    angles = 0.3 + rng.standard_normal((400, 2)) * [1.0, 0.8] @ ways + 0.01 * rng.standard_normal((400, 8))
    path = tmp_path / f"angles{ending}"
    if ending == ".npy":
        np.save(path, angles)
    else:
        np.savetxt(path, angles, delimiter=",")
    policy = agents.make("synergy", env, seed=0, recordings=path)
    np.testing.assert_allclose(policy.basis[0], ways[0], atol=0.1)
    np.testing.assert_allclose(np.abs(policy.basis[1]), np.abs(ways[1]), atol=0.1)
    assert len(policy.basis) == 2, "nine tenths of the variance"
    torques = np.array([policy.predict(None)[0] for _ in range(20)], dtype=np.float64)
    assert np.linalg.matrix_rank(torques[(np.abs(torques) < 1).all(axis=1)], tol=1e-4) == 2


def test_recordings_of_other_joints_are_refused(env, tmp_path):
    path = tmp_path / "angles.npy"
    np.save(path, np.zeros((10, 5)))
    with pytest.raises(
        ValueError, match=r"shape \(T, 8\), one column for each of thumb_mcp_abduction.*shape \(10, 5\)"
    ):
        agents.make("synergy", env, recordings=path)
    with pytest.raises(ValueError, match=r"\.npy or \.csv file of joint angles, got .*nothing"):
        agents.make("synergy", env, recordings=tmp_path / "nothing.csv")


ZEROS = np.zeros((10, 8))


@pytest.mark.parametrize(
    ("content", "told"),
    [
        (np.full((10, 8), 45.0), "joint_angles of .* is 45 at frame 0, beyond 12.57 rad; .* are these degrees"),
        (np.full((10, 8), 1e300), "joint_angles of .* is 1e.300 at frame 0, beyond 12.57 rad"),
        (np.full((10, 8), np.nan), "joint_angles of .* is nan at frame 0, which is not finite"),
        (ZEROS + 1j, "joint_angles must be numbers, got complex128"),
        (np.array([{}]), "recordings must be a .npy or .csv file .*it holds object"),
        ("0,0,0,0,0,0,0,1e999\n" * 3, "joint_angles of index_dip_flexion is inf at frame 0"),
        ("", "recordings must be finite angles"),
        ("0,0\n0\n", "recordings must be a .npy or .csv file"),
        (b"\xff\xfe", "not a text file"),
    ],
)
def test_recordings_of_no_angles_are_refused(env, tmp_path, content, told):
    path = tmp_path / ("angles.npy" if isinstance(content, np.ndarray) else "angles.csv")
    if isinstance(content, np.ndarray):
        np.save(path, content)
    else:
        path.write_bytes(content.encode() if isinstance(content, str) else content)
    with pytest.raises(ValueError, match=told):
        agents.make("synergy", env, recordings=path)


# Exploratory procedures


def test_both_procedures_touch_far_more_than_random_torques(env):
    touched = {
        name: _contacts(env, agents.make(name, env, seed=0), 150).any(axis=1).mean()
        for name in ("random_torque", "enclosure", "contour_following")
    }
    assert min(touched["enclosure"], touched["contour_following"]) > 0.5
    assert touched["contour_following"] > touched["random_torque"] + 0.2


def test_enclosure_touches_with_more_links_at_once_than_contour_following(env):
    patches = env.unwrapped.hand.patches

    def links(name: str) -> float:
        felt = _contacts(env, agents.make(name, env, seed=0), 200)
        each = np.array([felt[:, patches.link == link].any(axis=1) for link in range(len(patches.links))])
        return each.sum(axis=0)[felt.any(axis=1)].mean()

    assert links("enclosure") > links("contour_following") > links("random_torque")


def test_a_finger_presses_harder_until_it_feels_contact(env):
    policy = agents.make("contour_following", env, seed=0)
    observation, _ = env.reset(seed=0)
    nothing = observation | {"contacts": np.zeros_like(observation["contacts"])}
    everything = observation | {"contacts": np.ones_like(observation["contacts"])}
    _, state = policy.predict(nothing)
    _, more = policy.predict(nothing, state)
    _, less = policy.predict(everything, state)
    assert (more[0] > state[0]).all()
    assert (less[0] < state[0]).all()


# Looking ahead


def test_unknown_objective_lists_the_known(env):
    with pytest.raises(ValueError, match="unknown objective 'shape'; choose from class, map"):
        agents.make("information_gain", env, objective="shape")


def _line(hand, held: np.ndarray) -> rollouts.Line:
    state = np.concatenate([hand.rest_pose, np.zeros(hand.joints)])
    ahead = ForwardModel(hand, 50.0).predict(state, held)
    low, high = (np.ascontiguousarray(each) for each in hand.joint_limits.T)
    return rollouts.Line(state, ahead.state, ahead.transition, ahead.torque_gain, low, high)


def test_the_rolled_out_hand_stops_at_the_object_as_the_simulated_one_does():
    """Closing on a cube: the line with what holds fingers out, against MuJoCo with the object."""
    env = gym.make("HapticSLAM/TwoFinger-v0", shape="cube", sigma_deg=0.0, motor_noise=0.0, reveal_truth=True)
    hand = env.unwrapped.hand
    torque = 0.5 * FingerKinematics(hand).strokes(hand.rest_pose, hand.grasp_centre).close.sum(axis=0)
    env.reset(seed=0)
    for _ in range(25):
        _, _, _, _, info = env.step(torque.astype(np.float32))
    posterior = ShapePosterior(hand, {"cube": [shapes.make("cube", position=hand.grasp_centre)]})
    line = _line(hand, np.zeros(hand.joints))
    looks = np.empty((5, hand.joints))
    solids = posterior.hypotheses.solids
    plan = rollouts.Plan(line, torque[None] * hand.torque_limits, 5, len(looks))
    rollouts.roll(rollouts.hand_of(hand), solids, 0, plan, 0, looks)
    error = np.abs(looks[-1] - info["truth"]["joint_angles"])
    assert error.max() < np.deg2rad(10.0)
    assert error.mean() < np.deg2rad(3.0)
    assert np.abs(looks[-1] - hand.rest_pose).max() > np.deg2rad(30.0), "it has moved much further than that"
    position, rotation = link_frames(tree_of(hand), looks[-1])
    skin = hand.patches.surface(0.002)
    points = position[skin.link] + np.einsum("mij,mj->mi", rotation[skin.link], skin.points)
    deepest = shapes.make("cube", position=hand.grasp_centre).signed_distance(points).min()
    assert -0.003 < deepest < 0.001, "fingers touch and do not sink in"


def test_what_tells_candidates_apart_leaves_less_entropy():
    """A large and a small ball: closing says which, staying away does not."""
    env = gym.make("HapticSLAM/TwoFinger-v0")
    hand = env.unwrapped.hand
    balls = {name: [shapes.make("sphere", [size] * 3, hand.grasp_centre)] for name, size in (("s", 0.03), ("l", 0.055))}
    shape = ShapePosterior(hand, balls)
    solids, log_weights, label = shape.hypotheses
    np.testing.assert_allclose(np.exp(log_weights), 0.5)
    close = 0.7 * FingerKinematics(hand).strokes(hand.rest_pose, hand.grasp_centre).close.sum(axis=0)
    push = np.array([-close, close]) * hand.torque_limits
    of_hand = rollouts.hand_of(hand)
    line = _line(hand, np.zeros(hand.joints))
    told = lookahead.LookaheadModel(tolerance=0.002, surprise=0.001, weight=0.2, said=shape.said, alike=0.008)
    worlds = lookahead.Worlds(solids, log_weights, label, np.array([0, 1]))
    plan = rollouts.Plan(line, push, 5, 5)
    left, again = np.empty((2, 2, 2))
    lookahead.class_entropies(0, 2, of_hand, worlds, plan, told, left)
    assert left[0] == pytest.approx([1.0, 1.0], abs=1e-6)
    assert left[1].max() < 0.7
    # Once what would be felt of either was felt, nothing more is to be learnt from it.
    poses, alike, news = np.empty((5, hand.joints)), np.full(len(hand.links), 0.008), np.empty(len(hand.links))
    for world in range(2):
        rollouts.roll(of_hand, solids, world, plan, 1, poses)
        for pose in np.repeat(poses, 50, axis=0):
            contacts = _touching(hand, pose, list(balls.values())[world][0])
            note(shape.said, link_frames(of_hand.tree, pose), contacts, alike, 0.2, 0.001, BY_PLACE, news)
    lookahead.class_entropies(0, 2, of_hand, worlds, plan, told, again)
    assert again[1].min() > 0.95


def test_a_map_gains_where_the_hand_has_not_been(env):
    """To relax from the open hand sweeps more of what is not known than to stay open does, and less the second time."""
    hand = env.unwrapped.hand
    ahead = MapLookahead(hand)
    opening = -0.5 * FingerKinematics(hand).strokes(hand.rest_pose, hand.grasp_centre).close.sum(axis=0)
    push = np.array([np.zeros(hand.joints), opening]) * hand.torque_limits
    line = _line(hand, np.zeros(hand.joints))
    env.reset(seed=0, options={"size": (0.02, 0.02, 0.02)})
    first = ahead.gain(env.map_now(), env.belief.grid, line, push, 5, 5)
    for _ in range(60):
        env.step(np.zeros(hand.joints, np.float32))
    second = ahead.gain(env.map_now(), env.belief.grid, line, push, 5, 5)
    assert first[0] > first[1] > 0.0
    assert second[0] < 0.5 * first[0]


def test_what_a_map_gains_is_weighed_by_the_map_in_hindsight(env, monkeypatch):
    policy = agents.make("information_gain", env, seed=0, objective="map")
    weighed, gain = [], policy._map.gain
    monkeypatch.setattr(policy._map, "gain", lambda *told: weighed.append(told[0]) or gain(*told))
    observation, _ = env.reset(seed=0)
    state, maps = None, []
    for step in range(41):
        if step % policy.steps == 0:
            maps.append(env.observer.map_now())
        torque, state = policy.predict(observation, state)
        observation, *_ = env.step(torque)
    np.testing.assert_array_equal(weighed, maps)
    assert len(maps) == 5
    assert not np.array_equal(maps[-1], env.belief.occupancy)


def test_the_hand_alone_is_never_changed(env):
    hand = env.unwrapped.hand
    before = mujoco.MjModel.from_xml_string(hand.xml).opt.disableflags
    _contacts(env, agents.make("information_gain", env, seed=0), 5)
    assert hand.model.opt.disableflags == before
