"""A recording of another hand than the one that was said."""

from __future__ import annotations

import numpy as np
import pytest

from haptic_env import hands
from haptic_env.recordings import read_measured
from haptic_env.recordings.streams import arrays_of
from haptic_env.recordings.whose import whose


@pytest.mark.parametrize("named", [False, True], ids=["columns", "joint_names"])
@pytest.mark.parametrize(("of", "taken_for"), [("adroit", "two_finger"), ("two_finger", "adroit")])
def test_a_recording_of_another_hand_is_told_in_a_line_with_the_hand_that_fits(tmp_path, of, taken_for, named) -> None:
    theirs, mine = hands.make(of), hands.make(taken_for)
    angles, contacts = np.tile(theirs.rest_pose, (20, 1)), np.zeros((20, len(theirs.patches)))
    arrays = arrays_of(theirs, 50.0, angles, contacts)
    if named:
        told = {"joint_names": np.array(theirs.joint_names), "joint_angles": angles, "contacts": contacts}
        arrays = {**told, "time": arrays["time"]}
    np.savez(tmp_path / "a.npz", **arrays)
    with pytest.raises(ValueError, match=rf"of hand '{taken_for}'.*; there are the joints of hand '{of}'$") as caught:
        read_measured(tmp_path / "a.npz", None, mine)
    said = str(caught.value)
    assert len(said) < 1000
    if not named:
        count = len(mine.joint_names) - 5
        assert f"{', '.join(mine.joint_names[:5])} and {count} more" in said


def test_whose_joints_they_are() -> None:
    arm, two = hands.make("two_finger_arm").joint_names, hands.make("two_finger").joint_names
    assert whose([*two, "time"]).endswith("hand 'two_finger'")
    assert whose([*reversed(arm), "time"]).endswith("hand 'two_finger_arm'")
    assert whose(two[1:]) == whose([]) == ""
