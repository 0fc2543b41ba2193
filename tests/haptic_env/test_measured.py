"""Recordings with measured touch, in the layouts of other programs."""

from __future__ import annotations

import json
import pickle
import re
import shutil
from pathlib import Path

import numcodecs
import numpy as np
import pytest

from haptic_env import hands, recordings
from haptic_env.recordings.merging import (
    Samples,
    angles_at,
    angles_of_one,
    contacts_at,
    contacts_of_one,
    in_order,
    longest_run,
)
from tests.haptic_env import measured_files
from tests.haptic_env.measured_files import FRAMES, MAKERS, PARTS, made


def read(path: Path, text: str, part: str | None = None) -> recordings.MeasuredTouch:
    (place := path.parent / "map.toml").write_text(text)
    return recordings.read_measured(path, recordings.read_columns(place), hands.make("two_finger"), part=part)


@pytest.mark.parametrize("kind", MAKERS)
def test_each_layout_tells_the_same(tmp_path: Path, kind: str) -> None:
    path, text = MAKERS[kind](tmp_path)
    told = read(path, text, PARTS.get(kind))
    hand, _, angles, contacts = made()
    assert told.control_hz == pytest.approx(50.0, abs=0.05)
    np.testing.assert_allclose(told.joint_angles, angles, atol=1e-4)
    if kind in ("npz", "xdf"):  # touch comes half as often: the nearest is taken
        assert (told.contacts == contacts).mean() > 0.99
    else:
        np.testing.assert_array_equal(told.contacts, contacts)
    assert len(told) == FRAMES
    assert told.coverage.patches_measured == len(hand.patches)
    assert told.coverage.joints_missing == told.coverage.touch_missing == 0.0


@pytest.mark.parametrize(
    ("hand", "whose"),
    [(None, None), ("two_finger", "two_finger"), ("paw.toml", "{}/paw.toml"), ("/far/paw.toml", "/far/paw.toml")],
)
def test_a_hand_of_ones_own_lies_beside_the_map_that_names_it(
    tmp_path: Path, hand: str | None, whose: str | None
) -> None:
    (place := tmp_path / "map.toml").write_text("" if hand is None else f"hand = {json.dumps(hand)}")
    columns = recordings.read_columns(place)
    assert columns.hand == hand
    assert columns.whose == (whose and whose.format(tmp_path))


@pytest.mark.parametrize("kind", MAKERS)
def test_what_was_merged_is_read_again_without_a_map(tmp_path: Path, kind: str) -> None:
    path, text = MAKERS[kind](tmp_path)
    told = read(path, text, PARTS.get(kind))
    np.savez(tmp_path / "again.npz", **told.streams())
    assert recordings.has_touch(tmp_path / "again.npz")
    again = recordings.read_measured(tmp_path / "again.npz", None, hands.make("two_finger"))
    np.testing.assert_array_equal(again.joint_angles, told.joint_angles)
    np.testing.assert_array_equal(again.contacts, told.contacts)


@pytest.mark.parametrize("version", [2, 3])
def test_a_zarr_store_may_be_zipped(tmp_path: Path, version: int) -> None:
    path, text = measured_files.store(tmp_path / "a", version)
    shutil.make_archive(str(tmp_path / "inspect.zarr"), "zip", tmp_path / "a", "inspect.zarr")
    np.testing.assert_array_equal(
        read(tmp_path / "inspect.zarr.zip", text, "1").joint_angles, read(path, text, "1").joint_angles
    )


def test_an_npz_with_contacts_but_no_torques_is_measured_touch(tmp_path: Path) -> None:
    hand, time, angles, contacts = made()
    contacts[5, 2] = np.nan
    np.savez(
        tmp_path / "a.npz", time=time, joint_names=np.array(hand.joint_names), joint_angles=angles, contacts=contacts
    )
    assert recordings.has_touch(tmp_path / "a.npz")
    told = recordings.read_measured(tmp_path / "a.npz", None, hand)
    np.testing.assert_array_equal(told.joint_angles, angles)
    assert told.coverage.touch_missing == pytest.approx(1 / contacts.size)
    assert np.isnan(told.contacts[5, 2])
    swaying = recordings.Recording("made", time, hand.joint_names, angles)
    recordings.write(tmp_path / "b.npz", swaying)
    assert not recordings.has_touch(tmp_path / "b.npz")


def test_parts_that_are_not_named_are_listed(tmp_path: Path) -> None:
    for kind, told in (("parquet", "6, 7"), ("zarr", "0, 1")):
        path, text = MAKERS[kind](tmp_path)
        with pytest.raises(ValueError, match=f"several episodes; choose a part from {told}"):
            read(path, text)
        with pytest.raises(ValueError, match=f"unknown episode .* choose from {told}"):
            read(path, text, "9")


def test_gaps_nan_late_and_repeated_samples_are_counted(tmp_path: Path) -> None:
    angles = made()[2]
    path, text = measured_files.csv(tmp_path)
    lines = path.read_text().splitlines()
    kept = lines[:11] + lines[19:]  # frames 10 to 17 are lost
    kept[3], kept[4] = kept[4], kept[3]  # one is late
    kept.insert(6, kept[6])  # one comes twice
    cells = kept[24].split(",")
    cells[3] = ""  # of frame 30, joint 2
    kept[24] = ",".join(cells)
    path.write_text("\n".join(kept))
    told = read(path, text)
    frame = round(float(cells[0]) / 20.0)
    expected = np.zeros((FRAMES, 8), dtype=bool)
    expected[10:18] = expected[frame, 2] = True
    assert (told.coverage.late, told.coverage.repeated) == (1, 1)
    np.testing.assert_array_equal(np.isnan(told.joint_angles), expected)
    np.testing.assert_allclose(told.joint_angles[~expected], angles[~expected], atol=1e-6)
    assert told.coverage.joints_missing == pytest.approx(expected.mean())
    assert told.coverage.longest_gap == pytest.approx(8 * 0.02)
    assert "the longest gap is 0.16 s; 1 samples came late, 1 twice" in str(told.coverage)


def test_samples_that_jitter_are_told_when_they_were_taken() -> None:
    rng = np.random.default_rng(0)
    time = np.arange(0.0, 2.0, 0.017) + rng.uniform(0.0, 0.004, 118)
    steps = 0.1 + 0.02 * np.arange(80)
    found = angles_at(Samples(time, np.stack([time, 2.0 * time], axis=1)), steps)
    np.testing.assert_allclose(found, np.stack([steps, 2.0 * steps], axis=1), atol=1e-5)


def test_slow_samples_are_no_more_than_they_are() -> None:
    """Between samples that are far apart nothing is measured: each counts once."""
    time = np.arange(0.0, 1.01, 0.1)
    steps = 0.02 * np.arange(51)
    found = angles_at(Samples(time, time[:, None]), steps)[:, 0]
    assert np.isfinite(found).sum() == len(time)
    np.testing.assert_allclose(found[np.isfinite(found)], time)
    touch = contacts_at(Samples(time, (time[:, None] > 0.5).astype(float)), steps)[:, 0]
    assert np.isfinite(touch).all()


def test_a_touch_between_two_steps_is_felt_and_one_far_away_is_not_known() -> None:
    time = np.concatenate([np.arange(0.0, 0.2, 0.004), [1.0]])
    value = np.zeros((len(time), 1))
    value[11] = 1.0  # at 0.044 s
    found = contacts_at(Samples(time, value), 0.02 * np.arange(51))[:, 0]
    np.testing.assert_array_equal(found[:10], [0, 0, 1, 0, 0, 0, 0, 0, 0, 0])
    assert np.isnan(found[12:49]).all()
    assert longest_run(np.isnan(found)) == len(found[np.isnan(found)])


def test_a_clock_that_runs_back_is_refused() -> None:
    time = np.array([0.0, 0.1, 0.05, 5.0, 3.0])
    with pytest.raises(ValueError, match=r"the time of joints runs back by 2 s at sample 4 .*up to 1 s"):
        in_order("x", "joints", time, time[:, None])
    assert in_order("x", "joints", time[:4], time[:4, None]).late == 1


def change(old: str, new: str):
    def changed(path: Path, text: str) -> str:
        assert old in text
        return text.replace(old, new, 1)

    return changed


def rewrite(old: str, new: str, count: int = -1):
    def changed(path: Path, text: str) -> str:
        content = path.read_text()
        assert old in content
        path.write_text(content.replace(old, new, count))
        return text

    return changed


def zeros(path: Path, text: str) -> str:
    content = [line.split(",") for line in path.read_text().splitlines()]
    path.write_text(
        "\n".join(",".join([*c[:9], *["0.0"] * 50, "x"]) if k else ",".join(c) for k, c in enumerate(content))
    )
    return text


J0 = hands.make("two_finger").joint_names[0]
P7 = hands.make("two_finger").patches.names[7]
WRONG = {
    "a column that is not there": (change('"j0"', '"j99"'), r"unknown column of joint .*'j99'.*choose from j0, j1"),
    "an unknown joint": (change(f"{J0} =", "FFJ9 ="), "unknown joint of hand 'two_finger' 'FFJ9'.*choose from"),
    "a joint that is missing": (change(f'{J0} = "j0"\n', ""), f"which column is {J0} of hand 'two_finger'"),
    "a taxel without a place": (change(f'"{P7}"', '""'), "taxel 'tax7' has no place: name its patch"),
    "a patch that is none": (change(f'"{P7}"', '"palm"'), "unknown patch of taxel 'tax7' 'palm'"),
    "no time": (change('column = "when"', ""), r"no column is called time, timestamp.*\[time\] column"),
    "an unknown unit": (change('"degrees"', '"grad"'), "unknown unit of joints 'grad'.*degrees, radians"),
    "an unknown key": (change("threshold", "treshold"), r"unknown touch keyword 'treshold' \(did you mean 'threshold'"),
    "a sign that is none": (change("sign = -1", "sign = 2"), "must be 1 or -1, got 2"),
    "a threshold above all": (change("threshold = 0.5", "threshold = 7"), r"no pressure is above .* of 7; they lie in"),
    "no threshold": (
        change("threshold = 0.5\n", ""),
        r"contacts must be 0 or 1, got 0\.1; of pressures",
    ),
    "pressures that are all zero": (zeros, "the pressures are all zero"),
    "degrees taken for radians": (change('"degrees"', '"radians"'), "joint_angles .* are these degrees"),
    "milliseconds taken for seconds": (change('unit = "ms"\n', ""), "joints come every .* s, .*are these milliseconds"),
    "a word": (rewrite("glove\n", "7\n", 1), "glove.csv, line 3: note is 'glove', no number"),
    "no table": (lambda path, text: [path.write_text("\n\n"), text][1], "not a table with a line of names"),
    "bytes": (lambda path, text: [path.write_bytes(b"\xff\xfe\x00"), text][1], "not a text file"),
}


@pytest.mark.parametrize("case", WRONG)
def test_what_is_wrong_is_told_in_a_line_with_what_is_valid(tmp_path: Path, case: str) -> None:
    spoil, message = WRONG[case]
    path, text = measured_files.csv(tmp_path)
    with pytest.raises(ValueError, match=message) as told:
        read(path, spoil(path, text))
    assert "\n" not in str(told.value)


def test_a_stream_of_another_width_is_refused(tmp_path: Path) -> None:
    for kind in ("npz", "zarr", "parquet"):
        path, text = MAKERS[kind](tmp_path)
        with pytest.raises(ValueError, match="has 8 columns, but the map names 7 joints in its order"):
            read(path, text.replace(f'"{J0}", ', "", 1), PARTS.get(kind))


@pytest.mark.parametrize("kind", ["npz", "parquet", "xdf"])
@pytest.mark.parametrize("share", [0.0, 0.02, 0.5, 0.97])
def test_a_file_that_is_cut_short_is_refused(tmp_path: Path, kind: str, share: float) -> None:
    path, text = MAKERS[kind](tmp_path)
    content = path.read_bytes()
    path.write_bytes(content[: int(share * len(content))])
    with pytest.raises(ValueError, match=re.escape(str(path))) as told:
        read(path, text, PARTS.get(kind))
    assert "\n" not in str(told.value)


def test_a_recording_that_ends_before_a_stream_begins_is_cut_short(tmp_path: Path) -> None:
    path, text = measured_files.xdf(tmp_path)
    content = path.read_bytes()
    head = content.index(b"<name>skin</name>")
    path.write_bytes(content[: content.index(b"</desc></info>", head) + 100])
    with pytest.raises(ValueError, match="cut short: stream 'skin' has no samples and says no end"):
        read(path, text)


@pytest.mark.parametrize("cut", [3, 20, 40])
def test_a_table_of_text_that_is_cut_short_is_refused_with_its_line(tmp_path: Path, cut: int) -> None:
    path, text = measured_files.csv(tmp_path)
    lines = path.read_text().splitlines()
    cells = lines[cut].split(",")
    path.write_text("\n".join([*lines[:cut], ",".join(cells[: len(cells) // 2])]))
    with pytest.raises(ValueError, match=rf"line {cut + 1} has {len(cells) // 2} cells of {len(cells)}"):
        read(path, text)


def test_a_store_that_is_cut_short_is_refused(tmp_path: Path) -> None:
    path, text = measured_files.store(tmp_path)
    for each in (path / "data" / "right_hand_joints").glob("[0-9]*"):
        each.write_bytes(each.read_bytes()[:-20])
    with pytest.raises(ValueError, match="not a whole Zarr store"):
        read(path, text, "1")
    (tmp_path / "b.zarr").mkdir()
    with pytest.raises(ValueError, match="not a whole Zarr store"):
        read(tmp_path / "b.zarr", text)
    with pytest.raises(OSError, match="No such file"):
        read(tmp_path / "c.zarr", text)


@pytest.mark.parametrize(
    ("codec", "told"),
    [
        (numcodecs.Pickle(), "not a whole Zarr store"),
        (numcodecs.JSON(), "not a whole Zarr store"),
        (numcodecs.Base64(), "right_hand_joints is packed by base64, which is not read: it may run code"),
    ],
    ids=("pickle", "json", "base64"),
)
def test_nothing_in_a_store_is_unpickled(tmp_path: Path, codec, told: str) -> None:
    path, text = measured_files.store(tmp_path)
    spoilt = path / "data" / "right_hand_joints" / ".zarray"
    content = json.loads(spoilt.read_text())
    content |= {"filters": [codec.get_config()], "compressor": None}
    spoilt.write_text(json.dumps(content))
    for chunk in spoilt.parent.glob("[0-9]*"):
        chunk.write_bytes(pickle.dumps(Bomb(tmp_path / "gone off")))
    with pytest.raises(ValueError, match=told):
        read(path, text, "1")
    assert not (tmp_path / "gone off").exists()


class Bomb:
    def __init__(self, path: Path) -> None:
        self.path = path

    def __reduce__(self):
        return Path.touch, (self.path,)


def test_the_map_says_which_part_of_a_stream_is_which_patch(tmp_path: Path) -> None:
    path, _ = measured_files.store(tmp_path)
    hand, *_ = made()
    text = measured_files.streams("right_hand_joints", "right_tactile_data_glove")
    text = text[: text.index("[touch]")] + (
        f'[touch.taxels]\n"right_tactile_data_glove[0:20]" = "{hand.patches.names[0]}"\n'
        f'"right_tactile_data_glove[30]" = "{P7}"\n'
    )
    told = read(path, text, "1")
    assert told.coverage.patches_measured == 2
    np.testing.assert_array_equal(told.contacts[:, 0], made()[3][:, :20].max(axis=1))
    np.testing.assert_array_equal(told.contacts[:, 7], made()[3][:, 30])
    assert np.isnan(told.contacts[:, 1]).all()
    with pytest.raises(ValueError, match=re.escape("column of touch right_tactile_data_glove[40:60] is not there")):
        read(path, text.replace("[0:20]", "[40:60]"), "1")


@pytest.mark.parametrize("seed", range(40))
def test_one_step_is_merged_as_all_are(seed):
    rng, step = np.random.default_rng(seed), 0.02
    count = int(rng.integers(0, 8))
    time = np.sort(np.round(rng.uniform(-3.0, 3.0, count) * rng.choice([1.0, 4.0]), int(rng.integers(1, 5))) * step)
    time = np.unique(time + rng.choice([0.0, 1e-6 * step, -0.01 * step]))
    values, touched = rng.standard_normal((len(time), 3)), rng.integers(0, 2, (len(time), 4)).astype(float)
    if seed % 4 == 3:
        values[rng.random(values.shape) < 0.3], touched[rng.random(touched.shape) < 0.3] = np.nan, np.nan
    joints, touch = Samples(time, values), Samples(time, touched)
    for at in step * np.array([0.0, 1.0, -1.0, 7.0]):
        one = np.array([at])
        np.testing.assert_array_equal(angles_of_one(joints, at, step), angles_at(joints, one, step)[0])
        grid = -3.0 * step, step
        expected = contacts_at(touch, one, grid, 0.7 * step)[0]
        np.testing.assert_array_equal(contacts_of_one(touch, at, grid, 0.7 * step), expected)
