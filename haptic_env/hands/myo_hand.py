"""The human right hand of the package `myo-sim` (MyoHand), with a torque motor for each joint in place of its muscles.

Joints, their axes and ranges, and the capsules of the skin are the package's (Wang et al. 2022, "MyoSim: Fast and
physiologically realistic MuJoCo models for musculoskeletal and exoskeletal studies", ICRA). The forearm is fixed at
its `ulna_r`. Joints are named as there without the "_r", and their signs are the package's: thumbs flex towards
negative angles.

Damping, stiffness and torque of a finger's joints are those of `two_finger`. Of wrist and forearm: passive stiffness
of the order that Formica et al. 2012 measured (J. Neurophysiol. 108, 1158-1166), torques that turn them by some ten
degrees. Weight is taken as borne by posture: there is no gravity.
"""

from __future__ import annotations

import logging
import warnings

import mujoco

from haptic_env import extras
from haptic_env.hand import Hand
from haptic_env.skeleton import Bone, Drive, bone_of_geom, hand_of

SIDE = "_r"
DISTAL = (0.0, -1.0, 0.0)
PALMAR = (0.0, 0.0, -1.0)  # of every bone but the thumb's, in the frames of the package
THUMB_PALMAR = {"firstmc": (-1.0, 0.0, -0.3), "proximal_thumb": (-0.9, -0.5, -0.2), "distal_thumb": (-0.9, -0.5, -0.3)}

DRIVES = {
    "pro_sup": Drive(0.15, 0.05, 0.40, 0.0, 0.0),
    "deviation": Drive(0.15, 0.04, 0.50, 0.0, 0.0),
    "flexion": Drive(0.15, 0.04, 0.40, 0.0, 0.0),
    "cmc_flexion": Drive(0.040, 0.0090, 0.040, 0.0, 0.0),
    "cmc_abduction": Drive(0.040, 0.0090, 0.040, 20.0, 20.0),
    "mp_flexion": Drive(0.030, 0.0080, 0.030, 0.0, 0.0),
    "ip_flexion": Drive(0.016, 0.0040, 0.012, -20.0, 0.0),
}
FINGER_DRIVES = {
    "mcp{}_flexion": Drive(0.040, 0.0090, 0.025, 30.0, 10.0),
    "mcp{}_abduction": Drive(0.030, 0.0080, 0.050, 0.0, 0.0),
    "pm{}_flexion": Drive(0.016, 0.0040, 0.012, 30.0, 10.0),
    "md{}_flexion": Drive(0.008, 0.0020, 0.008, 25.0, 5.0),
}
FINGERS = {"index": 2, "middle": 3, "ring": 4, "little": 5}  # the package's numbers
# The package's capsules; {} is the finger's number.
METACARPALS = ("2mcskin_coll", "3mcskin_coll", "4mcski", "5mcskin")
PHALANGES = {"proximal": "proxph{}_coll", "middle": "midph{}_coll", "distal": "distph{}_coll"}
LITTLE = {"proximal": "5proxph_coll", "middle": "5midph_coll", "distal": "5distph_coll"}
THUMB = {"metacarpal": "1mcskin", "proximal": "proximal_thumb_coll", "distal": "distal_thumb_coll"}


def make(patches_along: int = 2, patches_around: int = 4) -> Hand:
    """The hand: J = 23, P = 157 with the default patches per bone."""
    model = _model()
    drives = dict(DRIVES)
    for number in FINGERS.values():
        drives |= {name.format(number): drive for name, drive in FINGER_DRIVES.items()}
    return hand_of(
        model,
        "myo_hand",
        root="ulna" + SIDE,
        drives={name + SIDE: drive for name, drive in drives.items()},
        bones=_bones(model),
        # Palm towards -y, thumb up, the forearm on the side of +x.
        position=(0.355, 0.010, -0.022),
        quaternion=(0.5, -0.5, -0.5, -0.5),
        grasp_centre=(0.0, 0.0, 0.0),
        workspace=(0.2, 0.2, 0.2),
        patches_along=patches_along,
        patches_around=patches_around,
        rename=lambda name: name.removesuffix(SIDE),
    )


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
