"""Checks of user input: every error quotes the value and lists what is valid."""

from haptic_env.validate.arrays import (
    FARTHEST,
    LARGEST,
    LONGEST,
    MOST,
    REAL,
    array,
    binary,
    numbers,
    one_or_each,
    place,
    probabilities,
    quaternion,
    real,
    together,
)
from haptic_env.validate.choices import choice, keywords, keywords_of, names
from haptic_env.validate.values import (
    LONGEST_TIME,
    NO_NUMBERS,
    NOT_IN_PATHS,
    boolean,
    instance,
    integer,
    number,
    path,
    seconds,
    seed,
)
from haptic_env.validate.wording import QUOTED, counted, few, listed, plain, shown

__all__ = [
    "FARTHEST", "LARGEST", "LONGEST", "LONGEST_TIME", "MOST", "NOT_IN_PATHS", "NO_NUMBERS", "QUOTED", "REAL",
    "array", "binary", "boolean", "choice", "counted", "few", "instance", "integer", "keywords", "keywords_of",
    "listed", "names", "number", "numbers", "one_or_each", "path", "place", "plain", "probabilities", "quaternion",
    "real", "seconds", "seed", "shown", "together",
]  # fmt: skip
