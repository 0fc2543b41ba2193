"""Provenance of the rows of a table: versions of packages and interpreter, and a digest of the code."""

from __future__ import annotations

import hashlib
import importlib.metadata
import platform
from functools import lru_cache
from pathlib import Path

import agents
import haptic_env
import observer as observer_package

PACKAGES = ("haptic-slam", "gymnasium", "mujoco", "numba", "numpy", "scipy", "scikit-learn")


@lru_cache
def versions() -> dict[str, str]:
    """Say what figures may depend on.

    Returns:
        Versions of packages and interpreter, and a digest of this project's own code, by name.
    """
    digest = hashlib.sha256()
    for package in (haptic_env, observer_package, agents):
        root = Path(str(package.__file__)).parent
        for path in sorted(root.rglob("*.py")):
            digest.update(path.relative_to(root).as_posix().encode() + path.read_bytes())
    found = {f"version_{name}": importlib.metadata.version(name) for name in PACKAGES}
    return found | {"version_python": platform.python_version(), "code": digest.hexdigest()[:12]}


@lru_cache
def signature() -> dict[str, str]:
    """Say what must be the same wherever the rows of one table are made.

    Returns:
        By name, as text.
    """
    digest = hashlib.sha256()
    root = Path(__file__).parents[1]
    for path in sorted(root.rglob("*.py")):
        digest.update(path.relative_to(root).as_posix().encode() + path.read_bytes())
    return {**versions(), "haptic_lab": digest.hexdigest()[:12]}
