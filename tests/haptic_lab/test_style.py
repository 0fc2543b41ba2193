"""Pictures look alike, and whoever imports this project draws on as before."""

from __future__ import annotations

import subprocess
import sys

import matplotlib

from haptic_lab.style import RC, styled

IMPORTS = """
import importlib, pkgutil, matplotlib
before = dict(matplotlib.rcParams.copy())
import haptic_lab
for module in pkgutil.walk_packages(haptic_lab.__path__, "haptic_lab."):
    if not module.name.endswith("__main__"):
        importlib.import_module(module.name)
changed = {name for name, value in before.items() if dict.__getitem__(matplotlib.rcParams, name) != value}
assert not changed, changed
"""


def test_no_module_changes_how_matplotlib_draws() -> None:
    done = subprocess.run([sys.executable, "-c", IMPORTS], capture_output=True, text=True)
    assert done.returncode == 0, done.stderr


def test_what_is_styled_draws_in_our_style_and_leaves_no_trace() -> None:
    def kept() -> dict[str, object]:
        return {name: matplotlib.rcParams[name] for name in RC}

    before = kept()
    assert before != RC

    assert styled(kept)() == RC
    assert kept() == before
