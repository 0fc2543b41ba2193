"""What the documents say runs, their tables say what the code does, and what they name is there."""

from __future__ import annotations

import ast
import builtins
import inspect
import pkgutil
import re
from pathlib import Path

import pytest

from haptic_env import hands
from haptic_env.explore import ExploreEnv
from haptic_lab.cli import COMMANDS
from haptic_lab.exploration import output
from haptic_lab.figures import FIGURES
from haptic_lab.sweeps import measures, options
from observer import OBSERVERS, Belief
from observer.variants import ABLATION
from tests.scripts import documents
from tests.scripts.documents import DOCUMENTS, README, ROOT

LONGEST = 150  # lines of a front door
NEW = {  # files that a reader may add
    "haptic_env/shapes/egg.py",
    "haptic_env/hands/three_finger.py",
    "agents/follow.py",
    "observer/classifiers/mine.py",
    "haptic_lab/figures/mine.py",
}
ELSEWHERE = {"--logdir", "--nthreads", "--nworkers", "--array", "--cpus-per-task", "--time"}  # TensorBoard, dask, Slurm
FOREIGN = {  # classes of Gymnasium and Stable-Baselines3
    *("AutoresetMode", "Box", "DummyVecEnv", "RecordEpisodeStatistics", "RecordVideo", "SyncVectorEnv", "VecNormalize"),
}
FOLDERS = r"(?:scripts|tests|haptic_lab|observer|haptic_env|agents|docs)/"
WITH_EXAMPLES = [each for each in DOCUMENTS if documents.examples(each)]
each_document = pytest.mark.parametrize("document", DOCUMENTS, ids=documents.name_of)


@pytest.mark.parametrize("document", WITH_EXAMPLES, ids=documents.name_of)
def test_every_example_runs(document: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    names: dict[str, object] = {}
    for block in documents.examples(document):
        exec(compile(block, document.name, "exec"), names)


def test_the_documents_that_say_how_things_are_used_have_examples() -> None:
    names = {documents.name_of(each).removeprefix("docs/") for each in WITH_EXAMPLES}
    assert {"README.md", "environment.md", "belief.md", "policies.md", "learning.md", "recordings.md"} <= names
    assert {"tutorials/people.md", "tutorials/policies.md", "howto/noise.md"} <= names


def test_the_sweep_in_toml_is_one(tmp_path: Path) -> None:
    text = (ROOT / "docs" / "commands.md").read_text()
    (sweep,) = [block for _, kind, block in documents.BLOCK.findall(text) if kind == "toml"]
    (tmp_path / "sweep.toml").write_text(sweep)
    arguments = ["--config", str(tmp_path / "sweep.toml"), "--out", str(tmp_path / "out")]
    assert len(options.check(None, arguments).conditions) == 3 * 2 * 2 * 2


def test_the_table_of_keywords_is_that_of_the_environment() -> None:
    parameters = list(inspect.signature(ExploreEnv).parameters.values())
    parameters += inspect.signature(hands.HANDS["two_finger"]).parameters.values()
    expected = {each.name: each.default for each in parameters if each.kind is not each.VAR_KEYWORD}
    del expected["hand"]  # which the id decides
    rows = documents.table("environment.md", "keyword").items()
    assert {name.strip("`"): ast.literal_eval(default.strip("`")) for name, (default, _) in rows} == expected


def test_the_tables_of_brackets_and_of_the_belief_are_complete() -> None:
    assert [name.strip("`") for name in documents.table("belief.md", "name")] == list(OBSERVERS)
    fields = set(re.findall(r"`(\w+)`", " ".join(documents.table("belief.md", "field"))))
    assert fields <= {*Belief.__dataclass_fields__, "occupancy"}
    assert {"joint_angles", "lagged_joint_angles", "occupancy", "grid", "weights", "particles"} <= fields


def test_every_command_and_every_figure_is_explained() -> None:
    told = re.findall(r"`([\w-]+)`", " ".join(documents.table("commands.md", "command")))
    assert sorted(told) == sorted(COMMANDS)
    assert {name.strip("`") for name in documents.table("commands.md", "name")} == set(FIGURES)


def test_the_columns_of_a_sweep_and_the_arrays_of_an_exploration_are_explained() -> None:
    told = re.findall(r"`([\w]+)`", " ".join(documents.table("tables.md", "column")))
    assert sorted(told) == sorted([*measures.MEASURES, *measures.HISTOGRAMS, *measures.COURSES])
    arrays = re.findall(r"`([\w]+)`", " ".join(documents.table("tables.md", "array of `explore.npz`")))
    assert sorted(arrays) == sorted(re.findall(r"^ +(\w+)=", inspect.getsource(output.save_trace), flags=re.MULTILINE))


def test_every_variant_of_the_ablation_is_explained() -> None:
    rows = documents.table("notes/ablation.md", "variant | what is changed")
    assert [name.strip("`") for name in rows] == list(ABLATION[1:])


@each_document
def test_files_that_it_names_exist(document: Path) -> None:
    for name in re.findall(FOLDERS + r"[\w./]*\w", document.read_text()):
        assert (ROOT / name).exists() or name in NEW, name


@each_document
def test_what_it_calls_by_its_module_is_there(document: Path) -> None:
    text = re.sub(r"\w+\.md", "", document.read_text())
    for name in re.findall(r"\b(?:haptic_lab|observer|haptic_env|agents)(?:\.[a-zA-Z]\w*)+", text):
        pkgutil.resolve_name(name)


@each_document
def test_classes_that_it_names_exist(document: Path) -> None:
    packages = ("haptic_lab", "agents", "observer", "haptic_env")
    code = "\n".join(path.read_text() for name in packages for path in (ROOT / name).rglob("*.py"))
    known = {*re.findall(r"^class (\w+)", code, flags=re.MULTILINE), *dir(builtins), *FOREIGN}
    assert set(re.findall(r"`([A-Z][a-z]\w*)\b", document.read_text())) <= known


@each_document
def test_flags_that_it_names_exist(document: Path) -> None:
    text = document.read_text()
    for command, arguments in re.findall(r"haptic-slam ([a-z][a-z-]*)([^\n`|]*)", text):
        assert command in COMMANDS, command
        assert set(re.findall(r"--[a-z][\w-]*", arguments)) <= documents.flags(command), f"{command}{arguments}"
    fuzz = set(re.findall(r'"(--[\w-]+)"', (ROOT / "tests/properties/fuzz.py").read_text()))
    assert set(re.findall(r"(?<![\w-])--[a-z][\w-]*", text)) <= documents.every_flag() | fuzz | ELSEWHERE


def test_every_command_of_slam_is_a_script_too() -> None:
    scripts = {path.stem for path in (ROOT / "scripts").glob("*.py")}
    assert scripts | {"replay"} == {name.replace("-", "_") for name in COMMANDS}


@each_document
def test_its_links_lead_somewhere(document: Path) -> None:
    for path, anchor in documents.links(document):
        place = (document.parent / path).resolve() if path else document
        assert place.exists(), path
        assert not anchor or anchor in documents.anchors(place), f"{path}#{anchor}"


def test_every_document_is_reached_from_the_front_door() -> None:
    reached, waiting = {README}, [README]
    while waiting:
        document = waiting.pop()
        found = {(document.parent / path).resolve() for path, _ in documents.links(document) if path.endswith(".md")}
        waiting += found - reached
        reached |= found
    assert reached >= set(DOCUMENTS)


def test_the_front_door_is_short() -> None:
    assert len(README.read_text().splitlines()) <= LONGEST
