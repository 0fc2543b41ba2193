"""What the commands that fit, compare, design and simulate are told alike: trials, courses, ranges of parameters."""

from __future__ import annotations

import argparse
import math
import re
from collections.abc import Collection, Iterable
from pathlib import Path

import pandas as pd
from rich.console import Console

from haptic_env import validate
from haptic_lab.people import evidence
from haptic_lab.people.answers import answers_of
from haptic_lab.people.courses import Courses
from haptic_lab.people.fitting import DRAWS
from haptic_lab.people.intervals import in_two_intervals, two_intervals
from haptic_lab.people.models import LOGARITHMIC, MODELS, USUAL, Model
from haptic_lab.people.scoring import NO, YES
from haptic_lab.people.table_flags import add_table_flags, read_tables
from haptic_lab.terminal import as_path
from haptic_lab.worlds import as_shape

FLAGS = {
    "sigma_deg": "--sigma",
    "memory_seconds": "--memory-seconds",
    "decision_noise": "--decision-noise",
    "stop_at": "--stop-at",
    "price": "--price",
    "lapse": "--lapse",
}
SEED = "what chance starts from (default 0)"
EXAMPLES = Path(__file__).parent / "data"
EXAMPLE = "example"  # in place of a file: the one that ships
SHIPPED = {"table": EXAMPLES / "example_trials.csv", "courses": EXAMPLES / "example_courses.npz"}


def add_trials(parser: argparse.ArgumentParser) -> None:
    """Let a command take a table of trials.

    Args:
        parser: of the command.
    """
    add = parser.add_argument
    add("table", type=as_path, metavar="TABLE", help=f"trials, .csv or .tsv; {EXAMPLE!r}: the simulated ones that ship")
    add_table_flags(parser)
    add("--subjects", nargs="+", metavar="NAME", help="these alone (default: all of the table)")
    told = (
        "of choices of two intervals, yes for the right one: what the other interval had; the object is the comparison"
    )
    add("--standard", type=as_shape, metavar="SHAPE", help=told)


def read_table(given: argparse.Namespace) -> pd.DataFrame:
    """Read the table that a command was told.

    Args:
        given: flags of `add_trials`.

    Returns:
        Its trials, of the subjects that were asked for.

    Raises:
        ValueError: for what is no such table, and subjects that are not in it.
        OSError: where it cannot be read.
    """
    table = read_tables([shipped("table", given.table)], given)
    for subject in given.subjects or []:
        validate.choice("--subjects", subject, sorted(set(table["subject"])))
    if given.subjects is not None:
        table = table[table["subject"].isin(given.subjects)].reset_index(drop=True)
    if given.standard is not None:
        return in_two_intervals(table, given.standard)
    if {*table["response"]} & {YES, NO}:
        raise ValueError(
            f"answers of yes and no are explained where they choose between two intervals ({YES} for the right one): "
            "say what the other interval had, as in --standard sphere. Other answers must be names that courses have"
        )
    return table


def by_subject(table: pd.DataFrame, models: Iterable[Model]) -> dict[str, pd.DataFrame]:
    """Split trials by subjects.

    Args:
        table: of `read_table`.
        models: that all trials can be put to.

    Returns:
        The trials of each subject, by name.

    Raises:
        ValueError: for a trial that is none of a model's courses.
    """
    tables = {str(name): trials for name, trials in table.groupby("subject", sort=False)}
    for trials in tables.values():
        for model in models:
            answers_of(trials, model.courses, model.timed)
    return tables


def add_courses(parser: argparse.ArgumentParser) -> None:
    """Let a command take courses of belief.

    Args:
        parser: of the command.
    """
    add = parser.add_argument
    told = f"courses of belief: an .npz, or the folder of evaluate --courses; {EXAMPLE!r}: those that ship"
    add("--courses", type=as_path, required=True, metavar="FILE", help=told)
    add("--observer", default="haptic_slam", help="whose courses, of a folder (default haptic_slam)")


def read_courses(path: str, observer: str, standard: str | None = None) -> Courses:
    """Read courses of belief.

    Args:
        path: of a file, or of the folder of a sweep; or `EXAMPLE`.
        observer: whose, of a folder.
        standard: of choices of two intervals, what the other interval had; None: objects are named.

    Returns:
        The courses.

    Raises:
        ValueError: for what has none in it.
        OSError: where it cannot be read.
    """
    place = Path(shipped("courses", path))
    if not place.exists():
        raise ValueError(f"there is no file or folder of courses {path!r}")
    courses = Courses.of_sweep(place, observer=observer) if place.is_dir() else Courses.load(place)
    return courses if standard is None else two_intervals(courses, standard)


def shipped(what: str, path: str) -> str:
    """Find the file that a command is told of.

    Args:
        what: a key of `SHIPPED`.
        path: of a file, or `EXAMPLE`.

    Returns:
        The path; of `EXAMPLE`, where no file is called so, that of what ships.
    """
    return str(SHIPPED[what]) if path == EXAMPLE and not Path(path).exists() else path


def add_draws(parser: argparse.ArgumentParser) -> None:
    """Let a command that fits take the flags of chance.

    Args:
        parser: of the command.
    """
    add = parser.add_argument
    add("--draws", type=int, default=DRAWS, help=f"of how much each repeat counts; 0: none (default {DRAWS})")
    add("--seed", type=int, default=0, help=SEED)


def check_draws(given: argparse.Namespace) -> None:
    """Check the flags of chance.

    Args:
        given: flags of `add_draws`.

    Raises:
        ValueError: for a number out of its range.
    """
    validate.integer("--draws", given.draws, 0, 10_000)
    validate.seed(given.seed)


def add_ranges(parser: argparse.ArgumentParser, usual: str, without: Collection[str] = ("price",)) -> None:
    """Let a command take ranges of parameters.

    Args:
        parser: of the command.
        usual: what they are otherwise, for the help.
        without: parameters that it does not know; the price of time is simulated, and not found (docs/people.md).
    """
    said = {
        "sigma_deg": "degrees, noise of felt angles",
        "memory_seconds": "s, the time constant with which evidence fades",
        "decision_noise": "nats, the temperature of the choice",
        "stop_at": "probability of the best name at which it answers; of times of answers",
        "price": "what a second costs, as a share of a right answer; of times of answers",
        "lapse": "share of trials answered by a guess",
    }
    for name, flag in FLAGS.items():
        if name in without:
            continue
        told = f"{said[name]}: a value, or a least and a largest one {usual}"
        parser.add_argument(flag, dest=name, nargs="+", type=float, metavar="VALUE", help=told)


def ranges_of(given: argparse.Namespace) -> dict[str, tuple[float, float]]:
    """Read the ranges that a command was told.

    Args:
        given: flags of `add_ranges`.

    Returns:
        The least and the largest value, of what was told.

    Raises:
        ValueError: for three values or more, and those out of what can be.
    """
    found = {}
    for name, flag in FLAGS.items():
        values = getattr(given, name, None)
        if values is None:
            continue
        if len(values) > 2 or any(math.isnan(value) for value in values):
            raise ValueError(f"{flag} must be a value, or a least and a largest one, got {validate.shown(values)}")
        found[name] = (values[0], values[-1])
    return found


def in_flags(told: str) -> str:
    """What an error `told` of the range of a parameter, by the name of its flag."""
    return re.sub(r"^range of (\w+)", lambda found: FLAGS[found[1]], told)


def model_of(
    text: str,
    courses: Courses,
    ranges: dict[str, tuple[float, float]],
    standard: str | None = None,
    *,
    offered: Collection[str] = tuple(MODELS),
) -> Model:
    """Make the model that a command was told.

    Args:
        text: a name of `MODELS`, or "NAME=FILE": an ideal observer of other courses, by a name of its own.
        courses: of the models.
        ranges: of parameters, those that the model finds; of the others they are not heeded.
        standard: as of `read_courses`.
        offered: names of models that make sense of the command, for messages.

    Returns:
        The model.

    Raises:
        ValueError: for a name that is none, and courses that cannot be read.
        OSError: likewise.
    """
    name, equals, path = text.partition("=")
    kind = "ideal" if equals else text if text in MODELS else validate.choice("model", text, offered)
    if equals and (not name.strip() or not path.strip()):
        raise ValueError(f"model must be one of {', '.join(offered)}, or like floor=FILE, got {validate.shown(text)}")
    other = read_courses(path, name, standard) if equals else courses
    mine = {key: value for key, value in ranges.items() if key in MODELS[kind]}
    return Model(name, other, MODELS[kind], mine)


def tell(models: Iterable[Model], console: Console) -> None:
    """Print what models find, and within what.

    Args:
        models: any.
        console: to print on.
    """
    for model in models:
        told = []
        for name in model.parameters:
            grid = model.grids[name]
            scale = "in proportion" if name in LOGARITHMIC else "evenly"
            told.append(f"{name} {grid.low:g} to {grid.high:g} ({scale})")
        grids = model.grids.items()
        held = [f"{name} {grid.low:g}" for name, grid in grids if grid.fixed and grid.low != USUAL.get(name)]
        line = "; ".join([", ".join(told) or "nothing is found", *held])
        console.print(f"Model {model.name}: {line}", highlight=False)


def seconds_of(given: list[float] | None, courses: Courses) -> list[float]:
    """Choose when simulated subjects are asked.

    Args:
        given: s; None: as usual.
        courses: that they are asked about.

    Returns:
        Those, or five times, each twice the one before, up to the longest course.

    Raises:
        ValueError: for a time that the courses do not have.
    """
    if given is not None:
        return [float(each) for each in evidence.check_times(courses, given)]
    longest = float(courses.seconds[-1])
    return [round(longest * share, 3) for share in (0.0625, 0.125, 0.25, 0.5, 1.0)]
