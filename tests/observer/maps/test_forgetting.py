"""Maps that fade. Steps of 20 ms."""

from __future__ import annotations

import numpy as np
import pytest

from observer import HapticSLAM
from observer.maps.contact_model import ContactModel
from observer.maps.forgetting import Forgetting

MEMORY = 0.4  # s
KINDS = {
    "one particle": {"particles": 1, "candidates": 1},
    "four particles": {"particles": 4},
    "sampled": {"particles": 2, "matching": "sample"},
}


@pytest.fixture(scope="module")
def trial(explore):
    """Two fingers about a cube, which they touch."""
    return explore("cube", 80, seed=3)


def _told(trial, slam: HapticSLAM, silent: int = 0):
    """The observer after a trial, and after steps of which no contact was measured."""
    slam.reset(seed=0)
    for turn in zip(trial.torque, trial.felt, trial.contacts, strict=True):
        belief = slam.step(*turn)
    nothing = np.full(trial.contacts.shape[1], np.nan)
    for _ in range(silent):
        belief = slam.step(np.zeros_like(trial.torque[0]), trial.felt[-1], nothing)
    return belief


@pytest.mark.parametrize("first", [100, -100, 7, -3, 1])
def test_what_is_left_is_the_exponential_of_its_age_on_average(first):
    whole, forgetting, off = np.full(1, first, dtype=np.int64), Forgetting(3.0), []
    for step in range(1, 301):
        forgetting.step()
        if forgetting.now is not None:
            whole = forgetting.now.of(whole)
            off.append(whole[0] - first * np.exp(-step / 50 / 3.0))
    assert len(off) == 60
    assert np.abs(off).max() < 3.0
    assert abs(np.mean(off)) < 0.8


def test_bytes_fade_as_whole_numbers_do():
    forgetting = Forgetting(0.5)
    for _ in range(5):
        forgetting.step()
    quanta = np.arange(-128, 128).astype(np.int8)
    assert forgetting.now is not None
    np.testing.assert_array_equal(forgetting.now.of_bytes(quanta), forgetting.now.of(quanta.astype(np.int64)))
    assert forgetting.now.of_bytes(quanta)[128] == 0, "the prior stays what it is"
    nothing = Forgetting(1e-9, 10.0)
    nothing.step()
    assert nothing.now is not None
    assert not nothing.now.of(quanta).any(), "of the shortest memory nothing is left"


@pytest.mark.parametrize("kind", KINDS)
def test_a_map_of_which_nothing_more_is_felt_goes_back_to_the_prior(trial, kind):
    prior = ContactModel().prior
    forgetful = HapticSLAM(trial.hand, 3.0, memory_seconds=MEMORY, **KINDS[kind])
    belief = _told(trial, forgetful)
    known = belief.occupancy != 0.5
    sure = np.abs(belief.occupancy - prior)[known].max()
    rested = _told(trial, forgetful, silent=150).occupancy
    assert sure > 0.15
    assert np.abs(rested - prior)[known].max() < 0.02
    in_hindsight = forgetful.map_now()
    assert np.abs(in_hindsight - prior)[in_hindsight != 0.5].max() < 0.02
    ideal = HapticSLAM(trial.hand, 3.0, **KINDS[kind])
    assert np.abs(_told(trial, ideal, silent=150).occupancy - prior)[known].max() > 0.15


def test_the_map_of_the_flush_is_the_one_of_the_moment_before(trial):
    slam = HapticSLAM(trial.hand, 3.0, particles=2, memory_seconds=MEMORY)
    _told(trial, slam)
    now = slam.map_now()
    np.testing.assert_array_equal(slam.map_now(), now)
    np.testing.assert_array_equal(slam.flush()[-1].occupancy, now)
    ideal = HapticSLAM(trial.hand, 3.0, particles=2)
    _told(trial, ideal)
    assert np.abs(ideal.map_now() - now).max() > 0.1


def test_an_infinite_memory_has_the_same_bits(trial):
    beliefs = [trial.beliefs(HapticSLAM(trial.hand, 3.0, 2, **told)) for told in ({}, {"memory_seconds": np.inf})]
    for one, other in zip(*beliefs, strict=True):
        assert one == other


def test_a_touch_that_lasts_is_felt_again_once_it_was_forgotten(trial):
    touching = int(np.flatnonzero(trial.contacts.any(axis=1))[-1])
    slam = HapticSLAM(trial.hand, 1.0, 1, memory_seconds=MEMORY, motion="raw_angles", lag=0)
    slam.reset(seed=0)
    for _ in range(300):
        belief = slam.step(np.zeros_like(trial.torque[0]), trial.true[touching], trial.contacts[touching])
    for occupancy in (belief.occupancy, slam.map_now()):
        assert occupancy[occupancy != 0.5].max() > 5.0 * ContactModel().prior


@pytest.mark.parametrize("memory", [0.0, -1.0, float("nan"), True, "5", None])
def test_what_is_no_time_constant_is_refused(two_finger, memory):
    with pytest.raises(ValueError, match=r"memory_seconds must be .*; or inf"):
        HapticSLAM(two_finger, memory_seconds=memory)
