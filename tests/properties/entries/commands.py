"""What commands read: their flags, and files of settings, results and models. Nothing is explored or trained."""

from __future__ import annotations

import importlib
from collections.abc import Mapping
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
from hypothesis import strategies as st

import agents
import haptic_env
from haptic_env import shapes
from haptic_lab.commands import explore
from haptic_lab.exploration.run import begin
from haptic_lab.figures import explorations
from haptic_lab.learning import checkpoints, presets
from haptic_lab.people.studies import presets as studies
from haptic_lab.sweeps import results
from haptic_lab.terminal import refuse
from observer import OBSERVERS, HapticSLAM
from observer.classifiers import CLASSIFIERS
from tests.properties import samples
from tests.properties.entry import Entry
from tests.properties.files import archives, file, out
from tests.properties.parameters import Parameter
from tests.properties.rule import Allowed
from tests.properties.strategies import NAMES, NUMBERS, PATHS

WORDS = sorted(
    {str(each) for each in (*NUMBERS, *NAMES, *PATHS) if isinstance(each, str | int | float | Path)}, key=ascii
)
odd_words = st.lists(st.sampled_from([word for word in WORDS if len(word) < 5000]) | st.text(max_size=4), max_size=2)
COMMAND = Allowed(exits=True, words=("--", "error"))
FILE = Allowed(files=True, words=("input", "config", "trials", "checkpoints"))
SWEEP = b"""shapes = ["cube", "sphere"]
sigmas = [3.0, 5]
trials = 2
seconds = 5.0
observers = ["floor", "haptic_slam"]
policy = ["random_torque"]
bias_deg = 1.5
classifiers = []
quick = false
out = "out/sweep"
"""
TRIALS = b"""subject,object,response,seconds,condition
a,cube,sphere,2.5,cold
a,sphere,none,5,warm
b,cube,cube,2.5,warm
"""


def _said(flags: Mapping[str, Any]) -> list[str]:
    """A command line that says `flags`; a path stands for itself."""
    arguments: list[str] = []
    for flag, words in flags.items():
        arguments += [f"--{flag.replace('_', '-')}", *map(str, words if isinstance(words, list) else [words])]
    return arguments


def _run(module: str, function: str, flags: Mapping[str, Any]) -> Any:
    """The command's own parser on the words of `flags`."""
    getattr(importlib.import_module(f"haptic_lab.{module}"), function)(
        *([None] if function == "check" else []), _said(flags)
    )


def _command(module: str, function: str = "parse") -> Any:
    return lambda **flags: _run(module, function, flags)


def words(*valid: str) -> Parameter:
    """The word after a flag."""
    return Parameter(st.sampled_from(valid).map(lambda word: [word]), odd_words)


def _preset(path: Any) -> Any:
    return presets.read(str(path))


def _checkpoint(path: Path) -> Any:
    """The newest below a folder with a list that is odd."""
    place = path.parent / "checkpoints" / "000000100"
    place.mkdir(parents=True)
    path.replace(place / "checkpoint.json")
    found, broken = checkpoints.newest(place.parent)
    return found is None, len(broken)


def _results(path: Path, config: Any = None) -> Any:
    """A table of a sweep that somebody has edited."""
    folder = path.parent / "sweep"
    folder.mkdir()
    path.replace(folder / "trials.csv")
    if isinstance(config, Path):
        config.replace(folder / "config.json")
    else:
        (folder / "config.json").write_text('{"trials": 1}')
    made = results.Results(folder, {"trials": 1}, *COLUMNS, ["floor", "haptic_slam"])
    return len(made.trials)


def _showing(path: Path) -> Any:
    return explorations.read(path)


def _begin(path: Any, shape: Any = "sphere") -> Any:
    """As explore.py does up to its first step."""
    name = [str(path)] if isinstance(path, str | Path) else []
    settings, recording = explore.parse(["--recording", *name, "--shape", shape, "--particles", "2"])
    try:
        session = begin(settings, recording)
    except ValueError as error:
        refuse(str(error))
    told = {name: each for name, each in session.told.items() if name != "grid"}
    slam = HapticSLAM(session.hand, particles=2, lag=1, **told)
    (felt, info), state = session.env.reset(seed=0), None
    seen = [slam.reset(seed=0, joint_angles=felt["joint_angles"])]
    for _ in range(3):
        action, state = session.policy.predict(felt, state) if not isinstance(session.policy, str) else (STILL, None)
        felt, *_, over, info = session.env.step(action)
        seen.append(slam.step(action, felt["joint_angles"], felt["contacts"], info.get("root")))
        if over:
            break
    return seen


STILL = np.zeros(samples.JOINTS)
KEY = ("sigma_deg", "bias_deg", "drift_deg", "drift_seconds", "proportional", "motor_noise", "contact_miss")
KEY = (*KEY, "contact_false_alarm", "policy", "seconds", "shape", "seed", "observer")
COLUMNS = ([*KEY, "value"], [each for each in KEY if each not in ("policy", "shape", "observer")] + ["value"])
ROW = "3.0,0,0,10,0,0.1,0,0,random_torque,10.0,cube,1,{},0.5"
TABLE = "\n".join([",".join(COLUMNS[0]), ROW.format("floor"), ROW.format("haptic_slam"), ""]).encode()
FLAGS: dict[str, dict[str, Parameter]] = {
    "evaluate": {
        "env": words(*haptic_env.ENVIRONMENTS, "two_finger"),
        "shapes": words(*shapes.SHAPES),
        "objects": words(*shapes.SETS),
        "trial_table": words("missing.csv"),
        "column": words("seconds=5", "object=thing"),
        "under": words("bare"),
        "candidates": words("cube", "twelve"),
        "none": words("0.1"),
        "scale": words("1", "0.5"),
        "sigmas": words("1", "3.5"),
        "bias_deg": words("0", "2"),
        "contact_miss": words("0.1"),
        "contact_confusion": words("0.1"),
        "patches_stuck": words("0.1", "3,", "index_distal_tip"),
        "policy": words(*agents.POLICIES),
        "seconds": words("5", "2.5"),
        "trials": words("2"),
        "first_seed": words("7"),
        "observers": words(*OBSERVERS, "haptic_slam+limited"),
        "memory_seconds": words("5", "inf"),
        "attention_seconds": words("0.5"),
        "particles": words("4"),
        "exemplars": words("2"),
        "classifiers": words(*CLASSIFIERS),
        "size_jitter": words("0.1"),
        "believed_sigma": words("1"),
        "believed": words("human"),
        "believed_sigma_deg": words("2", "unknown"),
        "believed_bias_deg": words("3"),
        "jobs": words("1"),
        "cluster": words("tcp://10.0.0.1:8786"),
        "out": words("out/a"),
    },
    "explore": {
        "env": words(*haptic_env.ENVIRONMENTS, "two_finger"),
        "shape": words(*shapes.SHAPES),
        "scale": words("1", "0.5"),
        "sigma": words("3"),
        "bias_deg": words("2"),
        "believed_drift_deg": words("1"),
        "patches_dead": words("0.1", "3,7"),
        "believed_patches_dead": words("0.1", "index_distal_tip,4"),
        "save_offsets": words("a.toml"),
        "believed_sigma_deg": words("unknown"),
        "seconds": words("5"),
        "particles": words("4"),
        "policy": words("random_torque"),
        "seed": words("3"),
        "library": words("missing"),
        "rotation_jitter": words("10"),
        "size_jitter": words("0.1"),
        "recording": words("missing.npz"),
        "part": words("a"),
        "glove_calibration": words("missing.toml"),
        "out": words("out/a"),
    },
    "figures": {
        "sigmas": words("1"),
        "trials": words("2"),
        "seconds": words("3"),
        "show_seconds": words("3"),
        "offsets": words("0", "3"),
        "believed": words("human"),
        "trials_of": words("missing"),
        "seed": words("3"),
        "shapes": words(*shapes.SHAPES),
        "out": words("out/a"),
    },
    "study": {
        "sigmas": words("1", "3.5"),
        "seconds": words("5", "2.5"),
        "policy": words("random_torque"),
        "observers": words("floor", "haptic_slam"),
        "trials": words("2"),
        "first_seed": words("7"),
        "trials_of": words("missing"),
        "jobs": words("1"),
        "cluster": words("tcp://10.0.0.1:8786"),
        "out": words("out/a"),
    },
    "bench": {
        "env": words("two_finger"),
        "shape": words("cube"),
        "sigma": words("3"),
        "seed": words("1"),
        "rounds": words("1"),
        "json": words("missing/a.json"),
    },
    "benchmark": {
        "tasks": words("Name", "Map"),
        "policies": words("random_torque", "enclosure"),
        "worlds": words("3"),
        "steps": words("1000"),
        "jobs": words("1"),
        "hand": words("two_finger", "adroit"),
    },
    "train": {
        "preset": words("trained", "sac", "ppo"),
        "steps": words("1000"),
        "seed": words("3"),
        "envs": words("2"),
        "jobs": words("1"),
        "bias_deg": words("2"),
        "patches_stuck": words("0.1", "3,"),
        "believed": words("human"),
    },
}
STUDIES = tuple(path.read_bytes() for path in sorted(studies.FOLDER.glob("*.toml")))
PRESETS = tuple(path.read_bytes() for path in sorted(presets.FOLDER.glob("*.toml")))
SHOWING = {"angles": np.zeros((3, 8)), "occupancy": np.zeros((3, 4, 4, 4), dtype=np.uint16)}

ENTRIES: dict[str, Entry] = {
    **{
        f"haptic_lab.commands.{name}": Entry(
            _command(f"commands.{name}"), FLAGS[name], COMMAND, weight=2 if name != "train" else 1
        )
        for name in ("explore", "figures", "bench", "benchmark")
    },
    "haptic_lab.commands.evaluate": Entry(_command("sweeps.options", "check"), FLAGS["evaluate"], COMMAND, weight=2),
    "haptic_lab.commands.evaluate[trials]": Entry(
        _command("sweeps.options", "check"),
        {
            "trial_table": file(".csv", TRIALS).always,
            "column": words("seconds=5", "object=response"),
            "unit": words("seconds=ms"),
            "name": words("ball=sphere"),
            "under": words("cold", "warm"),
            "sigmas": words("1", "3.5"),
        },
        COMMAND,
        weight=2,
    ),
    "haptic_lab.commands.evaluate[config]": Entry(
        _command("sweeps.options", "check"),
        {"config": file(".toml", SWEEP).always, "trials": words("3")},
        COMMAND,
        weight=2,
    ),
    "haptic_lab.commands.train": Entry(
        lambda **flags: _run("commands.train", "parse", {**flags, "out": [out("run")]}), FLAGS["train"], COMMAND
    ),
    "haptic_lab.commands.train[preset]": Entry(
        lambda preset: _run("commands.train", "parse", {"preset": preset, "out": [out("run")]}),
        {"preset": file(".toml", *PRESETS).always},
        COMMAND,
        weight=2,
    ),
    "haptic_lab.commands.study": Entry(
        lambda name, **flags: importlib.import_module("haptic_lab.commands.study").parse(
            [*map(str, name), *_said(flags)]
        ),
        {"name": words(*studies.names()), **FLAGS["study"]},
        COMMAND,
    ),
    "haptic_lab.people.studies.presets.read": Entry(
        lambda path: studies.read(str(path)).comparisons,
        {"path": file(".toml", *STUDIES, there=True).always},
        FILE,
        weight=2,
    ),
    "haptic_lab.commands.explore[recording]": Entry(
        partial(_begin),
        {
            "path": file(".npz", *samples.recordings_npz(), also=archives(samples.arrays())).always,
            "shape": Parameter(st.just("sphere"), st.sampled_from([w for w in WORDS if len(w) < 5000])),
        },
        COMMAND,
        weight=0.3,
    ),
    "haptic_lab.learning.presets.read": Entry(
        _preset, {"path": file(".toml", *PRESETS, there=True).always}, FILE, weight=2
    ),
    "haptic_lab.learning.checkpoints.newest": Entry(
        _checkpoint,
        {"path": file(".json", b'{"files": {"model.npz": "00"}, "state": {"steps": 3}}', there=True).always},
        FILE,
    ),
    "haptic_lab.sweeps.results.Results": Entry(
        _results,
        {
            "path": file(".csv", TABLE, there=True).always,
            "config": file(".json", b'{"trials": 1}', there=True),
        },
        FILE,
        weight=2,
    ),
    "haptic_lab.figures.explorations.read": Entry(
        _showing, {"path": file(".npz", samples.npz(SHOWING), also=archives(SHOWING), there=True).always}, FILE
    ),
}
