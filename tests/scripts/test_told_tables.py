"""Each table of figures in the documents names, in its section, the command that makes it, its seeds and intervals."""

from __future__ import annotations

import re
from typing import NamedTuple

import pytest

from tests.haptic_lab.test_told_results import HELD
from tests.scripts import documents
from tests.scripts.documents import BLOCK, DOCUMENTS, ROOT

FIGURE = re.compile(r"[^\w]*-?\d")  # how a cell begins that tells one
MOST = 0.2  # share of cells, beyond the first of each row, that may be figures in a table of words
COMMAND = re.compile(r"\bhaptic-slam [a-z]|\bpytest -m statistical|\bmake statistics")
SEED = re.compile(r"\bseeds?\b|--first-seed \d")
TIMED = re.compile(r"\bload\b|by the clock|processor time")  # times of a machine, which no seed repeats
SPREAD = re.compile(r"95 %|±|\[\d|standard error|median")
DEFINED = {  # tables of what was decided, not found: heading, and what holds them instead
    "bytes": "sizes of arrays",
    "entry | numbers": "spaces: tests/haptic_lab/tasks",
    "id | hand | J | P": "hands: tests/haptic_lab/test_hand_documents.py",
    "joint | moves": "the same",
    "joint | unit | least": "the same",
    "keyword | default": "tests/scripts/test_readme.py",
    "name | hand | joints": "the same as of hands",
    "preset | keyword": "what others published, each with its source",
    "what | valid": "limits of what is read",
}


class Table(NamedTuple):
    """A table of a document.

    Attributes:
        document: where it lies in the repository.
        heading: its first line.
        cells: of all rows, beyond the first of each.
        section: text between the headings about it.
    """

    document: str
    heading: str
    cells: tuple[str, ...]
    section: str

    @property
    def of_figures(self) -> bool:
        return sum(bool(FIGURE.match(each)) for each in self.cells) > MOST * len(self.cells)

    @property
    def defined(self) -> bool:
        return any(each in self.heading for each in DEFINED)


def tables_in(document: str, text: str) -> list[Table]:
    """The tables of a text, each with the section that it stands in."""
    text = BLOCK.sub("", text)
    found = []
    for section in re.split(r"^(?=#+ )", text, flags=re.MULTILINE):
        for lines in re.findall(r"(?:^\|.*\n?)+", section, flags=re.MULTILINE):
            heading, _, *rows = lines.splitlines()
            cells = [cell.strip() for row in rows for cell in row.strip("|").split("|")[1:]]
            found.append(Table(document, heading.strip("| "), tuple(cells), section))
    return found


TABLES = [each for path in DOCUMENTS for each in tables_in(documents.name_of(path), path.read_text())]
TOLD = [each for each in TABLES if each.of_figures and not each.defined]


def missing(table: Table) -> list[str]:
    """What the section of a table does not say of its figures."""
    asked = {"command": COMMAND, "seeds": SEED, "interval": SPREAD}
    if TIMED.search(table.section):
        del asked["seeds"]
    return [name for name, pattern in asked.items() if not pattern.search(table.section)]


@pytest.mark.parametrize("table", TOLD, ids=[f"{each.document}: {each.heading[:40]}" for each in TOLD])
def test_figures_are_told_with_their_command_seeds_and_interval(table: Table) -> None:
    lacks = missing(table)
    assert not lacks, (
        f"{table.document}: nothing of {', '.join(lacks)} in the section of the table {table.heading!r}; name "
        "`haptic-slam ...` or `pytest -m statistical ...` that makes it, or add it to DEFINED if nothing was found out"
    )


def held(table: Table) -> bool:
    """Whether result files hold it, and all tables of its document that are called alike."""
    document, begins = table.document.removeprefix("docs/"), f"{table.heading} |"
    mine = [each for each in HELD if each.document == document and begins.startswith(f"{each.heading} |")]
    return len(mine) == sum((each.document, each.heading) == (table.document, table.heading) for each in TOLD)


def test_what_no_file_holds_is_told_with_its_reason() -> None:
    told = documents.table("tables.md", "page | which of its tables, and why")
    listed = {page for each in told for page in re.findall(r"\]\((.*?)\)", each)}
    without = {each.document.removeprefix("docs/") for each in TOLD if not held(each)}
    assert without == listed, (
        "declare it in HELD of test_told_results.py, or say in docs/tables.md why no file holds it"
    )
    assert all(why for (why,) in told.values())


def test_each_result_file_is_told() -> None:
    told = documents.table("tables.md", "file | what it is of")
    assert sorted(re.findall(r"`(\w+\.csv)`", " ".join(told))) == sorted(
        path.name for path in (ROOT / "docs" / "results").iterdir()
    )


def test_tables_of_figures_are_found() -> None:
    assert len(TOLD) > 30
    assert all(any(each in table.heading for table in TABLES if table.of_figures) for each in DEFINED)
    told = "## A\nseeds 3 to 5, `haptic-slam evaluate`, 95 % intervals\n\n| a | b |\n|---|---|\n| x | 3 [2, 4] |\n"
    (whole,) = tables_in("a.md", told)
    assert (whole.of_figures, whole.heading, missing(whole)) == (True, "a | b", [])
    for part, name in (("haptic-slam", "command"), ("seeds", "seeds")):
        (table,) = tables_in("a.md", told.replace(part, ""))
        assert missing(table) == [name]
    (none,) = tables_in("a.md", "## A\nseeds, `haptic-slam evaluate`\n## B\n\n| a | b |\n|---|---|\n| x | 3 |")
    assert missing(none) == ["command", "seeds", "interval"]
