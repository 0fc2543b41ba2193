"""The hands from other packages: their geometry is the package's; without it one is told what to install."""

from __future__ import annotations

import subprocess
import sys

import gymnasium as gym
import mujoco
import numpy as np
import pytest

from haptic_env import extras, hands
from haptic_env.hands import adroit, myo

FINGERS = ("thumb", "index", "middle", "ring", "little")
SOURCES = {"myo": myo._model, "adroit": adroit._model}


@pytest.fixture(params=SOURCES)
def name(request: pytest.FixtureRequest) -> str:
    """Each of the whole hands."""
    return str(request.param)


def test_every_phalanx_and_the_palm_carry_patches(name):
    hand = hands.make(name)
    names = [link.name for link in hand.links]
    assert hand.joints == {"myo": 23, "adroit": 24}[name]
    assert len(hand.patches) >= 100
    for finger in FINGERS:
        assert {f"{finger}_proximal", f"{finger}_distal"} <= set(names)
    assert sum(link.tip for link in hand.links) == len(FINGERS)
    assert sum(not hand.moves[i].all() and hand.link_group[i] == 0 for i in range(len(names))) >= 4, "the palm"


def test_joints_are_where_the_package_has_them(name):
    """Anchors and axes at any angles, in the frame of the forearm."""
    hand, source = hands.make(name), SOURCES[name]()
    mine, theirs = mujoco.MjData(hand.model), mujoco.MjData(source)
    root = hand.model.body(1).name
    suffix = "_r" if name == "myo" else ""
    rng = np.random.default_rng(0)
    for _ in range(10):
        theirs.qpos[:] = 0.0
        mine.qpos[:] = rng.uniform(*hand.joint_limits.T)
        for joint, angle in zip(hand.joint_names, mine.qpos, strict=True):
            theirs.joint(joint + suffix).qpos[:] = angle
        for model, data in ((hand.model, mine), (source, theirs)):
            mujoco.mj_kinematics(model, data)
            mujoco.mj_comPos(model, data)
        for joint in hand.joint_names:
            for own, other in zip(_seen(mine, root, joint), _seen(theirs, root, joint + suffix), strict=True):
                np.testing.assert_allclose(own, other, atol=1e-6)


def _seen(data: mujoco.MjData, root: str, joint: str) -> tuple[np.ndarray, np.ndarray]:
    """Anchor and axis of `joint` in the frame of the body `root`."""
    body, hinge = data.body(root), data.joint(joint)
    turn = body.xmat.reshape(3, 3)
    return (hinge.xanchor - body.xpos) @ turn, hinge.xaxis @ turn


def test_palmar_patches_face_the_object(name):
    """At rest the palmar side of every finger's first bone looks to where the object is."""
    hand = hands.make(name)
    data = mujoco.MjData(hand.model)
    data.qpos[:] = hand.rest_pose
    mujoco.mj_kinematics(hand.model, data)
    for link, body in zip(hand.links, hand.link_bodies, strict=True):
        if link.name.endswith("proximal") and not link.name.startswith("thumb"):
            palmar = -data.xmat[body].reshape(3, 3)[:, 0]
            assert palmar @ hand.opening > 0.8


def test_a_finger_is_the_chain_that_is_its_own(name):
    hand = hands.make(name)
    of = dict(zip((link.name for link in hand.links), hand.link_group, strict=True))
    assert len({of[f"{finger}_distal"] for finger in FINGERS}) == len(FINGERS)
    for finger in FINGERS:
        assert of[f"{finger}_proximal"] == of[f"{finger}_distal"] != 0
    touched = [link.name for link in hand.links].index("index_distal")
    np.testing.assert_array_equal(hand.stopped_by[touched], hand.moves[touched])
    palm = int(np.flatnonzero(hand.link_group == 0)[0])
    np.testing.assert_array_equal(hand.stopped_by[palm], hand.joint_group == 0)


def test_large_objects_are_moved_out_of_the_palm(name):
    hand = hands.make(name)
    np.testing.assert_array_equal(hand.place((0.05, 0.05, 0.09)), hand.grasp_centre)
    np.testing.assert_allclose(hand.place((0.05, 0.09, 0.05)), hand.grasp_centre + 0.02 * hand.opening)
    np.testing.assert_array_equal(hands.make("two_finger").place((0.1, 0.1, 0.1)), np.zeros(3))


@pytest.mark.parametrize("module", ["myo_sim", "gymnasium_robotics", "trimesh"])
def test_without_the_package_one_is_told_what_to_install(monkeypatch, module):
    monkeypatch.setattr(extras.importlib.util, "find_spec", lambda name: None)
    extra = "meshes" if module == "trimesh" else "hands"
    with pytest.raises(ImportError, match=rf"a hand needs the package '{module}': pip install .*\[{extra}\]'"):
        extras.load(module, extra, "a hand")


@pytest.mark.parametrize(("env_id", "package"), [("MyoHand", "myo_sim"), ("AdroitHand", "gymnasium_robotics")])
def test_making_the_environment_says_so_too(monkeypatch, env_id, package):
    for module in (myo, adroit):
        module._model.cache_clear()
    monkeypatch.setattr(extras.importlib.util, "find_spec", lambda name: None)
    with pytest.raises(ImportError, match=rf"{env_id} needs the package '{package}': pip install .*\[hands\]'"):
        gym.make(f"HapticSLAM/{env_id}-v0")


MADE = """
import sys, haptic_env, haptic_env.explore, observer, agents
print([m for m in ("myo_sim", "gymnasium_robotics", "trimesh", "coacd", "igl") if m in sys.modules])
for hand in sys.argv[1:]:
    haptic_env.hands.make(hand)
"""


def test_importing_imports_none_of_the_packages_and_nothing_is_said_when_a_hand_is_made():
    command = [sys.executable, "-W", "always::UserWarning", "-c", MADE, *SOURCES]
    done = subprocess.run(command, capture_output=True, text=True)
    assert (done.returncode, done.stdout, done.stderr) == (0, "[]\n", "")
