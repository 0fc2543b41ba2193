"""Small valid things, each made once: a hand, an object, a recording, and files of every format that is read.

Shapes: T = 6 frames, J = 8 joints, P = 50 patches.
"""

from __future__ import annotations

import io
import json
import struct
from functools import lru_cache
from pathlib import Path
from typing import Any

import gymnasium as gym
import numpy as np

import haptic_env  # noqa: F401 - registers
from haptic_env import hands, recordings, shapes
from haptic_env.grid import Grid
from haptic_env.hand import Hand
from haptic_env.recordings import ObserverInputs, Recording, Track
from haptic_env.shapes import Solid
from observer import HapticSLAM, ShapePosterior, classifiers
from observer.classifiers import MapClassifier

FRAMES, JOINTS, PATCHES = 6, 8, 50
TWO_FINGER = "HapticSLAM/TwoFinger-v0"
ROOT = Path(__file__).resolve().parents[2]


@lru_cache(maxsize=1)
def hand() -> Hand:
    return hands.make("two_finger")


@lru_cache(maxsize=1)
def solid() -> Solid:
    return shapes.make("sphere")


@lru_cache(maxsize=1)
def grid() -> Grid:
    """(16, 16, 16) voxels of 8 mm."""
    return Grid.around((0.0, 0.0, 0.0), (0.128,) * 3, 0.008)


@lru_cache(maxsize=1)
def namer() -> ShapePosterior:
    """Of two solids."""
    return ShapePosterior(hand(), {name: [shapes.make(name)] for name in ("sphere", "cube")}, samples=1)


@lru_cache(maxsize=1)
def slam() -> HapticSLAM:
    return HapticSLAM(hand(), 3.0, 4, lag=1, grid=grid())


@lru_cache(maxsize=1)
def map_classifier() -> MapClassifier:
    """Of two maps of the sample observer's grid."""
    empty = np.full(grid().shape, 0.5)
    return classifiers.make("nearest_neighbour").fit([empty, empty + 0.3], ["a", "b"])


def environment(**keywords: Any) -> gym.Env:
    """A new one, of half a second."""
    return gym.make(TWO_FINGER, **{"shape": "sphere", "episode_seconds": 0.5, **keywords})


def track() -> Track:
    return Track(np.zeros((FRAMES, 3)), np.tile([1.0, 0.0, 0.0, 0.0], (FRAMES, 1)))


def felt() -> ObserverInputs:
    angles = np.tile(hand().rest_pose, (FRAMES, 1))
    return ObserverInputs(np.zeros((FRAMES, JOINTS)), angles, np.zeros((FRAMES, PATCHES), dtype=bool))


def recording(**changes: Any) -> Recording:
    """Of a hand and an object that rest."""
    keywords: dict[str, Any] = {
        "source": "sample",
        "time": np.arange(FRAMES) / 50,
        "joint_names": hand().joint_names,
        "joint_angles": np.tile(hand().rest_pose, (FRAMES, 1)),
        "root": track(),
        "object": track(),
        "felt": felt(),
        "settings": {"object": {"name": "sphere"}, "in_object_frame": True},
    }
    return Recording(**{**keywords, **changes})


def arrays() -> dict[str, np.ndarray]:
    """Those of `recording` in an `.npz`."""
    told = recording()
    assert told.root is not None
    assert told.object is not None
    assert told.felt is not None
    return {
        "time": told.time,
        "joint_names": np.array(told.joint_names),
        "joint_angles": told.joint_angles,
        "root_position": told.root.position,
        "root_quaternion": told.root.quaternion,
        "object_position": told.object.position,
        "object_quaternion": told.object.quaternion,
        "object_mesh": np.array("ball"),
        "torques": told.felt.torques,
        "felt_angles": told.felt.joint_angles,
        "contacts": told.felt.contacts,
        "settings": np.array(json.dumps(dict(told.settings))),
    }


def npz(content: dict[str, np.ndarray], compressed: bool = False) -> bytes:
    file = io.BytesIO()
    (np.savez_compressed if compressed else np.savez)(file, **content)
    return file.getvalue()


def recordings_npz() -> tuple[bytes, ...]:
    """What was felt; a path of hand and object; angles alone; demonstrations on the Adroit hand."""
    every = arrays()
    moved = {name: every[name] for name in every if name not in ("torques", "felt_angles", "contacts", "settings")}
    alone = {name: every[name] for name in ("time", "joint_names", "joint_angles")}
    demonstrations = {"a_obs": np.zeros((FRAMES, 30)), "b_obs": np.zeros((FRAMES, 30), dtype=np.float32)}
    return (npz(every), npz(moved, compressed=True), npz(alone), npz(demonstrations))


def glove_txt() -> bytes:
    """Rows of a CyberGlove of three sensors, as `calibration_toml` has."""
    rows = [f"2014 3 1 12 0 {0.02 * frame:.2f} 0 {frame} {2 * frame} 0.5" for frame in range(FRAMES)]
    return "\n".join(rows).encode() + b"\n"


def measured_csv() -> bytes:
    """A table whose columns are called as the joints and a patch of the hand are."""
    made, patch = hand(), hand().patches.names[0]
    rows = [f"{0.02 * k:.2f}," + ",".join(f"{x:.3f}" for x in made.rest_pose) + f",{k % 2}" for k in range(FRAMES)]
    return "\n".join([f"time,{','.join(made.joint_names)},{patch}", *rows]).encode()


def columns_toml() -> bytes:
    """What columns mean."""
    return (
        b'hand = "two_finger"\ncontrol_hz = 50\n[time]\ncolumn = "t"\nunit = "ms"\n[joints]\nunit = "degrees"\n'
        b'[joints.columns]\na = "x"\nb = { column = "y", sign = -1, zero = 3.0 }\nc = 0.5\n'
        b'[touch]\nthreshold = 0.5\n[touch.taxels]\n"x[0:3]" = "tip"\n'
    )


def calibration_toml() -> bytes:
    return b"""sensors = ["one", "two", "three"]
unit = "degrees"
[joints]
A = {offset_deg = 5.0, gains = {one = 1.0, two = -0.5}}
B = {gains = {three = 2.0}}
"""


@lru_cache(maxsize=1)
def calibration() -> recordings.Calibration:
    gain = np.array([[1.0, -0.5, 0.0], [0.0, 0.0, 2.0]])
    return recordings.Calibration("sample", ("one", "two", "three"), np.pi / 180, ("A", "B"), np.zeros(2), gain)


CORNERS = np.array([[x, y, z] for x in (0.0, 0.05) for y in (0.0, 0.05) for z in (0.0, 0.05)])
SQUARES = ((0, 1, 3, 2), (4, 6, 7, 5), (0, 4, 5, 1), (2, 3, 7, 6), (0, 2, 6, 4), (1, 5, 7, 3))
TRIANGLES = tuple(three for a, b, c, d in SQUARES for three in ((a, b, c), (a, c, d)))


def stl() -> bytes:
    """A cube of 5 cm, as all of these."""
    body = b"".join(struct.pack("<12fH", 0, 0, 0, *CORNERS[list(three)].ravel(), 0) for three in TRIANGLES)
    return bytes(80) + struct.pack("<I", len(TRIANGLES)) + body


def stl_text() -> bytes:
    facets = []
    for three in TRIANGLES:
        corners = "\n".join("vertex {:g} {:g} {:g}".format(*CORNERS[corner]) for corner in three)
        facets.append(f"facet normal 0 0 0\nouter loop\n{corners}\nendloop\nendfacet")
    return "\n".join(["solid cube", *facets, "endsolid cube\n"]).encode()


def obj(squares: bool = False) -> bytes:
    lines = ["v {:g} {:g} {:g}".format(*corner) for corner in CORNERS]
    lines += ["f " + " ".join(str(corner + 1) for corner in face) for face in (SQUARES if squares else TRIANGLES)]
    return "\n".join(lines).encode() + b"\n"


def ply(text: bool = True) -> bytes:
    kind = "ascii" if text else "binary_little_endian"
    head = (
        f"ply\nformat {kind} 1.0\nelement vertex 8\nproperty float x\nproperty float y\nproperty float z\n"
        "element face 12\nproperty list uchar int vertex_indices\nend_header\n"
    ).encode()
    if not text:
        return head + CORNERS.astype("<f4").tobytes() + b"".join(struct.pack("<B3i", 3, *three) for three in TRIANGLES)
    lines = ["{:g} {:g} {:g}".format(*corner) for corner in CORNERS]
    return head + "\n".join([*lines, *("3 {} {} {}".format(*three) for three in TRIANGLES)]).encode() + b"\n"


def npy() -> bytes:
    """(T, J) rad."""
    file = io.BytesIO()
    np.save(file, np.random.default_rng(0).uniform(0, 1, (FRAMES, JOINTS)))
    return file.getvalue()


def csv() -> bytes:
    """The same as text."""
    rows = np.random.default_rng(0).uniform(0, 1, (FRAMES, JOINTS))
    return "\n".join(",".join(f"{each:.4f}" for each in row) for row in rows).encode() + b"\n"
