"""Torques that come as a stream: the hand's physics moves by them, live as in a replay, and nothing waits in vain."""

from __future__ import annotations

import json

import numpy as np
import pytest

from haptic_env import hands
from haptic_env.recordings import read_measured
from haptic_env.recordings.streams import arrays_of
from haptic_lab.commands import live
from haptic_lab.live.layout import torque_layout
from haptic_lab.live.merging import PATIENCE, LiveMerger
from haptic_lab.live.session import Chunk
from haptic_lab.live.torques import HOLDS, HeldTorques
from tests.haptic_lab.live.streams import Kept, Played, commanded, moving
from tests.haptic_lab.live.test_live import FEW, replayed, send, session

STEP = 0.02


@pytest.fixture(scope="module")
def hand():
    return hands.make("two_finger")


def played(hand, rate, *, every=1, burst=1, gone=(0, 0), missing=0.0):
    """Chunks of joints, contacts and torques; some torques are lost, and angles too."""
    time, angles, contacts = moving(hand, 100, rate)
    torques, rng = commanded(hand, 100), np.random.default_rng(1)
    angles[rng.random(angles.shape) < missing] = np.nan
    angles[0] = hand.rest_pose
    for first in range(0, 100, burst):
        rows = slice(first, first + burst)
        chunks = [Chunk("joints", time[rows], angles[rows]), Chunk("contacts", time[rows], contacts[rows])]
        told = [k for k in range(first, min(first + burst, 100)) if k % every == 0 and not gone[0] <= k < gone[1]]
        if told:
            chunks.append(Chunk("torques", time[told] + 0.003, torques[told]))
        yield chunks


HOW = {
    "steady": (50.0, {}),
    "at 100 Hz": (100.0, {}),
    "in bursts": (50.0, {"burst": 9}),
    "rarer than steps": (50.0, {"every": 3, "burst": 4}),
    "lost for a while": (50.0, {"gone": (20, 80)}),
    "joints not measured": (50.0, {"missing": 0.05}),
}


@pytest.mark.parametrize("how", HOW)
def test_what_was_believed_live_is_what_a_replay_believes(tmp_path, hand, bits, how):
    rate, keywords = HOW[how]
    path = tmp_path / "session.npz"
    source, made = session("--control-hz", f"{rate:g}", "--record", str(path), "--torques", "--believed-bias-deg", "2")
    source.close()
    assert made.slam.pose.needs_torque
    seen, kept, source = [], Kept(), Played(played(hand, rate, **keywords))
    source.session = made
    kept.tell = lambda told: seen.append((bits(told.belief), told.posterior.tobytes()))
    made.run(source, [kept])
    assert made.record.write()
    assert len(seen) == 100
    assert seen[1:] == replayed(path, bits, "--believed-bias-deg", "2")
    told = read_measured(path, None, hand).torques
    assert told.shape == (100, hand.joints)
    assert not told[0].any()
    assert (np.abs(told[1:15]).max(axis=1) > 0.1).all()
    np.testing.assert_array_equal(told.astype(np.float32), told)  # as actions are


def test_a_torque_holds_until_the_next_one_and_not_for_ever():
    held = HeldTorques(2, STEP)
    np.testing.assert_array_equal(held.between(0.0, STEP), 0.0)
    assert held.missing == 1
    held.samples.add(np.array([1.0, 1.015]), np.array([[0.5, -1.0], [-0.5, 1.0]]))
    np.testing.assert_allclose(held.between(1.0, 1.02), [0.25, -0.5], atol=1e-7)
    np.testing.assert_allclose(held.between(1.02, 1.04), [-0.5, 1.0], atol=1e-7)
    np.testing.assert_allclose(held.between(0.99, 1.01), [0.25, -0.5], atol=1e-7)  # nobody told before 1.0
    np.testing.assert_array_equal(held.between(1.02 + HOLDS, 1.04 + HOLDS), 0.0)
    assert held.missing == 2


@pytest.mark.parametrize("after", [0.0, 0.005, 0.019])
def test_whoever_commands_by_the_belief_is_not_waited_for(hand, after):
    """The torque of a step comes after its belief; waiting for it would be to wait in vain."""
    time, angles, contacts = moving(hand, 40)
    torques, patches = commanded(hand, 40), np.arange(len(hand.patches))
    made, steps = LiveMerger(hand.joints, len(patches), patches, 50.0, STEP, HeldTorques(hand.joints, STEP)), []
    for k in range(40):
        made.add_joints(time[k : k + 1], angles[k : k + 1], time[k])
        made.add_touch(time[k : k + 1], contacts[k : k + 1], time[k])
        steps += made.ready(time[k])
        assert len(steps) == k + 1
        made.add_torques(time[k : k + 1] + after, torques[k : k + 1], time[k] + after)
    share = after / STEP
    expected = share * torques[8] + (1.0 - share) * torques[9]
    np.testing.assert_allclose(steps[10].torques, expected, atol=1e-6)


def test_torques_that_never_come_are_zero_and_waited_for_but_a_while(hand):
    time, angles, contacts = moving(hand, 150)
    patches = np.arange(len(hand.patches))
    made, steps = LiveMerger(hand.joints, len(patches), patches, 50.0, STEP, HeldTorques(hand.joints, STEP)), []
    for k in range(150):
        made.add_joints(time[k : k + 1], angles[k : k + 1], time[k])
        made.add_touch(time[k : k + 1], contacts[k : k + 1], time[k])
        steps += made.ready(time[k])
    assert steps[-1].time > time[-1] - PATIENCE - STEP
    assert not any(step.torques.any() for step in steps)
    assert made.torques.missing == len(steps) - 1


def test_columns_of_torques(hand):
    names = list(hand.joint_names)
    by_name = torque_layout("drive", [*reversed(names), "temperature"], hand)
    told, odd = by_name.torques(np.arange(27.0).reshape(3, 9) / 20.0 - 0.5)
    np.testing.assert_allclose(told[0], (np.arange(8) / 20.0 - 0.5)[::-1])
    assert odd == 0
    in_order = torque_layout("drive", [f"drive[{k}]" for k in range(8)], hand)
    told, odd = in_order.torques(np.array([[0.5] * 7 + [2.0], [0.5] * 7 + [np.nan], [1.0 + 1e-9] * 8]))
    assert odd == 1
    assert np.isnan(told[:2]).all()
    np.testing.assert_array_equal(told[2], 1.0)
    for labels in (names[:-1], [*names[:-1], "other"], [f"drive[{k}]" for k in range(9)]):
        with pytest.raises(ValueError, match=r"one of each of the 8 joints of hand 'two_finger'"):
            torque_layout("drive", labels, hand)


def test_lines_tell_torques(hand):
    source, _ = session("--torques")
    told = {"time": 1.0, "torques": dict.fromkeys(hand.joint_names, 0.25)}
    send(source.port, [json.dumps(told).encode()])
    (chunk,) = next(found for _ in range(100) if (found := source.poll("torques", 0.1)))
    source.close()
    assert chunk.stream == "torques"
    np.testing.assert_array_equal(chunk.values, np.full((1, hand.joints), 0.25))


@pytest.mark.parametrize("gone", [(0, 0), (10, 100)])
def test_steps_whose_torques_are_not_known_are_counted_in_the_end(hand, capsys, gone):
    """Of 100 steps the first has none before it."""
    source, made = session("--torques")
    source.close()
    source = Played(played(hand, 50.0, gone=gone))
    source.session = made
    assert live._run({"lsl_in": ["a"], "seconds": None, "save": None}, source, made, []) == 0
    unknown = made.merger.torques.missing
    assert (unknown > 30) == (gone[1] > 0)
    assert f", {unknown} without torques" in " ".join(capsys.readouterr().out.split())


@pytest.mark.parametrize(
    ("arguments", "valid"),
    [
        (["--udp", "0", "--torques", "Drive"], "takes no name"),
        (["--lsl-in", "a", "b", "--torques", "a"], "another stream than those of --lsl-in"),
    ],
)
def test_torques_that_make_no_sense_are_told_in_a_line(capsys, arguments, valid):
    assert live.main([*arguments, "--hand", "two_finger", *FEW]) == 2
    told = capsys.readouterr().err
    assert valid in told
    assert told.count("\n") == 1


@pytest.mark.parametrize("wrong", [np.zeros((3, 8)), np.full((20, 8), 2.0), np.full((20, 8), np.nan), np.zeros(20)])
def test_a_file_whose_torques_do_not_fit_is_told(tmp_path, hand, wrong):
    _, angles, contacts = moving(hand, 20)
    arrays = arrays_of(hand, 50.0, angles, contacts, np.zeros((20, 8)))
    np.savez(tmp_path / "right.npz", **arrays)
    assert read_measured(tmp_path / "right.npz", None, hand).torques is not None
    np.savez(tmp_path / "wrong.npz", **{**arrays, "commanded_torques": wrong})
    with pytest.raises(ValueError, match=r"wrong\.npz: commanded_torques .* one of each joint for each step"):
        read_measured(tmp_path / "wrong.npz", None, hand)
