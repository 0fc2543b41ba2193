"""The example of an experiment in PsychoPy: the observer beside it, without a window, of a glove that is simulated."""

from __future__ import annotations

import runpy
from pathlib import Path
from typing import Any

import gymnasium as gym
import numpy as np
import pytest

import agents
import haptic_env  # noqa: F401 - registers the environments
from haptic_lab.people.trials import read_trials

EXAMPLE = Path(__file__).resolve().parents[3] / "examples" / "psychopy_beside.py"


class Glove:
    """A hand that explores a sphere at random, and a frame at each look."""

    def __init__(self) -> None:
        self.env = gym.make("HapticSLAM/TwoFinger-v0", shape="sphere", sigma_deg=1.0, disable_env_checker=True)
        self.policy, self.state = agents.make("random_torque", self.env, seed=2), None
        self.felt, _ = self.env.reset(seed=900_007)
        self.frames = 0

    def feel(self) -> tuple[Any, Any]:
        return self.felt["joint_angles"], self.felt["contacts"]

    def flip(self) -> None:
        action, self.state = self.policy.predict(self.felt, self.state)
        self.felt, *_ = self.env.step(action)
        self.frames += 1


def test_the_observer_runs_beside_an_experiment(tmp_path: Path) -> None:
    example, glove = runpy.run_path(str(EXAMPLE)), Glove()
    path, answers = tmp_path / "S1.csv", iter(["cube", "sphere"])
    told = "S1", ["sphere", "sphere"], glove.feel, glove.flip, lambda: next(answers), path
    example["experiment"](*told, seconds=2.0)
    assert glove.frames == 200
    table = read_trials(path)
    assert table["response"].tolist() == ["cube", "sphere"]
    assert table["object"].tolist() == ["sphere", "sphere"]
    shares = table[["observer_cube", "observer_sphere"]].to_numpy()
    assert shares.sum(axis=1) == pytest.approx(1.0, abs=1e-3)
    assert np.all(shares[:, 1] != 0.5)
    assert shares[-1, 1] > 0.9
