"""What the README says runs, its tables say what the code does, and what the documents name is there."""

from __future__ import annotations

import ast
import inspect
import re
from pathlib import Path

import pytest

from haptic_env import hands
from haptic_env.explore import ExploreEnv
from haptic_lab.sweeps import options
from observer import OBSERVERS, Belief
from observer.variants import ABLATION

ROOT = Path(__file__).resolve().parents[2]
README = (ROOT / "README.md").read_text()
EXAMPLES = {  # of files that a reader may add
    "haptic_env/shapes/egg.py",
    "haptic_env/hands/three_finger.py",
    "agents/follow.py",
    "observer/classifiers/mine.py",
    "haptic_lab/figures/mine.py",
}
ELSEWHERE = {"--logdir", "--nthreads", "--nworkers"}  # of TensorBoard and of dask worker
DOCUMENTS = [ROOT / "README.md", *sorted((ROOT / "docs").glob("*.md"))]


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


def test_the_sweep_in_toml_is_one(tmp_path: Path) -> None:
    (text,) = re.findall(r"```toml\n(.*?)```", README, flags=re.DOTALL)
    (tmp_path / "sweep.toml").write_text(text)
    arguments = ["--config", str(tmp_path / "sweep.toml"), "--out", str(tmp_path / "out")]
    assert len(options.check(None, arguments).conditions) == 3 * 2 * 2 * 2


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


@pytest.mark.parametrize("document", DOCUMENTS, ids=lambda path: path.name)
def test_files_that_it_names_exist(document: Path) -> None:
    text = document.read_text()
    for name in re.findall(r"\]\(([\w./]+\.\w+|LICENSE)\)", text):
        assert (document.parent / name).exists(), name
    for name in re.findall(r"(?:scripts|tests|haptic_lab|observer|haptic_env|agents)/[\w/]+\.py", text):
        assert (ROOT / name).exists() or name in EXAMPLES, name


@pytest.mark.parametrize("document", DOCUMENTS, ids=lambda path: path.name)
def test_flags_that_it_names_exist(document: Path) -> None:
    text = document.read_text()
    for script, arguments in re.findall(r"python (scripts/\w+\.py)([^\n`]*)", text):
        assert set(re.findall(r"--[a-z][\w-]*", arguments)) <= flags(script), f"{script}{arguments}"
    every = set().union(*(flags(f"scripts/{path.name}") for path in (ROOT / "scripts").glob("*.py")))
    every |= flags("tests/properties/fuzz.py")
    assert set(re.findall(r"--[a-z][\w-]*", text)) <= every | ELSEWHERE


def test_every_variant_of_the_ablation_is_explained() -> None:
    text = (ROOT / "docs" / "observer.md").read_text()
    table = text.partition("| variant | what is changed |")[2].partition("\n\n")[0]
    assert re.findall(r"^\| `([\w+]+)` \|", table, flags=re.MULTILINE) == list(ABLATION[1:])


def flags(script: str) -> set[str]:
    """What the command line of `script` takes."""
    if script == "scripts/evaluate.py":
        _, found = options.make_parser(None)
        return {"--help", "--config", *(flag for each in found.values() for flag in each.option_strings)}
    return {
        "--help",
        *re.findall(r'"(--[\w-]+)"', (ROOT / script.replace("scripts/", "haptic_lab/commands/")).read_text()),
    }
