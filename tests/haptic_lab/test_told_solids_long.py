"""What an observer of a recorded hand is told that the object may be, and what becomes of its pose and of the name: the
tables of docs/recordings.md about sets with and without the object.

    python -m pytest -m statistical -s tests/haptic_lab/test_told_solids_long.py

Each draw of the noise is seen by an observer that is told nothing of the object (`blind`), by one that believes the set
in full, and by one that doubts it, as the commands do. Recordings are those of people (kept beside the checkout), on
their own object or on another in its place; and hands that explored an object in the simulation, whose angles are
replayed as if a camera had seen them.
"""

from __future__ import annotations

from functools import cache
from pathlib import Path
from typing import NamedTuple

import numpy as np
import pytest
import trimesh
from scipy import stats

import agents
from haptic_env import hand_env, registration, shapes
from haptic_env.recordings import Recording
from haptic_env.recordings.recording import Track
from haptic_lab import recorded, replay
from haptic_lab.exploration.run import begin
from haptic_lab.exploration.settings import DEFAULTS, ExplorationSettings
from haptic_lab.trial import Trial
from observer import HapticSLAM, ShapePosterior, metrics

SHARED = Path(__file__).resolve().parents[3] / "shared"
PEOPLE = {"cube": "cubemedium", "sphere": "spheremedium", "cylinder": "cylinderlarge"}
SIGMA = 3.0  # degrees
SEEDS = range(77410, 77422)  # nothing was tuned on them
FOUR = ("cube", "sphere", "pyramid", "cylinder")
OTHERS = ("airplane", "mug", "hammer")
BODIES = ("elephant", "ring", "piggybank")  # as a duck, a torus and a rabbit are: of one size, none of the four
RING = 0.033, 0.014  # m, radii of the torus
SECONDS = 2.0  # of an exploration in the simulation


class Case(NamedTuple):
    """A recording (of a person, or "explored"), the object that is in it, and what it may be."""

    hand: str
    object: str
    among: tuple[str, ...] | None


RIGHT = [Case(each, each, None) for each in PEOPLE]
WRONG = [
    Case("cube", "cube", ("sphere", "pyramid", "cylinder")),
    Case("cylinder", "cylinder", ("sphere", "pyramid", "cube")),
    Case("cylinder", "cylinder", OTHERS),
    Case("sphere", "sphere", ("cube", "pyramid")),
    Case("cube", "teapot", FOUR),
    Case("cylinder", "elephant", FOUR),
    Case("sphere", "mug", FOUR),
    Case("cube", "cube", OTHERS),
]
MESHES = [
    Case(hand, body, among)
    for hands in (PEOPLE, ("explored",) * 3)
    for hand, body in zip(hands, BODIES, strict=True)
    for among in (BODIES, FOUR)
]


class Draw(NamedTuple):
    """Of one draw of the noise: lagged errors in σ of who is told nothing, told in full, and doubts; the name."""

    blind: float
    full: float
    doubted: float
    name: str
    sure: float


@pytest.fixture(scope="module")
def ring(tmp_path_factory: pytest.TempPathFactory) -> str:
    path = tmp_path_factory.mktemp("meshes") / "ring.stl"
    trimesh.creation.torus(*RING).export(path)
    return str(path)


def _path(name: str, ring: str) -> str:
    if name == "ring":
        return ring
    return str(SHARED / "objects" / f"{PEOPLE.get(name, name)}.stl")


@cache
def _explored(mesh: str, seed: int) -> Recording:
    """MyoHand explores a mesh that lies at its grasp centre; only where hand and object were is kept."""
    env = registration.make(
        "HapticSLAM/MyoHand-v0", shape=mesh, sigma_deg=SIGMA, episode_seconds=SECONDS, reveal_truth=True
    )
    policy, state = agents.make("sweep", env, seed), None
    observation, info = env.reset(seed=seed)
    angles, over = [info["truth"]["joint_angles"]], False
    while not over:
        torque, state = agents.act(policy, observation, state)
        observation, _, _, over, info = env.step(torque)
        angles.append(info["truth"]["joint_angles"])
    shape, truth, frames = shapes.find(mesh), info["truth"], len(angles)
    still = np.tile([1.0, 0.0, 0.0, 0.0], (frames, 1))
    place = np.tile(truth["object_position"] - shape.centre, (frames, 1))
    time = np.arange(frames) / hand_env(env).control_hz
    root, held = Track(np.zeros((frames, 3)), still), Track(place, still)
    return Recording("explored", time, hand_env(env).hand.joint_names, np.array(angles), root, "", held)


def _session(case: Case, ring: str, seed: int) -> replay.ExplorationSession:
    mesh = _path(case.object, ring)
    if case.hand == "explored":
        recording = _explored(mesh, seed)
    else:
        recording = recorded.load(str(SHARED / "recordings" / f"{PEOPLE[case.hand]}_inspect.npz"), None, None, None)
    among = None if case.among is None else [each if each in FOUR else _path(each, ring) for each in case.among]
    told = {"env": "HapticSLAM/MyoHand-v0", "shape": mesh, "sigma": SIGMA, "seed": seed, "candidates": among}
    more = {"seconds": None, "policy": "random_torque", "out": ""}
    return begin(ExplorationSettings(**(DEFAULTS | told | more)), recording)


def _draw(case: Case, ring: str, seed: int) -> Draw:
    session = _session(case, ring, seed)
    hand, told = session.hand, {**session.told, "control_hz": hand_env(session.env).control_hz}
    sure = ShapePosterior(hand, session.candidates, press=replay.FOLLOWED_NAMER["press"])
    observers = {
        "blind": HapticSLAM(hand, SIGMA, particles=1, **told),
        "full": HapticSLAM(hand, SIGMA, particles=1, **told, solids=sure),
        "doubted": HapticSLAM(hand, SIGMA, particles=1, **told, **session.informed),
    }
    trial = Trial(session.env, session.policy, observers, session.namer, seed, naming=("doubted",))
    trial.run()
    exploration, traces = trial.finish()
    errors = (
        metrics.pose_rmse_deg(each.lagged_joint_angles, exploration.true_angles) / SIGMA for each in traces.values()
    )
    name = traces["doubted"].name
    return Draw(*errors, Path(name).stem, float(traces["doubted"].posterior[-1].max()))


def _shown(values: np.ndarray) -> str:
    """Mean and 95 % interval (Student's t)."""
    half = stats.t.ppf(0.975, len(values) - 1) * values.std(ddof=1) / np.sqrt(len(values))
    return f"{values.mean():+.3f} ± {half:.3f}"


def _told_of(case: Case, ring: str) -> tuple[np.ndarray, list[str]]:
    """Errors (n, 3) of who is told nothing, in full, and doubts; and the names. Prints a row of the table."""
    draws = [_draw(case, ring, seed) for seed in SEEDS]
    errors, names = np.array([draw[:3] for draw in draws]), [draw.name for draw in draws]
    blind, full, doubted = errors.T
    print(
        f"{case.hand} | {case.object} | {', '.join(case.among or ('itself', 'the four'))} | {blind.mean():.3f} | "
        f"{full.mean():.3f} | {doubted.mean():.3f} | {_shown(doubted - blind)} | "
        + ", ".join(f"{each} {names.count(each)}" for each in sorted(set(names)))
        + f" of {len(names)}"
    )
    return errors, names


people = pytest.mark.skipif(not SHARED.exists(), reason="the recordings of people are not here")
long = [people, pytest.mark.statistical, pytest.mark.timeout(3600)]


@pytest.mark.parametrize("case", [pytest.param(case, marks=long) for case in RIGHT + MESHES])
def test_what_is_among_the_candidates_is_named_and_what_is_not_is_none(case: Case, ring: str) -> None:
    errors, names = _told_of(case, ring)
    blind, _, doubted = errors.T
    right = PEOPLE.get(case.object, case.object) if case.among is None or case.object in case.among else "none"
    assert names.count(right) >= 0.9 * len(names)
    assert doubted.mean() <= 1.03 * blind.mean()


@pytest.mark.parametrize("case", [pytest.param(case, marks=long) for case in WRONG])
def test_a_set_without_the_object_pulls_the_pose_little(case: Case, ring: str) -> None:
    errors, names = _told_of(case, ring)
    blind, full, doubted = errors.mean(axis=0)
    assert names.count("none") >= 0.5 * len(names)
    assert doubted < full
    assert doubted <= 1.1 * blind
