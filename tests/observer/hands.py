"""Hands made for the tests: a random tree, a hand of a thousand patches, a finger simple enough to enumerate.

Shapes: J joints. Angles in radians, lengths in metres.
"""

from __future__ import annotations

from functools import lru_cache

import numpy as np

from haptic_env.composer import mjcf
from haptic_env.hand import Hand
from haptic_env.hands import two_finger
from haptic_env.patches import Link, Patches


def random_tree(seed: int, bodies: int = 9) -> Hand:
    """A tree of `bodies` with one to three hinges each, anchors off the origin, rotated bodies and angles at zero."""
    rng = np.random.default_rng(seed)
    root = mjcf.RootElement(model="tree")
    root.option.gravity = (0, 0, 0)
    root.compiler.angle = "radian"
    parents, links = [root.worldbody], []
    for b in range(bodies):
        parent = parents[rng.integers(len(parents))]
        quaternion = rng.standard_normal(4)
        body = parent.add("body", name=f"body{b}", pos=rng.uniform(-0.05, 0.05, 3), quat=quaternion)
        for j in range(rng.integers(1, 4)):
            name = f"joint{b}_{j}"
            hinge = body.add(
                "joint",
                name=name,
                axis=rng.standard_normal(3),
                pos=rng.uniform(-0.03, 0.03, 3),
                ref=rng.uniform(-1, 1),
                range=(-3.0, 3.0),
                damping=0.01,
                armature=1e-4,
            )
            root.actuator.add("motor", name=name, joint=hinge, gear=[0.02])
        radius, length = rng.uniform(0.004, 0.01), rng.uniform(0.01, 0.04)
        body.add("geom", type="capsule", fromto=(0, 0, 0, 0, 0, length), size=[radius], density=1000)
        links.append(Link(f"link{b}", f"body{b}", radius, length, tip=bool(rng.integers(2))))
        parents.append(body)
    return _hand("tree", root, tuple(links))


def many_patches() -> Hand:
    """The two-finger hand with single mechanoreceptors: more than a thousand patches."""
    return two_finger.make(patches_along=14, patches_around=13)


ARM = 0.2  # metres from the pointer's hinge to the middle of its link
VOXEL = 0.001


@lru_cache
def pointer(joints: int = 1) -> Hand:
    """A hair on a long arm, turning in the plane of y and z; its joints forget their velocity in some 10 ms.

    The hair runs along z for one voxel, its palmar side (-x) is one patch and its end another. What the patch says of
    a cell and what the map is told are then the same: the cell of one row along y beside which the hair stands. With
    two joints both turn about one axis, and only their sum moves the hair.
    """
    root = mjcf.RootElement(model="pointer")
    root.option.gravity = (0, 0, 0)
    root.compiler.angle = "radian"
    body = root.worldbody.add("body", name="hair", pos=(0, 0, ARM - VOXEL / 2))
    body.add("inertial", pos=(0, 0, 0), mass=1e-3, diaginertia=(2e-5, 2e-5, 2e-5))
    for j in range(joints):
        hinge = body.add(
            "joint",
            name=f"hinge{j}",
            axis=(-1, 0, 0),
            pos=(0, 0, VOXEL / 2 - ARM),
            range=(-1, 1),
            damping=6e-3,
            armature=2e-5 * (joints - 1),
        )
        root.actuator.add("motor", name=f"hinge{j}", joint=hinge, gear=[0.01])
    return _hand("pointer", root, (Link("hair", "hair", 1e-6, VOXEL, tip=True),), 1, 1)


def _hand(name: str, root: mjcf.RootElement, links: tuple[Link, ...], along: int = 2, around: int = 4) -> Hand:
    xml = root.to_xml_string()
    hand = Hand(name, xml, links, Patches(links, along, around), np.zeros(0), np.zeros(3), np.full(3, 0.1))
    rest = np.zeros(hand.joints)
    return Hand(name, xml, links, hand.patches, rest, np.zeros(3), np.full(3, 0.1))
