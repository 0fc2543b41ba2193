"""Observers of every name, their models, and the namers of objects. J joints, P patches, C labels."""

from __future__ import annotations

import tempfile
import warnings
from collections.abc import Mapping
from dataclasses import fields
from functools import lru_cache, partial
from typing import Any

import numpy as np
from hypothesis import strategies as st

import observer
from haptic_env import hands, reading
from haptic_env.grid import Grid
from haptic_env.hand import Hand
from haptic_env.pose import Pose
from observer import ContactDynamics, ContactModel, HapticSLAM, PoseOnly, ShapePosterior, variants
from observer.maps.matching import MATCHING
from observer.pose.motions import MOTIONS
from tests.properties import samples
from tests.properties.entry import Entry
from tests.properties.files import archives, file
from tests.properties.parameters import (
    Parameter,
    array,
    binary,
    given,
    integer,
    name,
    number,
    one_of,
    one_of_these,
    seed,
    spread,
    switch,
)
from tests.properties.rule import Allowed
from tests.properties.strategies import SEEDS, Strategy, odd_names, odd_numbers

J, P = samples.JOINTS, samples.PATCHES
TORQUE, ANGLES, CONTACTS = array((J,)), array((J,), -0.5, 1.5), binary((P,))
NAMES = (*variants.NAMES, "paper+no_scan_matching", "haptic_slam+no_lag+sampled_matching")
WEIGHTS = {"second_look": 0.1}  # which goes through each trial twice


def _root(position: Any, rotation: Any) -> Any:
    """What claims to be a pose, even where `Pose` refuses to be made of it."""
    try:
        return Pose(position, rotation)
    except ValueError:
        changed = Pose(np.zeros(3), np.eye(3))
        for part, numbers in zip(changed, (position, rotation), strict=True):
            try:
                with warnings.catch_warnings():
                    warnings.simplefilter("ignore")
                    part[...] = numbers
            except (ValueError, TypeError, OverflowError, RuntimeError):
                return (position, rotation)
        return changed


ROOT = Parameter(
    st.none() | st.builds(Pose, array((3,), -0.1, 0.1).valid, st.builds(lambda: np.eye(3))),
    st.builds(_root, array((3,)).odd, st.builds(lambda: np.eye(3)) | array((3, 3)).odd) | odd_numbers | odd_names,
)
STEP = {"torque": TORQUE.always, "joint_angles": ANGLES.always, "contacts": CONTACTS.always, "root": ROOT}
STEPS: Strategy = st.lists(given(STEP), min_size=1, max_size=5)
WILD = st.builds(lambda kind, seed: (kind, seed), st.sampled_from(["limits", "jumps", "all", "noise", "rest"]), SEEDS)


def _legal_but_wild(kind: str, seed: int, hand: Hand | None = None, most: int = 12) -> list[dict[str, Any]]:
    """Steps that the spaces of the environment allow."""
    hand = samples.hand() if hand is None else hand
    rng, steps, joints = np.random.default_rng(seed), [], hand.joints
    for _ in range(int(rng.integers(1, most))):
        angles = {
            "limits": hand.joint_limits[:, rng.integers(2)],
            "jumps": 12.566 * rng.choice([-1.0, 0.0, 1.0], joints),
            "all": np.full(joints, rng.uniform(-12.566, 12.566)),
            "noise": rng.uniform(-12.566, 12.566, joints),
            "rest": hand.rest_pose,
        }[kind]
        touches = rng.random(len(hand.patches)) < rng.choice([0.0, 0.1, 0.9, 1.0])
        steps.append({"torque": rng.choice([-1.0, 0.0, 1.0], joints), "joint_angles": angles, "contacts": touches})
    return steps


@lru_cache(maxsize=32)
def _observer(kind: str) -> Any:
    how: dict[str, Any] = {} if kind in variants.WITHOUT_MAP else {"grid": samples.grid()}
    return variants.make_observer(kind, samples.hand(), 3.0, 4, **how)


def prepare() -> None:
    """Compile what observers of any name need."""
    for kind in NAMES:
        _steps(kind, ("limits", 0))
    _made(HapticSLAM, solids=samples.namer(), particles=2)


def _explore(made: Any, steps: Any, **reset: Any) -> list[Any]:
    """A trial; a step that is refused changes nothing, so that the trial goes on."""
    beliefs = [made.reset(**{"seed": 0, **reset})]
    refused = None
    for step in steps:
        try:
            beliefs.append(made.step(**step))
        except (ValueError, TypeError) as error:
            refused = error
            break
    hand = made.hand
    beliefs.append(made.step(np.zeros(hand.joints), hand.rest_pose, np.zeros(len(hand.patches))))
    beliefs += made.flush()
    for belief in beliefs:
        numbers = belief.joint_angles, belief.joint_std, belief.occupancy
        if refused is not None and not all(np.isfinite(each).all() for each in numbers):
            raise AssertionError("the trial did not go on as it was after a step that was refused") from refused
    if refused is not None:
        raise refused
    return beliefs


def _steps(kind: str, steps: Any) -> list[Any]:
    return _explore(_observer(kind), _legal_but_wild(*steps) if isinstance(steps, tuple) else steps)


def _made(build: Any, **keywords: Any) -> list[Any]:
    """An observer is not done before it has observed something."""
    steps = _legal_but_wild("noise", 0)[:3]
    return _explore(build(samples.hand(), **keywords), steps)


def _long(steps: Any, hand: str = "two_finger", **keywords: Any) -> list[Any]:
    """What is legal for seconds, which no hand does."""
    known = _hand(hand)
    made = HapticSLAM(known, **{"particles": 3, "grid": samples.grid(), **keywords})
    return _explore(made, _legal_but_wild(*steps, hand=known, most=200))[-3:]


@lru_cache(maxsize=3)
def _hand(name: str) -> Hand:
    return hands.make(name)


def _posterior(**keywords: Any) -> list[Any]:
    namer = ShapePosterior(samples.hand(), **{"candidates": {"ball": [samples.solid()]}, "stride": 1, **keywords})
    beliefs = _explore(samples.slam(), _legal_but_wild("noise", 0)[:3])
    return [namer.reset(seed=0), *(namer.update(each) for each in beliefs), namer.log_likelihood, namer.posterior]


def _update(steps: Any) -> list[Any]:
    """Of whatever the observer has made of wild steps."""
    namer = samples.namer()
    namer.reset(seed=0)
    return [namer.update(each) for each in _explore(samples.slam(), _legal_but_wild(*steps))]


GRIDS = one_of(samples.grid, lambda: Grid.around((0.01, 0, 0), (0.03, 0.05, 0.02), 0.004))
ODD_GRIDS = st.builds(
    lambda far, resolution: lambda: Grid.around(far, (0.05,) * 3, resolution),
    st.sampled_from([(5.0, 5.0, 5.0), (90.0, 0.0, 0.0)]),
    st.sampled_from([0.001, 0.05, 0.5]),
).map(lambda make: make())
MODELS = one_of(ContactModel, lambda: ContactModel(prior=0.5, temper=1.0), lambda: ContactModel(free=0.0, edge=1e-9))
FELT: dict[str, Parameter] = {
    "sigma_deg": spread(90.0, samples.JOINTS),
    "bias_deg": spread(90.0, samples.JOINTS),
    "drift_deg": spread(90.0, samples.JOINTS),
    "drift_seconds": number(0.1, 10.0),
    "proportional": number(0.0, 1.0),
    "start_std_deg": number(0.0, 90.0),
    "contact_miss": number(0.0, 1.0),
    "contact_false_alarm": number(0.0, 1.0),
    "contact_confusion": number(0.0, 1.0),
    "patches_stuck": number(0.0, 0.5),
    "patches_dead": number(0.0, 0.5),
}
SLAM: dict[str, Parameter] = {
    **FELT,
    "particles": integer(1, 6),
    "motion": name(MOTIONS),
    "candidates": integer(1, 9),
    "matching": name(MATCHING),
    "lag": integer(0, 4),
    "motor_noise": number(0.0, 1.0),
    "control_hz": number(10.0, 100.0),
    "grid": Parameter(GRIDS.valid, ODD_GRIDS | odd_numbers | odd_names, needed=True),
    "contact_model": Parameter(MODELS.valid, odd_numbers | odd_names),
    "in_hindsight": switch(),
    "memory_seconds": number(0.1, 10.0),
    "dynamics": one_of(None, ContactDynamics, lambda: ContactDynamics(constrained=False)),
    "solids": one_of(None, samples.namer),
    "threads": one_of(None, 1),
    "no_such_keyword": one_of(1),
}
POSE_ONLY = {key: SLAM[key] for key in (*FELT, "motor_noise", "control_hz", "dynamics", "no_such_keyword")}
MODEL = {each.name: number(0.01, 0.9) for each in fields(ContactModel)}
DYNAMICS = {each.name: number(0.01, 20.0) for each in fields(ContactDynamics) if each.name != "constrained"}
POSTERIOR: dict[str, Parameter] = {
    "candidates": Parameter(
        one_of(lambda: {"ball": [samples.solid()]}, lambda: {"a": [samples.solid()] * 2, "b": [samples.solid()]}).valid,
        st.sampled_from(
            [
                {},
                {"a": []},
                {"a": None},
                {"a": 3},
                {"a": [3]},
                {"a": "cube"},
                {3: ["cube"]},
                {"none": [samples.solid()]},
            ]
        )
        | odd_numbers
        | odd_names,
    ),
    "size_jitter": number(0.0, 0.3),
    "yaw_jitter": number(0.0, 180.0),
    "position_jitter": number(0.0, 0.02),
    "variants": integer(1, 12),
    "none": number(0.0, 0.5),
    "samples": integer(1, 4),
    "tolerance": number(0.0005, 0.01),
    "press": number(0.0, 0.01),
    "memory_seconds": number(0.1, 10.0),
    "control_hz": number(10.0, 200.0),
    "surprise": number(0.0001, 0.5),
    "temper": number(0.01, 1.0),
    "stride": integer(1, 3),
    "no_such_keyword": one_of(1),
}
OBSERVER = Allowed(words=("observer", "solids", "candidate", "voxels", "memory", "none", "root"))
DRAWN: Mapping[str, Parameter] = {"steps": Parameter(STEPS | WILD, STEPS, needed=True)}
NAMED = Parameter(name(NAMES).valid, odd_names, needed=True)


def _explored() -> HapticSLAM:
    """An observer in mid-trial."""
    made = HapticSLAM(samples.hand(), particles=2, lag=1, grid=samples.grid())
    made.reset(seed=0)
    for step in _legal_but_wild("rest", 0)[:3]:
        made.step(**step)
    return made


@lru_cache(maxsize=1)
def _saved() -> Parameter:
    """Files of one that was saved."""
    with tempfile.TemporaryDirectory() as folder:
        _explored().save(f"{folder}/state.npz")
        arrays = dict(reading.npz(f"{folder}/state.npz"))
    return file(".npz", samples.npz(arrays), also=archives(arrays), there=True)


# Not before it is asked for: it takes an observer that has observed.
SAVED = Parameter(st.deferred(lambda: _saved().valid), st.deferred(lambda: _saved().odd), needed=True)
ENTRIES: dict[str, Entry] = {
    **{
        f"observer.variants[{kind}].step": Entry(
            partial(_steps, kind),
            DRAWN,
            Allowed(words=("torque", "joint_angles", "contacts", "root", "PoseOnly")),
            weight=WEIGHTS.get(kind, 1.0),
        )
        for kind in NAMES
    },
    "observer.HapticSLAM": Entry(partial(_made, HapticSLAM), SLAM, OBSERVER, weight=4),
    "observer.HapticSLAM.paper": Entry(partial(_made, HapticSLAM.paper), SLAM, OBSERVER),
    **{
        f"observer.HapticSLAM.step[{hand}]": Entry(
            partial(_long, hand=hand),
            {
                "steps": Parameter(WILD, WILD, needed=True),
                **{
                    key: Parameter(SLAM[key].valid, SLAM[key].valid)
                    for key in ("motion", "matching", "dynamics", "lag")
                },
                "sigma_deg": one_of_these(0.0, 1e-9, 1.0, 90.0, None),
                "bias_deg": one_of_these(0.0, 1e-9, 3.0, 90.0),
                "drift_deg": one_of_these(0.0, 0.0, 3.0, 90.0),
                "drift_seconds": one_of_these(1e-3, 10.0, 1e6),
                "proportional": one_of_these(0.0, 0.0, 1.0),
                "start_std_deg": one_of_these(0.0, 0.0, 10.0, 90.0),
                "motor_noise": one_of_these(0.0, 0.1, 1.0),
                "control_hz": one_of_these(1.0, 2.0, 50.0, 500.0),
            },
            OBSERVER,
            weight=0.2 if hand == "two_finger" else 0.02,
        )
        for hand in hands.HANDS
    },
    "observer.HapticSLAM.reset": Entry(
        lambda **call: _explore(samples.slam(), [], **call), {"seed": seed(), "joint_angles": ANGLES}, weight=2
    ),
    "observer.HapticSLAM.save": Entry(
        lambda path: _explored().save(path), {"path": file(".npz", b"").always}, Allowed(files=True)
    ),
    "observer.HapticSLAM.load": Entry(
        lambda path: HapticSLAM.load(path).map_now(),
        {"path": SAVED},
        Allowed(files=True, words=("input",)),
        weight=0.3,
    ),
    "observer.PoseOnly": Entry(partial(_made, PoseOnly), {**POSE_ONLY, "stride": integer(1, 4)}, OBSERVER),
    "observer.PoseOnly.reset": Entry(
        lambda **call: _explore(_observer("smoother_pose"), [], **call), {"seed": seed(), "joint_angles": ANGLES}
    ),
    **{
        f"observer.OBSERVERS[{kind}]": Entry(
            partial(_made, build),
            {
                key: SLAM[key]
                for key in ("sigma_deg", "control_hz", "grid", "motor_noise", "contact_model", "no_such_keyword")
            },
            OBSERVER,
            weight=WEIGHTS.get(kind, 1.0),
        )
        for kind, build in observer.OBSERVERS.items()
    },
    "observer.variants.make_observer": Entry(
        lambda **call: _explore(variants.make_observer(hand=samples.hand(), **call), []),
        {"name": NAMED, "sigma_deg": number(0.0, 90.0).always, "particles": integer(1, 6).always},
        OBSERVER,
    ),
    "observer.variants.check": Entry(lambda name: variants.check("name", name), {"name": NAMED}),
    "observer.warm_up": Entry(
        lambda hand, progress, **call: observer.warm_up(hand, progress, **call),
        {
            "hand": Parameter(odd_numbers, odd_numbers | odd_names, needed=True),
            "progress": one_of(None).always,
            "observer": one_of(None),
        },
        weight=0.3,
    ),
    "observer.ContactModel": Entry(
        lambda **call: _made(HapticSLAM, contact_model=ContactModel(**call), particles=3, grid=samples.grid(), lag=1),
        MODEL,
        weight=2,
    ),
    "observer.ContactModel.evidence": Entry(
        lambda resolution: ContactModel().evidence(resolution),
        {"resolution": number(0.001, 0.1).always},
        Allowed(infinite=True),
    ),
    "observer.ContactDynamics": Entry(
        lambda **call: _made(PoseOnly, dynamics=ContactDynamics(**call)), {**DYNAMICS, "constrained": switch()}
    ),
    "observer.ShapePosterior": Entry(_posterior, POSTERIOR, OBSERVER),
    "observer.ShapePosterior.update": Entry(_update, {"steps": Parameter(WILD, WILD, needed=True)}, weight=2),
    "observer.ShapePosterior.reset": Entry(lambda seed: samples.namer().reset(seed=seed), {"seed": seed()}),
    "observer.ShapePosterior.update[of no belief]": Entry(
        lambda belief: samples.namer().update(belief), {"belief": Parameter(odd_numbers, odd_numbers | odd_names, True)}
    ),
}
