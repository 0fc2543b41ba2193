"""What the README says runs, and its tables say what the code does."""

from __future__ import annotations

import ast
import inspect
import re
from pathlib import Path

import pytest

from haptic_env import hands
from haptic_env.explore import ExploreEnv
from observer import OBSERVERS, Belief

README = (Path(__file__).resolve().parents[2] / "README.md").read_text()


def table(heading: str) -> dict[str, list[str]]:
    """The rows of the first table whose first column is called `heading`, by their first cell."""
    _, _, rest = README.partition(f"| {heading} |")
    rows = rest.partition("\n\n")[0].splitlines()[2:]
    cells = [[cell.strip() for cell in row.strip("|").split("|")] for row in rows]
    return {first: others for first, *others in cells}


def test_every_example_runs(capsys: pytest.CaptureFixture) -> None:
    names: dict[str, object] = {}
    for block in re.findall(r"```python\n(.*?)```", README, flags=re.DOTALL):
        exec(compile(block, "README.md", "exec"), names)
    assert "cube" in capsys.readouterr().out


def test_the_table_of_keywords_is_that_of_the_environment() -> None:
    parameters = list(inspect.signature(ExploreEnv).parameters.values())
    parameters += inspect.signature(hands.HANDS["two_finger"]).parameters.values()
    expected = {each.name: each.default for each in parameters if each.kind is not each.VAR_KEYWORD}
    del expected["hand"]  # which the id decides
    told = {name.strip("`"): ast.literal_eval(default.strip("`")) for name, (default, _) in table("keyword").items()}
    assert told == expected


def test_the_tables_of_brackets_and_of_the_belief_are_complete() -> None:
    assert [name.strip("`") for name in table("name")] == list(OBSERVERS)
    fields = set(re.findall(r"`(\w+)`", " ".join(table("field"))))
    assert fields <= {*Belief.__dataclass_fields__, "occupancy"}
    assert {"joint_angles", "lagged_joint_angles", "occupancy", "grid", "weights", "particles"} <= fields


def test_files_that_it_names_exist() -> None:
    root = Path(__file__).resolve().parents[2]
    for name in re.findall(r"\]\(([\w./]+\.\w+|LICENSE)\)", README):
        assert (root / name).exists(), name
    for name in re.findall(r"scripts/\w+\.py", README):
        assert (root / name).exists(), name
