"""What was asked of people, and which of their answers were right."""

from __future__ import annotations

from collections.abc import Collection
from dataclasses import dataclass

import numpy as np
import pandas as pd

from haptic_env import validate
from haptic_env.shapes.names import NONE

DESIGNS = ("identification", "yes-no", "2afc")
YES, NO = "yes", "no"


@dataclass(frozen=True)
class Design:
    """What was asked.

    Attributes:
        kind: of `DESIGNS`: which object it is; whether it is one of a kind ("yes"), or not ("no"); or in which of two
            intervals it was, with "yes" for the right one.
        answers: (C,) that there were to choose from.
        absent: of a yes–no design, objects of which "no" is right; where there are none, nobody knows what is right.
        standard: of two intervals, what the other one had; "": it is not said.
    """

    kind: str
    answers: tuple[str, ...]
    absent: frozenset[str] = frozenset()
    standard: str = ""

    @property
    def scored(self) -> bool:
        """Whether it is known which answers are right."""
        return self.kind != "yes-no" or bool(self.absent)

    @property
    def alternatives(self) -> int:
        """m, of which chance is 1 / m."""
        return 2 if self.kind != "identification" else len(self.answers)

    def right(self, objects: pd.Series) -> pd.Series:
        """Say which answers are right.

        Args:
            objects: (M,) that were explored.

        Returns:
            (M,) answers; "" where nobody knows.
        """
        if self.kind == "2afc":
            return pd.Series(YES, index=objects.index)
        if self.kind == "yes-no":
            return (
                objects.map(lambda name: NO if name in self.absent else YES)
                if self.scored
                else objects.map(lambda _: "")
            )
        return objects.where(objects.isin(self.answers), NONE)


def design_of(
    table: pd.DataFrame,
    kind: str | None = None,
    candidates: Collection[str] = (),
    absent: Collection[str] = (),
    standard: str = "",
) -> Design:
    """Find out what was asked.

    Args:
        table: (M,) trials, as `read_trials` gives them.
        kind: of `DESIGNS`; None: "yes-no" where all answers are yes or no, "2afc" with a standard, else
            "identification".
        candidates: that people could choose from; "none" is right of other objects. Nothing: all objects and answers
            of the table.
        absent: objects of which "no" is right.
        standard: of two intervals, what the other one had, for observers to be asked as people were.

    Returns:
        The design.

    Raises:
        ValueError: where answers are of another kind, and for names that are not in the table.
    """
    answers, objects = list(dict.fromkeys(table["response"])), list(dict.fromkeys(table["object"]))
    binary = [each for each in answers if each in (YES, NO)]
    if binary and len(binary) < len(answers):
        other = [each for each in answers if each not in binary]
        row = int(np.argmax(table["response"].isin(other))) + 1
        raise ValueError(
            f"response is yes or no in some trials and a name in others, such as {validate.listed(other[:5])} in trial "
            f"{row} of the table: report them apart"
        )
    of_binary = "2afc" if standard else "yes-no"
    found = (of_binary if binary else "identification") if kind is None else validate.choice("design", kind, DESIGNS)
    if (found != "identification") != bool(binary):
        wanted = "names of objects" if found == "identification" else "yes or no"
        raise ValueError(f"responses of design {found!r} must be {wanted}, got {validate.listed(answers[:5])}")
    if absent and found != "yes-no":
        raise ValueError(f"absent objects are those of yes and no; the design is {found!r}")
    if standard and found != "2afc":
        raise ValueError(f"a standard is that of two intervals; the design is {found!r}")
    if candidates and found != "identification":
        raise ValueError(f"candidates are those of identification; the design is {found!r}")
    for name in absent:
        validate.choice("absent object", name, objects)
    if absent and not set(objects) - {*absent}:
        raise ValueError(f"absent objects must not be all that there are, got {validate.listed(absent)}")
    if found != "identification":
        return Design(found, (YES, NO), frozenset(absent), standard)
    strangers = [each for each in answers if each not in {*candidates, NONE}]
    if candidates and strangers:
        raise ValueError(f"candidates must have all responses in them, got responses {validate.listed(strangers)}")
    several = [*candidates] if candidates else sorted({*objects, *answers} - {NONE}, key=[*objects, *answers].index)
    if NONE in answers or {*objects} - {*several}:
        several.append(NONE)
    if len(several) < 2:
        raise ValueError(
            f"there must be two answers to choose from at least, got {validate.listed(several)}; "
            "say what people could choose from, as in --candidates cube sphere"
        )
    return Design(found, tuple(dict.fromkeys(several)))
