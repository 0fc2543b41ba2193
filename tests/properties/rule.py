"""The rule for whatever a user may give: it works, or it is refused with an error that names the value.

All that is no `Outcome` of "accepted" or "refused" is a fault: another exception, a message of several lines, or one
that tells neither the value nor what it was given for, and numbers that are not finite. Signals, hangs and memory that
runs out end or stall a process: the fuzzer (`tests.properties.fuzz`) counts them from outside.
"""

from __future__ import annotations

import contextlib
import dataclasses
import io
import re
import traceback
import warnings
from collections.abc import Callable, Iterator, Mapping
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

ACCEPTED, REFUSED = "accepted", "refused"
# What Python itself says of a call that does not fit a signature; nobody checks that once more.
CALLED_WRONGLY = re.compile(r"unexpected keyword argument|missing \d+ required|positional argument|multiple values for")
DEEPEST = 12
LARGE = 1e100
PROJECT = ("haptic_env", "observer", "agents", "haptic_lab")


class Outcome(NamedTuple):
    """`kind`: "accepted", "refused", or what the fault is, without the value, so that alike faults are counted
    together; `told`: what was said."""

    kind: str
    told: str = ""

    @property
    def fault(self) -> bool:
        """Whether the rule is broken."""
        return self.kind not in (ACCEPTED, REFUSED)


@dataclasses.dataclass(frozen=True)
class Allowed:
    """What is right of one entry point beyond the rule.

    `files`: it reads some, so that the system's own errors are told as they are. `errors`: of other libraries, which
    are theirs to tell. `exits`: it is a command, which ends with code 2 and one line. `nan`: what cannot be said is
    NaN by its documentation, where what was given are numbers of a usual size; `nan_of_nan`: and elsewhere.
    `infinite`: a log probability may be. `words`: by which else an error may name what was wrong.
    """

    files: bool = False
    errors: tuple[type[Exception], ...] = ()
    exits: bool = False
    nan: bool = False
    nan_of_nan: bool = False
    infinite: bool = False
    words: tuple[str, ...] = ()


def judge(call: Callable[[], Any], given: Mapping[str, Any], allowed: Allowed) -> Outcome:
    """What comes of `call` on what was `given`."""
    said = io.StringIO()
    try:
        with warnings.catch_warnings(), contextlib.redirect_stderr(said), contextlib.redirect_stdout(io.StringIO()):
            warnings.simplefilter("ignore")
            result = call()
            silent = allowed.nan_of_nan or (allowed.nan and _usual(given))
            wrong = next(not_finite(result, silent, allowed.infinite), None)
    except SystemExit as error:
        return _of_exit(error, said.getvalue(), given, allowed)
    except ImportError as error:
        return Outcome(REFUSED, str(error)) if "pip install" in str(error) else _of_error(error)
    except OSError as error:
        return Outcome(REFUSED, str(error)) if allowed.files else _of_error(error)
    except allowed.errors as error:
        return Outcome(REFUSED, str(error))
    except ValueError as error:
        return _of_message(str(error), given, allowed, _where(error))
    except TypeError as error:
        return Outcome(REFUSED, str(error)) if CALLED_WRONGLY.search(str(error)) else _of_error(error)
    except Exception as error:
        return _of_error(error)
    return Outcome(ACCEPTED) if wrong is None else Outcome(f"not finite: {wrong}")


def not_finite(
    result: Any, nan: bool = False, infinite: bool = False, path: str = "result", depth: int = 0
) -> Iterator[str]:
    """Where in `result` a number is NaN, or infinite, unless that is right."""
    if depth > DEEPEST or result is None or isinstance(result, bool | int | str | bytes):
        return
    if isinstance(result, float | complex | np.ndarray | np.generic):
        numbers = np.asarray(result)
        if numbers.dtype.kind in "fc":
            if not nan and np.isnan(numbers).any():
                yield path
            elif not infinite and np.isinf(numbers).any():
                yield f"{path} (infinite)"
        return
    for name, part in _parts(result):
        yield from not_finite(part, nan, infinite, f"{path}{name}", depth + 1)


def _usual(given: Mapping[str, Any]) -> bool:
    """Whether all numbers of what was `given` are finite, and none so large that what is made of them is not."""
    for value in given.values():
        try:
            numbers = np.asarray(value, dtype=np.float64)
        except Exception:  # no numbers
            continue
        if not (np.abs(numbers) < LARGE).all():
            return False
    return True


def _parts(result: Any) -> Iterator[tuple[str, Any]]:
    if isinstance(result, Mapping):
        yield from ((f"[{key!r}]", value) for key, value in result.items())
    elif hasattr(result, "_fields"):
        yield from ((f".{name}", getattr(result, name)) for name in result._fields)
    elif isinstance(result, list | tuple | set):
        yield from (("[]", value) for value in result)
    elif dataclasses.is_dataclass(result):
        yield from ((f".{each.name}", getattr(result, each.name)) for each in dataclasses.fields(result))
        if hasattr(result, "occupancy") and not callable(result.occupancy):
            yield ".occupancy", result.occupancy


def _of_exit(error: SystemExit, said: str, given: Mapping[str, Any], allowed: Allowed) -> Outcome:
    if allowed.exits and error.code == 0:
        return Outcome(ACCEPTED)
    if not allowed.exits or error.code != 2:
        return Outcome(f"exit {error.code!r}", said)
    told = said.removesuffix("\n").encode(errors="backslashreplace").decode()  # as on any standard error
    return _of_message(told, given, allowed, "the command")


def _of_message(message: str, given: Mapping[str, Any], allowed: Allowed, where: str) -> Outcome:
    if not message.strip():
        return Outcome(f"says nothing at {where}", message)
    if len(message.splitlines()) > 1:
        return Outcome(f"says it in several lines at {where}", message)
    try:
        message.encode()
    except UnicodeEncodeError:
        return Outcome(f"cannot be printed at {where}", ascii(message))
    if not any(word.casefold() in message.casefold() for word in (*allowed.words, *_words(given))):
        return Outcome(f"tells neither value nor argument at {where}", message)
    return Outcome(REFUSED, message)


def _words(given: Mapping[str, Any]) -> Iterator[str]:
    """By which an error may name something of what was `given`."""
    for name, value in given.items():
        yield from (name, name.replace("_", " "))
        if isinstance(value, Path) or (isinstance(value, str) and len(value) > 3):
            yield str(value)
        with contextlib.suppress(Exception):  # of an int of thousands of digits
            yield repr(value)[:40]


def _of_error(error: BaseException) -> Outcome:
    return Outcome(f"{type(error).__name__} at {_where(error)}", str(error))


def _where(error: BaseException) -> str:
    """The last line of the project that an error came through."""
    frames = traceback.extract_tb(error.__traceback__)
    ours = [each for each in frames if any(f"/{name}/" in each.filename for name in PROJECT)]
    ours = [each for each in ours if "/tests/" not in each.filename and "/site-packages/" not in each.filename]
    last = (ours or frames)[-1]
    return f"{'/'.join(last.filename.split('/')[-2:])}:{last.name}"
