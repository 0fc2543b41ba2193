"""Runs what a study explores: a resumable sweep for each condition of the hand."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from fnmatch import fnmatchcase
from functools import partial
from pathlib import Path
from typing import Any

import pandas as pd
from rich.console import Console

from haptic_env import hand_of, registration
from haptic_env.hand import Hand
from haptic_lab.files import part_of_name
from haptic_lab.people.studies.naming import name_objects
from haptic_lab.people.studies.presets import DISCRIMINATION, HandCondition, Study
from haptic_lab.sweeps import options
from haptic_lab.sweeps.driver import sweep
from haptic_lab.sweeps.plan import HAND, SweepPlan
from haptic_lab.sweeps.results import Results
from haptic_lab.worlds import as_shape, environment

TRIALS = "trials"  # folder of the sweeps


@dataclass(frozen=True)
class ConditionPlan:
    """One condition of the hand, to be run.

    Attributes:
        name: of the condition.
        sweep: what is explored.
        moves: indices of the joints that are driven; None: all.
    """

    name: str
    sweep: SweepPlan
    moves: tuple[int, ...] | None

    def open(self) -> Results:
        """Open the table of its sweep, as far as it is there; ends the program as `open_results` does.

        Returns:
            The table.
        """
        said = {} if self.moves is None else {"moves": list(self.moves)}
        return options.open_results(self.sweep, {"names_only": True, **said})

    @property
    def work(self) -> Any:
        """What makes rows of a bundle of its trials."""
        return partial(name_objects, moves=self.moves)


def plan(study: Study, given: Mapping[str, Any], out: Path) -> list[ConditionPlan]:
    """Check what a study explores; ends the program with code 2 where it makes no sense. Nothing is written.

    Args:
        study: what is done.
        given: keys of a sweep that take the place of the study's.
        out: folder for the results.

    Returns:
        Its conditions.

    Raises:
        ValueError: for a key or a pattern that is none.
    """
    return [_planned(study, each, given, out) for each in study.conditions]


def _planned(study: Study, condition: HandCondition, given: Mapping[str, Any], out: Path) -> ConditionPlan:
    _, known = options.make_parser(None)
    values = options.typed({**study.sweep, **condition.sweep}, known) | dict(given)
    values["env"] = environment(values.get("env") or HAND)
    hand = _hand(values["env"], values.get("wrist"))
    moves = _matching("moves", condition, hand.joint_names)
    feels = _matching("feels", condition, hand.patches.names)
    if len(feels) < len(hand.patches):
        dead = sorted({*range(len(hand.patches))} - {*feels})
        values["patches_dead"] = [f"{','.join(map(str, dead))},"]
    if study.task == DISCRIMINATION:
        values["shapes"] = [shape for _, shape in study.stimuli]
    elif isinstance(values.get("shapes"), list):
        values["shapes"] = [as_shape(each) for each in values["shapes"]]
    values |= {"classifiers": [], "out": str(place_of(condition.name, out))}
    driven = None if len(moves) == hand.joints else moves
    checked = options.check_values(values)
    alike = {replace(each, sigma_deg=1.0, seconds=1.0) for each in checked.conditions}
    if len(alike) > 1:
        raise ValueError("a study varies sigmas and seconds alone; everything else must have one value")
    return ConditionPlan(condition.name, checked, driven)


def place_of(name: str, out: Path, what: str = TRIALS) -> Path:
    """Say where the explorations of a condition are kept.

    Args:
        name: of the condition.
        out: folder for the results of the study.
        what: they are.

    Returns:
        The folder.
    """
    return out / what / part_of_name(name or "all")


def _hand(env: str, wrist: str | None) -> Hand:
    try:
        return hand_of(registration.make(env, wrist=wrist))
    except ImportError as error:
        raise ValueError(str(error)) from error


def _matching(what: str, condition: HandCondition, names: Sequence[str]) -> tuple[int, ...]:
    """The indices of the names that one of the patterns of a condition fits."""
    patterns = getattr(condition, what)
    for pattern in patterns:
        if not any(fnmatchcase(name, pattern) for name in names):
            raise ValueError(f"{what} of condition {condition.name!r}: {pattern!r} fits none of {', '.join(names)}")
    return tuple(i for i, name in enumerate(names) if any(fnmatchcase(name, each) for each in patterns))


def explore(plans: Sequence[ConditionPlan], console: Console) -> None:
    """Run what is not in the tables yet.

    Args:
        plans: of the conditions.
        console: shows how it goes.

    Raises:
        ValueError: where the code was changed while the sweep ran.
    """
    for each in plans:
        if each.name:
            console.rule(each.name)
        results = each.open()
        try:
            sweep(each.sweep, results, console, each.work)
        finally:
            results.rewrite()


def one_by_one(plans: Sequence[ConditionPlan], out: Path, what: str) -> Iterator[tuple[ConditionPlan, Results]]:
    """Take conditions of a sweep apart, for whoever decides what is explored next.

    Args:
        plans: of the conditions of the hand.
        out: folder for the results.
        what: they are, a folder in it.

    Yields:
        Each with one noise and duration alone, and the table where explorations are kept.
    """
    for each in plans:
        mine = replace(each, sweep=replace(each.sweep, out=str(place_of(each.name, out, what))))
        results = mine.open()
        try:
            for condition in mine.sweep.conditions:
                yield replace(mine, sweep=replace(mine.sweep, conditions=(condition,))), results
        finally:
            results.rewrite()


def read_tables(paths: Mapping[str, Path]) -> pd.DataFrame:
    """Read tables of sweeps.

    Args:
        paths: of each, by the name of its condition.

    Returns:
        Their rows, with a column `condition`; of conditions without a table there are none.

    Raises:
        ValueError: for what is no table of a sweep, and where there is no row.
    """
    tables = []
    for name, path in paths.items():
        if path.is_file():
            try:
                rows = pd.read_csv(path)
            except (ValueError, OSError) as error:
                raise ValueError(f"{path} is no table of a sweep: {error}") from error
            tables.append(rows.assign(condition=name))
    whole = pd.concat(tables, ignore_index=True) if tables else pd.DataFrame()
    if whole.empty:
        raise ValueError("nothing was explored yet")
    missing = {"shape", "seed", "sigma_deg", "seconds", "observer"} - {*whole.columns}
    if missing:
        raise ValueError(f"no table of a sweep: it has no column {', '.join(sorted(missing))}")
    return whole
