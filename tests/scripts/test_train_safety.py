"""Training runs nothing that lies in a folder, is stopped whole, and says before it begins what makes no sense."""

from __future__ import annotations

import base64
import contextlib
import hashlib
import json
import os
import re
import shutil
import signal
import subprocess
import sys
import time
import warnings
import zipfile
from pathlib import Path

import numpy as np
import pytest

pytest.importorskip("stable_baselines3")
pytest.importorskip("sb3_contrib")

import cloudpickle

from haptic_lab.commands import train
from haptic_lab.learning import checkpoints
from haptic_lab.learning.evaluation import OF_EVALUATIONS, read_evaluations

SCRIPT = Path(__file__).parents[2] / "scripts" / "train.py"
TINY = """
algorithm = "{algorithm}"
steps = {steps}
envs = 2
evaluate_every = 100_000
checkpoint_every = 100
episodes = 2
[world]
seconds = 0.4
observation = ["pose", "names", "time"]
variants = 4
samples = 2
[learner]
policy = "MlpPolicy"
batch_size = 16
policy_kwargs = {{net_arch = [{units}]}}
{learner}
"""
LEARNERS = {"PPO": "n_steps = 8\nn_epochs = 1", "SAC": "learning_starts = 10\nbuffer_size = 30"}


class Payload:
    """Whoever unpickles it makes an empty folder at `mark`."""

    def __init__(self, mark: Path) -> None:
        self.mark = str(mark)

    def __reduce__(self):
        return os.mkdir, (self.mark,)


def preset(folder: Path, algorithm: str = "PPO", steps: int = 100, units: int = 8, learner: str | None = None) -> Path:
    """A run of seconds, as a TOML file."""
    path = folder / "tiny.toml"
    more = LEARNERS[algorithm] if learner is None else learner
    path.write_text(TINY.format(algorithm=algorithm, steps=steps, units=units, learner=more))
    return path


def run(path: Path, out: Path, *more: str) -> int:
    """Train in this process; the exit code."""
    try:
        return train.main(["--preset", str(path), "--out", str(out), "--jobs", "1", *more])
    except SystemExit as ended:
        return ended.code


@pytest.fixture(scope="module")
def runs(tmp_path_factory: pytest.TempPathFactory) -> dict[str, Path]:
    """Folders of whole runs."""
    made = {}
    for algorithm in LEARNERS:
        folder = tmp_path_factory.mktemp(algorithm)
        assert run(preset(folder, algorithm), folder / "out") == 0
        made[algorithm] = folder / "out"
    return made


def _sign(place: Path) -> None:
    """Bring the digests up to date, as a stranger can."""
    listed = json.loads((place / checkpoints.LIST).read_text())
    for name in listed["files"]:
        listed["files"][name] = hashlib.sha256((place / name).read_bytes()).hexdigest()
    (place / checkpoints.LIST).write_text(json.dumps(listed))


@pytest.mark.parametrize("algorithm", LEARNERS)
def test_no_file_of_a_checkpoint_is_a_pickle(runs, algorithm):
    place = checkpoints.newest(runs[algorithm] / "checkpoints")[0].folder
    files = {checkpoints.MODEL, checkpoints.LIST} | ({checkpoints.REPLAY} if algorithm == "SAC" else set())
    assert {each.name for each in place.iterdir()} == files
    with zipfile.ZipFile(place / checkpoints.MODEL) as file:
        assert json.loads(file.read("data")) == {}


@pytest.mark.parametrize("poisoned", ["data", "policy.pth", "replay_buffer.npz"])
def test_a_strangers_checkpoint_runs_nothing(runs, tmp_path, poisoned, capsys):
    out, mark = tmp_path / "out", tmp_path / "mark"
    algorithm = "SAC" if poisoned == "replay_buffer.npz" else "PPO"
    shutil.copytree(runs[algorithm], out)
    place = checkpoints.newest(out / "checkpoints")[0].folder
    pickled = cloudpickle.dumps(Payload(mark))
    if poisoned == "replay_buffer.npz":
        np.savez(place / poisoned, rewards=np.array([Payload(mark)], dtype=object))
    else:
        with zipfile.ZipFile(place / checkpoints.MODEL) as file:
            content = {name: file.read(name) for name in file.namelist()}
        note = {"note": {":type:": "x", ":serialized:": base64.b64encode(pickled).decode()}}
        content[poisoned] = json.dumps(note).encode() if poisoned == "data" else pickled
        with zipfile.ZipFile(place / checkpoints.MODEL, "w") as file:
            for name, each in content.items():
                file.writestr(name, each)
    _sign(place)
    before = {each: each.read_bytes() for each in out.rglob("*") if each.is_file()}
    code = run(preset(tmp_path, algorithm), out, "--steps", "150")
    assert not mark.exists()
    if poisoned == "data":  # which is not even looked at
        assert code == 0
        return
    assert code == 2
    assert f"{place} is no checkpoint of this run" in capsys.readouterr().err
    assert {each: each.read_bytes() for each in out.rglob("*") if each.is_file()} == before


def _with(place: Path, **changes) -> None:
    listed = json.loads((place / checkpoints.LIST).read_text())
    for name, value in changes.items():
        listed[name] = value
    (place / checkpoints.LIST).write_text(json.dumps(listed))


@pytest.mark.parametrize(
    ("changes", "said"),
    [
        ({"counters": None}, "is of a version that kept pickles"),
        ({"counters": {"steps": -1, "updates": 0, "episodes": 0}}, "steps in .* must be an integer"),
        ({"counters": {"steps": 1, "updates": "2", "episodes": 0}}, "updates in .* must be an integer"),
        ({"state": {"seconds": "long"}}, "seconds in .* must be a finite number"),
        ({"state": {"seconds": 1.0, "best": [3]}}, "best in .* must be a finite number"),
    ],
)
def test_a_list_that_makes_no_sense_is_told(runs, tmp_path, changes, said, capsys):
    out = tmp_path / "out"
    shutil.copytree(runs["PPO"], out)
    _with(checkpoints.newest(out / "checkpoints")[0].folder, **changes)
    assert run(preset(tmp_path), out) == 2
    error = capsys.readouterr().err
    assert len(error.splitlines()) == 1
    assert re.search(said, error)


def test_what_else_lies_beside_the_checkpoints_is_left_alone(runs, tmp_path):
    out = tmp_path / "out"
    shutil.copytree(runs["PPO"], out)
    foreign = out / "checkpoints" / "zz_mine"
    foreign.mkdir()
    (out / "checkpoints" / ".DS_Store").write_text("")
    assert run(preset(tmp_path), out, "--steps", "300") == 0
    assert foreign.is_dir()
    assert len(list((out / "checkpoints").glob("0*"))) == checkpoints.KEPT


def test_what_was_lived_through_comes_back(runs, tmp_path):
    """Also where the buffer is full and begins anew: the same arrays, and the place where the next goes."""
    from gymnasium import spaces
    from stable_baselines3.common.buffers import DictReplayBuffer, ReplayBuffer

    from haptic_lab.learning import replay_buffer

    box = spaces.Box(-1.0, 1.0, (3,), np.float32)
    for kind, space in ((ReplayBuffer, box), (DictReplayBuffer, spaces.Dict({"a": box, "b": spaces.MultiBinary(2)}))):
        for steps in (4, 5, 7):
            whole, again = (kind(10, space, box, device="cpu", n_envs=2) for _ in range(2))
            for _ in range(steps):
                seen = [space.sample(), space.sample()]
                if isinstance(space, spaces.Dict):
                    seen = {name: np.stack([each[name] for each in seen]) for name in space}
                whole.add(seen, seen, np.ones((2, 3)), np.arange(2.0), np.zeros(2), [{}, {}])
            replay_buffer.save(tmp_path / "kept.npz", whole)
            replay_buffer.restore(tmp_path / "kept.npz", again)
            assert (again.pos, again.full) == (whole.pos, whole.full)
            for mine, other in zip(
                replay_buffer._arrays(again).values(), replay_buffer._arrays(whole).values(), strict=True
            ):
                np.testing.assert_array_equal(mine, other)
        with pytest.raises(ValueError, match="is of another replay buffer"):
            replay_buffer.restore(tmp_path / "kept.npz", kind(6, space, box, device="cpu", n_envs=2))


@pytest.mark.parametrize(
    "content",
    [
        b"no table",
        {"timesteps": np.arange(3)},
        dict(zip(OF_EVALUATIONS, (np.arange(3), np.zeros((2, 2)), np.ones((3, 2)), np.ones((3, 2))), strict=True)),
        dict(zip(OF_EVALUATIONS, (np.arange(3), np.zeros(3), np.ones(3), np.ones(3)), strict=True)),
        {"timesteps": np.array([{}]), "results": np.zeros(3)},
    ],
)
def test_evaluations_that_are_none_are_told(runs, tmp_path, content, capsys):
    out = tmp_path / "out"
    shutil.copytree(runs["PPO"], out)
    if isinstance(content, bytes):
        (out / "evaluations.npz").write_bytes(content)
    else:
        np.savez(out / "evaluations.npz", **content)
    assert run(preset(tmp_path), out) == 2
    assert "evaluations.npz" in capsys.readouterr().err
    with pytest.raises(ValueError, match=r"evaluations\.npz"):
        read_evaluations(out / "evaluations.npz")


@pytest.mark.parametrize(
    ("learner", "said"),
    [
        ("n_stepz = 8", "unknown key of [learner] 'n_stepz' (did you mean 'n_steps'?)"),
        ("learning_rate = nan", "learning_rate of [learner] must be"),
        ("env = 'CartPole-v1'", "unknown key of [learner] 'env'"),
        ("n_steps = 1\nnormalize_advantage = true", "[learner] makes no PPO: "),  # a rollout of two, in batches of 16
    ],
)
def test_a_learner_that_makes_no_sense_is_told_and_leaves_nothing(tmp_path, capsys, learner, said):
    path = preset(tmp_path, learner=learner)
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        assert run(path, tmp_path / "out") == 2
    error = capsys.readouterr().err
    assert said in error
    assert len(error.splitlines()) == 1
    assert not (tmp_path / "out").exists()


@pytest.mark.parametrize(
    ("flags", "said"),
    [
        (("--steps", "0"), "steps must be an integer in [1, 1000000000000], got 0"),
        (("--steps", "1.5"), "invalid int value: '1.5'"),
        (("--envs", "-2"), "envs must be an integer in [1, 1024], got -2"),
        (("--seed", "-1"), "seed must be an integer in [0, 2147483648], got -1"),
        (("--jobs", "0"), "--jobs must be an integer in [1, 1024], got 0"),
        (("--preset", "train"), "unknown preset 'train'"),
        (("--preset", "nowhere.toml"), "nowhere.toml: "),
        (("--out", __file__), "--out must be a folder that can be written to"),
        (("--step", "x", "--trust"), "error"),
    ],
)
def test_flags_that_make_no_sense_are_told(tmp_path, capsys, flags, said):
    assert run(preset(tmp_path), tmp_path / "out", *flags) == 2
    error = capsys.readouterr().err
    assert said in error
    assert len(error.splitlines()) == 1
    assert not (tmp_path / "out").exists()


@pytest.mark.parametrize("content", ["{", "[]", "3", '{"seed": 0}'])
def test_a_configuration_of_another_run_is_told(tmp_path, capsys, content):
    out = tmp_path / "out"
    out.mkdir()
    (out / "config.json").write_text(content)
    assert run(preset(tmp_path), out) == 2
    assert "choose another --out" in capsys.readouterr().err
    assert (out / "config.json").read_text() == content


def test_a_learner_that_goes_astray_is_told(tmp_path, capsys, monkeypatch):
    """Torch refuses a distribution of what is not finite."""
    import torch

    save = checkpoints.save

    def break_after(folder, model, state):
        save(folder, model, state)
        with torch.no_grad():
            next(model.policy.action_net.parameters())[:] = torch.nan

    monkeypatch.setattr(checkpoints, "save", break_after)
    assert run(preset(tmp_path, steps=2000), tmp_path / "out") == 1
    error = capsys.readouterr().err.splitlines()[-1]
    assert error.endswith("; the checkpoints before are kept")
    assert "nan" in error
    assert checkpoints.newest(tmp_path / "out" / "checkpoints")[0] is not None


def _own_group() -> None:
    os.setsid()
    signal.signal(signal.SIGINT, signal.default_int_handler)


def _members(group: int) -> list[int]:
    """The processes of a group that still run."""
    found = []
    for place in Path("/proc").glob("[0-9]*/stat"):
        try:
            state, _, of = place.read_text().rsplit(")", 1)[1].split()[:3]
        except OSError:
            continue
        if int(of) == group and state != "Z":
            found.append(int(place.parent.name))
    return found


def _until(what, process: subprocess.Popen | None = None) -> None:
    deadline = time.monotonic() + 200
    while not what():
        assert time.monotonic() < deadline
        assert process is None or process.poll() is None
        time.sleep(0.1)


@pytest.fixture
def start(tmp_path):
    """Starts a command in a process group of its own, which writes to a log; what is left of it ends with the test."""
    started = []

    def begin(*command: str) -> subprocess.Popen:
        with (tmp_path / "log").open("w") as log:
            env = os.environ | {"MUJOCO_GL": "egl", "PYTHONPATH": os.pathsep.join(sys.path)}
            started.append(
                subprocess.Popen([sys.executable, *command], stdout=log, stderr=log, preexec_fn=_own_group, env=env)
            )
        return started[-1]

    yield begin
    for process in started:
        for left in _members(process.pid):
            os.kill(left, signal.SIGKILL)
        process.wait()


needs_proc = pytest.mark.skipif(not Path("/proc/self/stat").exists(), reason="asks /proc which processes run")


@needs_proc
def test_ctrl_c_stops_all_processes_of_a_run_and_keeps_what_was_learnt(tmp_path, start):
    """As a terminal sends it, to every one of them."""
    out = tmp_path / "out"
    path = preset(tmp_path, steps=10_000_000)
    process = start(str(SCRIPT), "--preset", str(path), "--out", str(out), "--jobs", "5", "--envs", "1")
    _until(lambda: list(out.glob("checkpoints/*/checkpoint.json")), process)
    assert len(_members(process.pid)) > 3, "the command, what forks, and two workers"
    os.killpg(process.pid, signal.SIGINT)
    code, told = process.wait(100), (tmp_path / "log").read_text()
    assert code == 130, told
    assert "Stopped; the same command goes on from here." in told
    assert "Traceback" not in told
    assert {"model.npz", "model.zip", "training.json"} <= {each.name for each in out.iterdir()}
    _until(lambda: not _members(process.pid))


@pytest.mark.parametrize("fails", [AttributeError("partially initialized module"), ValueError("cut short")], ids=repr)
@pytest.mark.parametrize("where", ["prepare", "train"])
def test_what_fails_because_of_ctrl_c_ends_as_ctrl_c_does(tmp_path, monkeypatch, where, fails):
    """As an import, or a callback of C, that swallows it does."""

    def swallowed(*_):
        with contextlib.suppress(KeyboardInterrupt):
            signal.raise_signal(signal.SIGINT)
        raise fails

    monkeypatch.setattr(f"haptic_lab.learning.training.{where}", swallowed)
    usual = signal.getsignal(signal.SIGINT)
    with pytest.raises(KeyboardInterrupt):
        train.main(["--preset", str(preset(tmp_path)), "--out", str(tmp_path / "out"), "--jobs", "1"])
    assert signal.getsignal(signal.SIGINT) is usual


KILLED = """
import time
import gymnasium as gym
from haptic_lab.learning.environments import in_processes

class Busy(gym.Wrapper):
    def reset(self, **keywords):
        while True:
            time.sleep(1)

if __name__ == "__main__":
    env = in_processes([lambda: Busy(gym.make("CartPole-v1"))])
    env.remotes[0].send(("reset", (None, None)))
    print("ready", flush=True)
    time.sleep(1000)
"""


@needs_proc
def test_workers_end_with_what_started_them_however_it_ends(tmp_path, start):
    """Also in the middle of something that takes long."""
    script = tmp_path / "killed.py"
    script.write_text(KILLED)
    process = start(str(script))
    _until(lambda: "ready" in (tmp_path / "log").read_text(), process)
    assert len(_members(process.pid)) > 2, "it, what forks, and a worker"
    os.kill(process.pid, signal.SIGKILL)
    assert process.wait(100) == -signal.SIGKILL
    _until(lambda: not _members(process.pid))
