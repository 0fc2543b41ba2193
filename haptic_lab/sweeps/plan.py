"""What a sweep is asked for, checked: `SweepPlan`."""

from __future__ import annotations

import argparse
import importlib.util
import itertools
import math
from collections.abc import Mapping
from dataclasses import dataclass, fields, replace
from functools import lru_cache
from typing import Any

import gymnasium as gym

import agents
from agents.sb3 import Sb3
from haptic_env import hand_env, hand_of, registration, shapes, validate
from haptic_env.extras import how_to_install
from haptic_env.shapes import triangles
from haptic_lab.conditions import CONTACTS, FACTORS, RECORDED, Condition, check_contacts, check_policy
from haptic_lab.exploration.learnt import refuse_varied
from haptic_lab.exploration.playing import refuse_exploring
from haptic_lab.possible import DOUBT
from haptic_lab.sweeps import replayed, trial_tables
from haptic_lab.sweeps.tasks import SweepSettings
from haptic_lab.trial import check_model
from haptic_lab.worlds import candidates_of, environment, expanded, named_or_set
from observer import ShapePosterior
from observer.variants import FULL

MOST_CONDITIONS = 10_000
HAND = "two_finger"  # that explores where nothing is said
FLAGS = {"among": "candidates"}  # of settings that are called otherwise there


@dataclass(frozen=True)
class SweepPlan:
    """What a command line asks for.

    Attributes:
        settings: what all trials share.
        conditions: under which objects are explored, in their order.
        trials: of each of the shapes, under each condition.
        out: folder for the results.
        jobs: processes of this machine.
        cluster: address of a dask scheduler, asked in place of these.
        ablation: whether the table compares variants of the observer.
        calibration: whether it is shown how sure observers are and may be.
        held: path of each recording, and its object.
        cells: what is explored under each condition, where a table of trials says it.
    """

    settings: SweepSettings
    conditions: tuple[Condition, ...]
    trials: int
    out: str
    jobs: int
    cluster: str | None
    ablation: bool
    calibration: bool
    held: tuple[tuple[str, str], ...] = ()
    cells: Mapping[Condition, tuple[str, ...]] | None = None

    def explored(self, condition: Condition) -> tuple[str, ...]:
        """List what is explored under a condition.

        Args:
            condition: one of them.

        Returns:
            Names of shapes.
        """
        if self.cells is not None:
            return self.cells[condition]
        return (dict(self.held)[condition.recording],) if condition.recording else self.settings.shapes


def planned(given: argparse.Namespace) -> SweepPlan:
    """Check all options.

    Args:
        given: of the parser.

    Returns:
        What they ask for.

    Raises:
        ValueError: for what makes no sense.
    """
    table, cells = trial_tables.read(given), []
    if table is not None:
        cells = trial_tables.cells_of(given, table)
        given = trial_tables.as_flags(given, table, cells)
    told = {each.name: getattr(given, FLAGS.get(each.name, each.name)) for each in fields(SweepSettings)}
    if given.recordings is not None:
        _check_recorded(given)
    told["env"] = environment(HAND if given.env is None else given.env)
    named = named_or_set(given.shapes, given.objects)
    told["shapes"] = expanded(shapes.SHAPES if named is None else named, trust=given.trust)
    if given.candidates is not None:
        told["among"] = expanded(given.candidates, trust=given.trust)
    for name in ("none", "courses", "names_only", "meshes"):
        told[name] = getattr(given, name) or None
    _check_names_only(given)
    held: dict[str, str] = {}
    if given.recordings is not None:
        said = None if named is None else told["shapes"]
        held = replayed.objects_of(given.recordings, said)
        told["shapes"] = list(dict.fromkeys(held.values()))
        told["env"] = replayed.environment_of(given.recordings, given.env and told["env"])
        among = given.candidates and told["among"]
        if among is not None and told["none"] is None and not {*told["shapes"]} <= {*among}:
            told["none"] = DOUBT
    told = {name: tuple(value) if isinstance(value, list) else value for name, value in told.items()}
    settings = SweepSettings(**told)
    flags = {name: {"sigma_deg": "sigmas", "recording": "recordings"}.get(name, name) for name in FACTORS}
    said = {name: getattr(given, flag, [""]) for name, flag in flags.items()}
    said["recording"] = [""] if given.recordings is None else given.recordings
    if given.recordings is not None:
        said["policy"] = [RECORDED]
    whole = said["seconds"] is None
    said["seconds"] = [1.0] if whole else said["seconds"]
    values = {name: sorted(set(several), key=_order) for name, several in said.items()}
    for name, several in values.items():
        if not several:
            raise ValueError(f"--{flags[name].replace('_', '-')} must have a value, got []")
    if math.prod(map(len, values.values())) > MOST_CONDITIONS:
        counts = ", ".join(f"{len(several)} of {flags[name]}" for name, several in values.items() if len(several) > 1)
        raise ValueError(f"a sweep has {MOST_CONDITIONS} combinations at most, these are more: {counts}")
    product = itertools.product(*values.values())
    conditions = tuple(Condition(**dict(zip(FACTORS, each, strict=True))) for each in product)
    for each in itertools.product(*(values[name] for name in CONTACTS)):
        contacts = replace(conditions[0], **dict(zip(CONTACTS, each, strict=True))).noise
        check_contacts(settings.env, contacts)
        settings.check_told(settings.env, contacts)
    policies = values["policy"] if given.recordings is None else []
    for policy in policies:
        check_policy(policy, given.trust)
    most = values["sigma_deg"][-1] * settings.believed_sigma
    validate.number("--sigmas times --believed-sigma", most, high=90.0, above=0.0, unit="degrees")
    validate.integer(getattr(given, "trials_flag", "--trials"), given.trials, 1, 100_000)
    validate.integer("--jobs", given.jobs, 1, 1024)
    if given.ablation and FULL not in given.observers:
        raise ValueError(f"--ablation compares with {FULL}, which is not among --observers")
    if settings.meshes:
        _check_meshes()
    if given.cluster is not None and importlib.util.find_spec("distributed") is None:
        raise ValueError(f"--cluster needs dask.distributed, which is not installed: {how_to_install('cluster')}")
    for policy in policies:
        _check_fit(settings, policy)
    if settings.none:
        _check_none(settings)
    if held:
        conditions = _lasting(settings, conditions, held, whole)
    explored = trial_tables.conditions_of(conditions, cells) if cells else None
    if explored is not None and len(explored) > MOST_CONDITIONS:
        raise ValueError(f"a sweep has {MOST_CONDITIONS} combinations at most, those of the table are {len(explored)}")
    if settings.maps_every is not None:
        step, longest = 1.0 / hand_env(_env(settings)).control_hz, max(each.seconds for each in explored or conditions)
        validate.number("--maps-every", settings.maps_every, step, longest, unit="s")
    return SweepPlan(
        settings,
        conditions if explored is None else tuple(explored),
        given.trials,
        given.out,
        given.jobs,
        given.cluster,
        ablation=given.ablation,
        calibration=given.calibration,
        held=tuple(held.items()),
        cells=explored,
    )


def _check_names_only(given: argparse.Namespace) -> None:
    """Raise `ValueError` for what there is of maps alone."""
    if not given.names_only:
        return
    of_maps = {"--classifiers": given.classifiers, "--ablation": given.ablation, "--calibration": given.calibration}
    of_maps |= {"--maps-every": given.maps_every, "--meshes": given.meshes}
    for flag in [flag for flag, value in of_maps.items() if value]:
        raise ValueError(f"--names-only makes no maps, which {flag} is about")
    if given.recordings is not None:
        raise ValueError("--names-only is for hands that explore: the pose of a recording's is found with its map")


def _check_meshes() -> None:
    """Raise `ValueError` where what draws meshes is not installed."""
    try:
        triangles.check()
    except ImportError as error:
        raise ValueError(f"--meshes: {error}") from error


def _check_recorded(given: argparse.Namespace) -> None:
    """Raise `ValueError` for what is of explorations alone."""
    if given.objects is not None:
        raise ValueError("--objects is for explorations: say what was held in --recordings by --shapes, in their order")
    if given.policy != [Condition.policy]:
        raise ValueError("--policy is for hands that explore, and --recordings tell how theirs moved")
    refuse_exploring(given.wrist)
    if given.classifiers:
        raise ValueError("--classifiers learn from explorations, of which --recordings have none")
    refuse_varied(vars(given))


def _lasting(
    settings: SweepSettings, conditions: tuple[Condition, ...], held: Mapping[str, str], whole: bool
) -> tuple[Condition, ...]:
    """The conditions with how long their recordings are replayed, which are tried on hand and object for it."""
    asked = dict.fromkeys((each.recording, each.seconds) for each in conditions)
    usual = conditions[0]
    lasting = {
        (path, seconds): replayed.seconds_of(
            settings, replace(usual, recording=path, seconds=seconds), held[path], whole
        )
        for path, seconds in asked
    }
    found = (replace(each, seconds=lasting[each.recording, each.seconds]) for each in conditions)
    return tuple(dict.fromkeys(found))


def _order(value: Any) -> tuple[bool, Any]:
    """Numbers come before texts."""
    return isinstance(value, str), value


def _check_none(settings: SweepSettings) -> None:
    """Raise `ValueError` for a "none" that no namer takes; one of one candidate tells."""
    hand = hand_of(_env(settings))
    ShapePosterior(
        hand,
        candidates_of(hand, ("sphere",)),
        none=settings.none or 0.0,
        **settings.jitter,
        variants=1,
    )


def _env(settings: SweepSettings) -> gym.Env[Any, Any]:
    try:
        return registration.make(settings.env, wrist=settings.wrist)
    except ImportError as error:
        raise ValueError(str(error)) from error


@lru_cache
def _check_fit(settings: SweepSettings, policy: str) -> None:
    """Raise `ValueError` for a trained model that is not for this hand or these candidates."""
    if not issubclass(agents.find(policy), Sb3):
        return
    env = _env(settings)
    hand = hand_of(env)
    shape = ShapePosterior(
        hand, candidates_of(hand, settings.known, scale=settings.scale), none=settings.none or 0.0, variants=1
    )
    check_model(env, policy, shape, settings.trust)
