"""What comes is merged as a whole recording would be, however it comes, and what cannot be is told."""

from __future__ import annotations

import numpy as np
import pytest

from haptic_env import hands
from haptic_env.recordings.column_map import ColumnMap
from haptic_env.recordings.measured import merge
from haptic_env.recordings.streams import Stream, Streams
from haptic_lab.live.clock import StreamClock
from haptic_lab.live.merging import PATIENCE, SILENT, LiveMerger
from tests.haptic_lab.live.streams import moving


@pytest.fixture(scope="module")
def hand():
    return hands.make("two_finger")


def merger(hand, rate=50.0, interval=0.02):
    patches = len(hand.patches)
    return LiveMerger(hand.joints, patches, np.arange(patches), rate, interval)


def played(hand, made, joints, touch, burst=1, delay=(0.0, 0.0)):
    """Steps as they are told while samples arrive, when they were taken or later."""
    events = [(t + delay[0], 0, k) for k, t in enumerate(joints[0])] + [
        (t + delay[1], 1, k) for k, t in enumerate(touch[0])
    ]
    steps, held = [], []
    for event in sorted(events):
        held.append(event)
        if len(held) < burst:
            continue
        now = event[0]
        for _, kind, k in held:
            times, values = (joints, touch)[kind]
            (made.add_joints, made.add_touch)[kind](times[k : k + 1], values[k : k + 1], now)
        held = []
        steps += made.ready(now)
    for now, kind, k in held:
        times, values = (joints, touch)[kind]
        (made.add_joints, made.add_touch)[kind](times[k : k + 1], values[k : k + 1], now)
    return [*steps, *made.rest(max(events)[0] + 2.0 * SILENT)]


def whole(hand, joints, touch, rate):
    """The same samples, as a recording."""
    streams = Streams(
        "session",
        [
            Stream("q", hand.joint_names, joints[1], joints[0]),
            Stream("z", hand.patches.names, touch[1], touch[0]),
        ],
    )
    return merge(streams, ColumnMap("session", control_hz=rate), hand)


@pytest.mark.parametrize("early", [0.0, 1e-5, 1e-4])
def test_a_sample_a_little_before_its_step_is_enough_for_it(hand, early):
    """Clocks are corrected: else each step would wait for the sample after its own."""
    time, angles, contacts = moving(hand, 60, rate=100.0)
    time = time - early * (np.arange(60) > 20)
    made = merger(hand, 100.0, 0.01)
    for k in range(60):
        made.add_joints(time[k : k + 1], angles[k : k + 1], time[k])
        made.add_touch(time[k : k + 1], contacts[k : k + 1], time[k])
        assert [step.time for step in made.ready(time[k])] == pytest.approx([time[0] + 0.01 * k], abs=1e-9)
    assert made.counts.joints_missing == 0


@pytest.mark.parametrize("burst", [1, 2, 7, 20])
@pytest.mark.parametrize(("rate", "touch_every"), [(50.0, 1), (100.0, 1), (50.0, 4), (30.0, 1)])
@pytest.mark.parametrize("jitter", [0.0, 0.1])
def test_it_is_merged_as_a_whole_recording_is(hand, burst, rate, touch_every, jitter):
    time, angles, contacts = moving(hand, 120, rate=100.0 if rate == 100.0 else 50.0)
    interval = time[1] - time[0]
    rng = np.random.default_rng(1)
    taken = time + jitter * interval * rng.uniform(-1, 1, len(time))
    touched = time[::touch_every] + jitter * interval * rng.uniform(0, 1, len(time[::touch_every]))
    missing = rng.random(angles.shape) < 0.02
    missing[0] = False
    joints = taken, np.where(missing, np.nan, angles)
    touch = touched, contacts[::touch_every]
    told = played(hand, made := merger(hand, rate, touch_every * interval), joints, touch, burst)
    recorded = whole(hand, joints, touch, rate)
    assert len(recorded) <= len(told) <= len(recorded) + 1
    count = len(recorded) - 1  # at the end a recording knows that no more comes
    np.testing.assert_array_equal([each.joint_angles for each in told[:count]], recorded.joint_angles[:count])
    np.testing.assert_array_equal([each.contacts for each in told[:count]], recorded.contacts[:count])
    assert made.counts.late == 0


def test_a_step_is_told_at_once_where_samples_are_its_own(hand):
    time, angles, contacts = moving(hand, 50)
    made = merger(hand)
    for k in range(50):
        made.add_joints(time[k : k + 1], angles[k : k + 1], time[k])
        assert not [*made.ready(time[k])] or k == 0
        made.add_touch(time[k : k + 1], contacts[k : k + 1], time[k])
        (step,) = made.ready(time[k])
        assert step.time == pytest.approx(time[k])


def test_a_touch_that_comes_too_late_counts_for_the_next_step(hand):
    """None is lost."""
    time, angles, contacts = moving(hand, 60)
    contacts[:] = 0.0
    contacts[30, 5] = 1.0
    made, steps = merger(hand), []
    for k in range(60):
        now = time[k]
        made.add_joints(time[k : k + 1], angles[k : k + 1], now)
        if k != 30:
            made.add_touch(time[k : k + 1], contacts[k : k + 1], now)
        if k == 50:
            made.add_touch(time[30:31], contacts[30:31], now)
        steps += made.ready(now)
    assert made.counts.late == 1
    assert [k for k, step in enumerate(steps) if step.contacts[5] == 1.0] == [50]


@pytest.mark.parametrize("gone", ["joints", "touch", "both"])
def test_silence_is_not_measured_and_what_comes_after_is(hand, gone):
    time, angles, contacts = moving(hand, 300)
    made, steps, silent = merger(hand), [], set()
    for k in range(300):
        now, away = time[k], 100 <= k < 220
        if not (away and gone in ("joints", "both")):
            made.add_joints(time[k : k + 1], angles[k : k + 1], now)
        if not (away and gone in ("touch", "both")):
            made.add_touch(time[k : k + 1], contacts[k : k + 1], now)
        steps += made.ready(now)
        silent |= {*made.silent(now)}
        assert now - steps[-1].time < PATIENCE + 0.1  # the belief goes on
    assert silent == {"joints", "touch"} if gone == "both" else {gone}
    assert len(steps) in (299, 300)
    blind = np.array([np.isnan(step.joint_angles).all() for step in steps])
    numb = np.array([np.isnan(step.contacts).all() for step in steps])
    for kind, missing in (("joints", blind), ("touch", numb)):
        assert missing[105:215].all() == (gone in (kind, "both"))
        assert not missing[:95].any()
        assert not missing[225:].any()


def test_a_touch_that_never_comes_is_not_waited_for(hand):
    time, angles, _ = moving(hand, 150)
    made, steps = merger(hand), []
    for k in range(150):
        made.add_joints(time[k : k + 1], angles[k : k + 1], time[k])
        steps += made.ready(time[k])
        assert bool(steps) == (time[k] - time[0] > SILENT)
    assert all(np.isnan(step.contacts).all() for step in steps)


@pytest.mark.parametrize("jump", [-50.0, 1000.0, -1.7e9, 1.7e9])
@pytest.mark.parametrize("which", ["joints", "touch", "both"])
def test_a_clock_that_steps_goes_on_where_it_was(hand, jump, which):
    time, angles, contacts = moving(hand, 200)
    made, steps = merger(hand), []
    for k in range(200):
        off = jump if k >= 100 else 0.0
        made.add_joints(time[k : k + 1] + (off if which != "touch" else 0.0), angles[k : k + 1], time[k])
        made.add_touch(time[k : k + 1] + (off if which != "joints" else 0.0), contacts[k : k + 1], time[k])
        steps += made.ready(time[k])
    assert made.counts.clock_steps == (2 if which == "both" else 1)
    assert 195 <= len(steps) <= 200
    assert sum(np.isnan(step.joint_angles).any() for step in steps) <= 3
    np.testing.assert_allclose(steps[-1].joint_angles, angles[199], atol=0.05)


def test_clocks_of_their_own_are_brought_together(hand):
    time, angles, contacts = moving(hand, 100)
    made, steps = merger(hand), []
    for k in range(100):
        made.add_joints(time[k : k + 1], angles[k : k + 1], time[k])
        made.add_touch(time[k : k + 1] + 1.7e9, contacts[k : k + 1], time[k])
        steps += made.ready(time[k])
    assert len(steps) >= 98
    assert np.nansum([step.contacts for step in steps]) > 0


def test_samples_that_are_twice_count_once(hand):
    time, angles, contacts = moving(hand, 60)
    made = merger(hand)
    for k in range(60):
        for _ in range(2):
            made.add_joints(time[k : k + 1], angles[k : k + 1], time[k])
            made.add_touch(time[k : k + 1], contacts[k : k + 1], time[k])
    assert made.counts.repeated == 120
    assert len([*made.ready(time[-1]), *made.rest(time[-1])]) == 60


@pytest.mark.parametrize("later", [0.0, 2.0 * SILENT])
def test_a_step_whose_touch_is_still_to_come_is_left_out_at_the_end(hand, later):
    """But not where the stream of touch had ended before."""
    time, angles, contacts = moving(hand, 60)
    made = merger(hand)
    made.add_touch(time[:58], contacts[:58], time[57])
    made.add_joints(time, angles, time[57])
    steps = [*made.ready(time[57]), *made.rest(time[57] + later)]
    assert len(steps) == (60 if later else 58)
    assert np.isfinite([step.contacts for step in steps[:58]]).all()


def test_a_burst_is_no_step_of_the_clock():
    clock = StreamClock()
    clock.mapped(np.array([5.0]), 5.0)
    np.testing.assert_array_equal(clock.mapped(np.array([5.02, 5.04, 9.0]), 9.0), [5.02, 5.04, 9.0])
    assert clock.steps == 0


def test_what_is_kept_does_not_grow(hand):
    """However long it takes."""
    time, angles, contacts = moving(hand, 400)
    made, most = merger(hand), 0
    for again in range(10):
        for k in range(400):
            now = 8.0 * again + time[k]
            made.add_joints(np.array([now]), angles[k : k + 1], now)
            made.add_touch(np.array([now]), contacts[k : k + 1], now)
            assert all(True for _ in made.ready(now))
        most = max(most, len(made._joints.time), len(made._touch.time))
    assert made.counts.steps >= 3990
    assert most < 600
