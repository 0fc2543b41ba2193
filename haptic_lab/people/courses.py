"""What observers believed through time, the input of every model of decisions.

Shapes: M cells (an object under a condition), S sigmas, R repeats, T times, C names.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, fields
from pathlib import Path
from typing import Any, Self

import numpy as np
from numpy.typing import NDArray

from haptic_env import readable, reading, validate
from haptic_env.arrays import Array
from haptic_env.files import atomic, check_writable
from haptic_lab.people import sweep_courses

FORMAT = 1  # of the files
TEXTS = ("names", "objects", "conditions")
CLOSE = 1e-6  # by which the probabilities of all names may miss 1
LISTED = 40  # cells, of which an error tells


@dataclass(frozen=True, eq=False, kw_only=True)
class Courses:
    """Log posteriors of one observer, through time.

    Attributes:
        names: (C,) that the object may have.
        objects: (M,) what is explored in each cell.
        conditions: (M,) under which; "" where there is only one.
        sigmas: (S,) degrees, the noise of felt angles, ascending.
        seconds: (T,) s since the exploration began, ascending; at 0 it is the prior.
        log_posterior: (M, S, R, T, C) nats, normalised over names, -inf where a name is impossible; repeats are the
            same object with other noise and another movement; NaN of all names where a repeat is missing, or was not
            that long.
    """

    names: tuple[str, ...]
    objects: tuple[str, ...]
    conditions: tuple[str, ...]
    sigmas: Array
    seconds: Array
    log_posterior: Array

    __repr__ = readable.line

    def __post_init__(self) -> None:
        for name in TEXTS:
            object.__setattr__(self, name, validate.names(name, getattr(self, name)))
        object.__setattr__(self, "sigmas", _ascending("sigmas", self.sigmas, "degrees", above=0.0))
        object.__setattr__(self, "seconds", _ascending("seconds", self.seconds, "s"))
        if len(self.objects) != len(self.conditions):
            told = f"{len(self.objects)} objects, {len(self.conditions)} conditions"
            raise ValueError(f"each cell is an object and a condition, got {told}")
        for what, several in (("name", self.names), ("cell", (*zip(self.objects, self.conditions, strict=True),))):
            again = next((each for each in several if several.count(each) > 1), None)
            if again is not None:
                raise ValueError(f"each {what} must be there once, got {validate.shown(again)} again")
        object.__setattr__(self, "log_posterior", self._checked())

    def _checked(self) -> Array:
        given = validate.real(self.log_posterior)
        sizes = (len(self.objects), len(self.sigmas), None, len(self.seconds), len(self.names))
        told = "({}, {}, repeats, {}, {})".format(*(each for each in sizes if each is not None))
        if given is None:
            raise ValueError(f"log_posterior must be numbers, got {validate.shown(self.log_posterior)}")
        fits = given.ndim == 5 and all(size in (None, length) for size, length in zip(sizes, given.shape, strict=True))
        if not fits or not given.shape[2]:
            raise ValueError(f"log_posterior must be of shape {told}, one repeat at least, got shape {given.shape}")
        if given.size > validate.MOST:
            raise ValueError(f"log_posterior must have {validate.MOST} numbers at most, got shape {given.shape}")
        with np.errstate(over="ignore"):  # what is too large is no log of a probability
            result = given.astype(np.float64)
            nan = np.isnan(result)
            total = np.exp(np.where(nan, -np.inf, result)).sum(axis=-1)
        wrong = np.where(nan.all(axis=-1), False, nan.any(axis=-1) | ~(np.abs(total - 1.0) <= CLOSE))
        if wrong.any():
            where = tuple(map(int, np.argwhere(wrong)[0]))
            raise ValueError(
                "log_posterior must be logs of probabilities that add to 1 over names, or NaN for all of them, got "
                f"{result[where].tolist()} at index {where}"
            )
        return result

    @property
    def repeats(self) -> int:
        """R, those that are missing included."""
        return int(self.log_posterior.shape[2])

    @property
    def cells(self) -> tuple[tuple[str, str], ...]:
        """(M,) each object with its condition."""
        return tuple(zip(self.objects, self.conditions, strict=True))

    def cell(self, object: str, condition: str = "") -> int:
        """Find a cell.

        Args:
            object: that is explored.
            condition: under which.

        Returns:
            Its index.

        Raises:
            ValueError: where there is none; it lists those that there are.
        """
        if (object, condition) in self.cells:
            return self.cells.index((object, condition))
        there = "; ".join(f"{name} under {under}" if under else name for name, under in self.cells[:LISTED])
        more = f" and {len(self.cells) - LISTED} more" if len(self.cells) > LISTED else ""
        under = f" under {validate.shown(condition)}" if condition or any(self.conditions) else ""
        raise ValueError(f"there is no course of {validate.shown(object)}{under}; there are {there}{more}")

    def save(self, path: Path | str) -> None:
        """Write the courses to an `.npz` of plain arrays, whole or not at all.

        Args:
            path: of the file.

        Raises:
            ValueError: where it cannot be written.
        """
        place = validate.path("path of courses", path)
        check_writable("path of courses", place)
        arrays: dict[str, Any] = {each.name: np.asarray(getattr(self, each.name)) for each in fields(self)}
        with atomic(place) as unfinished, unfinished.open("wb") as file:
            np.savez_compressed(file, format=np.array(FORMAT), **arrays)

    @classmethod
    def of_sweep(cls, folder: Path | str, *more: Path | str, observer: str = "haptic_slam") -> Self:
        """Read what `haptic-slam evaluate --courses` kept.

        A cell is an object under what its trial table calls the condition, with its recording where it has one
        (`haptic_lab.people.sweep_courses.condition_of`), and with what else varies in the sweep. Repeats are in the
        order of their seeds. What is there of a sweep that goes on is taken.

        Args:
            folder: of the sweep.
            *more: folders of others of the same candidates: of conditions that were swept apart, say.
            observer: whose belief it is.

        Returns:
            The courses.

        Raises:
            ValueError: for a folder without courses, a table that was altered, or sweeps of other candidates.
            OSError: where it cannot be read.
        """
        found = [each for place in (folder, *more) for each in sweep_courses.read(place, observer)]
        return cls(**sweep_courses.together(found))

    @classmethod
    def load(cls, path: Path | str) -> Self:
        """Read courses. Nothing in the file is run.

        Args:
            path: of the file.

        Returns:
            The courses.

        Raises:
            ValueError: for a file that is none, is cut short, or of another format.
            OSError: where it cannot be read.
        """
        content = reading.npz(path)
        wanted = [each.name for each in fields(cls)]
        missing = [name for name in ("format", *wanted) if name not in content]
        if missing:
            raise ValueError(f"{path}: these are no courses, there is no {', '.join(missing)} in it")
        told = content["format"]
        if told.ndim or told.dtype.kind not in "iu" or int(told) != FORMAT:
            raise ValueError(f"{path}: courses of format {validate.shown(told.tolist())}, {FORMAT} is read here")
        try:
            held: dict[str, Any] = {name: content[name] for name in wanted}
            return cls(**held | {name: _texts(name, held[name]) for name in TEXTS})
        except ValueError as error:
            raise ValueError(f"{path}: {error}") from error


def _texts(name: str, array: NDArray[Any]) -> Sequence[str]:
    if array.dtype.kind != "U" or array.ndim != 1:
        raise ValueError(f"{name} must be texts in a row, got {array.dtype} of shape {array.shape}")
    return [str(each) for each in array]


def _ascending(what: str, value: Any, unit: str, above: float | None = None) -> Array:
    """(n,) one number at least, each larger than the one before."""
    result = validate.numbers(what, value, 1)
    low = 0.0 if above is None else above
    if not result.size or (result < low).any() or (above is not None and result[0] <= above) or _falls(result):
        least = f"above {low:g}" if above is not None else f"of at least {low:g}"
        raise ValueError(f"{what} must be ascending numbers {least} {unit}, got {validate.shown(result.tolist())}")
    return result.copy()


def _falls(numbers: Array) -> bool:
    return bool((np.diff(numbers) <= 0.0).any())
