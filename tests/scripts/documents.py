"""The documents that a user reads, and what can be read from them: blocks, tables, links, flags."""

from __future__ import annotations

import re
from functools import cache
from pathlib import Path

from haptic_lab.cli import COMMANDS
from haptic_lab.conditions import DEFAULTS
from haptic_lab.sweeps import options

ROOT = Path(__file__).resolve().parents[2]
README = ROOT / "README.md"
DOCUMENTS = [README, *sorted((ROOT / "docs").rglob("*.md"))]
BLOCK = re.compile(r"(<!-- not run: [^\n]+ -->\n)?^```(\w*)\n(.*?)^```$", re.DOTALL | re.MULTILINE)
LINK = re.compile(r"\]\(([^)\s]*)\)")


def name_of(document: Path) -> str:
    """Where a document lies in the repository."""
    return document.relative_to(ROOT).as_posix()


def examples(document: Path) -> list[str]:
    """The Python of a document, block by block, but for what is marked as not run with its reason."""
    return [text for marked, kind, text in BLOCK.findall(document.read_text()) if kind == "python" and not marked]


def rows(document: str, heading: str, nth: int = 0) -> list[list[str]]:
    """The rows of the `nth` table of docs/`document` whose first columns are called `heading`, cell by cell."""
    rest = (ROOT / "docs" / document).read_text().split(f"| {heading} |")[nth + 1]
    told = rest.partition("\n\n")[0].splitlines()[2:]
    return [[cell.strip() for cell in row.strip("|").split("|")] for row in told]


def table(document: str, heading: str) -> dict[str, list[str]]:
    """The rows of the first table of docs/`document` whose first columns are called `heading`, by their first cell."""
    return {first: others for first, *others in rows(document, heading)}


def links(document: Path) -> list[tuple[str, str]]:
    """The links of a document to files of this project: path, and anchor or ""."""
    every = LINK.findall(BLOCK.sub("", document.read_text()))
    found = [each.partition("#") for each in every if not each.startswith(("http:", "https:"))]
    return [(path, anchor) for path, _, anchor in found]


def anchors(document: Path) -> set[str]:
    """The anchors of a document's headings, as the usual hosts of repositories name them."""
    headings = re.findall(r"^#+ (.+)$", BLOCK.sub("", document.read_text()), flags=re.MULTILINE)
    return {re.sub(r"[^\w\- ]", "", each.lower()).replace(" ", "-") for each in headings}


@cache
def flags(command: str) -> frozenset[str]:
    """What the command line of `haptic-slam command` takes."""
    if command == "evaluate":
        _, found = options.make_parser(None)
        return frozenset({"--help", "--config", *(flag for each in found.values() for flag in each.option_strings)})
    if command == "replay":  # the recording of explore is an argument here
        return flags("explore") - {"--recording"}
    if command == "learn":  # explores, to learn
        return flags("explore")
    place = ROOT / "haptic_lab"
    text = (place / "commands" / f"{command.replace('-', '_')}.py").read_text()
    if command in ("explore", "figures", "train"):
        text += (place / "believed.py").read_text() + "".join(f'"--{name.replace("_", "-")}"' for name in DEFAULTS)
    if command == "live":
        text += (place / "believed.py").read_text()
    if command in ("explore", "live"):
        text += (place / "view" / "options.py").read_text() + (place / "exploration" / "learnt.py").read_text()
    if command == "people":
        text += (place / "people" / "table_flags.py").read_text()
    if command in ("compare", "design", "fit", "simulate"):
        text += (place / "people" / "options.py").read_text()
    if command in ("compare", "fit"):
        text += (place / "people" / "table_flags.py").read_text()
    if command == "figures":
        text += (place / "figures" / "plan.py").read_text()
    return frozenset({"--help", *re.findall(r'"(--[\w-]+)"', text)})


def every_flag() -> set[str]:
    """The flags of all commands."""
    return set().union(*map(flags, COMMANDS))
