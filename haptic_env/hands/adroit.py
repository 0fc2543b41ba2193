"""The Adroit hand (Kumar, Xu & Todorov 2013, ICRA: a ShadowHand) that ships in `gymnasium-robotics`.

Joints, their axes and ranges, and the capsules of the fingers are the package's; capsules side by side fill the boxes
of its palm. The forearm is fixed, or moves. Motors and springs are those of a human hand, `haptic_env.hands.drives`, so
that it explores as gently as the other hands do.
"""

from __future__ import annotations

from functools import lru_cache

import mujoco

from haptic_env import extras
from haptic_env.hand import Hand
from haptic_env.hands import drives
from haptic_env.hands import wrist as wrists
from haptic_env.hands.skeleton import Bone, bone_of_geom, hand_of

MODEL = "envs/assets/adroit_hand/adroit_relocate.xml"
WRIST = (0.13, 0.052, 0.0)  # m in the world, half-way between the axes of its joints
PALMAR, THUMB_PALMAR = (0.0, -1.0, 0.0), (-1.0, 0.0, 0.0)
DISTAL = (0.0, 0.0, 1.0)
FINGERS = {"index": "ff", "middle": "mf", "ring": "rf", "little": "lf", "thumb": "th"}  # the package's names
SEGMENTS = ("proximal", "middle", "distal")
# name, body, x, the least and the largest z, radius (m): the thickness of the palm's boxes is 22 mm
PALM = (
    ("palm_index", "palm", 0.032, 0.000, 0.076, 0.0111),
    ("palm_middle", "palm", 0.011, 0.000, 0.076, 0.0111),
    ("palm_ring", "palm", -0.010, 0.000, 0.076, 0.0111),
    ("palm_heel", "palm", -0.032, 0.000, 0.028, 0.0111),
    ("little_metacarpal", "lfmetacarpal", -0.0165, -0.005, 0.025, 0.0105),
)
# what drives each joint, and the degrees at which an episode starts; {} is a finger's first letter
WRIST_AND_THUMB = {
    "WRJ1": (drives.WRIST, 0.0),
    "WRJ0": (drives.WRIST, 0.0),
    "LFJ4": (drives.MCP_ABDUCTION, 0.0),
    "THJ4": (drives.THUMB_BASE._replace(relaxed=40.0), 45.0),
    "THJ3": (drives.THUMB_BASE._replace(relaxed=45.0), 5.0),
    "THJ2": (drives.MCP_ABDUCTION, 0.0),
    "THJ1": (drives.MCP_FLEXION._replace(relaxed=0.0), 0.0),
    "THJ0": (drives.PIP_FLEXION._replace(relaxed=-20.0), 0.0),
}
FINGER = {
    "{}FJ3": (drives.MCP_ABDUCTION, 0.0),
    "{}FJ2": (drives.MCP_FLEXION, 10.0),
    "{}FJ1": (drives.PIP_FLEXION, 10.0),
    "{}FJ0": (drives.DIP_FLEXION, 5.0),
}


def make(patches_along: int = 2, patches_around: int = 4, wrist: str = "fixed") -> Hand:
    """Build the hand: J = 24, P = 165 with the default patches per bone.

    Args:
        patches_along: bins along each bone, 1 to 100.
        patches_around: sectors around each bone, 1 to 100.
        wrist: "fixed": the forearm is; "free": it moves (`haptic_env.hands.wrist`), six joints more, the first ones.

    Returns:
        The hand.

    Raises:
        ValueError: for a number of patches out of range, and an unknown wrist.
        ImportError: without the package `gymnasium-robotics`.

    References:
        Kumar, Xu & Todorov 2013, ICRA.
    """
    free = wrists.check("adroit", wrist)
    model = _model()
    fingers = {name.format(letter): drive for letter in "FMRL" for name, drive in FINGER.items()}
    return hand_of(
        model,
        "adroit",
        root="forearm",
        joints=WRIST_AND_THUMB | fingers,
        bones=_bones(model),
        # Palm towards -y, thumb up, the forearm on the side of +x.
        position=(0.545, 0.052, 0.0),
        quaternion=(1.0, 0.0, -1.0, 0.0),
        grasp_centre=(0.0, 0.0, 0.0),
        workspace=(0.16, 0.16, 0.16),
        opening=(0.0, -1.0, 0.0),
        wrist=WRIST if free else None,
        patches_along=patches_along,
        patches_around=patches_around,
    )


@lru_cache(maxsize=1)
def _model() -> mujoco.MjModel:
    file = extras.folder("gymnasium_robotics", "hands", "AdroitHand") / MODEL
    return mujoco.MjSpec.from_file(str(file)).compile()


def _bones(model: mujoco.MjModel) -> list[Bone]:
    bones = [
        Bone(name, body, (x, 0.0, low), (x, 0.0, high), radius, PALMAR) for name, body, x, low, high, radius in PALM
    ]
    for finger, short in FINGERS.items():
        palmar = THUMB_PALMAR if finger == "thumb" else PALMAR
        for segment in SEGMENTS:
            name, geom, tip = f"{finger}_{segment}", f"C_{short}{segment}", segment == "distal"
            bones.append(bone_of_geom(model, name, geom, distal=DISTAL, palmar=palmar, tip=tip))
    return bones
