"""Two opposing fingers, thumb and index, that reach up on either side of an object; fixed, or on a wrist that moves.

Bone lengths: Buryanov & Kotiuk 2010, Int. J. Morphol. 28(3), 755-758 (adults, both sexes): index phalanges 39.8,
22.4 and 15.8 mm plus 3.8 mm of soft tissue; thumb metacarpal, proximal and distal 46.2, 31.6 and 21.7 mm plus
4.0 mm. Radii: half the joint breadths of Greiner 1991 (NATICK/TR-92/011), rounded. Density 1160 kg/m³ (hand; Winter
2009, Biomechanics and Motor Control of Human Movement, table 4.1). Joint limits: American Academy of Orthopaedic
Surgeons 1965, Joint Motion; the thumb's three joints carry the same names as the finger's, as its metacarpal is its
first segment here. Motors and passive tissue: `haptic_env.hands.drives`.
"""

from __future__ import annotations

import numpy as np

from haptic_env.composer import mjcf
from haptic_env.hand import Hand
from haptic_env.hands import drives
from haptic_env.hands import wrist as wrists
from haptic_env.patches import Link, Patches

DENSITY = 1160.0  # kg/m³
BASE_X, BASE_Z = 0.052, -0.038  # metres from the object's centre to a finger's base joint
WRIST_Z = -0.1  # metres, likewise to the wrist, where there is one
REST_DEG = (0.0, -15.0, 10.0, 5.0)  # the open hand in which an episode starts

# name, low and high limit (degrees), what moves it
JOINTS = (
    ("mcp_abduction", -25.0, 25.0, drives.MCP_ABDUCTION),
    ("mcp_flexion", -30.0, 90.0, drives.MCP_FLEXION),
    ("pip_flexion", 0.0, 100.0, drives.PIP_FLEXION),
    ("dip_flexion", 0.0, 80.0, drives.DIP_FLEXION),
)
# finger: side of the object (+1 or -1), then length and radius (m) of its three segments; tips include soft tissue
FINGERS = {
    "thumb": (-1, ((0.0462, 0.0105), (0.0316, 0.0100), (0.0217 + 0.0040 - 0.0090, 0.0090))),
    "index": (+1, ((0.0398, 0.0095), (0.0224, 0.0085), (0.0158 + 0.0038 - 0.0075, 0.0075))),
}
SEGMENTS = ("proximal", "middle", "distal")


def make(patches_along: int = 2, patches_around: int = 4, wrist: str = "fixed") -> Hand:
    """Build the two-finger hand: J = 8; P = 50 with the default patches per phalanx.

    Args:
        patches_along: bins along each phalanx, 1 to 100.
        patches_around: sectors around each phalanx, 1 to 100.
        wrist: "fixed".

    Returns:
        The hand.

    Raises:
        ValueError: for a number of patches out of range, and another wrist.
    """
    wrists.check("two_finger", wrist)
    return _hand("two_finger", patches_along, patches_around, free=False)


def make_arm(patches_along: int = 2, patches_around: int = 4, wrist: str = "free") -> Hand:
    """Build the same hand on a wrist that moves, 10 cm below the object: J = 14.

    Args:
        patches_along: bins along each phalanx, 1 to 100.
        patches_around: sectors around each phalanx, 1 to 100.
        wrist: "free".

    Returns:
        The hand.

    Raises:
        ValueError: for a number of patches out of range, and another wrist.
    """
    wrists.check("two_finger_arm", wrist)
    return _hand("two_finger_arm", patches_along, patches_around, free=True)


def _hand(name: str, patches_along: int, patches_around: int, free: bool) -> Hand:
    root = mjcf.RootElement(model=name)
    root.option.gravity = (0, 0, 0)
    base, below = root.worldbody, 0.0
    if free:
        base, below = base.add("body", name="wrist", pos=(0, 0, WRIST_Z)), WRIST_Z
        wrists.add(root, base, np.zeros(3), np.eye(3))
    links = []
    for finger, (side, segments) in FINGERS.items():
        # In its own frame every finger points to +z and flexes towards -x, which is where the object is.
        quaternion = (1, 0, 0, 0) if side > 0 else (0, 0, 0, 1)
        place = (side * BASE_X, 0, BASE_Z - below)
        parent = base.add("body", name=f"{finger}_base", pos=place, quat=quaternion)
        joints = iter(JOINTS)
        height = 0.0
        for segment, (length, radius) in zip(SEGMENTS, segments, strict=True):
            link = f"{finger}_{segment}"
            parent = parent.add("body", name=link, pos=(0, 0, height))
            for _ in range(2 if segment == "proximal" else 1):
                joint, low, high, drive = next(joints)
                axis = (1, 0, 0) if "abduction" in joint else (0, -1, 0)
                drives.add_joint(root, parent, f"{finger}_{joint}", drive, axis=axis, range=(low, high))
            parent.add(
                "geom", name=link, type="capsule", fromto=(0, 0, 0, 0, 0, length), size=[radius], density=DENSITY
            )
            links.append(Link(link, link, radius, length, tip=segment == "distal"))
            height = length
    patches = Patches(tuple(links), patches_along, patches_around)
    return Hand(
        name=name,
        xml=root.to_xml_string(),
        links=tuple(links),
        patches=patches,
        rest_pose=np.concatenate([np.zeros(len(wrists.NAMES) * free), np.deg2rad(REST_DEG * len(FINGERS))]),
        grasp_centre=np.zeros(3),
        workspace=np.full(3, 0.128),
    )
