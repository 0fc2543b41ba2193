"""Observe a hand as it moves: joints and contacts come as streams, what is believed goes out as streams.

Streams are those of the Lab Streaming Layer (--lsl-in), or JSON lines by UDP (--udp). docs/live.md has the formats.
"""

from __future__ import annotations

import argparse
import signal
from collections.abc import Sequence
from contextlib import ExitStack
from pathlib import Path
from typing import Any

from haptic_env import hands, recordings, validate
from haptic_env.files import check_writable
from haptic_env.hand import Hand
from haptic_env.recordings import ColumnMap
from haptic_env.recordings.measured import USUAL_HZ
from haptic_lab import believed, replay
from haptic_lab.exploration import learnt
from haptic_lab.exploration.settings import DEFAULTS, OBSERVER, ExplorationSettings
from haptic_lab.live import lsl, udp
from haptic_lab.live.layout import layouts, torque_layout
from haptic_lab.live.lsl import LslSink, LslSource
from haptic_lab.live.pace import BEHIND
from haptic_lab.live.record import StepRecord
from haptic_lab.live.session import LiveSession
from haptic_lab.terminal import Parser, as_path, make_console, tell, tell_error
from haptic_lab.trial import make_observers
from haptic_lab.view.live_sink import ViewSink
from haptic_lab.view.options import ViewOptions
from haptic_lab.view.options import add_flags as add_view_flags
from haptic_lab.view.viewer import opened
from haptic_lab.warm_up import get_ready, told_on
from haptic_lab.worlds import environment, expanded, typed_shape
from observer import HapticSLAM, warm_up

EXAMPLE = """examples: haptic-slam live --lsl-in Glove Skin --hand adroit --columns map.toml --record session.npz
          haptic-slam live --udp 5005 --udp-out 5006 --hand two_finger --candidates cube sphere
          haptic-slam replay session.npz --hand two_finger"""
TOLD = (*believed.BELIEVED, *learnt.JITTER, "sigma", "particles", "seed", "none", "library")
UNTOLD: dict[str, Any] = {"seconds": None, "policy": "random_torque", "out": "out/live"}


def main(arguments: list[str] | None = None) -> int:
    """Run the command.

    Args:
        arguments: of the command line; None: those of this process.

    Returns:
        Its exit code.
    """
    parser = Parser(description=__doc__, epilog=EXAMPLE, formatter_class=argparse.RawDescriptionHelpFormatter)
    add = parser.add_argument
    add("--lsl-in", nargs="+", metavar="NAME", help="streams that have the joints and the contacts")
    what = (
        "what is commanded, fractions of the torques' limits: a stream of --lsl-in's kind, or without a name the lines "
        "of --udp; then the hand's physics says how it moves"
    )
    add("--torques", nargs="?", const=udp.TORQUES, metavar="NAME", help=what)
    add("--udp", type=int, metavar="PORT", help="listen for JSON lines at this port instead; 0: any that is free")
    add("--host", default=udp.HERE, help=f"address at which to listen (default {udp.HERE}: this machine only)")
    begins = f"begins the names of the streams of beliefs, NAME_pose and so on (default {lsl.OUT}; of --udp: none)"
    add("--lsl-out", metavar="NAME", help=begins)
    add("--udp-out", type=int, metavar="PORT", help="send beliefs to this port of this machine, as JSON lines")
    add("--hand", help=f"whose joints and patches they are: {', '.join(hands.HANDS)}, or {hands.OWN}")
    meaning = "TOML: which column is which joint, and which taxel which patch (docs/recordings.md)"
    add("--columns", type=as_path, metavar="FILE", help=meaning)
    rate = f"steps a second (default: as joints come, {USUAL_HZ:g} at most; --udp {USUAL_HZ:g})"
    add("--control-hz", type=float, metavar="HZ", help=rate)
    named = "what the object may be, shapes or sets, each at its own size (default: the four shapes)"
    add("--candidates", type=typed_shape, nargs="+", metavar="SHAPE", help=named)
    add("--none", type=float, default=0.0, help="prior probability that it is none of these (default 0)")
    learnt.add_flags(add, learning=False)
    add("--sigma", type=float, help="error of the joint sensors, SD in degrees (default 3)")
    believed.add_flags(add)
    add("--particles", type=int, help="hypotheses of the observer (default 200)")
    add("--seed", type=int, help="of all that is left to chance (default 0)")
    add("--record", type=as_path, metavar="FILE", help="keep what was told to the observer, as .npz for replay")
    add("--save", type=as_path, metavar="FILE", help="keep the observer as it is at the end (HapticSLAM.load)")
    add("--seconds", type=float, help="end after so long (default: at Ctrl-C)")
    add_view_flags(add)
    given = vars(parser.parse_args(arguments))
    console = make_console()
    with ExitStack() as stack:
        try:
            options = ViewOptions.taken(given)
            options.check(".")
            viewer = opened(options, console)
            if viewer is not None:
                stack.callback(viewer.close)
            source, session, sinks = _set_up(given)
        except (ValueError, ImportError, OSError) as error:
            tell_error(str(error))
            return 2
        if viewer is not None:
            sinks.append(ViewSink(viewer, session.slam, session.namer.labels, console, lambda: session.told))
        code = _run(given, source, session, sinks)
        if viewer is not None and not session.stop:
            viewer.stay(console)
    return code


def _set_up(given: dict[str, Any]) -> tuple[Any, LiveSession, list[Any]]:
    if (given["lsl_in"] is None) == (given["udp"] is None):
        raise ValueError("say where joints and contacts come from: --lsl-in NAME ... or --udp PORT")
    for name, least in (("udp", 0), ("udp_out", 1)):
        if given[name] is not None:
            validate.integer(f"--{name.replace('_', '-')}", given[name], least, 65535)
    if given["udp_out"] is not None and given["udp_out"] == given["udp"]:
        raise ValueError(f"--udp-out must be another port than --udp, at which we listen, got {given['udp']} for both")
    if given["lsl_out"] is not None:
        lsl.check_prefix(given["lsl_out"])
    if given["save"] is not None:
        check_writable("--save", Path(given["save"]))
        if given["record"] is not None and Path(given["save"]).resolve() == Path(given["record"]).resolve():
            raise ValueError(f"--save must be another file than --record, got {validate.shown(given['save'])} for both")
    if given["seconds"] is not None:
        validate.number("--seconds", given["seconds"], 0.0, above=0.0, unit="s")
    columns = _columns(given["columns"])
    hand = _hand(given, columns)
    settings = _settings(given, hand)
    rate = None if columns is None else columns.control_hz
    if given["control_hz"] is not None:
        rate = validate.number("--control-hz", given["control_hz"], 1.0, 500.0, unit="Hz")
    torques = given["torques"]
    record = StepRecord(None if given["record"] is None else Path(given["record"]), hand, rate or USUAL_HZ)
    source: Any
    if given["udp"] is None:
        if len({*given["lsl_in"]}) < len(given["lsl_in"]):
            raise ValueError(f"--lsl-in must name each stream once, got {', '.join(given['lsl_in'])}")
        if torques in given["lsl_in"]:
            raise ValueError(f"--torques must be another stream than those of --lsl-in, got {validate.shown(torques)}")
        source = LslSource([*given["lsl_in"], *([] if torques is None else [torques])])
        named, rates = [(name, source.labels[name]) for name in given["lsl_in"]], source.rates
    else:
        if torques not in (None, udp.TORQUES):
            raise ValueError(f"--torques of --udp takes no name: lines tell them as {udp.TORQUES}, got {torques!r}")
        labels = _udp_columns(hand, columns)
        named, rates = list(labels.items()), {}
        told_by = labels if torques is None else {**labels, torques: hand.joint_names}
        source = udp.UdpSource(given["udp"], given["host"], told_by, _say)
    try:
        found = layouts(named, columns, hand)
        drive = None if torques is None else torque_layout(torques, source.labels[torques], hand)
        rate = rate or _rate(rates.get(found[0].stream, 0.0), found[0].stream, given["udp"] is not None)
        touched = rates.get(found[1].stream, 0.0)
        record = StepRecord(record.path, hand, rate, torques is not None)
        namer, _, told = replay.of_measured(settings, hand, torques is not None)
        noise = settings.told(settings.noise, hand)
        told = {"control_hz": rate, **noise, **told}
        slam = make_observers((OBSERVER,), hand, particles=settings.particles, **told)[OBSERVER]
        assert isinstance(slam, HapticSLAM)
        sinks: list[Any] = []
        if given["udp"] is None or given["lsl_out"] is not None:
            sinks.append(LslSink(hand.joint_names, namer.labels, rate, given["lsl_out"] or lsl.OUT))
        if given["udp_out"] is not None:
            sinks.append(udp.UdpSink(given["udp_out"], udp.HERE, hand.joint_names))
    except BaseException:
        source.close()
        raise
    driven = rates.get(torques, 0.0) if torques is not None else 0.0
    intervals = 1.0 / (touched if touched > 0.0 else rate), 1.0 / (driven if driven > 0.0 else rate)
    return source, LiveSession(slam, namer, (*found, drive), intervals, settings.seed, record, _say), sinks


def _columns(path: str | None) -> ColumnMap | None:
    if path is None:
        return None
    try:
        return recordings.read_columns(path)
    except OSError as error:
        raise ValueError(f"--columns {path!r} cannot be read: {error.strerror}") from error


def _say(told: str) -> None:
    tell("warning", told)


def _hand(given: dict[str, Any], columns: ColumnMap | None) -> Hand:
    name = given["hand"] or (columns.whose if columns is not None else None)
    if name is None:
        raise ValueError("say whose joints and patches they are: --hand NAME, or hand = NAME in --columns")
    return hands.make(hands.check("--hand", name))


def _settings(given: dict[str, Any], hand: Hand) -> ExplorationSettings:
    learnt.resolve(given)
    told = {name: given[name] for name in TOLD}
    known = {**DEFAULTS, **UNTOLD, **{name: each for name, each in told.items() if each is not None}}
    among = None if given["candidates"] is None else expanded(given["candidates"], trust=False)
    return ExplorationSettings(**{**known, "env": environment(hand.source or hand.name), "candidates": among})


def _udp_columns(hand: Hand, columns: ColumnMap | None) -> dict[str, Sequence[str]]:
    """What a line may tell of joints, and of contacts."""
    joints: Sequence[str] = hand.joint_names
    touch: Sequence[str] = hand.patches.names
    if columns is not None:
        joints = [f"joints[{k}]" for k in range(len(columns.joints_order))] or list(
            dict.fromkeys(line.column for line in columns.joints.values() if line.column is not None)
        )
        touch = [f"contacts[{k}]" for k in range(len(columns.touch_order))] or list(columns.taxels)
    return {udp.JOINTS: joints or hand.joint_names, udp.CONTACTS: touch or hand.patches.names}


def _rate(nominal: float, stream: str, usual: bool) -> float:
    """Hz of the steps: as of a recording whose joints come so often."""
    if nominal > 0.0:
        if not 1.0 <= nominal <= 1e5:
            raise ValueError(f"stream {stream!r} tells a rate of {nominal:g} Hz; it must be from 1 to 100000, or 0")
        return min(max(round(nominal, 3), 1.0), USUAL_HZ)
    if not usual:
        raise ValueError(f"stream {stream!r} tells no rate: say by --control-hz how many steps a second there are")
    return USUAL_HZ


def _run(given: dict[str, Any], source: Any, session: LiveSession, sinks: list[Any]) -> int:
    console = make_console()
    slam = session.slam
    with told_on(console):
        get_ready(console, slam.hand)
        warm_up(slam.hand, observer=slam)
    if (slow := session.pace.rehearse(slam, session.namer)) is not None:
        _say(slow)
    source.begin()
    where = f"UDP port {source.port}" if isinstance(source, udp.UdpSource) else ", ".join(given["lsl_in"])
    console.print(
        f"Listening to {where} for hand {slam.hand.name}, {slam.control_hz:g} steps a second; Ctrl-C ends it …"
    )

    def interrupt(*_: object) -> None:
        session.stop = True
        signal.signal(signal.SIGINT, signal.default_int_handler)  # a second one ends it at once

    usual = {each: signal.signal(each, interrupt) for each in (signal.SIGINT, signal.SIGTERM)}
    try:
        try:
            session.run(source, sinks, given["seconds"])
        finally:
            source.close()
            if session.record.write():
                console.print(
                    f"Recorded: {session.record.path}, {validate.counted(len(session.record), 'step')}", highlight=False
                )
            elif session.record.path is not None:
                _say(f"there was no step: {session.record.path} is not written")
        if given["save"] is not None and session.told is not None:
            slam.save(given["save"])
    finally:
        for each, handler in usual.items():
            signal.signal(each, handler)
        for sink in sinks:  # the page may take a while, and what was told is kept by then
            sink.close()
    counts, behind = session.merger.counts, session.pace.most
    if behind > BEHIND:
        console.print(f"Beliefs were up to {behind:.1f} s behind what had come", highlight=False)
    torques = session.merger.torques
    driven = "" if torques is None else f", {counts.torques} of torques"
    unknown = "" if torques is None else f", {torques.missing} without torques"
    console.print(
        f"{validate.counted(counts.steps, 'step')} told; {validate.counted(counts.joints, 'sample')} of joints "
        f"and {counts.touch} of touch{driven}, "
        f"{counts.late} late, {counts.repeated} twice, {counts.refused} numbers refused, {counts.clock_steps} steps of "
        f"clocks; {counts.joints_missing} steps without a joint, {counts.touch_missing} without touch{unknown}",
        highlight=False,
    )
    if session.told is not None:
        best = int(session.told.posterior.argmax())
        console.print(f"Most likely: {session.told.labels[best]}, {session.told.posterior[best]:.0%}", highlight=False)
    return 0
