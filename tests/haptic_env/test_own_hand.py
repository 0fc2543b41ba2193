"""Hands of one's own, of a model and a TOML file: they are what the files say, and wrong files are one clear line."""

from __future__ import annotations

import importlib.util
from pathlib import Path

import gymnasium as gym
import mujoco
import numpy as np
import pytest

import agents
import haptic_env
from haptic_env import hand_of, hands, registration
from haptic_env.hands import own
from haptic_lab import recorded
from observer import HapticSLAM
from tests.haptic_env.own_hands import GRIPPER, gripper, parallel, taxels

LATTICE = """[patches]
along = 2                            # rows along each capsule of skin
around = 4                           # sectors around it
"""


@pytest.fixture
def made() -> own.OwnHand:
    """The gripper of the examples."""
    return own.read(GRIPPER / "gripper.toml")


def test_links_are_where_the_model_has_its_geoms(made):
    """At any angles, in the world: the middles of the capsules, and of the geoms that they are of."""
    hand, source = made.hand, mujoco.MjModel.from_xml_path(str(GRIPPER / "gripper.xml"))
    mine, theirs = mujoco.MjData(hand.model), mujoco.MjData(source)
    rng = np.random.default_rng(0)
    for _ in range(10):
        mine.qpos[:] = rng.uniform(*hand.joint_limits.T)
        theirs.qpos[:] = mine.qpos
        mujoco.mj_kinematics(hand.model, mine)
        mujoco.mj_kinematics(source, theirs)
        for link, body in zip(hand.links, hand.link_bodies, strict=True):
            if not link.name.startswith("palm"):
                middle = mine.xpos[body] + 0.5 * link.length * mine.xmat[body].reshape(3, 3)[:, 2]
                np.testing.assert_allclose(middle, theirs.geom(link.name).xpos, atol=1e-9)


def test_joints_are_those_of_the_model(made):
    hand, source = made.hand, mujoco.MjModel.from_xml_path(str(GRIPPER / "gripper.xml"))
    assert hand.joint_names == tuple(source.joint(j).name for j in range(source.njnt))
    np.testing.assert_allclose(hand.joint_limits, source.jnt_range, atol=1e-9)
    assert [link.name for link in hand.links if link.tip] == ["left_distal", "right_distal", "thumb_distal"]
    assert np.rad2deg(hand.rest_pose[hand.joint_names.index("left_close")]) == pytest.approx(-15.0)
    assert hand.torque_limits[hand.joint_names.index("thumb_close")] == pytest.approx(0.05)
    assert not hand.wrist.size


def test_a_urdf_makes_the_same_hand(made, tmp_path):
    other = own.read(gripper(tmp_path, model="gripper.urdf")).hand
    hand = made.hand
    assert other.joint_names == hand.joint_names
    assert other.patches.names == hand.patches.names
    np.testing.assert_allclose(other.joint_limits, hand.joint_limits, atol=1e-7)
    first, second = mujoco.MjData(hand.model), mujoco.MjData(other.model)
    rng = np.random.default_rng(1)
    for _ in range(5):
        first.qpos[:] = second.qpos[:] = rng.uniform(*hand.joint_limits.T)
        mujoco.mj_kinematics(hand.model, first)
        mujoco.mj_kinematics(other.model, second)
        for data in ("xpos", "xmat"):
            mine, theirs = getattr(first, data)[hand.link_bodies], getattr(second, data)[other.link_bodies]
            np.testing.assert_allclose(mine, theirs, atol=1e-6)


def test_palmar_sides_face_the_grasp_centre(made):
    hand = made.hand
    data = mujoco.MjData(hand.model)
    data.qpos[:] = hand.rest_pose
    mujoco.mj_kinematics(hand.model, data)
    for patch, name in enumerate(hand.patches.names):
        body = hand.link_bodies[hand.patches.link[patch]]
        turn = data.xmat[body].reshape(3, 3)
        inward = hand.grasp_centre - data.xpos[body] - turn @ hand.patches.position[patch]
        if "distal" in name and name.endswith(("palmar", "dorsal")):
            assert (turn @ hand.patches.normal[patch] @ inward > 0) == name.endswith("palmar"), name


@pytest.mark.parametrize("lattice", [True, False])
def test_it_explores_and_an_observer_with_defaults_follows(lattice):
    path = GRIPPER / ("gripper.toml" if lattice else "taxels.toml")
    env = gym.make("HapticSLAM/Explore-v0", hand=str(path), shape="cube", reveal_truth=True)
    hand = hand_of(env)
    observer, policy, state = HapticSLAM(hand, 3.0, particles=20), agents.make("random_torque", env, seed=0), None
    observation, info = env.reset(seed=900000)
    observer.reset(seed=0)
    touched, felt, believed = 0, [], []
    for _ in range(150):
        torque, state = policy.predict(observation, state)
        observation, _, _, _, info = env.step(torque)
        belief = observer.step(torque, observation["joint_angles"], observation["contacts"])
        touched += int(observation["contacts"].any())
        felt.append(observation["joint_angles"] - info["truth"]["joint_angles"])
        believed.append(belief.joint_angles - info["truth"]["joint_angles"])
    assert observation["contacts"].shape == (len(hand.patches),)
    assert touched > 0
    # Where skin feels nothing, fingers are stopped unseen: the forward model says less, but the angles are still felt.
    assert np.square(believed).mean() < (0.25 if lattice else 0.5) * np.square(felt).mean()


def test_every_place_that_takes_a_hand_takes_a_file(made):
    path = str(GRIPPER / "gripper.toml")
    assert hands.check("--hand", path) == registration.check("--env", path) == registration.hand_name(path) == path
    assert hands.make(Path(path)).joint_names == hand_of(registration.make(path)).joint_names == made.hand.joint_names
    assert set(hands.keywords_of(path)) == {"patches_along", "patches_around", "wrist"}
    assert haptic_env.EXPLORE in gym.registry


def test_patches_and_wrist_are_keywords(tmp_path):
    hand = hands.make(GRIPPER / "gripper.toml", patches_along=3, patches_around=5, wrist="free")
    assert (hand.patches.along, hand.patches.around) == (3, 5)
    assert hand.wrist.tolist() == list(range(6))
    assert hand.joints == 15
    with pytest.raises(ValueError, match="say nothing"):
        hands.make(gripper(tmp_path, (LATTICE, ""), more=taxels()), patches_along=3)


def test_slides_go_as_far_as_the_model_says(tmp_path):
    hand = hands.make(parallel(tmp_path, more="[joint.left_slide]\nrest_m = 0.01\ntorque = 2.0\n"))
    assert (hand.lever_arms > 0).all()
    assert not hand.wrist.size, "fingers that slide are no wrist"
    np.testing.assert_allclose(hand.joint_limits[:, 1] * hand.lever_arms, 0.03)
    np.testing.assert_allclose(hand.rest_pose * hand.lever_arms, [0.01, 0.0])
    np.testing.assert_allclose(hand.torque_limits[0] / hand.lever_arms[0], 2.0)
    data = mujoco.MjData(hand.model)
    mujoco.mj_kinematics(hand.model, data)
    before = data.xpos[hand.link_bodies].copy()
    data.qpos[:] = hand.joint_limits[:, 1]
    mujoco.mj_kinematics(hand.model, data)
    way = np.array([[0, 0.03, 0] if link.name.startswith("left") else [0, -0.03, 0] for link in hand.links])
    np.testing.assert_allclose(data.xpos[hand.link_bodies] - before, way, atol=1e-9)


def test_what_of_the_model_is_left_out_is_told(tmp_path):
    coupling = '<equality><joint name="mirror" joint1="left_slide" joint2="right_slide"/></equality>'
    motor = '<actuator><motor joint="left_slide"/></actuator>'
    notes = " ".join(own.read(parallel(tmp_path, after=coupling + motor)).notes)
    assert "joint 'left_slide' follows 'right_slide' (1·right_slide), and has no motor of its own" in notes
    assert "actuators of the model (1) are left out" in notes
    assert "without skin: base" in notes


def test_bodies_without_mass_or_skin_are_no_obstacle(tmp_path):
    """As those of URDFs often are: a bare link between two joints."""
    light = '<inertial mass="1e-12" pos="0 0 0" diaginertia="1e-12 1e-12 1e-12"/>'
    bare = f'<body name="bare" pos="0 0 0.06"><joint name="turn"/>{light}</body>'
    found = own.read(parallel(tmp_path, extra=bare))
    assert "joints that move no skin: turn" in " ".join(found.notes)


@pytest.mark.skipif(importlib.util.find_spec("gymnasium_robotics") is None, reason="needs gymnasium-robotics")
def test_a_public_hand_with_includes_and_tendons(tmp_path):
    """The Shadow hand of gymnasium-robotics."""
    folder = Path(str(importlib.util.find_spec("gymnasium_robotics").origin)).parent  # type: ignore[union-attr]
    fingers = "".join(
        f'[[finger]]\nname = "{f}"\nbodies = ["robot0:{f}proximal", "robot0:{f}middle", "robot0:{f}distal"]\n'
        for f in ("ff", "mf", "rf", "lf", "th")
    )
    path = tmp_path / "shadow.toml"
    path.write_text(
        f'model = "{folder / "envs/assets/hand/reach.xml"}"\nroot = "robot0:forearm"\ngrasp_centre = [0.0, 0.0, 0.0]\n'
        'position = [0.405, 0.052, 0.0]\nquaternion = [1.0, 0.0, -1.0, 0.0]\n[palm]\nbodies = ["robot0:palm"]\n'
        + fingers
    )
    found = own.read(path)
    assert found.hand.joints == 24
    assert [fit.kind for fit in found.fits] == ["box", "box"]
    assert sum(link.tip for link in found.hand.links) == 5
    notes = " ".join(found.notes)
    assert "tendon 'robot0:T_FFJ1c' keeps 0.00705·robot0:FFJ" in notes
    assert "tendons of the model that couple no two joints of the hand" in notes


def test_a_recording_with_measured_touch_is_of_it(tmp_path):
    """Told by --hand, or by the map of columns beside which it lies."""
    hand = hands.make(gripper(tmp_path))
    names = ["time", *hand.joint_names, *hand.patches.names]
    rows = [f"{0.02 * k:g}," + ",".join("0" for _ in names[1:]) for k in range(20)]
    rows[5] = rows[5][: -len(",0")] + ",1"
    (tmp_path / "felt.csv").write_text("\n".join([",".join(names), *rows]) + "\n")
    (tmp_path / "map.toml").write_text('hand = "gripper.toml"\n[joints]\nunit = "degrees"\n')
    for told in ((str(tmp_path / "gripper.toml"), None), (None, str(tmp_path / "map.toml"))):
        found = recorded.load(str(tmp_path / "felt.csv"), None, None, *told)
        assert found.hand.source == str(tmp_path / "gripper.toml")
        assert found.contacts.sum() == 1
