"""A hand that rests, or only comes back to where it was, learns nothing new: it grows no surer."""

from __future__ import annotations

import dataclasses

import numpy as np
import pytest

from haptic_env.hand import Hand
from observer import Belief, ContactModel, HapticSLAM, PoseOnly, ShapePosterior
from observer.kinematics import link_frames, tree_of
from observer.novelty import LITTLE, LinkHistory, note
from observer.shape.exponents import sustained
from observer.shape.null_model import NullModel

LOOK = 0.06  # s
UNKNOWN = {"size_jitter": 0.2, "yaw_jitter": 45.0, "position_jitter": 0.005, "variants": 24}


# What is news


def _places(hand: Hand, pose: np.ndarray) -> np.ndarray:
    """(L, 6) m: both ends of each link's bone."""
    position, rotation = link_frames(tree_of(hand), pose)
    length = np.array([link.length for link in hand.links])
    return np.hstack([position, position + length[:, None] * rotation[:, :, 2]])


def _reference(hand, poses, contacts, alike, temper, lasting=0.0):
    """(T, L) news, look by look: 1 less the exponent of every look before, as far as it was the same."""
    places = np.array([_places(hand, pose) for pose in poses])
    exponent = np.zeros((len(poses), len(hand.links)))
    for now in range(len(poses)):
        for link in range(len(hand.links)):
            mine = hand.patches.link == link
            said = 0.0
            for before in range(now):
                distance = np.sqrt(0.5 * np.square(places[now, link] - places[before, link]).sum())
                either = (contacts[now, mine] | contacts[before, mine]).sum()
                same = (contacts[now, mine] & contacts[before, mine]).sum() / either if either else 1.0
                near = np.exp(-0.5 * (distance / alike) ** 2) * (distance < 3 * alike)
                if lasting:
                    near = max(near, np.exp(-LOOK * (now - before) / lasting))
                said += exponent[before, link] * same * near * (near >= 0.01)
            new = max(1.0 - said, 0.0)
            exponent[now, link] = temper * (new if new > 0.001 else 0.0)
    return exponent / temper


def _news(hand, poses, contacts, alike, temper, said=None, lasting=0.0):
    """(T, L), and what is then said."""
    said = LinkHistory.nothing(hand) if said is None else said
    tree, reach = tree_of(hand), np.full(len(hand.links), alike)
    told = np.empty((len(poses), len(hand.links)))
    for look, (row, pose, felt) in enumerate(zip(told, poses, contacts, strict=True)):
        note(said, link_frames(tree, pose), felt, reach, temper, LITTLE, (LOOK * look, lasting), row)
    return told, said


@pytest.mark.parametrize("lasting", [0.0, 0.2, 0.5])
@pytest.mark.parametrize(("alike", "temper"), [(0.002, 0.3), (0.01, 0.15), (0.02, 1.0)])
def test_news_is_what_no_look_before_has_said(two_finger, alike, temper, lasting):
    rng = np.random.default_rng(0)
    poses = two_finger.rest_pose + 0.1 * rng.standard_normal((40, two_finger.joints)).cumsum(axis=0) / 4
    contacts = rng.random((40, len(two_finger.patches))) < 0.1
    told, _ = _news(two_finger, poses, contacts, alike, temper, lasting=lasting)
    np.testing.assert_allclose(told, _reference(two_finger, poses, contacts, alike, temper, lasting), atol=1e-9)
    assert told[0].tolist() == [1.0] * len(two_finger.links)
    assert 0.0 < told[1:].min(initial=1.0, where=told[1:] > 0) < 0.9


@pytest.mark.parametrize("jitter", [0.0, 0.02])
@pytest.mark.parametrize(("patterns", "temper", "lasting"), [(1, 0.15, 0.0), (3, 0.15, 0.0), (3, 0.8, 0.5)])
def test_however_long_it_rests_a_place_counts_once_for_each_pattern_of_touch(
    two_finger, patterns, temper, lasting, jitter
):
    """Also where the believed pose trembles and a touch flickers."""
    rng = np.random.default_rng(1)
    felt = np.zeros((patterns, len(two_finger.patches)), dtype=bool)
    for i in range(1, patterns):
        felt[i, rng.permutation(len(two_finger.patches))[:10]] = True
    contacts = felt[rng.integers(patterns, size=2000)]
    poses = two_finger.rest_pose + jitter * rng.standard_normal((2000, two_finger.joints))
    told, _ = _news(two_finger, poses, contacts, 0.01, temper, lasting=lasting)
    assert (temper * told.sum(axis=0) < 1.5 * patterns).all()
    assert told[-500:].mean() < 0.002
    assert (temper * told.sum(axis=0) > 0.95).all(), "once, not less"


def test_of_a_touch_that_lasts_looks_say_what_those_of_an_error_that_lasts_do(two_finger):
    """With an exponent of 1 as much as n readings of one number with errors that are rho alike from one to the next,
    1' C^-1 1: where looks are alike by 2 rho / (1 + rho)."""
    rho, looks = 0.78, 20
    lasting = -LOOK / np.log(2 * rho / (1 + rho))
    poses = two_finger.rest_pose + np.linspace(0.0, 2.0, looks)[:, None]  # never twice at one place
    felt = np.ones((looks, len(two_finger.patches)), dtype=bool)
    told, _ = _news(two_finger, poses, felt, 1e-4, 1.0, lasting=lasting)
    apart = np.abs(np.subtract.outer(np.arange(looks), np.arange(looks)))
    worth = [np.linalg.inv(rho ** apart[:n, :n]).sum() for n in range(1, looks + 1)]
    np.testing.assert_allclose(told.cumsum(axis=0), np.tile(worth, (len(two_finger.links), 1)).T, rtol=1e-9)
    poses = two_finger.rest_pose + np.linspace(0.0, 2.0, 100)[:, None]
    for temper in (0.4, 1.0):
        told, _ = _news(two_finger, poses, felt[:1].repeat(100, axis=0), 1e-4, temper, lasting=lasting)
        np.testing.assert_allclose(told[-1], sustained(temper, lasting, LOOK), rtol=0.02)


def test_a_link_that_moves_says_something_new_beside_one_that_rests(two_finger):
    still, moved = np.tile(two_finger.rest_pose, (2, 1))
    moved = moved.copy()
    moved[two_finger.joint_group == 1] += 0.6
    contacts = np.zeros((201, len(two_finger.patches)), dtype=bool)
    told, _ = _news(two_finger, [still] * 200 + [moved], contacts, 0.005, 0.15)
    thumb, index = (two_finger.link_group == g for g in (0, 1))
    assert (told[-1, thumb] < 0.01).all()
    assert (told[-1, index] > 0.9).all()


def test_the_oldest_looks_are_forgotten(two_finger):
    said = LinkHistory.nothing(two_finger, kept=8)
    poses = two_finger.rest_pose + np.linspace(0.0, 2.0, 9)[:, None]
    contacts = np.zeros((9, len(two_finger.patches)), dtype=bool)
    _news(two_finger, poses[:8], contacts[:8], 0.001, 1.0, said)
    assert (_news(two_finger, poses[:1], contacts[:1], 0.001, 1.0, said)[0] == 0.0).all()
    _news(two_finger, poses[8:], contacts[:1], 0.001, 1.0, said)
    told, _ = _news(two_finger, poses[:1], contacts[:1], 0.001, 1.0, said)
    assert (told == 1.0).all()
    assert (said.looks == 10).all()


# What it does to names


def _resting(beliefs: list[Belief], times: int, seed: int = 0) -> list[Belief]:
    """The last of `beliefs` again and again, its lagged pose trembling as a filter's mean does."""
    rng = np.random.default_rng(seed)
    last = [belief for belief in beliefs if belief.transition is not None][-1]
    tremble = 0.002 * rng.standard_normal((times, len(last.joint_angles)))
    return [
        dataclasses.replace(last, transition=last.transition._replace(mean=last.transition.mean + each))
        for each in tremble
    ]


@pytest.mark.parametrize("shape", ["cube", pytest.param("cylinder", marks=pytest.mark.statistical)])
@pytest.mark.parametrize("keywords", [{}, {"none": 0.2}, UNKNOWN, {"samples": 8}])
def test_a_posterior_stays_where_it_was_when_the_hand_came_to_rest(explore, shape, keywords):
    trial = explore(shape, 60, sigma_deg=3.0)
    beliefs = trial.beliefs(PoseOnly(trial.hand, 3.0))
    posterior = ShapePosterior(trial.hand, **keywords)
    posterior.reset(seed=0)
    for belief in beliefs:
        posterior.update(belief)
    rested = [posterior.update(belief) for belief in _resting(beliefs, 1500)]
    assert np.abs(rested[-1] - rested[299]).max() < 0.05
    each = ShapePosterior(trial.hand, **{**keywords, "alike": 0.0})
    each.reset(seed=0)
    for belief in [*beliefs, *_resting(beliefs, 1500)]:
        each.update(belief)
    assert each.posterior.min() < 1e-20 < rested[-1].min(), "who counts every look is sure of what it is not"


def test_without_alike_every_look_counts(explore):
    trial = explore("cube", 60, sigma_deg=3.0)
    belief = [each for each in trial.beliefs(PoseOnly(trial.hand, 3.0)) if each.transition is not None][-1]
    posterior = ShapePosterior(trial.hand, alike=0.0, stride=1)
    first = posterior.update(belief)
    odds = np.log(first / first[0])
    for _ in range(9):
        posterior.update(belief)
    np.testing.assert_allclose(np.log(posterior.posterior / posterior.posterior[0]), 10 * odds, atol=1e-6)


def test_a_habit_takes_in_the_share_that_is_news():
    """Twice a half is the whole, for rates that are known; nothing is learned of what is no news."""
    rng = np.random.default_rng(0)
    contacts = rng.random((20, 5)) < 0.3
    habit, deaf = NullModel(5), NullModel(5)
    habit.BEGIN = habit.CEASE = (1e9, 2e9)
    habit._counts = np.array([habit.BEGIN, habit.CEASE])
    for felt in contacts:
        habit.update(felt, np.full(5, 0.5))
        deaf.update(felt, np.zeros(5))
    assert habit.log_likelihood == pytest.approx(0.5 * 20 * 5 * np.log(0.5))
    assert deaf.log_likelihood == 0.0
    np.testing.assert_array_equal(deaf._counts, [NullModel.BEGIN, NullModel.CEASE])


# What it does to maps


def _maps(trial, rest: int, **keywords) -> list[np.ndarray]:
    """The map as it grew, and the one in hindsight, after `trial` and a rest of so many steps at its end."""
    slam = HapticSLAM(trial.hand, 3.0, particles=1, contact_model=ContactModel(**keywords))
    slam.reset(seed=0)
    rng = np.random.default_rng(0)
    noise = np.deg2rad(3.0) * rng.standard_normal((rest, trial.hand.joints))
    nothing = np.zeros(trial.hand.joints)
    for each in zip(trial.torque, trial.felt, trial.contacts, strict=True):
        slam.step(*each)
    for each in noise:
        belief = slam.step(nothing, trial.true[-1] + each, trial.contacts[-1])
    maps = [belief.occupancy, slam.flush()[-1].occupancy]
    return [np.where(each == 0.5, slam.contact_model.prior, each) for each in maps]  # where nothing is said


def test_maps_grow_no_surer_of_what_a_hand_at_rest_repeats(explore):
    trial = explore("cube", 60, sigma_deg=3.0)
    assert trial.contacts[-1].any()
    for early, late, sure in zip(*(_maps(trial, 300), _maps(trial, 900), _maps(trial, 900, repeats=0.0)), strict=True):
        assert np.abs(late - early).max() < 0.02
        assert np.abs(sure - early).max() > 0.2, "who counts every step grows surer"


def test_a_hand_that_never_stays_has_the_same_map_whether_repeats_count_or_not(explore):
    trial = explore("cube", 30, sigma_deg=3.0)
    mine, every = (_maps(trial, 1, repeats=repeats) for repeats in (50.0, 0.0))
    np.testing.assert_array_equal(mine, every)


@pytest.mark.parametrize("value", [-1.0, np.inf])
def test_impossible_repeats_are_refused(value):
    with pytest.raises(ValueError, match=f"repeats must be a finite number in .* got {value!r}"):
        ContactModel(repeats=value)


@pytest.mark.parametrize("value", [-1.0, np.nan, "4"])
def test_an_impossible_alike_is_refused(two_finger, value):
    with pytest.raises(ValueError, match=f"alike must be .* got {value!r}"):
        ShapePosterior(two_finger, alike=value)
