"""Compiled code on disk: never stale, never half written, and no reason to fail."""

from __future__ import annotations

import os
import subprocess
import sys
import textwrap
import types

import numpy as np
import pytest

from haptic_env import cache, kernel_cache
from haptic_env.compiled import inner, kernel


def _made(text: str, **names):
    """The functions of a module with this source and these names."""
    module = types.ModuleType("made")
    vars(module).update(names, kernel=kernel, inner=inner, np=np)
    exec(textwrap.dedent(text), vars(module))
    return module


CALLER = """
    @kernel()
    def double(x):
        return FACTOR * step(x) + TABLE[0]
"""
STEP = """
    @inner()
    def step(x):
        return x + 1.0
"""


def _digest(caller: str = CALLER, step: str = STEP, factor: float = 2.0, table=(0.0, 1.0)) -> str:
    names = {"FACTOR": factor, "TABLE": np.array(table), "step": _made(step).step}
    return kernel_cache.digest_of(_made(caller, **names).double)


def test_the_same_code_has_the_same_digest_wherever_it_stands():
    assert _digest() == _digest(caller="\n\n\n" + CALLER)
    assert _digest() == _digest(step='    @inner()\n    def step(x):\n        """A word."""\n        return x + 1.0\n')


@pytest.mark.parametrize(
    "changed",
    [
        {"caller": CALLER.replace("TABLE[0]", "TABLE[1]")},
        {"caller": CALLER.replace("@kernel()", "@kernel(fastmath=True)")},
        {"step": STEP.replace("1.0", "2.0")},
        {"step": STEP.replace("@inner()", "@inner(fastmath=True)")},
        {"step": STEP.replace("(x)", "(x, y=3.0)")},
        {"factor": 3.0},
        {"factor": 2},
        {"table": (0.5, 1.0)},
    ],
)
def test_whatever_machine_code_follows_from_is_in_the_digest(changed):
    assert _digest(**changed) != _digest()


def test_what_is_read_of_a_module_is_in_the_digest():
    numbers = [types.SimpleNamespace(), types.ModuleType("a"), types.ModuleType("b")]
    for module, factor in zip(numbers[1:], (2.0, 3.0), strict=True):
        module.FACTOR = factor
    caller = "    @kernel()\n    def double(x):\n        return numbers.FACTOR * x\n"
    one, two = (kernel_cache.digest_of(_made(caller, numbers=each).double) for each in numbers[1:])
    assert one != two


def test_what_is_not_known_to_stay_the_same_is_refused():
    caller = "    @kernel()\n    def double(x):\n        return x if thing else x\n"
    with pytest.raises(TypeError, match="a kernel reads"):
        kernel_cache.digest_of(_made(caller, thing=object()).double)


PROBE = """
import sys
sys.path.insert(0, sys.argv[1])
from numba.core import event
compiled = []
class Listener(event.Listener):
    def on_start(self, event): pass
    def on_end(self, event): compiled.append(event.data["dispatcher"].py_func.__name__)
event.register("numba:compile", Listener())
from upper import result
print(result(1.0), "result" in compiled)
"""


def test_an_edit_of_a_callee_in_another_file_takes_effect(tmp_path, monkeypatch):
    """numba's own cache goes on with the old machine code (numba #3772)."""
    monkeypatch.setenv(cache.VARIABLE, str(tmp_path / "cache"))
    head = "from haptic_env.compiled import inner, kernel\n"
    (tmp_path / "lower.py").write_text(head + "NUMBER = 3.0\n@inner()\ndef each(x):\n    return x + NUMBER\n")
    (tmp_path / "upper.py").write_text(
        head + "from lower import each\n@kernel()\ndef result(x):\n    return 2.0 * each(x)\n"
    )

    def run() -> str:
        path = os.pathsep.join(filter(None, sys.path))
        command = [sys.executable, "-c", PROBE, str(tmp_path)]
        ran = subprocess.run(
            command, capture_output=True, text=True, env={**os.environ, "PYTHONPATH": path}, check=True, timeout=120
        )
        return ran.stdout.strip()

    assert run() == "8.0 True"
    assert run() == "8.0 False"
    lower = tmp_path / "lower.py"
    lower.write_text(lower.read_text().replace("3.0", "4.0"))
    assert run() == "10.0 True"


def _fresh():
    return _made("    @kernel()\n    def triple(x):\n        return 3.0 * x\n").triple


def _misses(dispatcher) -> int:
    return sum(dispatcher.stats.cache_misses.values())


MOVED = b"cobserver.solid_fields\nKernel\n.", b"cnowhere\nkernel\n.", b"cos\nno_kernel\n."


@pytest.mark.parametrize("spoilt", [b"", b"\x80\x05K", b"not a pickle", *MOVED])
def test_what_cannot_be_read_is_compiled_anew(tmp_path, monkeypatch, spoilt):
    monkeypatch.setenv(cache.VARIABLE, str(tmp_path))
    assert _fresh()(2.0) == 6.0
    (kept,) = (tmp_path / "kernels").glob("*.kernel")
    again = _fresh()
    assert again(2.0) == 6.0
    assert _misses(again) == 0
    kept.write_bytes(spoilt)
    once_more = _fresh()
    assert once_more(2.0) == 6.0
    assert _misses(once_more) == 1
    restored = _fresh()
    assert restored(2.0) == 6.0
    assert _misses(restored) == 0


def test_where_nothing_can_be_kept_it_still_runs(tmp_path, monkeypatch):
    monkeypatch.setenv(cache.VARIABLE, str(tmp_path))
    monkeypatch.setattr(os, "replace", _full)
    assert _fresh()(2.0) == 6.0
    assert not list((tmp_path / "kernels").iterdir())


def _full(*_):
    raise OSError("no space left on device")


def test_what_compiles_says_so_once_whoever_calls_it(tmp_path, monkeypatch, caplog):
    monkeypatch.setenv(cache.VARIABLE, str(tmp_path))
    kernel_cache._tell.cache_clear()
    made = _made(STEP + CALLER, FACTOR=2.0, TABLE=np.zeros(2))
    assert not caplog.records, "nothing is compiled before it is called"
    made.double(1.0)
    made.double(1)
    (record,) = caplog.records
    assert record.getMessage().startswith("Compiling ")
    caplog.clear()
    kernel_cache._tell.cache_clear()
    _made(STEP + CALLER, FACTOR=2.0, TABLE=np.zeros(2)).double(1.0)
    assert not caplog.records, "nothing is said of what is kept"
