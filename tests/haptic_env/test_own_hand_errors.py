"""What is wrong with a hand of one's own is told in one line that says what is valid; nothing in its files is run."""

from __future__ import annotations

import os
from pathlib import Path

import pytest

from haptic_env import hands
from tests.haptic_env.own_hands import gripper, parallel, taxels
from tests.haptic_env.test_own_hand import LATTICE


def refused(path: Path) -> str:
    """What is said of the hand at `path`, which is refused."""
    with pytest.raises(ValueError, match=r".") as told:
        hands.make(path)
    line = str(told.value)
    assert "\n" not in line
    assert str(path) in line
    return line


PALM = 'bodies = ["palm"]'
LEFT = 'bodies = ["left_proximal", "left_distal"]'
CURL = '<joint name="left_curl" axis="0 -1 0" range="-10 80"/>'
TAXEL = '\n[[taxel]]\nbody = "left_distal"\nposition = {}\nnormal = {}\n'


@pytest.mark.parametrize(
    ("old", "new", "told"),
    [
        ("workspace", "workspaces", "unknown key of hand 'workspaces' (did you mean 'workspace'?); choose from"),
        ('model = "gripper.xml"', "", "hand has no model"),
        ('"gripper.xml"', '"gripper.obj"', "model must be a file .xml, .mjcf, .urdf"),
        ('"gripper.xml"', '"nowhere.xml"', "nowhere.xml cannot be read: No such file"),
        ("grasp_centre = [0.0, 0.0, 0.0]", "", "the middle of its fingertips at rest is ["),
        ("grasp_centre = [0.0, 0.0, 0.0]", "grasp_centre = [0.0, 0.0]", "grasp_centre must be finite numbers"),
        (LEFT, 'bodies = ["left_proximal", "left_tip"]', "unknown body of finger 'left' 'left_tip'"),
        (LEFT, "bodies = []", "bodies of finger 'left' must be one name or more"),
        (LEFT, "bodies = ['right_distal']", "body 'right_distal' is listed twice"),
        (LEFT, LEFT + '\ngeoms = ["skin"]', "unknown geom of finger 'left' 'skin'"),
        (LEFT, LEFT + "\nlength = 3", "unknown key of finger 'length'"),
        (LEFT, LEFT + '\ntip = "yes"', "tip of finger 'left' must be True or False"),
        ("[joint.left_close]", "[joint.left_clothe]", "unknown joint 'left_clothe' (did you mean 'left_close'?)"),
        ("rest_deg = -15.0", "rest_deg = -45.0", "rest_deg of joint 'left_close' must lie in its range, [-30, 70] deg"),
        ("rest_deg = -15.0", "rest_m = 0.0", "which turns, 'rest_m'"),
        ("rest_deg = -15.0", "range_deg = [3.0, -3.0]", "range of joint 'left_close' must go from"),
        ("torque = 0.05", "torque = -1.0", "torque of joint 'thumb_close' must be a finite number in"),
        ("along = 2 ", "along = 0 ", "along of patches must be an integer in [1, 100]"),
        (LATTICE, "[[taxel]]\nbody = 'left_distal'\nnormal = [1, 0, 0]\n", "taxel 1 has no position"),
        (LATTICE, "[[taxel]]\nbody = 'left_distal'\nposition = [0, 0, 0]\n", "taxel 1 has no normal"),
        (LATTICE, TAXEL.format([0, 0, 0.01], [0, 0, 0]), "normal of taxel 1 must not be zero"),
        (LATTICE, TAXEL.format([0.1, 0, 0.01], [1, 0, 0]), "lies 92 mm off the skin of link 'left_distal'"),
        (LATTICE, 2 * TAXEL.format([-0.0085, 0, 0.01], [-1, 0, 0]), "'taxel1' and 'taxel2' lie at the same"),
        (LATTICE, TAXEL.format([0, 0, 0], [1, 0, 0]).replace("left_distal", "wrist"), "body of taxel 'taxel1'"),
        (LATTICE, LATTICE + TAXEL.format([0, 0, 0], [1, 0, 0]), "or a list ([[taxel]]), not both"),
        (LATTICE, "[[capsule]]\nbody = 'palm'\nstart = [0, 0, 0]\nend = [0, 0, 0]\nradius = 0.01\n", "has no length"),
        (LATTICE, "[[capsule]]\nbody = 'palm'\nstart = [0, 0, 0]\nend = [0, 0, 1]\n", "capsule 1 has no radius"),
        ("[palm]", "root = 'left_proximal'\n[palm]", "body 'right_proximal' does not hang from root 'left_proximal'"),
        ("[palm]", "root = 'wrist'\n[palm]", "unknown root 'wrist'"),
        ("[palm]", "[palm", "gripper.toml: "),
    ],
)  # fmt: skip
def test_a_wrong_toml(old, new, told, tmp_path):
    assert told in refused(gripper(tmp_path, (old, new)))


def test_no_file_and_no_fingers(tmp_path):
    assert "No such file" in refused(tmp_path / "nowhere.toml")
    (tmp_path / "empty.toml").write_text('model = "x.xml"\n')
    assert "at least one [[finger]]" in refused(tmp_path / "empty.toml")


@pytest.mark.parametrize(
    ("old", "new", "told"),
    [
        ("<mujoco model", "<extension/><mujoco model", "not XML"),
        ('<compiler angle="degree"/>', '<extension><plugin plugin="mujoco.pid"/></extension>', "<extension>: plugins"),
        ("<mujoco model", '<!DOCTYPE x [<!ENTITY a "b">]><mujoco model', "declares a document type"),
        ('<joint damping="0.05"/>', '<joint dampning="0.05"/>', "dampning"),
        ('<compiler angle="degree"/>', '<include file="nowhere.xml"/>', "nowhere.xml"),
        ('pos="0 0 0.046"', 'pos="0 nan 0.046"', "body_pos has numbers that are not finite"),
        ('size="0.0085"/>', 'size="8.5"/>', "are the model's lengths in metres?"),
        (CURL, '<joint name="left_curl" type="ball"/>', "a ball joint"),
        (CURL, '<joint type="slide"/>', "needs a name"),
        (CURL, '<joint name="left_curl" type="slide" limited="false"/>', "without a range"),
        ('<geom name="left_distal" type="capsule" fromto="0 0 0 0 0 0.032" size="0.0085"/>',
         '<inertial mass="1" pos="0 0 0" diaginertia="1 1 1"/>', "body 'left_distal' has no geom to be skin"),
    ],
)  # fmt: skip
def test_a_wrong_mjcf(old, new, told, tmp_path):
    path = gripper(tmp_path)
    text = (tmp_path / "gripper.xml").read_text()
    assert old in text
    (tmp_path / "gripper.xml").write_text(text.replace(old, new, 1))
    assert told in refused(path)


@pytest.mark.parametrize(
    ("new", "told"),
    [
        ('<mesh filename="package://arm/tip.stl"/>', "packages = { arm ="),
        ('<mesh filename="http://arm/tip.stl"/>', "must be a path"),
        ('<mesh filename="tip.dae"/>', "must be one of .stl, .obj, .msh"),
        ('<mesh filename="tip.stl"/>', "mesh 'tip.stl' is not at"),
    ],
)
def test_a_wrong_urdf(new, told, tmp_path):
    path = gripper(tmp_path, model="gripper.urdf")
    text = (tmp_path / "gripper.urdf").read_text()
    (tmp_path / "gripper.urdf").write_text(text.replace('<box size="0.06 0.06 0.012"/>', new))
    assert told in refused(path)


def test_a_program_that_makes_a_urdf(tmp_path):
    path = gripper(tmp_path, model="gripper.urdf")
    xacro = '<robot xmlns:xacro="http://www.ros.org/wiki/xacro"><xacro:include filename="x"/></robot>'
    (tmp_path / "gripper.urdf").write_text(xacro)
    assert "run xacro" in refused(path)


@pytest.mark.parametrize(
    ("extra", "after", "told"),
    [
        (
            "",
            '<equality><connect body1="left" body2="right" anchor="0 0 0"/></equality>',
            "closes a loop",
        ),
        ('<body name="thumb" pos="0 0 .1"><freejoint name="loose"/><geom size=".01"/></body>', "", "free"),
    ],
)
def test_what_is_no_tree_of_joints(extra, after, told, tmp_path):
    assert told in refused(parallel(tmp_path, extra=extra, after=after))


def test_a_skin_that_no_joint_moves(tmp_path):
    path = parallel(tmp_path)
    path.write_text('model = "parallel.xml"\ngrasp_centre = [0, 0, 0]\n[[finger]]\nname = "one"\nbodies = ["base"]\n')
    assert "no joint moves its skin: joints left_slide, right_slide are on other bodies" in refused(path)


def test_fingers_of_several_bodies_of_the_world(tmp_path):
    xml = "<mujoco><worldbody>{}</worldbody></mujoco>".format(
        "".join(f'<body name="{n}"><joint name="{n}"/><geom type="capsule" size="0.01 0.02"/></body>' for n in "ab")
    )
    (tmp_path / "two.xml").write_text(xml)
    (tmp_path / "two.toml").write_text('model = "two.xml"\n[[finger]]\nname = "f"\nbodies = ["a", "b"]\n')
    assert "hang from several bodies of the world, a, b" in refused(tmp_path / "two.toml")


def test_a_model_that_is_no_file(tmp_path):
    path = gripper(tmp_path, model="pipe.xml")
    os.mkfifo(tmp_path / "pipe.xml")
    assert "is no file" in refused(path)


def test_meshes_of_packages_are_found(tmp_path):
    """Beside the URDF, above it, or where the TOML says."""
    folder = tmp_path / "hand_description" / "urdf"
    folder.mkdir(parents=True)
    path = gripper(folder, model="gripper.urdf")
    (tmp_path / "hand_description" / "tip.obj").write_text(
        "v 0 0 0\nv .02 0 0\nv 0 .02 0\nv 0 0 .04\nf 1 3 2\nf 1 2 4\nf 1 4 3\nf 2 3 4\n"
    )
    text = (folder / "gripper.urdf").read_text()
    mesh = '<mesh filename="package://{}/tip.obj"/>'
    (folder / "gripper.urdf").write_text(text.replace('<box size="0.06 0.06 0.012"/>', mesh.format("hand_description")))
    assert any(link.name.startswith("palm") for link in hands.make(path).links)
    (folder / "gripper.urdf").write_text(text.replace('<box size="0.06 0.06 0.012"/>', mesh.format("elsewhere")))
    path.write_text('packages = { elsewhere = ".." }\n' + path.read_text())
    assert any(link.name.startswith("palm") for link in hands.make(path).links)


def test_taxels_whose_names_are_the_same(tmp_path):
    assert "two taxels have the name 'thumb0'" in refused(gripper(tmp_path, (LATTICE, ""), more=2 * taxels(1)))
