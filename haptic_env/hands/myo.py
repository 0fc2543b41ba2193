"""The human right hand of the package `myo-sim` (MyoHand), with a torque motor for each joint in place of its muscles.

Joints, their axes and ranges, and the capsules of the skin are the package's (Wang et al. 2022, "MyoSim: Fast and
physiologically realistic MuJoCo models for musculoskeletal and exoskeletal studies", ICRA). The forearm is fixed at
its `ulna_r`, or moves. Joints are named as there without the "_r", and their signs are the package's: thumbs flex
towards negative angles.

Motors and passive tissue: `haptic_env.hands.drives`.
"""

from __future__ import annotations

import logging
import warnings
from functools import lru_cache

import mujoco

from haptic_env import extras
from haptic_env.hand import Hand
from haptic_env.hands import drives
from haptic_env.hands import wrist as wrists
from haptic_env.hands.skeleton import Bone, bone_of_geom, hand_of

SIDE = "_r"
WRIST = (0.102, 0.055, -0.014)  # m in the world, where its joints' axes meet
DISTAL = (0.0, -1.0, 0.0)
PALMAR = (0.0, 0.0, -1.0)  # of every bone but the thumb's, in the frames of the package
THUMB_PALMAR = {"firstmc": (-1.0, 0.0, -0.3), "proximal_thumb": (-0.9, -0.5, -0.2), "distal_thumb": (-0.9, -0.5, -0.3)}

# what drives each joint, and the degrees at which an episode starts; {} is a finger's number
THUMB_AND_WRIST = {
    "pro_sup": (drives.WRIST, 0.0),
    "deviation": (drives.WRIST, 0.0),
    "flexion": (drives.WRIST, 0.0),
    "cmc_flexion": (drives.THUMB_BASE._replace(relaxed=-20.0), 20.0),
    "cmc_abduction": (drives.THUMB_BASE._replace(relaxed=20.0), -20.0),
    "mp_flexion": (drives.MCP_FLEXION._replace(relaxed=0.0), 0.0),
    "ip_flexion": (drives.PIP_FLEXION._replace(relaxed=-20.0), 0.0),
}
FINGER = {
    "mcp{}_flexion": (drives.MCP_FLEXION, 0.0),
    "mcp{}_abduction": (drives.MCP_ABDUCTION, 0.0),
    "pm{}_flexion": (drives.PIP_FLEXION, 5.0),
    "md{}_flexion": (drives.DIP_FLEXION, 5.0),
}
FINGERS = {"index": 2, "middle": 3, "ring": 4, "little": 5}  # the package's numbers
# The package's capsules; {} is the finger's number.
METACARPALS = ("2mcskin_coll", "3mcskin_coll", "4mcski", "5mcskin")
PHALANGES = {"proximal": "proxph{}_coll", "middle": "midph{}_coll", "distal": "distph{}_coll"}
LITTLE = {"proximal": "5proxph_coll", "middle": "5midph_coll", "distal": "5distph_coll"}
THUMB = {"metacarpal": "1mcskin", "proximal": "proximal_thumb_coll", "distal": "distal_thumb_coll"}


def make(patches_along: int = 2, patches_around: int = 4, wrist: str = "fixed") -> Hand:
    """Build the hand: J = 23, P = 157 with the default patches per bone.

    Args:
        patches_along: bins along each bone, 1 to 100.
        patches_around: sectors around each bone, 1 to 100.
        wrist: "fixed": the forearm is; "free": it moves (`haptic_env.hands.wrist`), six joints more, the first ones.

    Returns:
        The hand.

    Raises:
        ValueError: for a number of patches out of range, and an unknown wrist.
        ImportError: without the package `myo-sim`.

    References:
        Wang et al. 2022, "MyoSim: Fast and physiologically realistic MuJoCo models for musculoskeletal and exoskeletal
        studies", ICRA.
    """
    free = wrists.check("myo", wrist)
    model = _model()
    fingers = {name.format(number): drive for number in FINGERS.values() for name, drive in FINGER.items()}
    return hand_of(
        model,
        "myo",
        root="ulna" + SIDE,
        joints=THUMB_AND_WRIST | fingers,
        bones=_bones(model),
        # Palm towards -y, thumb up, the forearm on the side of +x.
        position=(0.355, 0.010, -0.032),
        quaternion=(0.5, -0.5, -0.5, -0.5),
        grasp_centre=(0.0, 0.0, 0.0),
        workspace=(0.16, 0.16, 0.16),
        opening=(0.0, -1.0, 0.0),
        wrist=WRIST if free else None,
        patches_along=patches_along,
        patches_around=patches_around,
        suffix=SIDE,
    )


@lru_cache(maxsize=1)
def _model() -> mujoco.MjModel:
    myo_sim = extras.load("myo_sim", "hands", "MyoHand")
    logger = logging.getLogger("absl")
    level = logger.level
    with warnings.catch_warnings():
        # MuJoCo says, in two ways, that the package attaches its parts without a prefix.
        warnings.filterwarnings("ignore", message="Attaching a spec with an empty prefix")
        logger.setLevel(logging.ERROR)
        try:
            return myo_sim.load_model("myohand")
        finally:
            logger.setLevel(level)


def _bones(model: mujoco.MjModel) -> list[Bone]:
    bones = []
    for segment, geom in THUMB.items():
        body = model.body(model.geom(geom + SIDE).bodyid[0]).name
        palmar = THUMB_PALMAR[body.removesuffix(SIDE)]
        bones.append(_bone(model, f"thumb_{segment}", geom, palmar))
    for (finger, number), metacarpal in zip(FINGERS.items(), METACARPALS, strict=True):
        bones.append(_bone(model, f"{finger}_metacarpal", metacarpal, PALMAR))
        for segment, geom in (LITTLE if number == 5 else PHALANGES).items():
            bones.append(_bone(model, f"{finger}_{segment}", geom.format(number), PALMAR))
    return bones


def _bone(model: mujoco.MjModel, name: str, geom: str, palmar: tuple[float, ...]) -> Bone:
    return bone_of_geom(model, name, geom + SIDE, distal=DISTAL, palmar=palmar, tip=name.endswith("distal"))
