"""Observers with human limits watch the same exploration as those without, and change nothing for them."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pandas as pd
import pytest

from haptic_env import hands
from haptic_lab.commands import evaluate
from haptic_lab.limits import Attention
from haptic_lab.people.courses import Courses
from haptic_lab.sweeps import options
from observer.shape.fading import faded
from tests.haptic_lab.workers import in_this_process

MEMORY = 0.5
TINY = [
    *("--shapes", "cube", "sphere", "--sigmas", "3", "5", "--trials", "1", "--seconds", "1", "--particles", "3"),
    *("--classifiers", "--first-seed", "900000", "--jobs", "1", "--courses"),
]
LIMITS = {
    "forgets": ["--memory-seconds", str(MEMORY)],
    "heeds one finger": ["--attention-seconds", "0.2"],
    "forgets nothing": ["--memory-seconds", "inf"],
}


def _swept(folder: Path, *flags: str) -> pd.DataFrame:
    with in_this_process(), pytest.MonkeyPatch.context() as patch:
        patch.setattr(evaluate, "report", lambda plan, results, console: results.rewrite())
        assert evaluate.main([*TINY, *flags, "--out", str(folder)]) == 0
    return pd.read_csv(folder / "trials.csv")


@pytest.fixture(scope="module")
def limited(tmp_path_factory: pytest.TempPathFactory) -> dict[str, Path]:
    """A sweep of each kind of limit."""
    folders = {kind: tmp_path_factory.mktemp("limited") / "out" for kind in LIMITS}
    for kind, folder in folders.items():
        _swept(folder, "--observers", "haptic_slam", "haptic_slam+limited", "ceiling+limited", "ceiling", *LIMITS[kind])
    return folders


def _measured(folder: Path, observer: str) -> pd.DataFrame:
    rows = pd.read_csv(folder / "trials.csv")
    kept = rows[rows["observer"] == observer].drop(columns=["observer", "observers", "check", *_told(rows)])
    return kept.reset_index(drop=True)


def _told(rows: pd.DataFrame) -> list[str]:
    return [name for name in ("memory_seconds", "attention_seconds") if name in rows]


def test_others_of_the_same_exploration_are_not_limited(limited: dict[str, Path], tmp_path: Path) -> None:
    _swept(tmp_path / "out", "--observers", "haptic_slam", "ceiling")
    for observer in ("haptic_slam", "ceiling"):
        alone = _measured(tmp_path / "out", observer)
        for folder in limited.values():
            pd.testing.assert_frame_equal(_measured(folder, observer), alone)


def test_limits_that_limit_nothing_have_the_same_bits(limited: dict[str, Path]) -> None:
    for observer in ("haptic_slam", "ceiling"):
        unlimited, same = (_measured(limited["forgets nothing"], name) for name in (observer, f"{observer}+limited"))
        pd.testing.assert_frame_equal(unlimited, same)


def test_who_forgets_believes_what_the_equation_says(limited: dict[str, Path]) -> None:
    folder = limited["forgets"]
    for observer in ("haptic_slam", "ceiling"):
        ideal, forgetful = (Courses.of_sweep(folder, observer=name) for name in (observer, f"{observer}+limited"))
        # Live evidence fades from step to step, and on courses each 0.1 s; the last time has what the flush adds.
        live, apart = forgetful.log_posterior[..., :-1, :], []
        for memory in (MEMORY, np.inf):
            told = faded(ideal.log_posterior, ideal.seconds, memory)[..., :-1, :]
            apart.append(np.abs(np.diff(told - live, axis=-1)).mean())
        assert apart[1] > 0.1
        assert apart[0] < 0.4 * apart[1]


def test_who_is_told_the_candidates_has_another_pose_and_the_same_map(tmp_path: Path) -> None:
    folder, both = tmp_path / "out", ("haptic_slam", "haptic_slam+informed")
    _swept(folder, "--observers", *both, "--bias-deg", "3", "--sigmas", "1", "5")
    blind, informed = (_measured(folder, name) for name in both)
    assert (blind["pose_error_lagged_deg"] != informed["pose_error_lagged_deg"]).all()
    assert informed["pose_error_lagged_deg"].mean() < blind["pose_error_lagged_deg"].mean()
    of_maps = [name for name in blind if name.startswith(("surface_", "touched_"))]
    assert len(of_maps) > 3
    pd.testing.assert_frame_equal(blind[of_maps], informed[of_maps])


def test_who_heeds_one_finger_knows_less(limited: dict[str, Path]) -> None:
    folder = limited["heeds one finger"]
    ideal, one_finger = (Courses.of_sweep(folder, observer=name) for name in ("ceiling", "ceiling+limited"))
    last = []
    for each in (ideal, one_finger):
        right = [each.names.index(name) for name in each.objects]
        last.append(np.mean([each.log_posterior[cell, 0, 0, -1, c] for cell, c in enumerate(right)]))
    assert last[1] < last[0]
    rows = pd.read_csv(folder / "trials.csv").groupby("observer")["touching_share"].first()
    assert rows.nunique() == 1, "what is measured of the world is the same for all"


@pytest.mark.parametrize("hand", ["two_finger", "adroit"])
def test_each_finger_has_its_turn_for_as_long(hand: str) -> None:
    made = hands.make(hand)
    finger = made.link_group[made.patches.link]
    attention = Attention(made, 0.1, 0.02, seed=4)
    heeded = []
    for step in range(1, 201):
        contacts = attention.attended(step, np.ones(len(finger), dtype=np.int8))
        measured = ~np.isnan(contacts)
        (mine,) = np.unique(finger[measured])
        assert (measured == (finger == mine)).all()
        assert (contacts[measured] == 1.0).all()
        heeded.append(mine)
    turns = np.reshape(heeded, (-1, 5))
    assert (turns == turns[:, :1]).all()
    count = len(np.unique(finger))
    for start in range(0, len(turns) - count, count):
        assert len(np.unique(turns[start : start + count, 0])) == count
    orders = {tuple(Attention(made, 0.1, 0.02, seed)._order) for seed in range(20)}
    assert len(orders) > 1


@pytest.mark.parametrize(
    ("flags", "told"),
    [
        (["--memory-seconds", "5"], "--memory-seconds is of limited observers: --observers must name one"),
        (["--observers", "second_look+no_torques"], "no_torques leaves nothing to look at a second time, choose from"),
        (["--observers", "second_look+informed"], "informed leaves nothing to look at a second time, choose from no_"),
        (["--observers", "floor+limited"], "floor+limited of --observers has no limits"),
        (["--observers", "haptic_slam+limited", "--memory-seconds", "0"], "memory_seconds must be"),
        (["--observers", "haptic_slam+limited", "--attention-seconds", "nan"], "attention_seconds must be"),
        (["--observers", "haptic_slam+limitd"], "(did you mean 'limited'?); choose from informed, limited, no_caution"),
        (
            ["--observers", "haptic_slam+informed+informed"],
            "haptic_slam+informed+informed of --observers has a change tw",
        ),
        (
            ["--observers", "haptic_slam+limited+informed", "--memory-seconds", "1"],
            "haptic_slam+limited+informed of --observers: who is informed has no limits",
        ),
        (["--observers", "floor+informed"], "floor+informed of --observers has no particles to inform"),
        (["--observers", "nobody+limited", "--memory-seconds", "1"], "unknown --observers 'nobody'"),
    ],
)
def test_limits_that_make_no_sense_are_refused(capsys: pytest.CaptureFixture, flags: list[str], told: str) -> None:
    with pytest.raises(SystemExit) as ended:
        options.check(None, flags)
    error = capsys.readouterr().err
    assert ended.value.code == 2
    assert told in error
    assert error.count("\n") == 1
