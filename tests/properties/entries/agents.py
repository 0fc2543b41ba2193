"""Policies and wrappers. J joints, P patches."""

from __future__ import annotations

import inspect
from functools import lru_cache, partial
from typing import Any

import gymnasium as gym
import numpy as np
from hypothesis import strategies as st

import agents
from agents.few_joints import FewJoints
from agents.hold_action import HoldAction
from agents.sb3 import SHIPPED, Sb3, asks_of
from agents.synergy import posture_basis
from observer import (
    BeliefFeatures,
    BeliefObservation,
    DecideWhenSure,
    DecisionReward,
    InformationGainReward,
    ObserverWrapper,
    ShapePosterior,
)
from observer.wrappers.belief_observation import ENTRIES as BELIEF_ENTRIES
from tests.properties import samples
from tests.properties.entry import Entry
from tests.properties.files import Content, archives, file, spoilt
from tests.properties.parameters import (
    Parameter,
    array,
    binary,
    integer,
    name,
    number,
    one_of,
    one_of_these,
    seed,
    several,
    switch,
)
from tests.properties.rule import Allowed
from tests.properties.strategies import odd_names, odd_numbers

J, P = samples.JOINTS, samples.PATCHES


@lru_cache(maxsize=1)
def observed() -> gym.Env:
    """An environment whose observer also names the object."""
    return ObserverWrapper(samples.environment(reveal_truth=True), samples.slam(), samples.namer())


@lru_cache(maxsize=1)
def _named_as_shipped() -> gym.Env:
    """An environment whose observer names what the model that ships does."""
    return ObserverWrapper(samples.environment(reveal_truth=True), samples.slam(), ShapePosterior(samples.hand()))


@lru_cache(maxsize=16)
def _policy(kind: str) -> Any:
    observed().reset(seed=0)
    return agents.make(kind, observed(), seed=0)


def _predict(kind: str, **call: Any) -> Any:
    """Then goes on as if nothing had been asked."""
    policy = _policy(kind)
    seen, _ = observed().reset(seed=0)
    try:
        return policy.predict(**{"observation": seen, **call})[0]
    finally:
        action, state = policy.predict(seen)
        action, _ = policy.predict(seen, state)
        assert np.isfinite(action).all()
        assert (np.abs(action) <= 1.0).all()


def _made(kind: str, **call: Any) -> Any:
    seen, _ = observed().reset(seed=0)
    policy = agents.make(kind, observed(), **call)
    action, state = agents.act(policy, seen)
    return action, agents.act(policy, seen, state)[0]


def _observation() -> Parameter:
    def build(angles: Any, contacts: Any) -> dict[str, Any]:
        return {"joint_angles": angles, "contacts": contacts}

    angles, contacts = array((J,), -0.2, 1.0), binary((P,))
    strange = st.sampled_from([{}, {"joint_angles": np.zeros(J)}, {"contacts": np.zeros(P)}, [], np.zeros(J)])
    return Parameter(
        st.builds(build, angles.valid, contacts.valid),
        st.builds(build, angles.odd, contacts.odd)
        | st.builds(build, angles.odd, contacts.valid)
        | strange
        | odd_numbers,
    )


STATES = st.sampled_from([(), (None,), (np.zeros(3),), ("x",), [], 3, (np.array(-1),), (np.full(J, np.nan),), {}])
PREDICT = {
    "observation": _observation(),
    "state": Parameter(st.none(), STATES | odd_numbers),
    "episode_start": Parameter(one_of(None, True, lambda: np.array([False])).valid, odd_numbers | array((1,)).odd),
    "deterministic": Parameter(st.booleans(), odd_numbers),
}
TRAINED = SHIPPED.read_bytes()
with np.load(SHIPPED) as _kept:
    ARRAYS = {name: _kept[name] for name in _kept.files}
DESCRIPTION = ARRAYS["description"].item()


def _described(text: bytes) -> Content:
    """The shipped model with another description."""
    return Content(
        ".npz", samples.npz({**ARRAYS, "description": np.array(text.decode(errors="replace").replace("\0", " "))})
    )


# No zip is ever opened here: what is damaged in a pickle may run anything.
MODEL = file(
    ".npz",
    TRAINED,
    also=archives(ARRAYS) | spoilt(".npz", DESCRIPTION.encode()).map(lambda content: _described(content.data)),
)
KEYWORDS: dict[str, Parameter] = {
    "sd": number(0.1, 3.0),
    "seconds": number(0.05, 2.0),
    "grip": number(0.01, 1.0),
    "objective": name(["class", "map"]),
    "candidates": integer(1, 6),
    "horizon": number(0.1, 1.0),
    "threads": one_of(None, 1),
    "synergies": integer(1, 4),
    "flexion": number(-1.0, 1.0),
    "recordings": file(".npy", samples.npy()),
    "path": MODEL,
    "normalize": one_of(None),
    "trust": switch(),
    "no_such_keyword": one_of(1),
}
POLICY = Allowed(words=("policy", "observation", "state", "episode_start", "model", "recordings"), files=False)


def _keywords_of(policy: Any) -> dict[str, Parameter]:
    return {key: KEYWORDS[key] for key in (*inspect.signature(policy).parameters, "no_such_keyword") if key in KEYWORDS}


def _wrapped(wrapper: Any, actions: Any = None, **call: Any) -> Any:
    env = wrapper(observed(), **call)
    seen = [env.reset(seed=0)]
    for action in [np.zeros(J)] if actions is None else actions if isinstance(actions, list) else [actions]:
        seen.append(env.step(action))
    return seen


def _observing(**call: Any) -> Any:
    env = ObserverWrapper(**{"env": samples.environment(), "observer": samples.slam(), **call})
    return env.reset(seed=0), env.step(np.zeros(J))


def _features(**call: Any) -> Any:
    usual = {"labels": samples.namer().labels, "seconds": 0.5, "control_hz": 50.0}
    made = BeliefFeatures(samples.hand(), **{**usual, **call})
    _, info = observed().reset(seed=0)
    return made.vector(info["belief"], np.zeros(P), info["posterior"], 0)


def _vector(**call: Any) -> Any:
    _, info = observed().reset(seed=0)
    usual = {"contacts": np.zeros(P), "posterior": info["posterior"], "steps": 0}
    given = {**usual, **call}
    made = BeliefFeatures(samples.hand(), samples.namer().labels, 0.5, 50.0)
    return made.vector(info["belief"], given["contacts"], given["posterior"], given["steps"])


ACTIONS = several(array((J,)))
SHOWN = several(name(BELIEF_ENTRIES), 1, 4)
WRAPPERS: dict[str, tuple[Any, dict[str, Parameter]]] = {
    "observer.BeliefObservation": (BeliefObservation, {"entries": SHOWN}),
    "observer.DecideWhenSure": (DecideWhenSure, {"threshold": number(0.0, 1.0), "seconds": number(0.0, 1.0)}),
    "observer.DecisionReward": (DecisionReward, {"price": number(0.0, 1.0), "least": number(0.001, 0.1)}),
    "observer.InformationGainReward": (InformationGainReward, {"objective": name(["class", "map"])}),
    "agents.hold_action.HoldAction": (HoldAction, {"steps": integer(1, 3)}),
}
OTHERS = odd_numbers | odd_names


class Commands:
    """A policy of somebody's own, who commands whatever it is made of."""

    def __init__(self, action: Any) -> None:
        self.action, self.joints, self.name = action, J, "mine"

    def predict(self, *_: Any) -> Any:
        return self.action, None


ENTRIES: dict[str, Entry] = {
    "agents.act": Entry(
        lambda action: agents.act(Commands(action), {})[0],  # type: ignore[arg-type]
        {"action": array((J,)).always},
        Allowed(words=("policy",)),
    ),
    "agents.act[of no policy]": Entry(
        lambda policy: agents.act(policy, {}), {"policy": Parameter(OTHERS, OTHERS, needed=True)}, weight=0.3
    ),
    "agents.few_joints.FewJoints": Entry(
        lambda joints: FewJoints(agents.make("random_torque", observed(), seed=1), joints).driven,
        {"joints": Parameter(st.just([1, 5]), st.lists(odd_numbers | odd_names, max_size=2)).always},
        POLICY,
    ),
    "agents.synergy.posture_basis": Entry(
        lambda path: posture_basis(samples.hand(), path),
        {
            "path": Parameter(
                file(".npy", samples.npy()).valid,
                file(".npy", samples.npy()).odd | file(".csv", samples.csv()).odd,
                True,
            )
        },
        POLICY,
        weight=2,
    ),
    **{
        f"agents.POLICIES[{kind}].predict": Entry(partial(_predict, kind), PREDICT, POLICY, weight=1)
        for kind in agents.POLICIES
    },
    **{
        f"agents.POLICIES[{kind}]": Entry(
            partial(_made, kind), {**_keywords_of(policy), "seed": seed()}, POLICY, weight=0.3
        )
        for kind, policy in agents.POLICIES.items()
    },
    "agents.load_model": Entry(
        lambda path: agents.load_model(path).told,  # type: ignore[arg-type]
        {"path": MODEL.always},
        POLICY,
        weight=2,
    ),
    "agents.is_model": Entry(lambda name: agents.is_model(name), {"name": Parameter(OTHERS, OTHERS, needed=True)}),
    "agents.export": Entry(
        lambda model, path: agents.export(model, path),
        {"model": Parameter(OTHERS, OTHERS, needed=True), "path": one_of("a.npz").always},
        POLICY,
        weight=0.3,
    ),
    "agents.ablate": Entry(
        lambda entries, path, episodes: agents.ablate(_named_as_shipped(), SHIPPED, path, entries, episodes=episodes),
        {
            "entries": several(name(["names", "rhythm"]), 1, 2).always,
            "path": one_of("a.npz").always,
            "episodes": one_of_these(0, 1, -1, 1001, 1.5, "one"),  # of hundreds, which it takes, each is explored
        },
        Allowed(words=("entry", "entries", "path", "to must")),
        weight=0.3,
    ),
    "agents.make": Entry(lambda name: _made(name), {"name": name(agents.POLICIES).always}, POLICY),
    "agents.find": Entry(lambda name: agents.find(name).guided, {"name": name(agents.POLICIES).always}, POLICY),
    "agents.sb3.asks_of": Entry(asks_of, {"path": MODEL.always}, POLICY),
    "agents.sb3.Sb3": Entry(
        lambda path: Sb3(observed(), path=path).predict(observed().reset(seed=0)[0])[0],
        {"path": MODEL.always},
        POLICY,
        weight=4,
    ),
    **{
        f"{kind}": Entry(partial(_wrapped, wrapper), keywords, Allowed(words=("entry",)), weight=0.5)
        for kind, (wrapper, keywords) in WRAPPERS.items()
    },
    **{
        f"{kind}.step": Entry(
            partial(_wrapped, wrapper), {"actions": ACTIONS.always}, Allowed(words=("action",)), weight=0.5
        )
        for kind, (wrapper, _) in WRAPPERS.items()
    },
    "observer.ObserverWrapper": Entry(
        _observing,
        {
            "observer": Parameter(st.just(samples.slam()), OTHERS),
            "shape": Parameter(st.none(), OTHERS),
            "classifier": Parameter(st.none() | st.just(samples.map_classifier()), OTHERS),
            "classify_every": integer(1, 20),
        },
        Allowed(words=("observer", "shape", "classifier")),
        weight=0.5,
    ),
    "observer.ObserverWrapper.step": Entry(
        partial(_wrapped, lambda env: env), {"actions": ACTIONS.always}, Allowed(words=("action",))
    ),
    "observer.BeliefFeatures": Entry(
        _features,
        {
            "entries": SHOWN,
            "seconds": number(0.1, 10.0),
            "control_hz": number(10.0, 100.0),
            "labels": several(name(["a", "b"]), 2, 2),
        },
        Allowed(words=("entry", "entries", "label")),
    ),
    "observer.BeliefFeatures.vector": Entry(
        _vector,
        {"contacts": binary((P,)), "posterior": array((2,), 0.0, 1.0), "steps": integer(0, 20)},
    ),
}
