"""What is missing is named with a line for the shell that installs it, from wherever this was installed."""

from __future__ import annotations

import json
from pathlib import Path

import pytest

from haptic_env import extras

ROOT = Path(extras.__file__).resolve().parents[1]


class Distribution:
    """As installed from `url`."""

    def __init__(self, url: str | None) -> None:
        self._url = url

    def read_text(self, _: str) -> str | None:
        return None if self._url is None else json.dumps({"dir_info": {}, "url": self._url})


@pytest.fixture
def installed(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> Path:
    """The folder of an installed package, beside which there is no checkout."""
    site = tmp_path / "site"
    monkeypatch.setattr(extras, "__file__", str(site / "haptic_env" / "extras.py"))
    return tmp_path


@pytest.mark.parametrize("inside", [True, False])
def test_in_a_checkout_it_is_that_of_the_checkout(
    inside: bool, monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    monkeypatch.chdir(ROOT if inside else tmp_path)
    assert extras.how_to_install("meshes") == f"pip install -e '{'.' if inside else ROOT}[meshes]'"


def test_installed_from_a_clone_it_is_that_of_the_clone(installed: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    clone = installed / "a clone é"
    monkeypatch.setattr(extras.metadata, "distribution", lambda _: Distribution(clone.as_uri()))
    assert extras.how_to_install("live") == "pip install 'haptic-slam[live]'"  # it is not there any more
    clone.mkdir()
    (clone / "pyproject.toml").touch()
    assert extras.how_to_install("live") == f"pip install '{clone}[live]'"
    monkeypatch.chdir(clone)
    assert extras.how_to_install("live") == "pip install '.[live]'"


def test_from_anywhere_else_it_is_by_name(installed: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(extras.metadata, "distribution", lambda _: Distribution(None))
    assert extras.how_to_install("train") == "pip install 'haptic-slam[train]'"

    def not_installed(_: str) -> Distribution:
        raise extras.metadata.PackageNotFoundError

    monkeypatch.setattr(extras.metadata, "distribution", not_installed)
    assert extras.how_to_install("train") == "pip install 'haptic-slam[train]'"


def test_a_missing_package_is_told_with_it(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(extras, "how_to_install", lambda extra: f"install {extra}")
    with pytest.raises(ImportError, match=r"^a thing needs the package 'nothing_is_called_so': install meshes$"):
        extras.load("nothing_is_called_so", "meshes", "a thing")
