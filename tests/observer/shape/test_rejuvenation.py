"""Solids that lie any way: moves keep the posterior that enumeration gives, and the evidence of each label."""

from __future__ import annotations

import gymnasium as gym
import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from haptic_env import shapes
from haptic_env.shapes.base import Solid
from observer.pose_only import PoseOnly
from observer.shape import rejuvenation
from observer.shape.hypotheses import Variants
from observer.shape.posterior import ShapePosterior
from observer.shape.turns import Turns

NAMES = ("cuboid(1, 1, 2)", "sphere")
FREE = {"rotation_jitter": 180.0, "size_jitter": 0.1, "position_jitter": 0.004}


def _solids(hand, *names: str) -> dict[str, list[Solid]]:
    return {name: [shapes.make(name, position=hand.grasp_centre)] for name in names}


@pytest.fixture(scope="module")
def felt(two_finger):
    """Beliefs of a hand that explores a box which lies askew."""
    with gym.make("HapticSLAM/TwoFinger-v0", shape="cuboid(1, 1, 2)", sigma_deg=1.0, rotation_jitter=180.0) as env:
        observer, (seen, _) = PoseOnly(two_finger, 1.0), env.reset(seed=4)
        beliefs = [observer.reset(seed=0, joint_angles=seen["joint_angles"])]
        rng = np.random.default_rng(0)
        for step in range(300):
            if step % 10 == 0:
                torque = rng.uniform(-1, 1, two_finger.joints).astype(np.float32)
            seen = env.step(torque)[0]
            beliefs.append(observer.step(torque, seen["joint_angles"], seen["contacts"]))
    return beliefs


def _named(hand, beliefs, seed: int = 0, **told):
    posterior = ShapePosterior(hand, _solids(hand, *NAMES), **{**FREE, **told})
    posterior.reset(seed=seed)
    for belief in beliefs:
        posterior.update(belief)
    return posterior


def test_the_same_seed_gives_the_same_bits(two_finger, felt):
    first, again = (_named(two_finger, felt, variants=40) for _ in range(2))
    np.testing.assert_array_equal(first.posterior, again.posterior)
    np.testing.assert_array_equal(first.hypotheses.solids.rotation, again.hypotheses.solids.rotation)


def test_a_box_askew_is_told_from_a_ball(two_finger, felt):
    posterior = _named(two_finger, felt, variants=120)
    assert posterior.posterior[0] > 0.9


def test_evidence_is_that_of_enumeration(two_finger, felt, monkeypatch):
    """Evidence of each label, its mean over draws: with as many moves as one likes that of draws from the prior."""
    told = {"variants": 300, "temper": 0.07}  # so little that draws from the prior are enough

    def evidence(seeds: int) -> np.ndarray:
        each = [_named(two_finger, felt, seed, **told).log_likelihood for seed in range(seeds)]
        return np.logaddexp.reduce(each) - np.log(seeds)

    for name, value in (("WORTH", 0.0), ("FEWEST", 3), ("MOST", 10), ("REPLAYED", 400), ("AT_A_STEP", 10**6)):
        monkeypatch.setattr(rejuvenation, name, value)
    moved = evidence(6)
    monkeypatch.setattr(rejuvenation, "WORTH", 2.0)
    monkeypatch.setattr(rejuvenation, "FEWEST_TOUCHES", np.inf)
    still = evidence(3)
    posterior = _named(two_finger, felt, **told)
    draws = Variants([shapes.usual(name, two_finger) for name in NAMES], 30_000, yaw_jitter=0.0, far=0.03, **FREE)
    all_felt = posterior._rejuvenation._felt
    fit, _ = all_felt.log_likelihood(draws.place(draws.draw(np.random.default_rng(0))), posterior.temper)
    expected = np.logaddexp.reduce(fit.reshape(len(NAMES), -1), axis=1) - np.log(draws.count)
    np.testing.assert_allclose(moved, expected, atol=1.0)
    assert moved[0] > still[0] + 0.5, "without moves, what fits is not found"


def test_moves_keep_what_hypotheses_explain(two_finger, felt):
    """What each one is said to explain is what it does, all looks again."""
    posterior = _named(two_finger, felt, variants=40)
    kept = posterior._rejuvenation
    again, _ = kept._felt.log_likelihood(posterior._solids, posterior.temper)
    np.testing.assert_allclose(kept._fit, again, rtol=1e-9, atol=1e-9)


def test_turns_are_proposed_as_probably_there_as_back():
    """Moves that are always made leave uniform turns uniform, of a restricted range too."""
    limit = 60.0
    allowed, rng = Turns(limit), np.random.default_rng(0)
    turns = allowed.draw(4000, rng)
    for _ in range(20):
        turns = allowed.propose(turns, np.full((len(turns), 1), 0.3), rng.random(len(turns)) < 0.15, rng)
    angle = Rotation.from_quat(turns).magnitude()
    most = np.deg2rad(limit)
    assert angle.max() <= most + 1e-6
    grid = np.linspace(0, most, 500)
    expected = np.interp(np.linspace(0, most - np.sin(most), 11)[1:-1], grid - np.sin(grid), grid)
    np.testing.assert_allclose(np.quantile(angle, np.linspace(0, 1, 11)[1:-1]), expected, atol=0.03)


def test_several_poses_are_refused(two_finger):
    with pytest.raises(ValueError, match=r"rotation_jitter above 0 needs samples=1, the mean pose, got samples=4"):
        ShapePosterior(two_finger, samples=4, rotation_jitter=180.0)


@pytest.mark.parametrize("told", [{"rotation_jitter": 200.0}, {"rotation_jitter": 5.0, "yaw_jitter": 5.0}], ids=str)
def test_turns_that_cannot_be_are_refused(two_finger, told):
    with pytest.raises(ValueError, match="rotation_jitter"):
        ShapePosterior(two_finger, **told)
