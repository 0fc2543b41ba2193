"""The hidden Markov model of patches: against enumeration, and against what it draws itself.

Shapes: T steps, P patches, S states.
"""

from __future__ import annotations

import itertools

import numpy as np
import pytest
from scipy import stats

from haptic_env import hands
from haptic_env.patches import Link, Patches
from haptic_env.sensors import ContactDetection
from observer.contacts.contact_filter import ContactFilter
from observer.contacts.hidden_markov import AWAY, DEAD, RATES, STUCK, TOUCH, transition

HZ = 50.0
UNLIKELY = 1e-4
BELIEFS = {
    "false alarms": {"false_alarm": 0.002},
    "misses": {"miss": 0.2},
    "faults": {"stuck": 0.01, "dead": 0.02},
    "all": {"miss": 0.2, "false_alarm": 0.01, "stuck": 0.01, "dead": 0.02},
}


def _patches(along: int = 2, around: int = 1) -> Patches:
    return Patches((Link("link", "link", 0.01, 0.04),), along, around)


def _one(belief: dict[str, float], reports: np.ndarray) -> tuple[np.ndarray, float]:
    """By enumeration of all paths of one patch: (T,) probability of touch, and that the patch works."""
    prior = np.zeros(5)
    prior[[STUCK, DEAD]] = belief.get("stuck", 0.0), belief.get("dead", 0.0)
    prior[AWAY] = 1.0 - prior.sum()
    ring = np.full(5, belief.get("false_alarm", 0.0))
    ring[[TOUCH, STUCK, DEAD]] = 1.0 - belief.get("miss", 0.0), 1.0, 0.0
    rates = transition(HZ)
    paths = np.array(list(itertools.product(range(5), repeat=len(reports))))  # (5**T, T)
    weight = (prior @ rates)[paths[:, 0]] * rates[paths[:, :-1], paths[:, 1:]].prod(axis=1)
    weight *= np.where(reports, ring[paths], 1.0 - ring[paths]).prod(axis=1)
    weight /= weight.sum()
    return weight @ (paths == TOUCH), float(weight @ (paths[:, -1] < STUCK))


@pytest.mark.parametrize("belief", BELIEFS)
@pytest.mark.parametrize("lag", [5, 2])
def test_touches_are_as_probable_as_by_enumeration(belief, lag):
    """The whole stream where the lag is as long, or else all that was reported up to then."""
    patches, steps = _patches(2, 2), 5
    detection = ContactDetection(**BELIEFS[belief], patches=patches)
    reports = np.zeros((steps, len(patches)), dtype=bool)
    reports[:, 0] = True
    reports[2, 2] = True
    reports[[1, 3, 4], 3] = True
    contacts = ContactFilter(detection, HZ, lag)
    for now in range(steps):
        contacts.step(reports[now])
        for patch in range(len(patches)):
            exact, works = _one(BELIEFS[belief], reports[: now + 1, patch])
            told = [contacts.probability(ago)[patch] for ago in range(min(now, lag) + 1)]
            np.testing.assert_allclose(told, exact[::-1][: len(told)], atol=1e-9)
            assert contacts.reliability[patch] == pytest.approx(works, abs=1e-9)


def _pair(detection: ContactDetection, reports: np.ndarray) -> np.ndarray:
    """By enumeration of all paths of two patches that are confused: (T, 2) probability of touch."""
    rates, confusion, steps = transition(HZ)[:3, :3], detection.confusion, len(reports)
    says = np.empty((3, 3, steps))  # of both states, the probability of what both report
    for a, b in itertools.product(range(3), repeat=2):
        says[a, b] = 0.0
        for moved in itertools.product([False, True], repeat=2):
            chance = np.prod([confusion if each else 1.0 - confusion for each in moved])
            felt = np.zeros(2, dtype=bool)
            for patch, state in enumerate((a, b)):
                if state == TOUCH:
                    felt[patch ^ moved[patch]] = True
            ring = detection.rings(felt.astype(float))
            says[a, b] += chance * np.prod(np.where(reports, ring, 1.0 - ring), axis=1)
    pairs = [(i, j) for i in range(3) for j in range(3)]
    joint = np.array([[rates[a, c] * rates[b, d] for c, d in pairs] for a, b in pairs])
    told = np.array([[says[a, b, t] for a, b in pairs] for t in range(steps)])
    forward, backward = [np.eye(9)[0]], [np.ones(9)]
    for each in told:
        forward.append(forward[-1] @ joint * each)
    for each in told[:0:-1]:
        backward.append(joint @ (each * backward[-1]))
    both = np.array(forward[1:]) * np.array(backward[::-1])
    touch = np.array([[a == TOUCH, b == TOUCH] for a, b in pairs], dtype=float)
    return (both @ touch) / both.sum(axis=1, keepdims=True)


def test_confused_touches_are_nearly_as_probable_as_by_exact_bayes():
    """What neighbours say of each other goes in a circle, so that it is too sure where two explain as much, which is
    once in ten times."""
    patches, steps = _patches(), 11
    detection = ContactDetection(0.05, 0.005, 0.2, patches=patches)
    alone = ContactDetection(0.05 + 0.2, 0.005, patches=patches)
    rng, errors = np.random.default_rng(0), []
    for _ in range(100):
        touched = np.zeros((steps, 2), dtype=bool)
        touched[3:8, rng.integers(2)] = True
        reports = np.array([detection.sample(rng, each) for each in touched])
        exact = _pair(detection, reports)
        each = []
        for believed in (detection, alone):
            contacts = ContactFilter(believed, HZ, steps - 1)
            for report in reports:
                contacts.step(report)
            each.append(np.abs([contacts.probability(steps - 1 - t) for t in range(steps)] - exact).mean())
        errors.append(each)
    (coupled, apart), usual = np.mean(errors, axis=0), np.median(errors, axis=0)[0]
    assert usual < 0.01
    assert coupled < 0.8 * apart


def _simulated(detection: ContactDetection, steps: int, seed: int) -> tuple[np.ndarray, np.ndarray]:
    """Touches and reports (T, P) as the model has them."""
    rng, patches = np.random.default_rng(seed), len(detection.beside)
    detection.reset(rng)
    state, touched = np.zeros(patches, dtype=int), []
    for _ in range(steps):
        state = (rng.random((patches, 1)) > transition(HZ)[state, :3].cumsum(axis=1)).sum(axis=1).clip(0, 2)
        touched.append(state == TOUCH)
    return np.array(touched), np.array([detection.sample(rng, each) for each in touched])


@pytest.mark.parametrize("confusion", [0.0, 0.2])
def test_what_is_said_is_as_often_so(confusion):
    """Simulation-based calibration: of several hands, of whose patches some are stuck and some dead."""
    patches = hands.make("two_finger", patches_along=4, patches_around=8).patches
    detection = ContactDetection(0.2, 0.005, confusion, 0.1, 0.1, patches)
    lag, said, so, works, worked = 10, [], [], [], []
    for seed in range(8):
        touched, reports = _simulated(detection, 300, seed)
        contacts = ContactFilter(detection, HZ, lag)
        sound = ~(detection.stuck | detection.dead)
        for now, report in enumerate(reports):
            contacts.step(report)
            if now >= lag and now % 5 == 0:
                said.append(contacts.probability(lag))
                so.append(touched[now - lag] & sound)
        works.append(contacts.reliability)
        worked.append(sound)
    # Loopy beliefs are a little too sure.
    for told, true, slack in ((said, so, 0.06 if confusion else 0.02), (works, worked, 0.05)):
        probability, truth = np.concatenate(told), np.concatenate(true)
        assert truth.mean() == pytest.approx(probability.mean(), abs=slack)
        for low in np.linspace(0.0, 0.9, 10):
            here = (probability >= low) & (probability < low + 0.1)
            if here.sum() >= 50:
                interval = stats.binomtest(int(truth[here].sum()), int(here.sum())).proportion_ci(1 - UNLIKELY)
                assert interval.low - slack <= probability[here].mean() <= interval.high + slack
    found = np.concatenate(works)[~np.concatenate(worked)]
    assert (found < 0.5).mean() > 0.45, "what is stuck is found out"


def test_a_lone_report_is_none_and_a_missed_one_is():
    detection = ContactDetection(0.2, 0.002, patches=_patches())
    contacts = ContactFilter(detection, HZ, 10)
    for step in range(31):
        contacts.step(np.array([step == 15, 10 <= step < 20 and step != 15]))
        if step >= 10:
            assert not contacts.touched(10)[0]
            assert contacts.touched(10)[1] == (10 <= step - 10 < 20)


def test_a_stuck_patch_is_found_out_and_a_silent_one_is_trusted():
    contacts = ContactFilter(ContactDetection(stuck=0.002, dead=0.002, patches=_patches()), HZ, 10)
    for step in range(500):
        contacts.step(np.array([True, False]))
        assert not contacts.touched(min(step, 10)).any()
    assert contacts.reliability[0] < 1e-6
    assert contacts.reliability[1] > 0.99


def test_an_honest_patch_that_is_pressed_for_long_is_trusted():
    contacts = ContactFilter(ContactDetection(stuck=0.01, dead=0.01, patches=_patches()), HZ, 10)
    for step in range(2000):
        contacts.step(np.array([step > 0, False]))
        assert contacts.touched(0)[0] == (step > 0)
    assert contacts.reliability[0] == 1.0


def test_what_cannot_be_reported_is_not_listened_to():
    """A patch that is known to be stuck is silent, and one that never errs is dead."""
    contacts = ContactFilter(ContactDetection(stuck=[0], dead=[1], patches=_patches()), HZ, 3)
    for report in ([False, True], [True, False], [False, True]):
        contacts.step(np.array(report))
        assert np.isfinite(contacts.probability(0)).all()
        np.testing.assert_array_equal(contacts.reliability, 0.0)


@pytest.mark.parametrize("control_hz", [10.0, 25.0, 100.0, 250.0])
def test_rates_are_those_of_any_control_rate(control_hz):
    rates = transition(control_hz)
    assert (rates >= 0.0).all()
    np.testing.assert_allclose(rates.sum(axis=1), 1.0)
    times = round(max(control_hz, HZ) / min(control_hz, HZ))
    slow, fast = (rates[:3, :3], RATES) if control_hz < HZ else (RATES, rates[:3, :3])
    np.testing.assert_allclose(np.linalg.matrix_power(fast, times), slow / slow.sum(axis=1, keepdims=True), atol=0.01)
