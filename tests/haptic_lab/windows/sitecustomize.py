"""Plays Windows, as far as Linux can, in every process that has this folder on its PYTHONPATH.

The play begins when the first of our modules is imported. What is installed has builds of its own for each system, and
has been imported before, as on Linux. From then on the system calls itself win32, names that POSIX alone has are gone,
spawn is the only way to start a process, a file that is open can be neither moved nor removed, lines end otherwise, and
text that is read or written in the encoding of the machine is an error. Each process that plays writes its number to
the file PLAYBILL.
"""

from __future__ import annotations

import contextlib
import functools
import importlib
import importlib.abc
import os
import sys
import types
from collections.abc import Callable
from typing import Any

OURS = ("agents", "haptic_env", "haptic_lab", "observer")
INSTALLED = (
    "concurrent.futures.process dm_control.mjcf filelock gymnasium.envs.mujoco.mujoco_rendering joblib "
    "matplotlib.backends.backend_agg matplotlib.pyplot mujoco multiprocessing.pool multiprocessing.popen_spawn_posix "
    "multiprocessing.resource_tracker numba numba.core.codegen numba.core.registry numba.np.arraymath pandas "
    "platformdirs rich.live rich.progress scipy.ndimage scipy.optimize scipy.spatial scipy.stats sklearn.ensemble "
    "threadpoolctl"
)
LACKING = {
    "os": "chown fchmod fork forkpty getegid geteuid getgid getloadavg getuid killpg mkfifo nice register_at_fork "
    "sched_getaffinity setsid uname",
    "signal": "SIGALRM SIGCHLD SIGHUP SIGKILL SIGUSR1 alarm pthread_kill pthread_sigmask setitimer sigwait",
}
# What asks for the system whenever it is called, to deal with the locks and libraries that there are.
BEHIND = "ctypes multiprocessing.queues multiprocessing.synchronize threadpoolctl"
MODULES = "fcntl grp pwd resource termios tty pty syslog"
MOVING = "remove rename replace unlink"


def _not_open(change: Callable[..., None]) -> Callable[..., None]:
    """`change` of files, which Windows refuses while one of them is open."""

    @functools.wraps(change)
    def refusing(*files: Any, **keywords: Any) -> None:
        open_here = {os.path.realpath(f"/proc/self/fd/{number}") for number in os.listdir("/proc/self/fd")}
        for each in files:
            if os.path.realpath(each) in open_here:
                raise PermissionError(13, "The process cannot access the file because it is open", str(each))
        change(*files, **keywords)

    return refusing


def _play() -> None:
    import multiprocessing.resource_tracker
    import pathlib
    import warnings

    warnings.simplefilter("ignore", EncodingWarning)  # of what is installed
    for name in f"{INSTALLED} {os.environ.pop('PLAY_AFTER', '')}".split():
        with contextlib.suppress(ImportError):  # of an extra
            importlib.import_module(name)
    multiprocessing.resource_tracker.ensure_running()  # spawn needs it on POSIX, where it blocks signals as it starts
    real = {"os": types.SimpleNamespace(**vars(os)), "sys": types.SimpleNamespace(**vars(sys))}
    for name in BEHIND.split():
        scene = vars(importlib.import_module(name))
        scene |= {called: real[called.strip("_")] for called in scene.keys() & {"os", "_os", "sys", "_sys"}}
    for module, names in LACKING.items():
        for name in names.split():
            vars(sys.modules[module]).pop(name, None)
    for name in MOVING.split():
        setattr(os, name, _not_open(getattr(os, name)))
    for name in MODULES.split():
        sys.modules[name] = None  # type: ignore[assignment]  # so that its import fails
    pathlib.WindowsPath = pathlib.PosixPath  # type: ignore[misc]  # which Path makes where os.name is nt
    sys.platform, os.name, os.linesep = "win32", "nt", "\r\n"
    with open(os.environ["PLAYBILL"], "a", encoding="utf-8") as bill:
        print(os.getpid(), file=bill)
    warnings.filterwarnings("error", category=EncodingWarning, module=rf"({'|'.join(OURS)})(\.|$)")


class _Curtain(importlib.abc.MetaPathFinder):
    """Begins the play when it is asked for one of our modules."""

    def find_spec(self, name: str, path: object = None, target: object = None) -> None:
        if name.partition(".")[0] in OURS and self in sys.meta_path:
            sys.meta_path.remove(self)
            _play()


sys.meta_path.insert(0, _Curtain())
