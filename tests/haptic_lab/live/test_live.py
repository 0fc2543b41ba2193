"""What is believed live is what a replay believes, bit for bit; and what comes from strangers is survived and told."""

from __future__ import annotations

import itertools
import json
import os
import signal
import socket
import subprocess
import sys
import threading
import time
from pathlib import Path

import numpy as np
import pytest
import trimesh

from haptic_env import hands
from haptic_lab.commands import explore, live
from haptic_lab.exploration.run import begin, make_trial
from haptic_lab.exploration.settings import OBSERVER
from haptic_lab.live.merging import LiveStep
from haptic_lab.live.session import Chunk, LiveSession
from haptic_lab.live.udp import UdpSource
from observer import HapticSLAM
from observer.library import Library
from observer.surface import Surface
from tests.haptic_lab.live.streams import Kept, Played, moving

FEW = ["--particles", "5", "--candidates", "cube", "sphere"]


@pytest.fixture(scope="module")
def hand():
    return hands.make("two_finger")


def session(*arguments: str) -> tuple[UdpSource, LiveSession]:
    """A session as the command sets it up, whose port nobody knows."""
    made = []
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(live, "_run", lambda given, source, session, sinks: made.append((source, session)) or 0)
        assert live.main(["--udp", "0", "--hand", "two_finger", *FEW, *arguments]) == 0
    return made[0]


def replayed(path: Path, bits, *more: str) -> list:
    """What a replay of a recording believes at each step."""
    given = [str(path), "--hand", "two_finger", "--out", str(path.parent / "out"), *FEW, *more]
    settings, recording = explore.parse(given, "recording")
    trial, beliefs = make_trial(settings, begin(settings, recording)), []
    run = trial.observer_runs[OBSERVER]
    for _ in trial:
        beliefs.append((bits(run.belief), run.shape.posterior.tobytes()))
    return beliefs


def played(time_, angles, contacts, *, burst=1, gap=(0, 0), jump=0.0, seldom=1, until=None):
    """Chunks of samples, some lost, of a clock that steps; touch that comes seldom, joints that are not measured."""
    angles, contacts = angles.copy(), contacts.copy()
    angles[until or len(angles) :] = np.nan
    contacts[np.arange(len(contacts)) % seldom > 0] = np.nan
    for first in range(0, len(time_), burst):
        rows = slice(first, first + burst)
        if gap[0] <= first < gap[1]:
            yield []
            continue
        off = jump if first > 60 else 0.0
        yield [Chunk("joints", time_[rows] + off, angles[rows]), Chunk("contacts", time_[rows] + off, contacts[rows])]


HOW = {
    "steady": {},
    "in bursts": {"burst": 9},
    "with a gap": {"gap": (40, 60)},
    "a clock that steps": {"jump": 500.0},
    "touch comes seldom": {"seldom": 5},
    "nothing is measured at last": {"until": 70},
}


@pytest.mark.parametrize("how", HOW)
@pytest.mark.parametrize("rate", ["50", "100"])
def test_what_was_believed_live_is_what_a_replay_believes(tmp_path, hand, bits, how, rate):
    path = tmp_path / "session.npz"
    source, made = session("--control-hz", rate, "--record", str(path), "--seed", "3")
    source.close()
    kept, source = Kept(), Played(played(*moving(hand, 120, float(rate)), **HOW[how]))
    source.session = made
    seen = []
    kept.tell = lambda told: seen.append((bits(told.belief), told.posterior.tobytes()))
    made.run(source, [kept])
    assert made.record.write()
    assert len(made.record) == len(seen) >= 90
    assert seen[1:] == replayed(path, bits, "--seed", "3")


@pytest.mark.parametrize("more", [[], ["--yaw-jitter", "20", "--position-jitter", "0.01"]], ids=len)
def test_objects_that_were_learnt_are_recognised_live_as_in_a_replay(tmp_path, hand, bits, more):
    ball = trimesh.creation.icosphere(subdivisions=2, radius=0.025)
    surface = Surface(np.array(ball.vertices), np.array(ball.faces), np.full(len(ball.vertices), 0.003))
    Library(tmp_path / "objects").add("mug1", surface)
    path, told = tmp_path / "session.npz", ["--library", str(tmp_path / "objects"), *more]
    source, made = session("--record", str(path), *told)
    source.close()
    assert "mug1" in made.namer.labels
    seen, kept, source = [], Kept(), Played(played(*moving(hand, 40)))
    source.session = made
    kept.tell = lambda told: seen.append((bits(told.belief), told.posterior.tobytes()))
    made.run(source, [kept])
    assert made.record.write()
    assert len({posterior for _, posterior in seen}) > 3
    assert seen[1:] == replayed(path, bits, *told)


def test_what_came_while_all_was_made_ready_is_let_go(hand):
    """Else a session begins as far behind as that took."""
    source, _ = session()
    time_, angles, contacts = moving(hand, 20)
    send(source.port, (line(*each) for each in zip(time_[:10], angles, contacts, strict=False)))
    source.begin()
    send(source.port, (line(*each) for each in zip(time_[10:], angles, contacts, strict=False)))
    found: list[Chunk] = []
    deadline = time.monotonic() + 10.0
    while len(found) < 20 and time.monotonic() < deadline:
        found += source.poll("joints", 0.1)
    source.close()
    assert [float(each.stamps[0]) for each in found[::2]] == time_[10:].tolist()


@pytest.mark.parametrize("stalled", [0.5, 1.5, 20.0])
def test_streams_that_are_read_one_long_after_the_other_stay_together(hand, stalled):
    """As where the first reading waits for the clock of a stream: that is no step of it."""
    source, made = session()
    source.close()
    time_, angles, contacts = moving(hand, 1200)
    known = time_ <= time_[100]
    made.take(Chunk("joints", time_[known], angles[known], 7.0), 7.0 + stalled)
    later = time_ <= time_[100] + stalled
    made.take(Chunk("contacts", time_[later], contacts[later], 7.0 + stalled), 7.0 + stalled)
    made.take(Chunk("joints", time_[later & ~known], angles[later & ~known], 7.0 + stalled), 8.0 + stalled)
    assert made.merger.counts.clock_steps == 0
    steps = [*made.merger.ready(7.0 + stalled)]
    assert len(steps) >= later.sum() - 2
    np.testing.assert_array_equal([each.contacts for each in steps], contacts[: len(steps)])


def line(time_, angles, contacts, names=None) -> bytes:
    told = {"time": float(time_), "joints": angles.tolist(), "contacts": contacts.tolist()}
    if names is not None:
        told["joints"] = dict(zip(names, angles.tolist(), strict=True))
    return json.dumps(told).encode() + b"\n"


def send(port: int, lines, pause: float = 0.0) -> None:
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as sender:
        for each in lines:
            sender.sendto(each, ("127.0.0.1", port))
            time.sleep(pause)


@pytest.mark.parametrize("by_name", [False, True])
def test_lines_by_udp_are_told_and_beliefs_come_back(hand, by_name):
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as ear:
        ear.bind(("127.0.0.1", 0))
        ear.settimeout(20.0)
        made: list = []
        with pytest.MonkeyPatch.context() as patch:
            patch.setattr(live, "_run", lambda *all_: made.append(all_) or 0)
            out = str(ear.getsockname()[1])
            assert live.main(["--udp", "0", "--udp-out", out, "--hand", "two_finger", *FEW]) == 0
        _, source, running, sinks = made[0]
        thread = threading.Thread(target=running.run, args=(source, sinks))
        thread.start()
        names = hand.joint_names if by_name else None
        send(source.port, (line(*each, names) for each in zip(*moving(hand, 30), strict=True)), 0.002)
        heard = [json.loads(ear.recv(65535)) for _ in range(29)]
        running.stop = True
        thread.join()
        source.close()
        sinks[0].close()
    assert [each["time"] for each in heard] == pytest.approx(100.0 + 0.02 * np.arange(29))
    last = heard[-1]
    assert list(last["pose"]) == list(last["offset_std"]) == list(hand.joint_names)
    assert sum(last["names"].values()) == pytest.approx(1.0)
    assert 0.0 <= last["entropy"] <= 1.0


ODD = {
    "no JSON": b"hello",
    "bytes": b"\xff\xfe",
    "a number": b"3",
    "no time": b'{"joints": []}',
    "a time that is none": b'{"time": NaN, "joints": []}',
    "a text for a time": b'{"time": "now", "contacts": []}',
    "another width": b'{"time": 1, "joints": [1, 2, 3]}',
    "no such joint": b'{"time": 1, "joints": {"thumb": 3}}',
    "a text": b'{"time": 1, "joints": {"index_mcp_flexion": "3"}}',
    "nested": b"[" * 60_000,
    "nothing of it": b'{"time": 1, "temperature": 3}',
    "too large": b'{"time": 1e300, "joints": []}',
    "milliseconds": b'{"time": 1796000000000, "joints": []}',
    "no number": b'{"time": NaN, "joints": []}',
}


@pytest.mark.parametrize("odd", ODD)
def test_lines_that_are_none_are_refused_and_told_once(hand, odd):
    said: list[str] = []
    source = UdpSource(0, "127.0.0.1", {"joints": hand.joint_names, "contacts": hand.patches.names}, said.append)
    time_, angles, contacts = moving(hand, 2)
    send(source.port, [ODD[odd], ODD[odd], line(time_[0], angles[0], contacts[0])])
    deadline, found = time.monotonic() + 10.0, []
    while len(found) < 2 and time.monotonic() < deadline:
        found += source.poll("joints", 0.1)
    source.close()
    assert [each.stream for each in found] == ["joints", "contacts"]
    np.testing.assert_array_equal(found[0].values, angles[:1])
    assert source.refused == 2
    assert len(said) == 1
    assert "\n" not in said[0]


@pytest.mark.parametrize("stamp", [-3, 1.796e9, 9.9e9])
def test_a_clock_may_count_from_1970(hand, stamp):
    said: list[str] = []
    source = UdpSource(0, "127.0.0.1", {"joints": hand.joint_names, "contacts": hand.patches.names}, said.append)
    send(source.port, [line(stamp, hand.rest_pose, np.zeros(len(hand.patches)))])
    found = source.poll("joints", 10.0)
    source.close()
    assert [each.stamps.tolist() for each in found] == [[stamp], [stamp]]
    assert not said


def test_numbers_that_no_joint_can_have_are_not_measured(hand, bits):
    source, made = session()
    source.close()
    time_, angles, contacts = moving(hand, 60)
    angles[20, 2], angles[25], contacts[30, 4] = 90.0, np.inf, 0.5
    kept, source = Kept(), Played(played(time_, angles, contacts))
    source.session = made
    made.run(source, [kept])
    assert len(kept.told) == 60
    assert made.merger.counts.refused == 2
    assert all(np.isfinite(each.belief.joint_angles).all() for each in kept.told)


BAD = {
    "no source": (["--hand", "two_finger"], "--lsl-in NAME ... or --udp PORT"),
    "two sources": (["--udp", "0", "--lsl-in", "a", "--hand", "two_finger"], "--lsl-in NAME ... or --udp PORT"),
    "no hand": (["--udp", "0"], "--hand NAME"),
    "another hand": (["--udp", "0", "--hand", "foot"], "foot"),
    "a port": (["--udp", "70000", "--hand", "two_finger"], "65535"),
    "an address": (["--udp", "0", "--host", "203.0.113.7", "--hand", "two_finger"], "address of this machine"),
    "a rate": (["--udp", "0", "--hand", "two_finger", "--control-hz", "1000"], "500"),
    "no rate": (["--udp", "0", "--hand", "two_finger", "--control-hz", "0"], "--control-hz must be"),
    "a stream twice": (["--lsl-in", "a", "b", "a", "--hand", "two_finger"], "each stream once, got a, b, a"),
    "no map": (["--udp", "0", "--columns", "none.toml"], "--columns 'none.toml' cannot be read: No such file"),
    "a record": (["--udp", "0", "--hand", "two_finger", "--record", "a.csv"], ".npz"),
    "a folder": (["--udp", "0", "--hand", "two_finger", "--record", "no/such/a.npz"], "a folder"),
    "a folder to save in": (["--udp", "0", "--hand", "two_finger", "--save", "no/such/a.npz"], "a folder"),
    "one file for both": (
        ["--udp", "0", "--hand", "two_finger", "--record", "a.npz", "--save", "./a.npz"],
        "another file than --record",
    ),
    "no port to send to": (["--udp", "0", "--udp-out", "0", "--hand", "two_finger"], "--udp-out must be"),
    "no name to send by": (["--udp", "0", "--lsl-out", "", "--hand", "two_finger"], "--lsl-out must be a word of 1"),
    "a name of two lines": (["--lsl-in", "a", "--lsl-out", "a\nb", "--hand", "two_finger"], "--lsl-out must be a word"),
    "its own port": (["--udp", "5005", "--udp-out", "5005", "--hand", "two_finger"], "another port than --udp"),
    "a candidate": (["--udp", "0", "--hand", "two_finger", "--candidates", "cub"], "cube"),
    "a library": (["--udp", "0", "--hand", "two_finger", "--library", "none"], "learn one first"),
    "seconds": (["--udp", "0", "--hand", "two_finger", "--seconds", "-1"], "--seconds"),
}


@pytest.mark.parametrize("bad", BAD)
def test_what_makes_no_sense_is_told_in_a_line(tmp_path, monkeypatch, capsys, bad):
    monkeypatch.chdir(tmp_path)
    arguments, valid = BAD[bad]
    assert live.main([*arguments, *([] if "--seconds" in arguments else ["--seconds", "0.1"])]) == 2
    told = capsys.readouterr().err
    assert valid in told
    assert told.count("\n") == 1
    assert not [*tmp_path.iterdir()]


def test_a_port_that_is_taken_is_told(capsys):
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as other:
        other.bind(("127.0.0.1", 0))
        assert live.main(["--udp", str(other.getsockname()[1]), "--hand", "two_finger", *FEW]) == 2
    told = capsys.readouterr().err
    assert "cannot be had" in told
    assert told.count("\n") == 1


def test_what_never_comes_is_told(hand, monkeypatch):
    source, made = session()
    source.close()
    said: list[str] = []
    made._say = said.append
    clock = itertools.count(0.0, 0.5)
    monkeypatch.setattr("haptic_lab.live.session.time.monotonic", lambda: next(clock))
    made.run(Played(iter([[]] * 200)), [], 99.0)
    for stream in ("joints have come from joints", "touch have come from contacts"):
        waited = [float(each.split(" s;")[0].split()[-1]) for each in said if f"no samples of {stream}" in each]
        assert len(waited) >= 3
        assert all(later > 1.9 * sooner for sooner, later in itertools.pairwise(waited)), "and ever more seldom"


@pytest.mark.skipif(os.name == "nt", reason="signals are POSIX's")
@pytest.mark.parametrize("ends", [signal.SIGINT, signal.SIGTERM])
def test_a_signal_ends_it_and_what_was_recorded_is_written(tmp_path, hand, capsys, ends):
    source, made = session("--record", str(tmp_path / "a.npz"))
    source.close()

    def until_told():
        yield from played(*moving(hand, 20))
        signal.raise_signal(ends)
        assert made.stop
        yield []

    usual = [signal.getsignal(each) for each in (signal.SIGINT, signal.SIGTERM)]
    source = Played(until_told())
    source.session = made
    assert live._run({"lsl_in": ["a"], "seconds": None, "save": None}, source, made, []) == 0
    assert "Recorded: " in capsys.readouterr().out
    assert [signal.getsignal(each) for each in (signal.SIGINT, signal.SIGTERM)] == usual
    with np.load(tmp_path / "a.npz") as content:
        assert len(content["time"]) == 20


def test_what_was_told_is_kept_before_anything_is_drawn(tmp_path, hand, capsys):
    """A second Ctrl-C, while a page is drawn, ends that alone."""
    kept = tmp_path / "a.npz", tmp_path / "state.npz"
    source, made = session("--record", str(kept[0]), "--save", str(kept[1]))
    source.close()

    class Slow(Kept):
        def close(self) -> None:
            assert all(each.exists() for each in kept)
            raise KeyboardInterrupt

    source = Played(played(*moving(hand, 20)))
    source.session = made
    with pytest.raises(KeyboardInterrupt):
        live._run({"lsl_in": ["a"], "seconds": None, "save": str(kept[1])}, source, made, [Slow()])
    assert "Recorded: " in capsys.readouterr().out


def test_a_session_without_a_step_writes_nothing_and_says_so(tmp_path, capsys):
    source, made = session("--record", str(tmp_path / "a.npz"))
    assert live._run({"lsl_in": None, "seconds": 0.01, "save": None}, source, made, []) == 0
    told = capsys.readouterr()
    assert "there was no step: " in told.err
    assert "0 steps told" in told.out
    assert not [*tmp_path.iterdir()]


@pytest.mark.skipif(os.name == "nt", reason="signals are POSIX's")
def test_ctrl_c_ends_it_and_what_was_recorded_is_written(tmp_path, hand):
    """And the observer is kept as it was."""
    arguments = ["--udp", "0", "--hand", "two_finger", *FEW, "--record", "a.npz", "--save", "state.npz"]
    command = [sys.executable, "-u", "-m", "haptic_lab", "live", *arguments]
    env = {**os.environ, "PYTHONPATH": os.pathsep.join(filter(None, [os.getcwd(), *sys.path]))}
    with subprocess.Popen(command, cwd=tmp_path, env=env, stdout=subprocess.PIPE, text=True) as child:
        assert child.stdout is not None
        for told in child.stdout:
            if "UDP port" in told:
                break
        port = int(told.split("UDP port ")[1].split()[0])
        send(port, (line(*each) for each in zip(*moving(hand, 60), strict=True)), 0.01)
        time.sleep(0.2)
        child.send_signal(signal.SIGINT)
        rest = child.stdout.read()
        assert child.wait(timeout=60) == 0
    assert "Recorded: a.npz" in rest
    assert "Most likely" in rest
    with np.load(tmp_path / "a.npz") as content:
        assert len(content["time"]) >= 58
    assert HapticSLAM.load(tmp_path / "state.npz").particle_maps.shape[0] == 5


def test_a_step_that_fails_is_in_the_record(tmp_path, monkeypatch):
    source, live_session = session("--record", str(tmp_path / "session.npz"))
    try:
        felt = LiveStep(0.0, live_session.slam.hand.rest_pose, np.zeros(len(live_session.slam.hand.patches)))
        live_session.observe(felt, [])

        def fails(*_):
            raise FloatingPointError("as asked")

        monkeypatch.setattr(live_session.slam, "step", fails)
        with pytest.raises(FloatingPointError, match="as asked"):
            live_session.observe(felt._replace(time=0.02), [])
        assert len(live_session.record) == 2
    finally:
        source.close()


def test_no_belief_is_held_while_the_next_one_is_found():
    """Its map would be computed just before it changes, though nobody asks for it."""
    source, made = session()
    source.close()
    time_, angles, contacts = moving(made.slam.hand, 40)
    step, held = made.slam.step, []

    def stepped(*told):
        held.append(made.told)
        return step(*told)

    made.slam.step = stepped
    source = Played(iter([Chunk(kind, time_, each)] for kind, each in (("joints", angles), ("contacts", contacts))))
    source.session = made
    made.run(source, [])
    assert len(held) == 39
    assert held == [None] * 39
    assert made.told is not None
