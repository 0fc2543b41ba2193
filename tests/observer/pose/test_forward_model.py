"""The internal forward model against MuJoCo's own steps and their differences."""

from __future__ import annotations

import copy

import mujoco
import numpy as np
import pytest

from haptic_env import hands
from observer.pose.forward_model import LARGEST_GROWTH, STEP_SECONDS, ForwardModel
from tests.observer.hands import pointer, random_tree

HANDS = {**hands.HANDS, "tree": lambda: random_tree(0), "pointer": pointer}
HZ = 50.0


@pytest.fixture(scope="module", params=HANDS)
def hand(request: pytest.FixtureRequest):
    """Every registered hand, a random tree and a pointer."""
    return HANDS[request.param]()


def _stepped(hand, state, torque, *, limits: bool = True, hz: float = HZ) -> np.ndarray:
    """State (2J,) after one control step of a simulation of its own."""
    model = copy.copy(hand.model)
    model.opt.integrator = mujoco.mjtIntegrator.mjINT_IMPLICITFAST
    model.opt.timestep = STEP_SECONDS
    model.opt.disableflags |= mujoco.mjtDisableBit.mjDSBL_CONTACT
    if not limits:
        model.opt.disableflags |= mujoco.mjtDisableBit.mjDSBL_LIMIT
    data = mujoco.MjData(model)
    data.qpos[:], data.qvel[:] = np.split(state, 2)
    data.ctrl[:] = torque
    for _ in range(round(1 / (hz * STEP_SECONDS))):
        mujoco.mj_step(model, data)
    return np.concatenate([data.qpos, data.qvel])


def _states(hand, count: int, *, anywhere: bool, seed: int = 0):
    """Random states (2J,) and torques (J,): anywhere, or slow ones well within the limits."""
    rng = np.random.default_rng(seed)
    low, high = hand.joint_limits.T
    for _ in range(count):
        if anywhere:
            q, v = rng.uniform(low - 0.1, high + 0.1), rng.normal(0, 8.0, hand.joints)
        else:
            q, v = low + (high - low) * rng.uniform(0.35, 0.65, hand.joints), rng.normal(0, 0.2, hand.joints)
        yield np.concatenate([q, v]), rng.uniform(-1, 1, hand.joints) * (1.0 if anywhere else 0.1)


@pytest.mark.parametrize("hz", [50.0, 100.0, 20.0])
@pytest.mark.parametrize("anywhere", [False, True])
def test_the_predicted_state_is_mujocos(hand, hz, anywhere):
    model = ForwardModel(hand, hz)
    for state, torque in _states(hand, 30, anywhere=anywhere):
        prediction = model.predict(state, torque)
        np.testing.assert_allclose(prediction.state, _stepped(hand, state, torque, hz=hz), rtol=1e-6, atol=1e-6)


def test_a_prediction_depends_on_nothing_before_it(hand):
    (first, torque), (second, other) = _states(hand, 2, anywhere=True)
    model = ForwardModel(hand, HZ)
    before = model.predict(first, torque)
    model.predict(second, other)
    after = model.predict(first, torque)
    for one, two in zip(before, after, strict=True):
        assert one.tobytes() == two.tobytes()
    assert not np.shares_memory(before.state, after.state)


def test_the_jacobians_are_those_of_the_whole_step(hand):
    """Away from limits. The model takes one substep for all: a tenth is allowed where the tree is a wild one."""
    model, step, joints = ForwardModel(hand, HZ), 1e-5, hand.joints
    for state, torque in _states(hand, 5 if joints <= 8 else 2, anywhere=False):
        prediction = model.predict(state, torque)
        numeric = np.empty((2 * joints, 3 * joints))
        for i in range(3 * joints):
            ends = []
            for sign in (-1, 1):
                x, u = state.copy(), torque.copy()
                if i < 2 * joints:
                    x[i] += sign * step
                else:
                    u[i - 2 * joints] += sign * step / hand.torque_limits[i - 2 * joints]
                ends.append(_stepped(hand, x, u))
            numeric[:, i] = (ends[1] - ends[0]) / (2 * step)
        got = np.hstack([prediction.transition, prediction.torque_gain])
        blocks = [slice(0, joints), slice(joints, 2 * joints), slice(2 * joints, None)]
        for rows in blocks[:2]:
            for columns in blocks:
                scale = np.abs(numeric[rows, columns]).max()
                np.testing.assert_allclose(
                    got[rows, columns],
                    numeric[rows, columns],
                    atol=(0.1 if hand.name == "tree" else 0.05) * scale + 1e-9,
                )


def test_one_free_hinge_is_known_in_closed_form():
    """v ← ρ v, q ← q + h v at every substep, with ρ = 1 / (1 + h d / I)."""
    hand = pointer()
    prediction = ForwardModel(hand, HZ).predict(np.array([0.1, 0.5]), np.zeros(1))
    inertia, damping, h = 2e-5 + 1e-3 * 0.1995**2, 6e-3, STEP_SECONDS  # of `pointer`, about its hinge
    rho = 1 / (1 + h * damping / inertia)
    travel = h * sum(rho**n for n in range(1, 11))
    np.testing.assert_allclose(prediction.transition, [[1, travel], [0, rho**10]], rtol=1e-4, atol=1e-7)
    np.testing.assert_allclose(prediction.state, [0.1 + 0.5 * travel, 0.5 * rho**10], rtol=1e-6)


def test_no_blow_up_at_limits(hand):
    """Where the step straddles an impact the Jacobian of angles stays that of a passive hand."""
    model, joints = ForwardModel(hand, HZ), hand.joints
    near = 0
    for state, torque in _states(hand, 2000 if joints <= 8 else 700, anywhere=True, seed=1):
        prediction = model.predict(state, torque)
        assert np.isfinite(prediction.state).all()
        assert np.isfinite(prediction.torque_gain).all()
        growth = np.abs(prediction.transition[:joints, :joints]).max()
        assert growth <= LARGEST_GROWTH**2, "of angles by angles"
        assert np.abs(prediction.transition[:joints, joints:]).max() < 0.1, "seconds"
        near += bool((np.abs(state[:joints, None] - hand.joint_limits).min(axis=1) < 0.1).any())
    assert near > 50 or joints == 1, "limits were met"


@pytest.mark.parametrize("hz", [1.0, 2.0, 5.0])
def test_however_long_a_step_is_its_jacobians_are_numbers_at_limits(hand, hz):
    """Differences that straddle an impact, raised to the number of substeps, are past all numbers: inf - inf."""
    model, joints, (low, high) = ForwardModel(hand, hz), hand.joints, hand.joint_limits.T
    rng = np.random.default_rng(0)
    for _ in range(12):
        q, v = rng.choice([low, high]), rng.normal(0.0, 0.01, joints)
        prediction = model.predict(np.concatenate([q, v]), rng.choice([-1.0, 0.0, 1.0], joints))
        for each in prediction:
            assert np.isfinite(each).all()
        assert np.abs(prediction.transition[:joints, :joints]).max() <= LARGEST_GROWTH**2


def test_errors_in_a_long_prediction_stay_bounded():
    """Thousands of steps of random torque: the product of the Jacobians never takes off."""
    hand = hands.make("two_finger")
    model, rng, joints = ForwardModel(hand, HZ), np.random.default_rng(0), hand.joints
    state = np.concatenate([hand.rest_pose, np.zeros(joints)])
    covariance = np.zeros((2 * joints, 2 * joints))
    noise = np.diag(np.concatenate([np.zeros(joints), np.full(joints, 0.5**2)]))
    for _ in range(3000):
        prediction = model.predict(state, rng.uniform(-1, 1, joints))
        state = prediction.state
        covariance = prediction.transition @ covariance @ prediction.transition.T + noise
        assert np.sqrt(np.diag(covariance)[:joints]).max() < np.pi


@pytest.mark.parametrize("hz", [0.0, -1.0, np.nan, np.inf, 501.0, "50", None])
def test_impossible_control_rates_are_refused(hz):
    with pytest.raises(ValueError, match=r"control_hz must be a finite number in \[1, 500\] Hz, got"):
        ForwardModel(pointer(), hz)


def test_the_hands_own_model_is_left_alone():
    hand = hands.make("two_finger")
    before = hand.model.opt.timestep, hand.model.opt.integrator, hand.model.opt.disableflags
    ForwardModel(hand, HZ).predict(np.zeros(16), np.ones(8))
    assert (hand.model.opt.timestep, hand.model.opt.integrator, hand.model.opt.disableflags) == before
