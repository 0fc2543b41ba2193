"""Streams of the Lab Streaming Layer: samples in, beliefs out. A sender that dies is looked for until it is back."""

from __future__ import annotations

import contextlib
import threading
import time
from collections.abc import Sequence
from typing import Any

import numpy as np

from haptic_env import extras, validate
from haptic_env.arrays import Array
from haptic_lab.live.session import Chunk, Told

WHAT = "the Lab Streaming Layer"
BUFFER = 60  # s of samples that are kept while nobody asks
AGAIN = 0.5  # s between two looks for a stream
_quiet: set[bool] = set()
OUT = "haptic_slam"  # begins the names of streams of beliefs, unless another word does
LONGEST = 100  # letters of that word
KINDS = ("pose", "offset", "names", "entropy")


def library() -> Any:
    """Load it.

    Returns:
        `mne_lsl.lsl`.

    Raises:
        ImportError: where it is missing.
    """
    extras.folder("mne_lsl", "live", WHAT)
    lsl = extras.load("mne_lsl.lsl", "live", WHAT)
    if not _quiet:
        lsl.set_config_content("[log]\nlevel = -3\n")  # it tells of itself on stderr
        _quiet.add(True)
    return lsl


def find(names: Sequence[str], seconds: float) -> list[Any]:
    """Look for streams.

    Args:
        names: of those that are wanted.
        seconds: to look for them.

    Returns:
        What is told of each, in the order of the names.

    Raises:
        ValueError: for one that is not there, with those that are; for a name that several have.
    """
    lsl, found, begun = library(), dict[str, Any](), time.monotonic()
    while len(found) < len(names) and time.monotonic() - begun < seconds:
        there = [each for each in lsl.resolve_streams(timeout=AGAIN) if each.name in names]
        for name in dict.fromkeys(each.name for each in there):
            hosts = {each.uid: each.hostname for each in there if each.name == name}
            if len(hosts) > 1:
                where = ", ".join(map(repr, sorted(hosts.values())))
                raise ValueError(f"{len(hosts)} streams are called {name!r}, on {where}; give each a name of its own")
        for each in there:
            found.setdefault(each.name, each)
    missing = [name for name in names if name not in found]
    if missing:
        there = sorted({each.name for each in lsl.resolve_streams(timeout=AGAIN)})
        listed = f"there are {', '.join(map(repr, there))}" if there else "there is none"
        raise ValueError(f"no stream {', '.join(map(repr, missing))} came within {seconds:g} s; {listed}")
    return [found[name] for name in names]


def labels_of(inlet: Any) -> list[str]:
    """Name the columns of a stream.

    Args:
        inlet: of it.

    Returns:
        The labels of its channels, or `NAME[0]` and so on.
    """
    info = inlet.get_sinfo(timeout=2.0)
    told = info.get_channel_names()
    if told and all(told) and len({*told}) == len(told):
        return [str(each) for each in told]
    return [f"{info.name}[{column}]" for column in range(info.n_channels)]


class LslSource:
    """Samples of one stream or several.

    Attributes:
        labels: of the columns of each stream, by its name.
        rates: Hz, nominal, of each stream; 0: none is told.
    """

    def __init__(self, names: Sequence[str], seconds: float = 5.0) -> None:
        """Find them.

        Args:
            names: of the streams.
            seconds: to look for them.

        Raises:
            ValueError: for one that is not there, or has words in place of numbers.
            ImportError: where the library is missing.
        """
        self._lsl = library()
        self._inlets: dict[str, Any] = {}
        self._seekers: dict[str, threading.Thread] = {}
        self._open = True
        self.labels: dict[str, list[str]] = {}
        self.rates: dict[str, float] = {}
        for told in find(names, seconds):
            if told.dtype == "string":
                raise ValueError(f"stream {told.name!r} has words; numbers are needed")
            self._inlets[told.name] = inlet = self._connected(told)
            self.labels[told.name], self.rates[told.name] = labels_of(inlet), float(told.sfreq)

    def begin(self) -> None:
        """Let go of what has come while all was made ready: streams were found one after the other."""
        for inlet in self._inlets.values():
            with contextlib.suppress(Exception):  # of one that has died, which the first reading will find
                inlet.time_correction(timeout=2.0)  # else the first reading waits for it
        for inlet in self._inlets.values():
            with contextlib.suppress(Exception):
                inlet.flush()

    def poll(self, stream: str, seconds: float) -> list[Chunk]:
        """Hand out what has come.

        Args:
            stream: that is waited for.
            seconds: at most.

        Returns:
            A chunk of each stream of which anything has come.
        """
        chunks = [chunk for name in self._inlets if (chunk := self._pulled(name, 0.0)) is not None]
        if chunks:
            return chunks
        first = self._pulled(stream, seconds) if stream in self._inlets else None
        if first is None and self._inlets.get(stream) is None:
            time.sleep(seconds)
        return [] if first is None else [first]

    def close(self) -> None:
        """End it."""
        self._open = False
        for inlet in self._inlets.values():
            if inlet is not None:
                inlet.close_stream()

    def _connected(self, told: Any) -> Any:
        inlet = self._lsl.StreamInlet(told, max_buffered=BUFFER, recover=False, processing_flags=["clocksync"])
        inlet.open_stream(timeout=5.0)
        return inlet

    def _pulled(self, name: str, seconds: float) -> Chunk | None:
        inlet = self._inlets[name]
        if inlet is None:
            return None
        try:
            stamps: Array
            if seconds:
                sample, stamp = inlet.pull_sample(timeout=seconds)
                values, stamps = np.array(sample)[None], np.array([] if stamp is None else [stamp])
            else:
                values, stamps = inlet.pull_chunk(timeout=0.0)
        except Exception:  # LostError and its like, which the library keeps to itself
            self._inlets[name] = None
            seeker = threading.Thread(target=self._seek, args=(name,), daemon=True)
            self._seekers[name] = seeker
            seeker.start()
            return None
        arrival = time.monotonic()
        if not len(stamps):
            return None
        told = np.array(values, dtype=np.float64).reshape(len(stamps), -1)
        return Chunk(name, np.array(stamps, dtype=np.float64), told, arrival)

    def _seek(self, name: str) -> None:
        """Look for a stream that was lost, as wide as it was, until it is back."""
        width = len(self.labels[name])
        while self._open:
            for told in self._lsl.resolve_streams(timeout=AGAIN, name=name):
                try:
                    if told.n_channels == width:
                        self._inlets[name] = self._connected(told)
                        return
                except Exception:  # it was a trace of the one that died
                    time.sleep(AGAIN)


def check_prefix(prefix: str) -> str:
    """Check what begins the names of streams of beliefs.

    Args:
        prefix: that is wanted.

    Returns:
        The same.

    Raises:
        ValueError: for one that no name can begin with.
    """
    if not prefix.isprintable() or prefix != prefix.strip() or not 0 < len(prefix) <= LONGEST:
        raise ValueError(
            f"--lsl-out must be a word of 1 to {LONGEST} letters with which names of streams begin, such as {OUT}, got "
            f"{validate.shown(prefix)}"
        )
    return prefix


class LslSink:
    """Hands beliefs on as four streams: `haptic_slam_pose`, `_offset` (mean and SD of each joint, rad), `_names`
    (probability of each) and `_entropy` (bits), stamped with the time of the step."""

    def __init__(self, joint_names: Sequence[str], labels: Sequence[str], rate: float, prefix: str = OUT) -> None:
        """Open them.

        Args:
            joint_names: (J,).
            labels: (C,) what the object may be.
            rate: Hz, of the steps.
            prefix: begins their names.

        Raises:
            ValueError: where somebody sends streams that are called so already.
            ImportError: where the library is missing.
        """
        lsl = library()
        names = {f"{check_prefix(prefix)}_{kind}" for kind in KINDS}
        sent = {each.name: each.hostname for each in lsl.resolve_streams(timeout=AGAIN) if each.name in names}
        if sent:
            taken = min(sent)
            raise ValueError(
                f"a stream {taken!r} is sent already, on {sent[taken]!r}: end that session, or say by --lsl-out "
                f"another word than {validate.shown(prefix)} with which names begin"
            )
        joints = [*joint_names, *(f"{name}_std" for name in joint_names)]
        columns = {"pose": joints, "offset": joints, "names": list(labels), "entropy": ["entropy"]}
        units = {"pose": "radians", "offset": "radians", "names": "probability", "entropy": "bits"}
        self._outlets = {}
        for kind in KINDS:
            of, name = columns[kind], f"{prefix}_{kind}"
            info = lsl.StreamInfo(name, "belief", len(of), rate, "float64", name)
            info.set_channel_names(of)
            info.set_channel_units([units[kind]] * len(of))
            self._outlets[kind] = lsl.StreamOutlet(info, max_buffered=BUFFER)

    def tell(self, told: Told) -> None:
        """Hand on.

        Args:
            told: what is believed.
        """
        belief = told.belief
        values = {
            "pose": np.concatenate([belief.joint_angles, belief.joint_std]),
            "offset": np.concatenate([belief.joint_offset, belief.joint_offset_std]),
            "names": told.posterior,
            "entropy": np.array([told.entropy]),
        }
        for name, each in values.items():
            self._outlets[name].push_sample(np.ascontiguousarray(each, dtype=np.float64), timestamp=told.time)

    def close(self) -> None:
        """End them."""
        self._outlets.clear()
