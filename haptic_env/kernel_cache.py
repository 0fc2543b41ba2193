"""What was compiled, kept on disk from process to process, and never stale.

numba's own cache asks whether the file of a function has changed, and goes on with old machine code where a function
that it calls, or a number that it reads, has changed in another file. Here the name of what is kept is a digest of all
that the machine code follows from: the function, whatever it calls and reads, how it is compiled, for which argument
types, which processor and by which versions.
"""

from __future__ import annotations

import contextlib
import functools
import hashlib
import logging
import os
import pickle
import sys
import tempfile
import types
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import llvmlite
import numba
import numpy as np
from numba.core import registry, serialize
from numba.core.caching import _Cache
from numba.core.compiler import CompileResult
from numba.core.dispatcher import Dispatcher

from haptic_env import cache

LOG = logging.getLogger("haptic_slam")
VERSIONS = sys.version, numba.__version__, llvmlite.__version__, np.__version__


class KernelCache(_Cache):
    """The compiled versions of one function: a file each, written whole, in a folder that nobody else can write to."""

    def __init__(self, dispatcher: Dispatcher) -> None:
        self._dispatcher = dispatcher

    @property
    def cache_path(self) -> str:
        """The folder."""
        return str(folder())

    def load_overload(self, sig: Any, target_context: Any) -> Any:
        """Read the compiled version for the argument types `sig`.

        Args:
            sig: types of the arguments.
            target_context: numba's, which the code is bound to.

        Returns:
            The `CompileResult`, or None where none is kept.
        """
        target_context.refresh()  # numba's own functions may not be there yet
        try:
            payload = pickle.loads(self._place(sig).read_bytes())
            return CompileResult._rebuild(target_context, *payload)
        except FileNotFoundError:
            pass
        except (OSError, EOFError, pickle.UnpicklingError, ValueError):  # cut off, or unreadable: compiled anew
            pass
        except (ImportError, AttributeError, Warning):  # it names a module that was moved since: likewise
            pass
        _tell()
        return None

    def save_overload(self, sig: Any, data: Any) -> None:
        """Keep a compiled version; where that fails, it is compiled again in the next process.

        Args:
            sig: types of the arguments.
            data: the `CompileResult`.
        """
        if data.library.has_dynamic_globals or data.lifted:
            return
        place = self._place(sig)
        with contextlib.suppress(OSError):
            file, name = tempfile.mkstemp(dir=place.parent, prefix=".", suffix=".tmp")
            try:
                with os.fdopen(file, "wb") as out:
                    out.write(serialize.dumps(data._reduce()))
                os.replace(name, place)
            except BaseException:
                with contextlib.suppress(OSError):
                    os.unlink(name)
                raise

    def _place(self, sig: Any) -> Path:
        function = self._dispatcher.py_func
        key = repr((VERSIONS, machine(), str(sig), digest_of(self._dispatcher)))
        name = f"{function.__module__}.{function.__qualname__}".replace("<", "").replace(">", "")
        return folder() / f"{name}-{hashlib.sha256(key.encode()).hexdigest()[:32]}.kernel"

    def enable(self) -> None:
        """Nothing: it is never off."""

    def disable(self) -> None:
        """Nothing: it is never off."""

    def flush(self) -> None:
        """Nothing: what is kept stays right."""


@functools.cache
def _tell() -> None:
    """Say, once in a process, that something is compiled, whoever asked for it."""
    LOG.warning("Compiling what this version has not run on this machine yet; it is kept, so that this is once …")


def folder() -> Path:
    """Find where compiled code is kept; see `haptic_env.cache.folder`.

    Returns:
        The folder, which exists.
    """
    return _made(cache.folder())


@functools.cache
def _made(place: Path) -> Path:
    kernels = place / "kernels"
    kernels.mkdir(mode=0o700, exist_ok=True)
    return kernels


def machine() -> str:
    """Tell the processor that code is compiled for, with all that it can.

    Returns:
        Its description by LLVM.
    """
    return repr(registry.cpu_target.target_context.codegen().magic_tuple())


def digest_of(dispatcher: Dispatcher) -> str:
    """Sum up all that the machine code of a compiled function follows from but its argument types and the machine.

    Args:
        dispatcher: the compiled function.

    Returns:
        SHA-256, in hexadecimal digits.
    """
    return _digest(dispatcher, ())


def _digest(dispatcher: Dispatcher, callers: tuple[Dispatcher, ...]) -> str:
    if dispatcher in callers:  # it calls itself
        return str(callers.index(dispatcher))
    known = _KNOWN.get(dispatcher)
    if known is None:
        function, callers = dispatcher.py_func, (*callers, dispatcher)
        told = hashlib.sha256(repr(sorted(dispatcher.targetoptions.items())).encode())
        code = function.__code__
        read = [cell.cell_contents for cell in function.__closure__ or ()] + list(function.__defaults__ or ())
        for name in _names(code):
            if name in function.__globals__:
                value = function.__globals__[name]
                read.append(value)
                if isinstance(value, types.ModuleType):  # what may be read of it
                    read += [getattr(value, each) for each in _names(code) if hasattr(value, each)]
        for each in (*_code(code, function.__doc__), *(_told(value, callers) for value in read)):
            told.update(each.encode() + b"\0")
        known = _KNOWN[dispatcher] = told.hexdigest()
    return known


_KNOWN: dict[Dispatcher, str] = {}


def _names(code: types.CodeType) -> Iterator[str]:
    yield from code.co_names
    for const in code.co_consts:
        if isinstance(const, types.CodeType):
            yield from _names(const)


def _code(code: types.CodeType, doc: str | None = None) -> Iterator[str]:
    """What a function does, wherever it stands and whatever its docstring says."""
    yield repr((code.co_code, code.co_names, code.co_varnames, code.co_argcount, code.co_freevars, code.co_cellvars))
    for const in code.co_consts:
        if isinstance(const, types.CodeType):
            yield from _code(const)
        elif const is not doc:
            yield repr(const)


def _told(value: Any, callers: tuple[Dispatcher, ...]) -> str:
    if isinstance(value, Dispatcher):
        return _digest(value, callers)
    if isinstance(value, np.ndarray):
        return f"{value.dtype} {value.shape} {hashlib.sha256(value.tobytes()).hexdigest()}"
    if isinstance(value, tuple):
        return repr([_told(each, callers) for each in value])
    if isinstance(value, types.ModuleType):
        return value.__name__
    if isinstance(value, type):
        return repr((value.__module__, value.__qualname__, getattr(value, "_fields", None)))
    if isinstance(value, (bool, int, float, complex, str, bytes, type(None), np.generic)):
        return repr(value)
    if hasattr(value, "__qualname__") or hasattr(value, "__name__"):  # of Python, NumPy or numba: as their versions
        return f"{getattr(value, '__module__', '')} {getattr(value, '__qualname__', getattr(value, '__name__', ''))}"
    raise TypeError(f"a kernel reads {value!r}, of which it is not known when it changes")
