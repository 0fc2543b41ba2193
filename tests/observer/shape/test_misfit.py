"""Contacts that fit no candidate are said, once a trial; where they fit nothing is said."""

from __future__ import annotations

import copy
import warnings

import numpy as np
import pytest

from observer import ContactsDoNotFit, PoseOnly, ShapePosterior
from observer.shape.misfit import RECENT, TOO_MANY, Misfit

STUCK = {
    "all ones": lambda rng, contacts: np.ones_like(contacts),
    "by chance": lambda rng, contacts: (rng.random(contacts.shape) < 0.5).astype(contacts.dtype),
}


def _name(namer, trial, change=lambda rng, contacts: contacts):
    """The share unexplained at its highest."""
    rng, observer = np.random.default_rng(0), PoseOnly(trial.hand, 3.0)
    observer.reset(seed=0)
    namer.reset(seed=0)
    most = 0.0
    for torque, felt, contacts in zip(trial.torque, trial.felt, trial.contacts, strict=True):
        namer.update(observer.step(torque, felt, change(rng, contacts)))
        most = max(most, namer.unexplained)
    return most


@pytest.mark.parametrize("told", [{}, {"size_jitter": 0.2, "yaw_jitter": 45.0}, {"none": 0.3}], ids=str)
@pytest.mark.parametrize("stuck", STUCK)
def test_contacts_of_a_stuck_sensor_are_said_once_a_trial(explore, stuck, told):
    trial = explore("sphere", 120, seed=3)
    namer = ShapePosterior(trial.hand, **told)
    for _ in range(2):
        with pytest.warns(ContactsDoNotFit, match=r"no solid explains \d+ % of the patches") as said:
            assert _name(namer, trial, STUCK[stuck]) > TOO_MANY
        assert len(said) == 1


@pytest.mark.parametrize("noise", [{}, {"contact_miss": 0.2, "contact_false_alarm": 0.05}], ids=str)
@pytest.mark.parametrize("shape", ["cube", "pyramid"])
def test_where_contacts_fit_nothing_is_said(explore, shape, noise):
    trial = explore(shape, 150, seed=3, **noise)
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        assert _name(ShapePosterior(trial.hand), trial) < 0.6 * TOO_MANY


@pytest.mark.parametrize("surprise", [1e-9, 0.001, 0.5])
def test_the_share_is_that_of_patches_that_surprise(surprise):
    misfit = Misfit(patches=50, surprise=surprise)
    before, temper = np.array([-1.0, -700.0, -3.0]), 0.15
    after = before + temper * np.log(surprise) * np.array([50, 0, 8])  # the third is likeliest now
    after[0] -= 3.0
    for _ in range(RECENT - 1):
        misfit.update(before, after, temper)
    assert misfit.share == 0.0
    misfit.update(before, after, temper)
    assert misfit.share == pytest.approx(8 / 50)


def test_where_nothing_surprises_nothing_is_said():
    misfit = Misfit(patches=50, surprise=1.0)
    for _ in range(2 * RECENT):
        misfit.update(np.zeros(2), np.zeros(2), 1.0)
    assert misfit.share == 0.0


def test_a_copy_has_doubts_of_its_own(explore):
    """As the observers of one trial, whose namers share their tables."""
    trial = explore("sphere", 120, seed=3)
    namer = ShapePosterior(trial.hand)
    other = copy.copy(namer)
    other.reset(seed=0)
    with pytest.warns(ContactsDoNotFit):
        assert _name(namer, trial, STUCK["all ones"]) > TOO_MANY
    assert other.unexplained == 0.0
