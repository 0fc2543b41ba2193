"""What every command does alike at the terminal: errors of one line, paths, Ctrl-C, and words that any stream takes."""

from __future__ import annotations

import argparse
import io
import logging
import os
import re
import signal
import sys
import unicodedata
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any, NoReturn

from rich.console import Console

ERRNO = re.compile(r"\[Errno \d+\] ")  # of errors of files: the words after it say the same
NOT_IN_PATHS = ("Cc", "Cs", "Zl", "Zp")  # control characters, bytes that are no text, ends of lines


class Parser(argparse.ArgumentParser):
    """Tells what is wrong in one line."""

    def error(self, message: str) -> NoReturn:
        refuse(message)


class Renamed(argparse.Action):
    """Of a flag's old name, kept for one release beside the new one, `dest`: says so, and takes the value."""

    def __call__(self, parser: Any, namespace: Any, values: Any, option_string: str | None = None) -> None:
        new = f"--{self.dest.replace('_', '-')}"
        tell("warning", f"{option_string} is {new} now; the old name goes with the next release")
        setattr(namespace, self.dest, values)


class Called(argparse.Action):
    """Of a flag with two names: also keeps the one that was typed, as `DEST_flag`, for errors."""

    def __call__(self, parser: Any, namespace: Any, values: Any, option_string: str | None = None) -> None:
        setattr(namespace, self.dest, values)
        setattr(namespace, f"{self.dest}_flag", option_string)


def tell_error(message: str) -> None:
    """Say what is wrong, in one line.

    Args:
        message: of any lines.
    """
    tell("error", message)


def tell(kind: str, message: str) -> None:
    """Say something on stderr, in one line.

    Args:
        kind: "error" or "warning".
        message: of any lines.
    """
    told = ERRNO.sub("", " ".join(message.splitlines()))
    sys.stderr.write(f"{Path(sys.argv[0]).name}: {kind}: {told}\n")


def refuse(message: str) -> NoReturn:
    """End the program with code 2, and say why in one line.

    Args:
        message: of any lines.
    """
    tell_error(message)
    sys.exit(2)


def as_keys(message: str) -> str:
    """Say of a file what is said of a command line.

    Args:
        message: that names flags.

    Returns:
        The same with their keys in a TOML file.
    """
    return re.sub(r"--([a-z][a-z-]*)", lambda found: found[1].replace("-", "_"), message)


def as_path(text: str) -> str:
    """Take the value of a flag that names a file or a folder.

    Args:
        text: as it was typed; `~` is the home folder, also where the shell leaves it as it is.

    Returns:
        The path.

    Raises:
        argparse.ArgumentTypeError: for what is no path, or can neither be printed nor be written as UTF-8.
    """
    if not text.strip() or any(unicodedata.category(each) in NOT_IN_PATHS for each in text):
        raise argparse.ArgumentTypeError(f"must be a path of printable characters, got {text!r}")
    found = os.path.expanduser(text)
    if found.startswith("~") and not os.path.exists(found):
        raise argparse.ArgumentTypeError(f"no home folder is known for {text!r}; './{text}' is a path that begins so")
    return found


def make_console(width: int | None = None) -> Console:
    """Make what a command prints on. Names are shown as they are: in a file's name brackets are no markup, and colons
    no emoji.

    Args:
        width: in characters, where it is no terminal.

    Returns:
        The console.
    """
    return Console(width=None if sys.stdout.isatty() else width, markup=False, emoji=False)


def program(main: Callable[[], int]) -> NoReturn:
    """Run a command, and end the program.

    Args:
        main: returns the exit code; where Ctrl-C ends it that is 130.
    """
    for name in ("stdout", "stderr"):
        if getattr(sys, name) is None:  # it was closed before the start
            setattr(sys, name, io.StringIO())
    if isinstance(sys.stdout, io.TextIOWrapper):
        # A terminal that knows no σ shall not end what it is told about, and a pipe is to have each line as it comes.
        sys.stdout.reconfigure(errors="replace", line_buffering=True)
    signal.signal(signal.SIGINT, signal.default_int_handler)
    with _told_plainly():
        try:
            sys.exit(main())
        except KeyboardInterrupt:
            sys.stderr.write(f"{Path(sys.argv[0]).name}: stopped\n")
            sys.exit(130)


@contextmanager
def _told_plainly() -> Iterator[None]:
    """Say what takes long as it is: a library may have told logging to put the names of level and logger before it."""
    log, handler = logging.getLogger("haptic_slam"), logging.StreamHandler()
    handler.setFormatter(logging.Formatter("%(message)s"))
    log.addHandler(handler)
    log.propagate = False
    try:
        yield
    finally:
        log.propagate = True
        log.removeHandler(handler)
