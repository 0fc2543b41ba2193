"""Recorded hands whose felt angles are off by a constant: what is reached, and what contacts could tell at most.

    python -m pytest -m statistical -s tests/haptic_lab/test_recorded_offsets_long.py

Shapes: J joints, L links, T frames, I items: a link at a frame, near the object.

Recordings have no torques, so that nothing but contacts says where a hand is. The bound is of who knows the object and
follows the felt path to `PATH` degrees, anew at each frame: each link at each frame tells whether its skin is outside
the object, as exactly as that path and a millimetre allow. Gaps are linear in the angles about the truth; the posterior
of the offsets, given a truth drawn beforehand, is sampled by Hamiltonian Monte Carlo (Neal 2011, Handbook of MCMC,
chapter 5).
"""

from __future__ import annotations

from pathlib import Path
from typing import Any, NamedTuple

import numba
import numpy as np
import pytest
from scipy.special import log_ndtr, ndtr

from haptic_env.arrays import Array
from haptic_lab import recorded, replay
from haptic_lab.exploration.run import begin
from haptic_lab.exploration.settings import DEFAULTS, ExplorationSettings
from haptic_lab.trial import Trial
from observer import HapticSLAM, ShapePosterior, metrics
from observer.brackets import DeadReckoning, TruePose
from observer.jacobians import point_jacobian
from observer.kinematics import body_frames, placed, tree_of
from observer.shape.skin import skin_of
from observer.shape.surface_conditioning import nearest

SHARED = Path(__file__).resolve().parents[3] / "shared"
RECORDINGS = {"cube": "cubemedium", "sphere": "spheremedium", "cylinder": "cylinderlarge"}
SIGMA, BIAS = 1.0, 3.0  # degrees
SEEDS = range(66320, 66336)  # nothing was tuned on them
PATH = 0.55  # degrees: SD of the felt path without its offset, as smooth motion has it at σ = 1°
SKIN = 0.001  # m
SURPRISE = 1e-4
NEAR = 0.5  # m
LAG = 10  # frames
DRAWS, SAMPLES, LEAPS = 2, 800, 8
KNOWN_AT = (10, 30, 50, 70, 90, 100)  # frames
people = pytest.mark.skipif(not SHARED.exists(), reason="the shared recordings are not here")
statistical = pytest.mark.statistical


def _session(label: str, bias_deg: float, seed: int) -> replay.ExplorationSession:
    recording = recorded.load(str(SHARED / "recordings" / f"{RECORDINGS[label]}_inspect.npz"), None, None, None)
    told = {
        "env": recorded.environment_of(recording),
        "shape": str(SHARED / "objects" / f"{RECORDINGS[label]}.stl"),
        "sigma": SIGMA,
        "bias_deg": bias_deg,
        "seed": seed,
        "seconds": None,
        "policy": "random_torque",
        "out": "",
    }
    return begin(ExplorationSettings(**(DEFAULTS | told)), recording)


def _explore(label: str, seed: int) -> dict[str, tuple[float, float, bool, bool]]:
    """Of each observer the lagged error in degrees, the share in the 90 % interval, whether it named the object, and
    whether it was wrong and surer than 0.95."""
    session = _session(label, BIAS, seed)
    hand, told = session.hand, {**session.told, "control_hz": 50.0}
    believed = {"sigma_deg": SIGMA, "bias_deg": BIAS, "particles": 1, **told}
    observers = {
        "floor": DeadReckoning(hand, SIGMA, bias_deg=BIAS, **told),
        "white": HapticSLAM(hand, SIGMA, particles=1, **told),
        "blind": HapticSLAM(hand, **believed),
        "haptic_slam": HapticSLAM(hand, **believed, **session.informed),
        "ceiling": TruePose(hand, **told),
    }
    trial = Trial(session.env, session.policy, observers, session.namer, seed)
    trial.run()
    exploration, traces = trial.finish()
    truth, lines = exploration.true_angles, {}
    for name, trace in traces.items():
        right = trace.name == label
        lines[name] = (
            metrics.pose_rmse_deg(trace.lagged_joint_angles, truth),
            metrics.credible_coverage(trace.lagged_joint_angles, trace.lagged_joint_std, truth),
            right,
            not right and trace.posterior[-1].max() > 0.95,
        )
    return lines


@people
@statistical
@pytest.mark.timeout(7200)
@pytest.mark.parametrize("label", RECORDINGS)
def test_recorded_hands_with_offsets(label: str) -> None:
    explorations = [_explore(label, seed) for seed in SEEDS]
    table = {name: np.array([each[name] for each in explorations], dtype=float).T for name in explorations[0]}
    floor = table["floor"][0]
    for name, (error, coverage, named, misled) in table.items():
        share = error / floor
        spread = 1.96 * share.std(ddof=1) / np.sqrt(len(share))
        print(
            f"{label} | {name} | lagged error {error.mean():.2f} | in the floor's {share.mean():.3f} ± {spread:.3f} | "
            f"in the 90 % interval {coverage.mean():.3f} | named {int(named.sum())} of {len(named)}, "
            f"{int(misled.sum())} sure and wrong"
        )
    assert table["haptic_slam"][0].mean() < floor.mean()
    assert table["haptic_slam"][2].mean() >= 0.8


class Said(NamedTuple):
    """What contacts say of the offsets: `side` · (`gap` + `row` · change of the angles) is above 0, to `spread`.

    `frame`, `side` (1 outside, -1 inside), `gap` m and `spread` m are (I,), `row` (I, J) m/rad.
    """

    frame: Array
    side: Array
    gap: Array
    row: Array
    spread: Array

    def until(self, frame: int) -> Said:
        """What was said before a frame."""
        return Said(*(each[self.frame < frame] for each in self))


@numba.njit
def _gaps(tree: Any, skin: Any, solids: Any, angles: Array, gap: Array, row: Array) -> None:
    """Fill in how far each link's skin is from the object, (L,) m, and how that changes with the angles, (L, J)."""
    joints, bodies = len(tree.zero), len(tree.parent)
    position, rotation = np.empty((bodies, 3)), np.empty((bodies, 3, 3))
    jacobian, spot, normal = np.empty((3, joints)), np.empty(3), np.empty(3)
    body_frames(tree, angles, position, rotation)
    for link in range(len(skin.body)):
        body = skin.body[link]
        gap[link] = nearest(solids, 0, skin, link, (position[body], rotation[body]), spot, normal)
        if gap[link] < solids.far * solids.scale[0]:
            point_jacobian(tree, angles, position, rotation, body, spot, jacobian)
            row[link] = normal @ jacobian
        else:
            gap[link] = np.inf


def _said(label: str) -> Said:
    """What the contacts of a recording say, linearised at the true path."""
    session = _session(label, 0.0, 0)
    env, hand = session.env.unwrapped, session.hand
    env.reset(seed=0)
    surface = ShapePosterior(hand, {label: [env.solid]})
    surface.reset(0)
    solids, tree, skin = surface.hypotheses.solids, tree_of(hand), skin_of(hand)
    of_link = np.arange(len(hand.links))[:, None] == hand.patches.link
    frames, over = [], False
    while not over:
        _, _, _, over, info = env.step(np.zeros(hand.joints, dtype=np.float32))
        gap, row = np.empty(len(hand.links)), np.zeros((len(hand.links), hand.joints))
        _gaps(placed(tree, info["root"]), skin, solids, info["truth"]["joint_angles"], gap, row)
        frames.append((gap, row, of_link[:, env.touched].any(axis=1)))
    gaps, rows, touches = map(np.array, zip(*frames, strict=True))
    near = gaps < NEAR
    spread = np.sqrt(SKIN**2 + (rows[near] ** 2).sum(axis=1) * np.deg2rad(PATH) ** 2)
    return Said(1 + np.nonzero(near)[0], np.where(touches[near], -1.0, 1.0), gaps[near], rows[near], spread)


def _posterior(said: Said, bias: Array, rng: np.random.Generator) -> tuple[Array, Array]:
    """Mean and variance (J,) of what the offsets are believed to be above their true values `bias`, rad and rad²."""
    prior = np.deg2rad(BIAS) ** -2
    outside = said.gap / said.spread
    density = -0.5 * outside**2 - 0.5 * np.log(2.0 * np.pi)
    information = np.exp(2.0 * density - log_ndtr(outside) - log_ndtr(-outside)) / said.spread**2
    precision = prior * np.eye(len(bias)) + (said.row * information[:, None]).T @ said.row
    to_joints = np.linalg.cholesky(np.linalg.inv(precision))
    slopes, start = (said.side / said.spread)[:, None] * said.row, said.side * outside

    def log_density(place: Array) -> tuple[float, Array]:
        change = to_joints @ place  # of the angles; the offsets change the other way
        at = start + slopes @ change
        likelihood = np.log(SURPRISE + (1.0 - SURPRISE) * ndtr(at))
        pull = (1.0 - SURPRISE) * np.exp(-0.5 * at**2 - 0.5 * np.log(2.0 * np.pi) - likelihood)
        left = bias - change
        gradient = to_joints.T @ (slopes.T @ pull + prior * left)
        return float(likelihood.sum() - 0.5 * prior * left @ left), gradient

    place, step, taken, kept = np.zeros(len(bias)), 0.25, 0, []
    value, slope = log_density(place)
    for turn in range(SAMPLES):
        momentum = rng.normal(size=len(bias))
        leap = step * rng.uniform(0.7, 1.3)
        there, height, uphill = place, value, slope
        energy = value - 0.5 * momentum @ momentum
        for _ in range(LEAPS):
            momentum = momentum + 0.5 * leap * uphill
            there = there + leap * momentum
            height, uphill = log_density(there)
            momentum = momentum + 0.5 * leap * uphill
        if np.log(rng.random()) < height - 0.5 * momentum @ momentum - energy:
            place, value, slope, taken = there, height, uphill, taken + 1
        if turn < SAMPLES // 4:
            step *= 1.03 if taken > 0.8 * (turn + 1) else 0.97
        else:
            kept.append(-to_joints @ place)
    return np.mean(kept, axis=0), np.var(kept, axis=0)


@people
@statistical
@pytest.mark.timeout(7200)
@pytest.mark.parametrize("label", RECORDINGS)
def test_what_contacts_of_a_recording_could_tell(label: str) -> None:
    said, rng = _said(label), np.random.default_rng(0)
    joints = said.row.shape[1]
    told = np.array(
        [
            [_posterior(said.until(frame), rng.normal(0.0, np.deg2rad(BIAS), joints), rng) for frame in KNOWN_AT]
            for _ in range(DRAWS)
        ]
    )
    error = np.rad2deg(np.sqrt(np.square(told[:, :, 0]).mean(axis=(0, 2))))
    sd = np.rad2deg(np.sqrt(told[:, :, 1].mean(axis=(0, 2))))
    print(f"{label} | offsets after {KNOWN_AT} frames | SD {sd.round(2)} | RMS error {error.round(2)}")
    known = np.minimum(np.arange(1, KNOWN_AT[-1]) + LAG, KNOWN_AT[-1])  # when the lagged pose of a frame is told
    variance = np.interp(known, (0, *KNOWN_AT), (BIAS**2, *sd**2))
    lagged, all_known = np.sqrt(variance.mean() + PATH**2), np.hypot(sd[-1], PATH)
    floor = np.hypot(SIGMA, BIAS)
    print(
        f"{label} | lagged error in the floor's, at best {lagged / floor:.3f}, all felt before {all_known / floor:.3f}"
    )
    assert all_known > 0.6 * floor
    assert 0.6 < error[-1] / sd[-1] < 1.4
