"""Files of measured touch in the layouts of other programs, made for the tests: the same hand in each of them."""

from __future__ import annotations

import json
import struct
import warnings
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
import zarr

from haptic_env import hands
from haptic_env.hand import Hand

HAND = "two_finger"
FRAMES = 40
HEAD = f'hand = "{HAND}"\n'


def made(frames: int = FRAMES) -> tuple[Hand, Any, Any, Any]:
    """A hand, when it was measured (T,) s, its angles (T, J) rad and its contacts (T, P)."""
    hand = hands.make(HAND)
    time = 0.02 * np.arange(frames)
    angles = hand.rest_pose + 0.2 * np.sin(2.0 * time[:, None] + np.arange(hand.joints))
    contacts = np.zeros((frames, len(hand.patches)))
    contacts[frames // 2 :, 3] = contacts[frames // 4 : frames // 3, 30] = 1.0
    return hand, time, angles, contacts


def listed(names: Any) -> str:
    return json.dumps(list(names))


def csv(folder: Path, suffix: str = ".csv", **changes: Any) -> tuple[Path, str]:
    """Angles in degrees, one of them with another sign and zero, milliseconds, pressures."""
    hand, time, angles, contacts = made()
    degrees = np.rad2deg(angles)
    degrees[:, 1] = 10.0 - degrees[:, 1]
    table = pd.DataFrame({"when": 1000.0 * time} | {f"j{j}": degrees[:, j] for j in range(hand.joints)})
    table = table.assign(**{f"tax{p}": 0.1 + 0.8 * contacts[:, p] for p in range(len(hand.patches))}, note="glove")
    table = table.assign(**changes)
    path = folder / f"glove{suffix}"
    table.to_csv(path, sep="," if suffix == ".csv" else "\t", index=False)
    lines = {name: f'"j{j}"' for j, name in enumerate(hand.joint_names)}
    lines[hand.joint_names[1]] = '{ column = "j1", sign = -1, zero = 10.0 }'
    return path, (
        f'{HEAD}[time]\ncolumn = "when"\nunit = "ms"\n[joints]\nunit = "degrees"\n[joints.columns]\n'
        + "".join(f"{name} = {line}\n" for name, line in lines.items())
        + "[touch]\nthreshold = 0.5\n[touch.taxels]\n"
        + "".join(f'tax{p} = "{name}"\n' for p, name in enumerate(hand.patches.names))
    )


def tsv(folder: Path) -> tuple[Path, str]:
    return csv(folder, ".tsv")


def streams(joints: str, touch: str, more: str = "", threshold: str = "") -> str:
    """A map of whole streams, in the order of the hand."""
    hand = hands.make(HAND)
    return (
        f'{HEAD}{more}[joints]\nstream = "{joints}"\norder = {listed(hand.joint_names)}\n'
        f'[touch]\n{threshold}stream = "{touch}"\norder = {listed(hand.patches.names)}\n'
    )


def npz(folder: Path) -> tuple[Path, str]:
    """Joints and touch at rates of their own."""
    _, time, angles, contacts = made()
    path = folder / "session.npz"
    np.savez(path, tq=time, q=angles, tz=time[::2], z=contacts[::2])
    text = streams("q", "z").replace("[touch]", '[joints.time]\ncolumn = "tq"\n[touch.time]\ncolumn = "tz"\n[touch]')
    return path, text


def parquet(folder: Path) -> tuple[Path, str]:
    """An episode of a LeRobot dataset, v2.1, between the rows of another."""
    _, time, angles, contacts = made()
    rows = 2 * len(time)
    table = pd.DataFrame(
        {
            "observation.state": [*angles.astype(np.float32)] * 2,
            "action": [*angles.astype(np.float32)] * 2,
            "observation.tactile": [*(30.0 * contacts).astype(np.float32)] * 2,
            "timestamp": np.tile(time, 2).astype(np.float32),
            "frame_index": np.tile(np.arange(len(time)), 2),
            "episode_index": np.repeat([6, 7], len(time)),
            "index": np.arange(rows),
            "task_index": np.zeros(rows, dtype=int),
            "task": ["inspect"] * rows,
        }
    )
    path = folder / "data" / "chunk-000" / "episode_000000.parquet"
    path.parent.mkdir(parents=True, exist_ok=True)
    (folder / "meta").mkdir(exist_ok=True)
    features = {"observation.state": {"dtype": "float32", "shape": [8], "names": [f"motor_{j}" for j in range(8)]}}
    (folder / "meta" / "info.json").write_text(json.dumps({"codebase_version": "v2.1", "features": features}))
    table.to_parquet(path)
    return path, streams("observation.state", "observation.tactile", threshold="threshold = 5.0\n")


def store(folder: Path, version: int = 2, **codecs: Any) -> tuple[Path, str]:
    """A store in the layout of Open-X-Tactile (FTP-1), whose second episode it is."""
    _, time, angles, contacts = made()
    path = folder / "inspect.zarr"
    root = zarr.create_group(path, zarr_format=version)  # type: ignore[arg-type]
    data = root.create_group("data")
    twice = {
        "timestamps": np.tile(time, 2),
        "right_hand_joints": np.tile(angles, (2, 1)).astype(np.float32),
        "right_hand_joints_idx": np.tile(np.arange(8), (2 * FRAMES, 1)),
        "right_tactile_data_glove": np.tile(contacts, (2, 1)).reshape(2 * FRAMES, 2, 25).astype(np.float32),
        "right_tactile_data_gel": np.zeros((2 * FRAMES, 1, 4, 4, 3), dtype=np.uint8),
        "camera_ego_rgb": np.zeros((2 * FRAMES, 4, 4, 3), dtype=np.uint8),
    }
    for name, values in twice.items():
        data.create_array(name, data=values, **codecs)
    for name, kind in (("glove", "matrix"), ("gel", "image")):
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")  # of texts in version 3
            data.create_array(f"right_tactile_type_{name}", data=np.full(2 * FRAMES, kind, dtype="<U6"))
    root.create_group("meta").create_array("episode_ends", data=np.array([FRAMES, 2 * FRAMES]))
    return path, streams("right_hand_joints", "right_tactile_data_glove", threshold="threshold = 0.5\n")


def _chunk(tag: int, content: bytes) -> bytes:
    return b"\x04" + struct.pack("<IH", len(content) + 2, tag) + content


def xdf(folder: Path) -> tuple[Path, str]:
    """Streams of LabRecorder: joints and touch with clocks of their own, and markers."""
    hand, time, angles, contacts = made()
    content = b"XDF:" + _chunk(1, b"<?xml version='1.0'?><info><version>1.0</version></info>")
    every = (
        ("glove", time + 0.003, angles, hand.joint_names),
        ("skin", time[::2] + 0.001, contacts[::2], hand.patches.names),
    )
    for number, (name, stamps, values, labels) in enumerate(every, start=1):
        channels = "".join(f"<channel><label>{label}</label></channel>" for label in labels)
        header = (
            f"<?xml version='1.0'?><info><name>{name}</name><type>MoCap</type><channel_count>{len(labels)}"
            f"</channel_count><nominal_srate>0</nominal_srate><channel_format>double64</channel_format>"
            f"<desc><channels>{channels}</channels></desc></info>"
        )
        content += _chunk(2, struct.pack("<I", number) + header.encode())
        samples = b"".join(
            b"\x08" + struct.pack("<d", 5000.0 + stamp) + row.astype("<f8").tobytes()
            for stamp, row in zip(stamps, values, strict=True)
        )
        content += _chunk(3, struct.pack("<I", number) + b"\x04" + struct.pack("<I", len(stamps)) + samples)
        footer = f"<?xml version='1.0'?><info><sample_count>{len(stamps)}</sample_count></info>"
        content += _chunk(6, struct.pack("<I", number) + footer.encode())
    path = folder / "session.xdf"
    path.write_bytes(content)
    return path, HEAD + "[touch]\nthreshold = 0.5\n[touch.taxels]\n" + "".join(
        f'{n} = "{n}"\n' for n in hand.patches.names
    )


MAKERS = {"csv": csv, "tsv": tsv, "npz": npz, "parquet": parquet, "zarr": store, "xdf": xdf}
PARTS = {"parquet": "7", "zarr": "1"}
