"""What is told of a run of training when it ends, and kept with it."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import asdict
from pathlib import Path
from typing import Any

import numpy as np
from rich.console import Console

from haptic_env import hand_env
from haptic_lab.files import write_json
from haptic_lab.learning.evaluation import EVALUATIONS, read_evaluations
from haptic_lab.learning.explored import unobserved
from haptic_lab.learning.learning_curve import draw, draw_touched
from haptic_lab.learning.presets import MAP, SEARCH, Preset
from haptic_lab.sweeps.provenance import versions


def report(
    preset: Preset,
    steps: int,
    seconds: float,
    learnt_by: Mapping[str, str],
    out: Path,
    console: Console,
    kept: int | None = None,
) -> None:
    """Write training.json and the learning curve, and say in lines what came of it.

    Args:
        preset: of the run.
        steps: of the environment.
        seconds: that it took.
        learnt_by: versions of what learns.
        out: folder of the run.
        console: to say it.
        kept: decisions before the evaluation whose model is kept; None: it is that with the largest mean reward.
    """
    told: dict[str, Any] = {
        **asdict(preset),
        "environment_steps": steps,
        "seconds": round(seconds),
        "versions": {**versions(), **learnt_by},
    }
    console.print(f"{told['environment_steps']} steps in {seconds / 60:.1f} min")
    if (out / EVALUATIONS).exists():
        decisions, rewards, lengths, right = read_evaluations(out / EVALUATIONS).values()
        evaluated, seconds_of = preset.world.hold * decisions, decision_seconds(preset) * lengths
        best = int(rewards.mean(axis=1).argmax() if kept is None else np.flatnonzero(decisions == kept)[0])
        told["best"] = {"environment_steps": int(evaluated[best])}
        if preset.algorithm == SEARCH and preset.world.task == MAP:
            when = f"{'as a mean through' if preset.world.soon else 'in'} {preset.world.seconds:g} s"
            draw_touched(out / "learning_curve.png", evaluated, rewards, when, best)
            told["best"]["touched"] = float(rewards[best].mean())
            found = f"{told['best']['touched']:.1%} of the surface touched {when}"
        else:
            draw(out / "learning_curve.png", evaluated, rewards, seconds_of, right, preset.world.seconds, best)
            told["best"]["median_seconds"] = float(np.median(seconds_of[best]))
            told["best"]["right"] = float(right[best].mean())
            found = f"decided after {told['best']['median_seconds']:.2f} s (median), {told['best']['right']:.0%} right"
        console.print(f"Best on held-out sizes: {found}, of {right.shape[1]} explorations")
    write_json(out / "training.json", told)


def decision_seconds(preset: Preset) -> float:
    """Say how long an action is held.

    Args:
        preset: of the learner.

    Returns:
        Seconds from one decision to the next.
    """
    return preset.world.hold / hand_env(unobserved(preset.world)).control_hz
