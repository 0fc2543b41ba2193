"""The state of an observer as plain arrays and JSON: kept in mid-trial, taken up again to the same bits.

What a trial changes is listed in `CHANGED`, class by class; all else an observer makes of its hand and keywords anew.
Nothing is pickled. Shapes: N particles, J joints, P patches, L links, B bodies, V voxels.
"""

from __future__ import annotations

import dataclasses
import json
from collections import deque
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from haptic_env import hands, reading, validate
from haptic_env.files import atomic, check_writable
from haptic_env.grid import Grid
from haptic_env.hand import Hand
from haptic_env.pose import Pose
from observer import edge, saved_checks, saved_solids
from observer.belief import Transition
from observer.configuration import Configured
from observer.contacts.contact_filter import ContactFilter
from observer.maps.contact_model import ContactModel
from observer.maps.forgetting import Forgetting
from observer.maps.hindsight import Hindsight, Moment
from observer.maps.occupancy import Maps
from observer.novelty import LinkHistory, MapNovelty
from observer.pose.contact_dynamics import ContactDynamics
from observer.pose.coupled_motion import CoupledKinematicPose
from observer.pose.delta_pose import DeltaPose
from observer.pose.filter_bank import FilterBank
from observer.pose.found_sigma import FoundSigma
from observer.pose.gating import Gate
from observer.pose.joint_pairs import JointPairs
from observer.pose.kalman import PoseFilter
from observer.pose.lagged_moments import LaggedMoments
from observer.pose.raw_angles import RawAngles
from observer.pose.smooth_motion import KinematicPose
from observer.shape.fading import FadingNames
from observer.shape.loose_fit import LooseFit
from observer.shape.misfit import Misfit
from observer.shape.names import NamePosterior
from observer.shape.null_model import NullModel
from observer.shape.pose_correction import PoseCorrection
from observer.shape.posterior import ShapePosterior
from observer.state import FilterState, Waiting
from observer.surface.touches import TouchingLink, TouchRecorder

FORMAT = 6  # of the files: another one wherever the state of a trial, or what is made of it, changes
GAUSSIAN = ("mean", "covariance", "log_evidence", "_gate")
CHANGED: dict[type, tuple[str, ...]] = {
    PoseFilter: (*GAUSSIAN, "_contacts", "doubted", "_finds", "_found"),
    DeltaPose: GAUSSIAN,
    **dict.fromkeys((KinematicPose, CoupledKinematicPose), (*GAUSSIAN, "_bank", "partners")),
    FilterBank: ("level", "moments"),
    RawAngles: ("mean", "covariance", "sigma", "_unfelt"),
    Gate: ("sigma", "set_aside", "_row", "_last"),
    FoundSigma: ("shape", "rate"),
    JointPairs: ("_advantage",),
    ContactFilter: ("_start", "_first", "_last", "_contacts", "_apart", "_touched"),
    FilterState: tuple(each.name for each in dataclasses.fields(FilterState)) + ("weights", "log_weights", "n_eff"),
    Maps: ("common", "slot", "_kept", "cells", "own", "touched", "solid", "seen", "stale", "_told", "_mean"),
    Hindsight: ("_swept", "_seen", "_touches", "_fresh", "empty"),
    MapNovelty: ("_said", "_news"),
    TouchRecorder: ("_links",),
    Forgetting: ("steps",),
    PoseCorrection: ("shape", "_before", "_against", "_missed", "_without", "_touching"),
    ShapePosterior: (
        *("_rng", "_units", "_log_evidence", "_poses", "_weights", "_likelihood", "said", "_misfit", "_news"),
        *("_null", "_moved", "_steps", "_passed", "_unfit", "_names"),
    ),
    Misfit: ("_recent", "_said"),
    NullModel: ("log_likelihood", "_felt", "_counts"),
    LooseFit: ("gained",),
    NamePosterior: ("_told", "_posterior", "_fading", "_forgetful"),
    FadingNames: ("_last", "_evidence"),
}
RECORDS: dict[str, Any] = {
    each.__name__: each for each in (Waiting, Pose, Moment, LinkHistory, LaggedMoments, Transition)
}
KEYWORDS: dict[str, Any] = {each.__name__: each for each in (Grid, ContactModel, ContactDynamics)}
HAND = ("joint_limits", "torque_limits", "rest_pose", "grasp_centre", "workspace")  # arrays that tell hands apart


def write(path: Path | str, made: Configured) -> None:
    """Write the state of an observer, whole or not at all.

    Args:
        path: of the file.
        made: the observer.

    Raises:
        ValueError: where it cannot be written, and for an observer that was told solids that lie any way.
    """
    place = validate.path("path", path)
    check_writable("path of a saved observer", place)
    if made._state is not None:
        made._state.hindsight.join()  # an hour's touches are some arrays, not thousands
        made._state.maps.catch_up()
    arrays: dict[str, NDArray[Any]] = {f"hand.{name}": getattr(made.hand, name) for name in HAND}
    arrays["hand.patches"] = made.hand.patches.position
    known = None if made._state is None else made._known  # which a trial begins
    told = {
        "format": FORMAT,
        "hand": {"name": made.hand.name, "joints": made.hand.joint_names, "patches": made.hand.patches.names},
        "keywords": {name: _keyword(value) for name, value in made._told.items() if name != "solids"},
        "pose": _packed("pose", made.pose, arrays),
        "reports": _packed("reports", made._reports, arrays),
        "state": _packed("state", made._state, arrays),
        "solids": None if made._known is None else saved_solids.tell(made._known, arrays),
        "known": _packed("known", known, arrays),
    }
    with atomic(place) as unfinished, unfinished.open("wb") as file:
        np.savez_compressed(file, **arrays, observer=np.array(json.dumps(told)))  # type: ignore[arg-type]


def read(path: Path | str, hand: Hand | None, kind: type[Configured], solids: ShapePosterior | None = None) -> Any:
    """Read the state of an observer.

    Args:
        path: of the file.
        hand: whose it is; None: the hand of the registry that it names.
        kind: of the observer that is made.
        solids: that it was told; None: none.

    Returns:
        The observer, which goes on where the one that was saved was.

    Raises:
        ValueError: for a file that is none, or cut short, of another hand, other solids or another format.
        OSError: where it cannot be read.
    """
    place = validate.path("path", path)
    content = reading.npz(place)
    try:
        told = _table(content)
        made: Any = kind.__new__(kind)
        mine = _hand(told["hand"], content, hand)
        # Not by a bracket's own constructor: what that changes was saved changed.
        saved_solids.check(told["solids"], content, solids)
        Configured.__init__(made, mine, **_keywords(told["keywords"]), solids=solids)
        if told["state"] is not None:
            made.reset(seed=0)
        known = None if made._state is None else made._known
        parts = {"pose": made.pose, "reports": made._reports, "state": made._state, "known": known}
        for name, whole in parts.items():
            if (whole is None) != (told[name] is None):
                raise ValueError(f"its {name} does not fit its keywords")
            if whole is not None:
                _unpacked(told[name], whole, content)
        saved_checks.check(made)
    except (KeyError, TypeError, AttributeError, IndexError, OverflowError, RecursionError) as error:
        raise ValueError(f"{place}: not the whole state of an observer ({type(error).__name__}: {error})") from error
    except ValueError as error:
        told_of = str(error)
        raise ValueError(told_of if told_of.startswith(str(place)) else f"{place}: {told_of}") from error
    return made


def _table(content: Mapping[str, NDArray[Any]]) -> dict[str, Any]:
    """What the file tells beside its arrays."""
    if "observer" not in content or content["observer"].dtype.kind != "U" or content["observer"].ndim:
        raise ValueError("not a saved observer, as HapticSLAM.save writes it")
    told = json.loads(str(content["observer"]))
    if not isinstance(told, dict) or told.get("format") != FORMAT:
        got = told.get("format") if isinstance(told, dict) else None
        raise ValueError(f"saved in format {validate.shown(got)}; this version reads format {FORMAT}")
    return told


def _hand(told: Mapping[str, Any], content: Mapping[str, NDArray[Any]], given: Hand | None) -> Hand:
    """The hand that a file is of; `ValueError` where it is not the one that is `given`."""
    name = told["name"]
    if given is None and name not in hands.HANDS:
        raise ValueError(f"saved of hand {validate.shown(name)}, which is not in the registry: give it, hand=...")
    hand = hands.make(name) if given is None else given
    edge.world(hand=hand)
    same = told["joints"] == list(hand.joint_names) and told["patches"] == list(hand.patches.names)
    mine = {f"hand.{each}": getattr(hand, each) for each in HAND} | {"hand.patches": hand.patches.position}
    if not same or not all(
        content[each].shape == array.shape and np.allclose(content[each], array) for each, array in mine.items()
    ):
        raise ValueError(
            f"saved of another hand, {validate.shown(name)} with {len(told['joints'])} joints and "
            f"{len(told['patches'])} patches, than {hand.name!r} with {hand.joints} and {len(hand.patches)}; give the "
            "one that it was saved of, hand=..."
        )
    return hand


def _keyword(value: Any) -> Any:
    """A keyword of the constructor, in JSON's words."""
    kind = type(value).__name__
    if kind in KEYWORDS:
        fields = {each.name: _keyword(getattr(value, each.name)) for each in dataclasses.fields(value)}
        return {"kind": kind, "fields": fields}
    if isinstance(value, np.ndarray | np.generic):
        return value.tolist()
    if isinstance(value, list | tuple):
        return [_keyword(each) for each in value]
    return value


def _keywords(told: Mapping[str, Any]) -> dict[str, Any]:
    def given(value: Any) -> Any:
        if isinstance(value, dict):
            return KEYWORDS[value["kind"]](**{name: given(each) for name, each in value["fields"].items()})
        return value

    return {name: given(value) for name, value in told.items()}


def _packed(name: str, value: Any, arrays: dict[str, NDArray[Any]]) -> Any:
    """`value` in JSON's words; its arrays go to `arrays`, under names that begin with `name`."""
    if isinstance(value, np.generic):
        value = value.item()
    if value is None or isinstance(value, bool | int | float | str):
        return value
    if isinstance(value, np.ndarray):
        arrays[name] = value
        return {"array": name}
    if isinstance(value, np.random.Generator):
        return {"generator": value.bit_generator.state}
    if type(value) in CHANGED:
        of = {each: _packed(f"{name}.{each}", getattr(value, each), arrays) for each in CHANGED[type(value)]}
        return {"changed": of}
    if isinstance(value, list) and value and isinstance(value[0], TouchingLink):
        return {"links": [_packed(f"{name}.{n}", each, arrays) for n, each in _columns(value).items()]}
    if type(value).__name__ in RECORDS:
        return {
            "record": type(value).__name__,
            "of": {each: _packed(f"{name}.{each}", getattr(value, each), arrays) for each in value._fields},
        }
    assert isinstance(value, list | tuple | deque), f"{name} is a {type(value).__name__}, which is not kept"
    return {type(value).__name__: [_packed(f"{name}.{i}", each, arrays) for i, each in enumerate(value)]}


def _columns(links: list[TouchingLink]) -> dict[str, NDArray[Any]]:
    """Thousands of touches in a few arrays."""
    return {
        "count": np.array([len(each.patches) for each in links]),
        "patches": np.concatenate([each.patches for each in links]),
        **{name: np.stack([getattr(each, name) for each in links]) for name in TouchingLink._fields[1:]},
    }


def _unpacked(told: Any, fresh: Any, content: Mapping[str, NDArray[Any]]) -> Any:
    """What `told` tells, of which objects are brought up to date in place of those of the `fresh` observer."""
    nothing: tuple[str, Any] = ("", told)
    kind, value = next(iter(told.items()), nothing) if isinstance(told, dict) else nothing
    if (type(fresh) in CHANGED) != (kind == "changed") and not (type(fresh) is FoundSigma and told is None):
        raise ValueError(f"where a {type(fresh).__name__} is to be it tells {validate.shown(value)}")
    if not isinstance(told, dict):
        return told
    if kind == "array":
        return content[value]
    if kind == "generator":
        fresh.bit_generator.state = value
        return fresh
    if kind == "changed":
        if set(value) != set(CHANGED[type(fresh)]):
            raise ValueError(f"it is not the state of a {type(fresh).__name__}")
        for name in CHANGED[type(fresh)]:
            setattr(fresh, name, _unpacked(value[name], getattr(fresh, name), content))
        if isinstance(fresh, Maps):
            saved_checks.maps(fresh)
            fresh.cells = fresh._kept[: len(fresh.cells)]
            fresh.arrays = fresh._arrays()
        if isinstance(fresh, ShapePosterior):
            saved_solids.check_state(fresh)
            fresh._solids = fresh.variants.place(fresh._units)
        return fresh
    if kind == "links":
        count, patches, *rest = (_unpacked(each, None, content) for each in value)
        if count.min() < 0 or count.sum() != len(patches):
            raise ValueError(f"it has {len(patches)} patches that touched, and says {count.sum()}")
        split = np.split(patches, np.cumsum(count)[:-1])
        return [TouchingLink(mine, *of) for mine, *of in zip(split, *rest, strict=True)]
    if kind == "record":
        record = RECORDS[value]
        return record(**{name: _unpacked(each, None, content) for name, each in told["of"].items()})
    every = [_unpacked(each, None, content) for each in value]
    if kind == "deque":
        return deque(every, maxlen=getattr(fresh, "maxlen", None))
    return {"list": list, "tuple": tuple}[kind](every)
