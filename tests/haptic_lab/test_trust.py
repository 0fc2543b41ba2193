"""Commands run nothing that lies in a model unless they are told that it is to be trusted."""

from __future__ import annotations

import base64
import json
import os
import shutil
import zipfile
from pathlib import Path

import pytest

from agents.sb3 import SHIPPED
from haptic_lab.commands import explore, figures
from haptic_lab.sweeps import options
from haptic_lab.sweeps.tasks import SweepTask, bundles
from haptic_lab.sweeps.worker import make_trial

cloudpickle = pytest.importorskip("cloudpickle")
PARSERS = {
    "explore.py": lambda flags: explore.parse(flags),
    "evaluate.py": lambda flags: options.check(None, flags),
    "figures.py": lambda flags: figures.parse(["bias", *flags]),
}


class Payload:
    """Whoever unpickles it makes an empty folder at `mark`."""

    def __init__(self, mark: Path) -> None:
        self.mark = str(mark)

    def __reduce__(self):
        return os.mkdir, (self.mark,)


@pytest.fixture
def poisoned(tmp_path) -> Path:
    """A zip that makes the folder `mark` beside it when Stable-Baselines3 reads it, and is no model."""
    pickled = base64.b64encode(cloudpickle.dumps(Payload(tmp_path / "mark"))).decode()
    with zipfile.ZipFile(tmp_path / "model.zip", "w") as file:
        file.writestr("data", json.dumps({"note": {":type:": "x", ":serialized:": pickled}}))
    return tmp_path / "model.zip"


def _refused(command: str, flags: list[str], capsys) -> str:
    with pytest.raises(SystemExit) as error:
        PARSERS[command](flags)
    assert error.value.code == 2
    said = capsys.readouterr().err
    assert len(said.splitlines()) == 1
    return said


@pytest.mark.parametrize("command", PARSERS)
def test_a_zip_needs_trust(command, poisoned, tmp_path, capsys):
    flags = ["--policy", str(poisoned), "--out", str(tmp_path / "out")]
    assert "holds pickles, which can run any code" in _refused(command, flags, capsys)
    assert not (tmp_path / "mark").exists()
    assert not (tmp_path / "out").exists()
    assert "is no whole model of Stable-Baselines3" in _refused(command, [*flags, "--trust"], capsys)
    assert (tmp_path / "mark").exists(), "what this test is about"


def test_no_file_can_say_that_a_model_is_to_be_trusted(poisoned, tmp_path, capsys):
    config = tmp_path / "sweep.toml"
    for content, said in (
        (f"policy = {str(poisoned)!r}\ntrust = true", "unknown key 'trust'"),
        (f"policy = {str(poisoned)!r}", "holds pickles, which can run any code"),
    ):
        config.write_text(content)
        assert said in _refused("evaluate.py", ["--config", str(config)], capsys)
    assert not (tmp_path / "mark").exists()
    assert "is no whole model" in _refused("evaluate.py", ["--config", str(config), "--trust"], capsys)


@pytest.mark.parametrize("command", PARSERS)
@pytest.mark.parametrize(
    ("name", "content", "said"),
    [
        ("odd.npz", b"no weights", "not a whole .npz file"),
        ("nothing.npz", None, "must be a policy's name or a model that exists"),
        ("nothing.zip", None, "must be a policy's name or a model that exists"),
    ],
)
def test_a_model_that_cannot_be_read_is_told_before_anything_begins(command, name, content, said, tmp_path, capsys):
    if content is not None:
        (tmp_path / name).write_bytes(content)
    assert said in _refused(command, ["--policy", str(tmp_path / name), "--out", str(tmp_path / "out")], capsys)
    assert not (tmp_path / "out").exists()


def test_weights_are_a_policy_of_every_command(tmp_path):
    path = shutil.copy(SHIPPED, tmp_path / "mine.npz")
    flags = ["--shape", "cube", "--seconds", "0.2", "--particles", "2", "--policy", str(path)]
    assert explore.main([*flags, "--out", str(tmp_path / "explored")]) == 0
    given = options.check(None, ["--policy", str(path), "--seconds", "0.2", "--observers", "floor"])
    task = SweepTask(given.settings, given.conditions[0], "cube", 1)
    assert bundles([task]) == [(task,)]
    trial = make_trial(task, naming=False)
    trial.run()
    assert trial.policy.name == str(path)
