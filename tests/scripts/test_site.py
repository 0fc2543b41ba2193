"""The site is built strictly, asks nobody for anything, and its reference has every public name."""

from __future__ import annotations

import os
import re
import subprocess
import sys
from importlib import util
from pathlib import Path

import pytest
import yaml

from tests.properties.registry import ENTRIES, MODULES
from tests.properties.test_registry import _names_of
from tests.scripts.documents import DOCUMENTS, ROOT

TOLD_OF_COMMANDS = ("haptic_lab.commands.", "haptic_lab.figures.", "haptic_lab.learning.", "haptic_lab.sweeps.")
FETCHED = re.compile(r'<(?:script|link|img|iframe|video|source)\b[^>]*?\b(?:src|href)="((?:https?:)?//[^"]+)"')


@pytest.fixture(scope="module")
def site(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The folder of the built site."""
    missing = [name for name in ("mkdocs", "material", "mkdocstrings", "latex2mathml") if not util.find_spec(name)]
    if missing and "CI" not in os.environ:
        pytest.skip(f"the extra docs is not installed: {', '.join(missing)} missing")
    folder = tmp_path_factory.mktemp("site")
    command = [sys.executable, "-m", "mkdocs", "build", "--strict", "--site-dir", str(folder)]
    environment = {**os.environ, "NO_MKDOCS_2_WARNING": "1"}
    done = subprocess.run(command, cwd=ROOT, env=environment, capture_output=True, text=True)
    assert done.returncode == 0, done.stderr
    return folder


def test_it_has_every_document(site: Path) -> None:
    pages = [each.relative_to(ROOT / "docs") for each in DOCUMENTS[1:]]
    for page in pages:
        assert (site / page.with_name(page.name.replace("README.md", "index.md"))).with_suffix(".html").exists(), page


def test_nothing_is_fetched_from_elsewhere(site: Path) -> None:
    for page in site.rglob("*.html"):
        foreign = [each for each in FETCHED.findall(page.read_text()) if not each.startswith("https://haptic-slam.")]
        assert not foreign, f"{page.relative_to(site)}: {foreign}"


def test_no_equation_is_left_as_it_was_typed(site: Path) -> None:
    left = [page for page in site.rglob("*.html") if 'class="arithmatex"' in page.read_text()]
    assert not left
    assert "<math" in (site / "observer.html").read_text()


def test_what_is_published_is_what_make_builds() -> None:
    steps = yaml.safe_load((ROOT / ".github/workflows/docs.yml").read_text())["jobs"]["publish"]["steps"]
    assert "make docs" in [step.get("run") for step in steps]
    (place,) = (step["with"]["path"] for step in steps if "upload-pages-artifact" in step.get("uses", ""))
    assert f"site_dir: {place}\n" in (ROOT / "mkdocs.yml").read_text()
    assert re.search(r"^docs: .*\n\t.*mkdocs build$", (ROOT / "Makefile").read_text(), flags=re.MULTILINE)


@pytest.fixture(scope="module")
def told(site: Path) -> set[str]:
    """The names that the reference has."""
    pages = (site / "reference").glob("*.html")
    return {name for page in pages for name in re.findall(r' id="([a-z_]+\.[\w.]+)"', page.read_text())}


@pytest.mark.parametrize("module", MODULES)
def test_the_reference_has_every_public_name(told: set[str], module: str) -> None:
    missing = sorted({f"{module}.{name}" for name in _names_of(module)} - told)
    assert not missing, (
        f"add a line to a page of docs/reference for each: {', '.join(f'::: {each}' for each in missing)}"
    )


def test_the_reference_has_every_entry_point(told: set[str]) -> None:
    names = {name.partition("[")[0] for name in ENTRIES if not name.startswith(TOLD_OF_COMMANDS)}
    modules = {*MODULES, "haptic_env.shapes.mesh"}  # as a whole: those whose registry has the names
    assert {name for name in names if name not in modules and not name.startswith("haptic_env.shapes.mesh")} <= told
