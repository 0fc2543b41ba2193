"""Streams of the Lab Streaming Layer, from other processes: one that dies and comes back, of another width, never."""

from __future__ import annotations

import contextlib
import functools
import inspect
import os
import subprocess
import sys
import threading
import time
import uuid
from collections.abc import Iterator
from types import SimpleNamespace

import numpy as np
import pytest

from haptic_env import hands
from haptic_lab.commands import live
from haptic_lab.live import lsl
from haptic_lab.live.session import LiveSession
from observer import warm_up
from tests.haptic_lab.live.streams import Kept

pytest.importorskip("mne_lsl")
FEW = ["--hand", "two_finger", "--particles", "5", "--candidates", "cube", "sphere"]


@contextlib.contextmanager
def sending(name: str, hand: str = "two_finger", rate: float = 50.0, seconds: float = 60.0) -> Iterator[None]:
    """Another process sends; it is killed at the end."""
    env = {**os.environ, "PYTHONPATH": os.pathsep.join(filter(None, [os.getcwd(), *sys.path]))}
    command = [sys.executable, "-m", "tests.haptic_lab.live.sender", name, hand, str(rate), str(seconds)]
    with subprocess.Popen(command, env=env, stdout=subprocess.PIPE, text=True) as child:
        try:
            assert child.stdout is not None
            assert child.stdout.readline() == "ready\n"
            yield
        finally:
            child.kill()


@pytest.fixture
def name() -> str:
    """That nobody else sends by."""
    return f"test{uuid.uuid4().hex[:8]}"


def session(name: str, *more: str) -> tuple:
    """Source, session and sinks as the command sets them up."""
    made: list = []
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(live, "_run", lambda *all_: made.append(all_) or 0)
        assert live.main(["--lsl-in", f"{name}_joints", f"{name}_touch", "--lsl-out", name, *FEW, *more]) == 0
    warm_up(made[0][2].slam.hand, observer=made[0][2].slam)  # as the command does
    return made[0][1:]


@contextlib.contextmanager
def running(source, made: LiveSession, sinks) -> Iterator[Kept]:
    kept = Kept()
    thread = threading.Thread(target=made.run, args=(source, [*sinks, kept]))
    thread.start()
    try:
        yield kept
    finally:
        made.stop = True
        thread.join()
        source.close()
        for sink in sinks:
            sink.close()


def wait(for_what, seconds: float = 30.0) -> None:
    deadline = time.monotonic() + seconds
    while not for_what():
        assert time.monotonic() < deadline
        time.sleep(0.02)


def test_joints_and_contacts_come_and_beliefs_go(name, capsys):
    from mne_lsl import lsl

    hand = hands.make("two_finger")
    with sending(name):
        source, made, sinks = session(name)
        with running(source, made, sinks) as kept:
            wait(lambda: len(kept.told) > 5)
            (told,) = lsl.resolve_streams(timeout=5.0, name=f"{name}_pose")
            ear = lsl.StreamInlet(told)
            ear.open_stream(timeout=5.0)
            assert ear.get_sinfo().get_channel_names() == [*hand.joint_names, *(f"{j}_std" for j in hand.joint_names)]
            stamps: list[float] = []
            values: list = []

            def heard() -> bool:
                got, when = ear.pull_chunk(timeout=0.05)
                stamps.extend(when)
                values.extend(np.array(got))
                return len(stamps) > 10

            wait(heard)
            there = {each.name for each in lsl.resolve_streams(timeout=1.0)}
            assert live.main(["--udp", "0", "--lsl-out", name, *FEW]) == 2
            refused = capsys.readouterr().err
    assert {f"{name}_{each}" for each in ("pose", "offset", "names", "entropy")} <= there
    by_time = {told.time: told.belief for told in kept.told}
    at = min(by_time, key=lambda time_: abs(time_ - stamps[3]))
    np.testing.assert_array_equal(values[3], np.concatenate([by_time[at].joint_angles, by_time[at].joint_std]))
    assert made.merger.counts.late == made.merger.counts.clock_steps == 0
    assert f"a stream '{name}_entropy' is sent already, on " in refused
    assert "say by --lsl-out another word" in refused
    assert refused.count("\n") == 1


def test_a_sender_that_dies_and_comes_back(name, monkeypatch):
    said: list[str] = []
    with sending(name):
        source, made, sinks = session(name)
        made._say = said.append
        thread = running(source, made, sinks)
        kept = thread.__enter__()
        wait(lambda: len(kept.told) > 20)
    wait(lambda: len([each for each in said if "silent" in each]) == 2)
    before = len(kept.told)
    with sending(name):
        wait(lambda: len([each for each in said if "back" in each]) == 2)
        missing = lambda: np.isnan([each.belief.joint_angles for each in kept.told[-3:]]).any()  # noqa: E731
        wait(lambda: len(kept.told) > before + 20 and not missing())
        thread.__exit__(None, None, None)
    assert made.merger.counts.joints_missing > 10


def test_a_stream_that_never_comes_is_told(monkeypatch, capsys):
    assert inspect.signature(lsl.LslSource).parameters["seconds"].default == 5.0
    monkeypatch.setattr(live, "LslSource", functools.partial(lsl.LslSource, seconds=0.6))  # which is sooner
    assert live.main(["--lsl-in", "nobody", *FEW]) == 2
    told = capsys.readouterr().err
    assert "no stream 'nobody' came within 0.6 s" in told
    assert told.count("\n") == 1


@pytest.mark.parametrize(("uids", "refused"), [("ab", True), ("aa", False), ("a", False)])
def test_a_name_that_several_streams_have_is_told(monkeypatch, uids, refused):
    """Else joints might be of one hand, and touch of another. One that is heard on two networks is one."""
    there = [SimpleNamespace(name="Glove", uid=uid, hostname="lab") for uid in uids]
    monkeypatch.setattr(lsl, "library", lambda: SimpleNamespace(resolve_streams=lambda timeout: there))
    if refused:
        with pytest.raises(ValueError, match="2 streams are called 'Glove', on 'lab', 'lab'; give each a name"):
            lsl.find(["Glove"], 1.0)
    else:
        assert lsl.find(["Glove"], 1.0) == there[:1]


def test_a_stream_of_another_width_is_told(name, capsys):
    with sending(name, "two_finger_arm"):
        assert live.main(["--lsl-in", f"{name}_joints", *FEW]) == 2
    told = capsys.readouterr().err
    assert "8 joints and 50 patches" in told
    assert f"'{name}_joints' has" in told
    assert told.count("\n") == 1


@pytest.mark.parametrize(
    ("arguments", "begins"),
    [
        (["--udp", "0"], None),
        (["--udp", "0", "--lsl-out", "left hand"], "left hand"),
        (["--lsl-in", "a", "b"], lsl.OUT),
        (["--lsl-in", "a", "b", "--lsl-out", "Left"], "Left"),
    ],
)
def test_beliefs_go_out_by_the_name_that_was_said(monkeypatch, arguments, begins):
    """Two sessions on one network are told apart; whoever listens by UDP may send by the Lab Streaming Layer too."""
    hand, made, opened = hands.make("two_finger"), [], []

    labels = {"a": list(hand.joint_names), "b": list(hand.patches.names)}
    source = SimpleNamespace(labels=labels, rates={"a": 50.0, "b": 50.0})
    library = SimpleNamespace(
        resolve_streams=lambda timeout: [SimpleNamespace(name="haptic_slam2_pose", hostname="lab")],
        StreamInfo=lambda name, *_: (
            opened.append(name)
            or SimpleNamespace(set_channel_names=lambda names: None, set_channel_units=lambda units: None)
        ),
        StreamOutlet=lambda info, max_buffered: info,
    )
    monkeypatch.setattr(lsl, "library", lambda: library)
    monkeypatch.setattr(live, "LslSource", lambda names: source)
    monkeypatch.setattr(live, "_run", lambda *all_: made.append(all_) or 0)
    assert live.main([*arguments, *FEW]) == 0
    assert opened == ([] if begins is None else [f"{begins}_{kind}" for kind in lsl.KINDS])
    if "--udp" in arguments:
        made[0][1].close()
