"""Streams as JSON lines in UDP datagrams, for whoever has no Lab Streaming Layer. Nothing in them is run.

In: `{"time": s, "joints": {...}, "contacts": {...}}`, any part of it, and "torques" where they are asked for; numbers
by the names of columns, or lists of all columns in the order of the hand; null, or what is left out, was not measured.
Out: a line a belief.
"""

from __future__ import annotations

import contextlib
import json
import select
import socket
from collections.abc import Callable, Sequence
from typing import Any

import numpy as np

from haptic_env import validate
from haptic_env.recordings.checks import LATEST
from haptic_lab.live.session import Chunk, Told

JOINTS, CONTACTS, TORQUES = "joints", "contacts", "torques"
LARGEST = 65_535  # bytes of a datagram
HERE = "127.0.0.1"
ROOM = 2**22  # bytes that the system keeps where they come in a burst


class UdpSource:
    """Datagrams at a port.

    Attributes:
        labels: of the columns of each stream.
        refused: how many were none that can be read.
    """

    def __init__(self, port: int, host: str, columns: dict[str, Sequence[str]], say: Callable[[str], object]) -> None:
        """Listen.

        Args:
            port: 0: any that is free.
            host: address of this machine at which it listens.
            columns: of "joints", of "contacts" and, where they are told, of "torques".
            say: told what is wrong with the first that cannot be read.

        Raises:
            ValueError: for a port that is taken, or an address that this machine has not.
        """
        self.labels = columns
        self._columns = {kind: {name: at for at, name in enumerate(names)} for kind, names in columns.items()}
        self._say, self.refused = say, 0
        self._socket = bound(port, host)
        self._socket.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, ROOM)
        self._socket.setblocking(False)

    @property
    def port(self) -> int:
        """At which it listens."""
        return int(self._socket.getsockname()[1])

    def begin(self) -> None:
        """Let go of what has come while all was made ready."""
        with contextlib.suppress(BlockingIOError, ConnectionError):
            while True:
                self._socket.recv(LARGEST)

    def poll(self, stream: str, seconds: float) -> list[Chunk]:
        """Hand out what has come.

        Args:
            stream: not used: all come at one port.
            seconds: to wait at most.

        Returns:
            A chunk of each line that says something of joints, or of contacts.
        """
        chunks: list[Chunk] = []
        select.select([self._socket], [], [], seconds)
        for _ in range(1024):
            try:
                data = self._socket.recv(LARGEST)
            except (BlockingIOError, ConnectionError):
                break
            for line in data.split(b"\n"):
                if line.strip():
                    try:
                        chunks += self._read(line)
                    except (ValueError, RecursionError) as error:
                        self.refused += 1
                        if self.refused == 1:
                            self._say(f"a line was refused, as others like it will be: {error}")
        return chunks

    def close(self) -> None:
        """Listen no more."""
        self._socket.close()

    def _read(self, line: bytes) -> list[Chunk]:
        try:
            told = json.loads(line)
        except (UnicodeDecodeError, json.JSONDecodeError) as error:
            raise ValueError(f"a line must be JSON ({error})") from error
        if not isinstance(told, dict) or not {*told} & {*self._columns}:
            raise ValueError(f"a line must be a table with time, joints and contacts, got {validate.shown(told)}")
        stamp: Any = told.get("time")
        if type(stamp) not in (int, float) or not abs(stamp) <= LATEST:
            said = f"time must be a number of seconds in [-{LATEST:g}, {LATEST:g}]"
            raise ValueError(f"{said}, got {validate.shown(stamp)}")
        return [
            Chunk(kind, np.array([float(stamp)]), self._values(kind, told[kind])[None])
            for kind in self._columns
            if told.get(kind) is not None
        ]

    def _values(self, kind: str, told: Any) -> Any:
        columns = self._columns[kind]
        values = np.full(len(columns), np.nan)
        if isinstance(told, list):
            if len(told) != len(columns):
                raise ValueError(f"{kind} has {len(told)} columns, and must have {len(columns)}")
            told = dict(zip(columns, told, strict=True))
        if not isinstance(told, dict):
            raise ValueError(f"{kind} must be a table or a list, got {validate.shown(told)}")
        for name, value in told.items():
            if name not in columns:
                validate.choice(f"column of {kind}", name, [*columns])
            if value is not None:
                if type(value) not in (int, float, bool):
                    raise ValueError(f"{name} must be a number or null, got {validate.shown(value)}")
                values[columns[name]] = value
        return values


class UdpSink:
    """Sends each belief as a line of JSON."""

    def __init__(self, port: int, host: str, joint_names: Sequence[str]) -> None:
        """Send to a port.

        Args:
            port: of whoever listens.
            host: its address.
            joint_names: (J,).
        """
        self._to, self._names = (host, port), joint_names
        self._socket = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
        self._socket.setblocking(False)

    def tell(self, told: Told) -> None:
        """Send a belief; where nobody listens it is lost.

        Args:
            told: what is believed.
        """
        line = json.dumps(as_table(told, self._names)).encode() + b"\n"
        try:
            self._socket.sendto(line, self._to)
        except OSError:  # nobody listens, or its queue is full
            return

    def close(self) -> None:
        """Send no more."""
        self._socket.close()


def as_table(told: Told, joint_names: Sequence[str]) -> dict[str, Any]:
    """Put a belief into JSON's words.

    Args:
        told: what is believed.
        joint_names: (J,).

    Returns:
        `time` s; by joint `pose`, `pose_std`, `offset`, `offset_std` rad; `names`, their probability; `entropy` bits.
    """
    belief = told.belief
    of_joints = {
        "pose": belief.joint_angles,
        "pose_std": belief.joint_std,
        "offset": belief.joint_offset,
        "offset_std": belief.joint_offset_std,
    }
    return {
        "time": told.time,
        **{name: dict(zip(joint_names, each.tolist(), strict=True)) for name, each in of_joints.items()},
        "names": dict(zip(told.labels, told.posterior.tolist(), strict=True)),
        "entropy": told.entropy,
    }


def bound(port: int, host: str) -> socket.socket:
    """Take a port.

    Args:
        port: its number.
        host: address of this machine.

    Returns:
        The socket.

    Raises:
        ValueError: for one that is taken, or an address that this machine has not.
    """
    found = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
    try:
        found.bind((host, port))
    except OSError as error:
        found.close()
        raise ValueError(
            f"--udp: port {port} of {host} cannot be had ({error.strerror}); give a free one from 1024 to 65535, or 0 "
            "for any, and with --host an address of this machine"
        ) from error
    return found
