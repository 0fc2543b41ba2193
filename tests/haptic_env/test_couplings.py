"""Joints that follow others: a hand's model says so, and the hand moves so."""

from __future__ import annotations

from pathlib import Path

import mujoco
import numpy as np
import pytest

from haptic_env import hands
from haptic_env.coupling import Coupling, Couplings, in_order
from haptic_env.hands import own
from haptic_env.recordings import read_measured
from tests.haptic_env.own_hands import GRIPPER, gripper, parallel

CURLS = "".join(f'<joint joint1="{f}_curl" joint2="{f}_close" polycoef="0.1 0.8 0 0 0"/>' for f in ("left", "thumb"))
SWINGS = '<joint joint1="right_swing" joint2="left_swing" polycoef="0 -1 0 0 0"/>'


def coupled(folder: Path, constraints: str = CURLS + SWINGS, more: str = "") -> Path:
    """The gripper of the examples with constraints."""
    path = gripper(folder, more=more)
    model = (GRIPPER / "gripper.xml").read_text()
    (folder / "gripper.xml").write_text(model.replace("</mujoco>", f"<equality>{constraints}</equality></mujoco>"))
    return path


def index(hand, *names):
    return [hand.joint_names.index(name) for name in names]


def test_joints_follow_where_all_torque_pushes_them(tmp_path):
    hand = hands.make(coupled(tmp_path))
    lead, follow = index(hand, "left_close", "left_curl")
    assert hand.couplings.root[follow] == lead
    assert hand.torque_limits[follow] < 1e-3 * hand.torque_limits[lead], "a follower has no motor"
    data, rng, farthest, moved = hand.at_rest(), np.random.default_rng(0), 0.0, 0.0
    for _ in range(40):
        data.ctrl[:] = rng.choice([-1.0, 1.0], hand.joints)
        mujoco.mj_step(hand.model, data, 50)
        farthest = max(farthest, float(np.abs(hand.couplings.follow(data.qpos) - data.qpos).max()))
        moved = max(moved, abs(float(data.qpos[follow] - hand.rest_pose[follow])))
    assert farthest < np.deg2rad(0.3)
    assert moved > 0.3
    np.testing.assert_allclose(hand.couplings.follow(hand.rest_pose), hand.rest_pose)


def test_a_mimic_joint_of_a_urdf_is_the_same_coupling(tmp_path):
    path = gripper(tmp_path, model="gripper.urdf")
    model = (GRIPPER / "gripper.urdf").read_text()
    start = model.index('<joint name="left_curl"')
    end = model.index("</joint>", start)
    mimic = '<mimic joint="left_close" multiplier="0.8" offset="0.1"/>'
    (tmp_path / "gripper.urdf").write_text(model[:end] + mimic + model[end:])
    found = own.read(path)
    follow, lead = index(found.hand, "left_curl", "left_close")
    assert found.hand.couplings.each == (Coupling(follow, lead, pytest.approx((0.1, 0.8, 0.0, 0.0, 0.0))),)
    assert "joint 'left_curl' follows 'left_close' (0.8·left_close +5.73°)" in " ".join(found.notes)


def test_a_tendon_of_two_joints_that_does_not_stretch_is_one_too(tmp_path):
    path = coupled(tmp_path, '<tendon name="bar" tendon1="t"/>')
    model = (tmp_path / "gripper.xml").read_text()
    shares = '<joint joint="left_close" coef="2"/><joint joint="left_curl" coef="-4"/>'
    tendon = f'<tendon><fixed name="t">{shares}</fixed></tendon>'
    (tmp_path / "gripper.xml").write_text(model.replace("</mujoco>", f"{tendon}</mujoco>"))
    hand = hands.make(path)
    follow, lead = index(hand, "left_curl", "left_close")
    angles = np.zeros(hand.joints)
    angles[lead] = 0.6
    assert hand.couplings.follow(angles)[follow] == pytest.approx(0.3)


def test_slides_follow_in_metres(tmp_path):
    coupling = (
        '<equality><joint name="mirror" joint1="left_slide" joint2="right_slide" polycoef="0 0.5 0 0 0"/></equality>'
    )
    hand = hands.make(parallel(tmp_path, after=coupling))
    follow, lead = index(hand, "left_slide", "right_slide")
    angles = hand.couplings.follow(np.full(hand.joints, 0.4))
    metres = angles * hand.lever_arms
    assert metres[follow] == pytest.approx(0.5 * metres[lead])


def test_a_tendon_holds_joints_near_each_other(tmp_path):
    path = coupled(tmp_path, "")
    model = (tmp_path / "gripper.xml").read_text()
    tendon = (
        '<tendon><fixed name="t" limited="true" range="-0.1 0.1"><joint joint="left_close" coef="1"/>'
        '<joint joint="left_curl" coef="-1"/></fixed></tendon>'
    )
    (tmp_path / "gripper.xml").write_text(model.replace("</mujoco>", f"{tendon}</mujoco>"))
    found = own.read(path)
    hand = found.hand
    assert "tendon 't' keeps 1·left_close - 1·left_curl from -0.1 to 0.1" in " ".join(found.notes)
    lead, curl = index(hand, "left_close", "left_curl")
    data = hand.at_rest()
    data.ctrl[lead] = 1.0
    mujoco.mj_step(hand.model, data, 500)
    assert data.qpos[lead] > 0.3
    assert abs(data.qpos[lead] - data.qpos[curl]) < 0.12


def test_a_tendon_may_be_called_as_a_constraint_of_joints_is(tmp_path):
    path = coupled(tmp_path, CURLS.replace("<joint ", '<joint name="t" ', 1))
    model = (tmp_path / "gripper.xml").read_text()
    shares = '<joint joint="left_swing" coef="1"/><joint joint="right_swing" coef="1"/>'
    tendon = f'<tendon><fixed name="t" limited="true" range="-0.1 0.1">{shares}</fixed></tendon>'
    (tmp_path / "gripper.xml").write_text(model.replace("</mujoco>", f"{tendon}</mujoco>"))
    found = own.read(path)
    assert found.hand.couplings.follows.sum() == 2
    assert found.hand.model.ntendon == 1
    assert "tendon 't' keeps" in " ".join(found.notes)


def test_what_couples_no_joints_of_the_hand_is_told(tmp_path):
    off = '<joint name="off" joint1="left_curl" joint2="left_close" active="false"/>'
    found = own.read(coupled(tmp_path, f'<joint name="lone" joint1="left_swing"/>{off}'))
    assert not found.hand.couplings
    told = " ".join(found.notes)
    assert "'lone' is left out" in told
    assert "'off' is left out" in told


@pytest.mark.parametrize(
    ("constraints", "more", "told"),
    [
        (
            '<joint joint1="left_swing" joint2="right_swing"/><joint joint1="right_swing" joint2="left_swing"/>',
            "",
            "follow each other in a ring, among left_swing, right_swing",
        ),
        (
            '<joint joint1="left_curl" joint2="left_close"/><joint joint1="left_curl" joint2="left_swing"/>',
            "",
            "'left_curl' follows two others",
        ),
        (
            CURLS,
            "[joint.left_curl]\ntorque = 0.1\n",
            "'left_curl' follows 'left_close': torque can be told of that one",
        ),
        (CURLS, "[joint.left_curl]\nrest_deg = 3.0\n", "rest_deg can be told of that one"),
        ('<joint joint1="left_curl" joint2="left_close" polycoef="2 1 0 0 0"/>', "", "would rest at 99.59 deg, beyond"),
    ],
)
def test_couplings_that_make_no_sense_are_one_line(tmp_path, constraints, more, told):
    with pytest.raises(ValueError, match=r"gripper\.toml: ") as error:
        hands.make(coupled(tmp_path, constraints, more))
    assert told in str(error.value)
    assert "\n" not in str(error.value)


def test_contact_at_one_joint_stops_those_that_move_with_it(tmp_path):
    hand, free = hands.make(coupled(tmp_path)), hands.make(GRIPPER / "gripper.toml")
    swing, other = index(hand, "left_swing", "right_swing")
    link = [each.name for each in hand.links].index("left_distal")
    assert hand.stopped_by[link, other]
    assert not free.stopped_by[link, other]
    assert hand.stopped_by[link, swing]


def test_torques_along_a_path_move_it(tmp_path):
    """Inverse dynamics: the leader's motor does the work of the follower's."""
    hand = hands.make(coupled(tmp_path))
    time = 0.02 * np.arange(60)
    path = np.tile(hand.rest_pose, (60, 1))
    path[:, index(hand, "left_close")] += 0.3 * (1.0 - np.cos(3.0 * time))[:, None]
    path = hand.couplings.follow(path)
    torques = hand.torques_along(path, 50.0)
    assert np.all(torques[:, hand.couplings.follows] == 0.0)
    data = hand.at_rest()
    for torque in torques:
        data.ctrl[:] = torque / hand.torque_limits
        mujoco.mj_step(hand.model, data, 10)
    np.testing.assert_allclose(data.qpos, path[-1], atol=0.02)


def test_a_chain_of_followers_is_led_by_its_first():
    made = Couplings(3, in_order([Coupling(2, 1, (0.1, 2.0)), Coupling(1, 0, (0.0, 0.0, 1.0))]))
    assert made.root.tolist() == [0, 0, 0]
    np.testing.assert_allclose(made.follow(np.array([0.5, 9.0, 9.0])), [0.5, 0.25, 0.6])
    angles, way = np.array([0.5, 0.25, 0.6]), 1e-6
    ahead = made.follow(angles + [way, 0.0, 0.0])
    np.testing.assert_allclose((ahead - angles) / way, made.slopes(angles), atol=1e-5)
    np.testing.assert_allclose(made.spread(angles)[:, 0], made.slopes(angles))


def test_a_follower_needs_no_column(tmp_path):
    hand = hands.make(coupled(tmp_path))
    led = [name for name, follows in zip(hand.joint_names, hand.couplings.follows, strict=True) if not follows]
    patch = hand.patches.names[0]
    lines = [",".join(["time", *led, patch])]
    rng = np.random.default_rng(0)
    for step in range(20):
        lines.append(",".join(map(str, [0.02 * step, *(0.1 * rng.random(len(led))), 0])))
    (tmp_path / "felt.csv").write_text("\n".join(lines))
    told = read_measured(tmp_path / "felt.csv", None, hand)
    np.testing.assert_allclose(told.joint_angles, hand.couplings.follow(told.joint_angles), atol=1e-9)
    assert np.isnan(hand.couplings.own(told.joint_angles[3])).tolist() == hand.couplings.follows.tolist()
