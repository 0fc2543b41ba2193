"""The observer against exact Bayes by enumeration, where poses and maps are few enough to enumerate.

Silence says nothing here (`free=0`, and the pointer's end is beside the grid), touches and particles have their full
weight, and contact says nothing about motion: then the observer's model is one that can be written down and every
step of the filter is exact but for the number of particles, the quantum of the maps (0.05) and, where the lag is
shorter than the trial, the past that later angles may no longer correct.
"""

from __future__ import annotations

import numpy as np
import pytest

from haptic_env.grid import Grid
from haptic_lab.benchmarks.reference import full_weight
from observer import ContactDynamics, HapticSLAM
from tests.observer.enumeration import posteriors
from tests.observer.hands import ARM, VOXEL, pointer

CELLS = 5
GRID = Grid((-1e-6 - VOXEL, -CELLS / 2 * VOXEL, ARM - VOXEL / 2), VOXEL, (1, CELLS, 1))
MODEL = full_weight(hit=0.8, false_alarm=0.05, free=0.0, shell=0.5**0.5)
SIGMA_DEG = 0.3  # one voxel at the end of the arm
TOUCHED = np.array([0, 1, 1, 0, 1, 1])
UNKNOWN = np.zeros(CELLS, dtype=np.int8)
KNOWN = np.array([60, -127, -127, 127, 127], dtype=np.int8)
EDGES = (np.arange(-8 * CELLS, 8 * CELLS) + 0.5) / 3 * VOXEL / ARM  # a third of a voxel, on no point of a lattice


class Trial:
    """One trial of a pointer, what the observer makes of it and what is exact."""

    def __init__(
        self, particles, *, joints=1, lag=None, seed=0, start=UNKNOWN, candidates=4, velocity_noise=0.6, bias_deg=0.0
    ):
        steps = len(TOUCHED)
        lag = steps + 1 if lag is None else lag  # None: all is known before the first step is assimilated
        self.slam = HapticSLAM(
            pointer(joints),
            SIGMA_DEG,
            particles,
            candidates=candidates,
            matching="sample",
            lag=lag,
            motor_noise=0.0,
            control_hz=10.0,
            grid=GRID,
            contact_model=MODEL,
            bias_deg=bias_deg,
            dynamics=ContactDynamics(constrained=False, joint_speed=0.0),
        )
        self.slam.pose.velocity_noise = velocity_noise
        self.bias = np.deg2rad(bias_deg)
        self.travel = (
            velocity_noise
            * self.slam.pose.model.predict(np.zeros(2 * joints), np.zeros(joints)).transition[:joints, joints:]
        )
        rng = np.random.default_rng(5)
        q = np.cumsum(
            [np.zeros(joints)] + [self.travel @ rng.standard_normal(joints) for _ in range(steps - 1)], axis=0
        )
        self.felt = q + np.deg2rad(SIGMA_DEG) * rng.standard_normal(q.shape)
        beliefs = [self.slam.reset(seed=seed)]
        maps = self.slam._state.maps
        maps.own[:] = start
        maps.seen[:] = maps.stale[:] = True
        for q, touched in zip(self.felt, TOUCHED, strict=True):
            beliefs.append(self.slam.step(np.zeros(joints), q, [touched, 0]))
        beliefs = [each for each in beliefs if each.lagged_contacts is not None] + self.slam.flush()
        self.beliefs = beliefs[-steps:]
        self.seen = None if lag > steps else lag
        self.prior = MODEL.evidence(1.0).probability[start.astype(int) + 128]

    def exact(self, biases=1, **lattice):
        """The same by enumeration, of so many `biases` of a joint too, as far as four SDs from none."""
        if not self.bias:
            return self._enumerated(0.0, lattice)
        line = np.linspace(-4.0, 4.0, biases)
        grid = np.stack(np.meshgrid(*[line] * self.felt.shape[1], indexing="ij"), axis=-1).reshape(
            -1, self.felt.shape[1]
        )
        of_each = [self._enumerated(self.bias * each, lattice) for each in grid]
        prior = np.exp(-0.5 * np.square(grid).sum(axis=1))
        return [_mixed(step, prior / prior.sum()) for step in zip(*of_each, strict=True)]

    def _enumerated(self, bias, lattice):
        return posteriors(
            self.felt - bias,
            TOUCHED,
            travel=self.travel,
            sigma=np.deg2rad(SIGMA_DEG),
            hit=MODEL.hit,
            false_alarm=MODEL.false_alarm,
            prior=self.prior,
            seen=self.seen,
            **lattice,
        )

    def distances(self, exact):
        """Of each step (T, 3): total variation of the pointer's angle, greatest of any cell, error of the evidence."""
        rows = []
        for belief, truth in zip(self.beliefs, exact, strict=True):
            pointing = sum(np.meshgrid(*[truth.angles] * self.felt.shape[1], indexing="ij"))
            expected = np.histogram(pointing, EDGES, weights=truth.pose)[0]
            got = np.histogram(belief.particles.sum(axis=1), EDGES, weights=belief.weights)[0]
            cells = np.abs(belief.occupancy.ravel() - truth.occupied).max()
            rows.append([0.5 * np.abs(got - expected).sum(), cells, belief.log_evidence - truth.log_evidence])
        return np.array(rows)


def _mixed(posteriors_of_a_step, prior):
    """The posterior of a step where which of some (B,) is so has the probability `prior` (B,)."""
    log = np.log(prior) + [each.log_evidence for each in posteriors_of_a_step]
    total = np.logaddexp.reduce(log)
    weights = np.exp(log - total)
    pose, occupied = (
        np.tensordot(weights, [getattr(each, what) for each in posteriors_of_a_step], 1)
        for what in ("pose", "occupied")
    )
    return posteriors_of_a_step[0]._replace(pose=pose, occupied=occupied, log_evidence=total)


BIASES = {0.0: 1, SIGMA_DEG: 33, 1.0: 65}  # degrees: how many are enumerated, five in an SD of what is left of it


@pytest.mark.parametrize("bias_deg", BIASES)
@pytest.mark.parametrize("start", [UNKNOWN, KNOWN], ids=["unknown map", "known map"])
def test_pose_map_and_evidence_of_one_joint_are_exact(start, bias_deg):
    trial = Trial(30_000, start=start, bias_deg=bias_deg)
    pose, cells, evidence = trial.distances(trial.exact(BIASES[bias_deg])).T
    assert pose.max() < 0.02
    assert cells.max() < 0.02
    assert np.abs(evidence).max() < 0.02
    assert np.abs(trial.beliefs[-1].occupancy.ravel() - trial.prior).max() > 0.01, "the trial teaches something"


def test_resampling_is_part_of_what_is_exact():
    """The trial of the check above resamples."""
    trial = Trial(30_000, start=KNOWN)
    assert any(belief.resampled for belief in trial.beliefs)


@pytest.mark.parametrize("start", [UNKNOWN, KNOWN], ids=["unknown map", "known map"])
def test_pose_map_and_evidence_of_two_joints_are_exact(start):
    trial = Trial(30_000, joints=2, start=start, velocity_noise=0.25)
    exact = trial.exact(fine=9, reach=2.5)
    pose, cells, evidence = trial.distances(exact).T
    assert pose.max() < 0.02
    assert cells.max() < 0.02
    assert np.abs(evidence).max() < 0.02
    mean = trial.beliefs[-1].lagged_joint_angles
    axes = np.meshgrid(*[exact[-1].angles] * 2, indexing="ij")
    np.testing.assert_allclose(mean, [(axis * exact[-1].pose).sum() for axis in axes], atol=0.05 * VOXEL / ARM)


@pytest.mark.statistical
@pytest.mark.timeout(3600)
def test_an_unknown_bias_of_two_joints_is_exact():
    """169 enumerations, somewhat more than one in an SD of what is left of a bias."""
    trial = Trial(30_000, joints=2, start=KNOWN, velocity_noise=0.25, bias_deg=0.15)
    pose, cells, evidence = trial.distances(trial.exact(13, fine=9, reach=2.5)).T
    print(pose, cells, evidence)
    assert pose.max() < 0.02
    assert cells.max() < 0.02
    assert np.abs(evidence).max() < 0.02


def test_a_known_map_tells_of_the_bias():
    """Against the mean of all biases by enumeration; and the angles alone would have said another one."""
    trial = Trial(30_000, start=KNOWN, bias_deg=SIGMA_DEG)
    line = np.linspace(-4.0, 4.0, 33) * trial.bias
    log = [trial._enumerated(bias, {})[-1].log_evidence for bias in line] - 0.5 * (line / trial.bias) ** 2
    exact = line @ np.exp(log - np.logaddexp.reduce(log))
    found = trial.beliefs[-1].joint_offset[0]
    assert found == pytest.approx(exact, abs=0.03 * trial.bias)
    assert abs(trial.slam.pose.offset.mean[0] - exact) > 0.3 * trial.bias


def test_a_known_map_moves_the_pose():
    """The check above means something: without the touches the pose would be another one."""
    trial = Trial(30_000, start=KNOWN)
    blind = trial.slam.pose.mean[trial.slam.pose.lagged(0)]
    assert abs(trial.beliefs[-1].lagged_joint_angles - blind)[0] > 0.1 * VOXEL / ARM


@pytest.mark.parametrize("lag", [1, 2])
def test_a_short_lag_is_nearly_exact(lag):
    """Particles drawn before an angle was felt are not drawn again: what that costs."""
    trial = Trial(30_000, lag=lag)
    pose, cells, evidence = trial.distances(trial.exact()).T
    assert pose.max() < 0.04
    assert cells.max() < 0.02
    assert np.abs(evidence).max() < 0.05


@pytest.mark.parametrize("bias_deg", [0.0, SIGMA_DEG])
def test_the_error_falls_as_one_over_the_root_of_the_number_of_particles(bias_deg):
    exact = Trial(1, start=KNOWN, bias_deg=bias_deg).exact(BIASES[bias_deg])
    counts, errors = np.array([30, 120, 480, 1920]), []
    for count in counts:
        last = [
            Trial(int(count), start=KNOWN, seed=seed, candidates=2, bias_deg=bias_deg).beliefs[-1] for seed in range(25)
        ]
        pose = [belief.lagged_joint_angles[0] - exact[-1].angles @ exact[-1].pose for belief in last]
        evidence = [belief.log_evidence - exact[-1].log_evidence for belief in last]
        errors.append([np.sqrt(np.mean(np.square(pose))), np.sqrt(np.mean(np.square(evidence)))])
    slopes = [np.polyfit(np.log(counts), np.log(column), 1)[0] for column in np.transpose(errors)]
    assert all(-0.65 < slope < -0.35 for slope in slopes)
