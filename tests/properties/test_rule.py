"""The rule and the fuzzer know a fault when they see one."""

from __future__ import annotations

import re
from typing import Any

import numpy as np
import pytest

from haptic_env import validate
from tests.properties.fuzz import Run, fuzz, inputs_of
from tests.properties.registry import ENTRIES
from tests.properties.rule import ACCEPTED, REFUSED, Allowed, judge


def _raise(error: BaseException) -> Any:
    raise error


def _outcome(result: Any, allowed: Allowed = Allowed(), **given: Any) -> str:  # noqa: B008 - frozen
    return judge(lambda: _raise(result) if isinstance(result, BaseException) else result, given, allowed).kind


@pytest.mark.parametrize("result", [None, 1.0, "nan", np.arange(3), {"a": [np.float32(2)]}, (1, np.array(["x"]))])
def test_finite_results_are_accepted(result):
    assert _outcome(result) == ACCEPTED


@pytest.mark.parametrize(
    ("result", "kind"),
    [
        (float("nan"), "not finite: result"),
        (np.array([1.0, np.inf]), "not finite: result (infinite)"),
        ({"a": [1.0, np.nan]}, "not finite: result['a'][]"),
        (validate, ACCEPTED),
        (ValueError(""), "says nothing"),
        (ValueError("sigma_deg must be\na number"), "says it in several lines"),
        (ValueError("math domain error"), "tells neither value nor argument"),
        (ValueError("sigma_deg is \ud800"), "cannot be printed"),
        (KeyError("sigma_deg"), "KeyError at"),
        (TypeError("sigma_deg must be a number"), "TypeError at"),
        (FileNotFoundError("sigma_deg"), "FileNotFoundError at"),
        (MemoryError("sigma_deg"), "MemoryError at"),
        (AssertionError("sigma_deg"), "AssertionError at"),
        (FloatingPointError("sigma_deg"), "FloatingPointError at"),
        (ImportError("sigma_deg"), "ImportError at"),
        (SystemExit(2), "exit 2"),
    ],
)
def test_everything_else_is_a_fault_of_its_kind(result, kind):
    assert _outcome(result, sigma_deg=-3.0).startswith(kind)


@pytest.mark.parametrize(
    ("error", "allowed"),
    [
        (ValueError("sigma_deg must be a number"), Allowed()),
        (ValueError("must be a number, got -3.0"), Allowed()),
        (ValueError("the sigma deg is wrong"), Allowed()),
        (UnicodeError("sigma_deg is no text"), Allowed()),
        (ImportError("meshes need trimesh: pip install 'haptic-slam[meshes]'"), Allowed()),
        (TypeError("f() got an unexpected keyword argument 'x'"), Allowed()),
        (FileNotFoundError("no such file"), Allowed(files=True)),
        (KeyError("a library's own"), Allowed(errors=(KeyError,))),
        (ValueError("the mesh is open"), Allowed(words=("mesh",))),
    ],
)
def test_errors_that_name_the_value_or_the_argument_are_refusals(error, allowed):
    assert _outcome(error, allowed, sigma_deg=-3.0) == REFUSED


def test_what_cannot_be_said_is_nan_only_of_usual_numbers():
    allowed = Allowed(nan=True)
    assert _outcome(float("nan"), allowed, places=np.zeros((0, 3))) == ACCEPTED
    for spoilt in (np.nan, np.inf, 1e300):
        assert _outcome(float("nan"), allowed, places=np.array([0.0, spoilt])) == "not finite: result"


def test_the_same_seed_is_the_same_inputs():
    name = "observer.ContactModel"
    first, again, other = (repr(inputs_of(name, ENTRIES[name], seed=seed, count=10)) for seed in (0, 0, 1))
    assert first == again
    assert first != other


def test_the_fuzzer_counts_signals_hangs_memory_and_other_errors_and_goes_on():
    told: list[str] = []
    run = Run(examples=200, minutes=2.0, longest=0.5, registry="tests.properties.faulty")
    assert fuzz(run, tell=told.append) == 1
    for kind, entry in (
        ("signal SIGSEGV at properties/faulty.py:_killed", "k"),
        ("takes more than 0.5 s", "s"),
        ("MemoryError at properties/faulty.py:_large", "m"),
        ("KeyError at properties/faulty.py:_other", "o"),
    ):
        assert re.search(
            rf"\d+ × faulty: {re.escape(kind)}\n +--again '{entry}' \d+\.\d+\.\d+\n +{{'count': 3}}", told[0]
        )
    faults, inputs = (int(each) for each in re.search(r"all +(\d+) +(\d+)", told[0]).groups()[::-1])
    assert 4 <= faults < inputs
