"""What a training run is: an algorithm, what it explores, and how long; read from a TOML file."""

from __future__ import annotations

import tomllib
from collections.abc import Mapping
from dataclasses import dataclass, field, fields
from pathlib import Path
from typing import Any

from training_env import World

from haptic_env import validate

FOLDER = Path(__file__).parent / "presets"
ALGORITHMS = ("PPO", "SAC", "RecurrentPPO")


@dataclass(frozen=True)
class Preset:
    """`steps`, `evaluate_every` and `checkpoint_every` count steps of the environment; `envs` run in parallel;
    `episodes` of an evaluation; `learner`: keyword arguments of the algorithm, as Stable-Baselines3 has them."""

    algorithm: str
    learner: Mapping[str, Any]
    world: World = field(default_factory=World)
    seed: int = 0
    steps: int = 1_000_000
    envs: int = 8
    evaluate_every: int = 100_000
    checkpoint_every: int = 50_000
    episodes: int = 40

    def __post_init__(self) -> None:
        validate.choice("algorithm", self.algorithm, ALGORITHMS)
        validate.integer("seed", self.seed, 0, 2**31)
        for name in ("steps", "envs", "evaluate_every", "checkpoint_every", "episodes"):
            validate.integer(name, getattr(self, name), 1)


def names() -> list[str]:
    """The presets that ship."""
    return sorted(path.stem for path in FOLDER.glob("*.toml"))


def read(name: str) -> Preset:
    """The preset of this name, or of the TOML file at this path; raises `ValueError` for what makes no sense."""
    path = Path(name) if name.endswith(".toml") else FOLDER / f"{validate.choice('preset', name, names())}.toml"
    try:
        content = tomllib.loads(path.read_text())
    except (OSError, tomllib.TOMLDecodeError) as error:
        raise ValueError(f"{path}: {error}") from error
    world = content.pop("world", {})
    for what, given, made in (("key", content, Preset), ("key of [world]", world, World)):
        for key in given:
            validate.choice(f"{what} in {path}", key, [each.name for each in fields(made)])
    for key in ("algorithm", "learner"):
        if key not in content:
            raise ValueError(f"{path} must set {key}")
    lists = {key: tuple(value) if isinstance(value, list) else value for key, value in world.items()}
    return Preset(world=World(**lists), **content)
