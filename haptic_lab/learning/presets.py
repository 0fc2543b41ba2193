"""What a training run is: an algorithm, what it explores, and how long; read from a TOML file."""

from __future__ import annotations

import json
from collections.abc import Mapping
from dataclasses import asdict, dataclass, field, fields
from pathlib import Path
from typing import Any

from agents.gains import GAINS, gains_of
from haptic_env import readable, reading, registration, rotation, shapes, validate
from haptic_lab import conditions, faults, toml_presets
from haptic_lab.believed import BELIEVED, Believed
from haptic_lab.learning import options
from haptic_lab.learning.sweeping_motion import SweepingMotion
from haptic_lab.terminal import as_keys
from haptic_lab.worlds import shapes_of
from observer.wrappers.belief_observation import ENTRIES, OF_MAPS, USUAL, tell_names

FOLDER = Path(__file__).parent / "presets"
SEARCH = "CMA-ES"
ALGORITHMS = ("PPO", "SAC", "RecurrentPPO", SEARCH)
RAW = "raw"
FELT = ("contacts",)  # which a rhythm reads
TASKS = NAME, MAP = "name", "map"
FOUR = tuple(shapes.SHAPES)
SEARCHED = tuple(entry for entry in ENTRIES if entry not in OF_MAPS)  # whose voxels would be too many weights
NOISES = (*conditions.DEFAULTS, *BELIEVED)  # of a world


@dataclass(frozen=True)
class TrainingWorld(Believed):
    """What is explored and how it is rewarded.

    The `ShapePosterior` that is asked is another than evaluation has, as it is most of the time that a step takes;
    evidence adds up as fast, for `temper` / `stride` is the same.

    Attributes:
        env: id of the environment.
        wrist: how the hand is held; None: as it usually is.
        seconds: of an episode at most.
        sigma_deg: least and largest noise, degrees, drawn for each episode.
        size_jitter: as the environment's.
        yaw_jitter: as the environment's.
        position_jitter: as the environment's.
        rotation_jitter: as the environment's.
        task: "name": `DecisionReward` until a name is sure; "map": bits of the surface (`InformationGainReward`).
        soon: whether what a rhythm touches of a surface counts the more the sooner, not in the end alone.
        observation: entries of the belief, or ("raw",) for what is felt.
        hold: control steps of an action.
        price: of `DecisionReward`.
        least: of `DecisionReward`.
        threshold: of `DecideWhenSure`.
        sure_seconds: of `DecideWhenSure`.
        variants: of the `ShapePosterior`.
        samples: of the `ShapePosterior`.
        stride: of the `ShapePosterior`.
        temper: of the `ShapePosterior`.
        filtered: whether the pose is; else angles are taken at their word, which is far quicker with a whole hand, and
            wants the sigma that a filter would leave.
        bias_deg: as the environment's, and so are the other noises; the observer is told of them.
        drift_deg: degrees.
        drift_seconds: s.
        proportional: a fraction.
        motor_noise: a fraction.
        contact_miss: a probability.
        contact_false_alarm: a probability.
        contact_confusion: a probability.
        patches_stuck: patches, or the probability of each.
        patches_dead: likewise.
        shapes: that are explored, equally often, and the candidates for the name.

    Raises:
        ValueError: for a value out of its range.
    """

    env: str = "HapticSLAM/TwoFinger-v0"
    seconds: float = 10.0
    sigma_deg: tuple[float, float] = (2.0, 6.0)
    size_jitter: float = 0.2
    yaw_jitter: float = 45.0
    position_jitter: float = 0.005
    rotation_jitter: float = 0.0
    task: str = NAME
    soon: bool = False
    observation: tuple[str, ...] = USUAL
    hold: int = 5
    price: float = 0.25
    least: float = 0.05
    threshold: float = 0.98
    sure_seconds: float = 0.0
    variants: int = 96
    samples: int = 1
    stride: int = 5
    temper: float = 0.083
    filtered: bool = True
    bias_deg: float = conditions.DEFAULTS["bias_deg"]
    drift_deg: float = conditions.DEFAULTS["drift_deg"]
    drift_seconds: float = conditions.DEFAULTS["drift_seconds"]
    proportional: float = conditions.DEFAULTS["proportional"]
    motor_noise: float = conditions.DEFAULTS["motor_noise"]
    contact_miss: float = conditions.DEFAULTS["contact_miss"]
    contact_false_alarm: float = conditions.DEFAULTS["contact_false_alarm"]
    contact_confusion: float = conditions.DEFAULTS["contact_confusion"]
    patches_stuck: faults.Given = conditions.DEFAULTS["patches_stuck"]
    patches_dead: faults.Given = conditions.DEFAULTS["patches_dead"]
    shapes: tuple[str, ...] = FOUR
    wrist: str | None = None

    __repr__ = readable.line

    def __post_init__(self) -> None:
        registration.check("env", self.env)
        registration.check_wrist(self.env, self.wrist)
        validate.number("seconds", self.seconds, 0.0, 3600.0, above=0.0, unit="s")
        if not isinstance(self.sigma_deg, tuple) or len(self.sigma_deg) != 2:
            raise ValueError(f"sigma_deg must be two numbers, the least and the largest, got {self.sigma_deg!r}")
        for sigma in self.sigma_deg:
            validate.number("sigma_deg", sigma, 0.0, 90.0, above=0.0, unit="degrees")
        if self.sigma_deg[0] > self.sigma_deg[1]:
            raise ValueError(f"sigma_deg must be the least and the largest, got {self.sigma_deg!r}")
        validate.number("size_jitter", self.size_jitter, 0.0, 0.5)
        validate.number("yaw_jitter", self.yaw_jitter, 0.0, 180.0, unit="degrees")
        validate.number("position_jitter", self.position_jitter, 0.0, 0.05, unit="m")
        rotation.jitter(self.rotation_jitter, self.yaw_jitter)
        validate.choice("task", self.task, TASKS)
        if validate.boolean("soon", self.soon):
            validate.choice("task, where soon is true,", self.task, (MAP,))
        if not isinstance(self.observation, tuple) or not self.observation:
            raise ValueError(f"observation must be a list of {', '.join((*ENTRIES, RAW))}, got {self.observation!r}")
        for entry in self.observation:
            validate.choice("entry of observation", entry, (*ENTRIES, RAW))
        if RAW in self.observation and len(self.observation) > 1:
            raise ValueError(f"observation {RAW} is what is felt, and stands alone, got {self.observation!r}")
        if self.task == MAP and tell_names(self.observation):
            raise ValueError('observation must be without names where the task is "map", which names nothing')
        if not validate.boolean("filtered", self.filtered) and (self.task == MAP or set(self.observation) & {*OF_MAPS}):
            raise ValueError("filtered must be true where there is a map, got false")
        validate.integer("hold", self.hold, 1, 1000)
        validate.number("price", self.price, 0.0, 1000.0, unit="nats a second")
        validate.number("least", self.least, 0.0, 0.1, above=0.0)
        validate.number("threshold", self.threshold, 0.0, 1.0)
        validate.number("sure_seconds", self.sure_seconds, 0.0, 3600.0, unit="s")
        validate.integer("variants", self.variants, 1, 10_000)
        validate.integer("samples", self.samples, 1, 1000)
        validate.integer("stride", self.stride, 1, 1000)
        validate.number("temper", self.temper, 0.0, 1.0, above=0.0)
        for name in validate.names("shapes", self.shapes):
            shapes.default_size(shapes.check("shape of shapes", name))
        if len({*self.shapes}) < len(self.shapes):
            raise ValueError(f"shapes must name each shape once, got {', '.join(self.shapes)}")
        conditions.check_noise(self.noise)
        conditions.check_contacts(self.env, self.noise)
        try:
            self.check_believed()
            self.check_told(self.env, self.noise)
        except ValueError as error:
            raise ValueError(as_keys(str(error))) from error

    @property
    def noise(self) -> dict[str, Any]:
        """Keyword arguments of the environment, all but sigma's, which is drawn."""
        return conditions.noise_of(self)


@dataclass(frozen=True)
class Preset:
    """How a policy is trained.

    Attributes:
        algorithm: a name of `ALGORITHMS`.
        learner: keyword arguments of the algorithm, as Stable-Baselines3 has them.
        world: in which it learns.
        sweep: what it begins with; None: with what chance has put into the network.
        rhythm: gains of `agents.rhythm` that are searched, as they begin, by name; None: weights are.
        begin: policy or model file of linear weights, which a search goes on with; None: with `sweep`.
        seed: of everything random.
        steps: of the environment, in all.
        envs: side by side.
        evaluate_every: steps of the environment.
        checkpoint_every: steps of the environment.
        episodes: of an evaluation.

    Raises:
        ValueError: for a value out of its range.
    """

    algorithm: str
    learner: Mapping[str, Any]
    world: TrainingWorld = field(default_factory=TrainingWorld)
    sweep: SweepingMotion | None = None
    rhythm: Mapping[str, float] | None = None
    begin: str | None = None
    seed: int = 0
    steps: int = 1_000_000
    envs: int = 8
    evaluate_every: int = 100_000
    checkpoint_every: int = 50_000
    episodes: int = 40

    __repr__ = readable.line

    def __post_init__(self) -> None:
        validate.choice("algorithm", self.algorithm, ALGORITHMS)
        validate.integer("seed", self.seed, 0, 2**31)
        if self.sweep is not None and self.algorithm == "RecurrentPPO":
            raise ValueError("[sweep] is for PPO, SAC and CMA-ES, not for RecurrentPPO")
        for name in ("steps", "evaluate_every", "checkpoint_every"):
            validate.integer(name, getattr(self, name), 1, 10**12)
        validate.integer("envs", self.envs, 1, 1024)
        validate.integer("episodes", self.episodes, 1, 1_000_000)
        options.check(self.algorithm, self.learner, raw=self.world.observation == (RAW,))
        self._check_search()

    def _check_search(self) -> None:
        for name, told in (("[rhythm]", self.rhythm), ("begin", self.begin), ("soon", self.world.soon or None)):
            if told is not None and self.algorithm != SEARCH:
                raise ValueError(f"{name} is for {SEARCH}, not for {self.algorithm}")
        if self.sweep is not None and (self.rhythm is not None or self.begin is not None):
            raise ValueError("[rhythm] begins as the sweep by itself, begin as a policy: each stands without [sweep]")
        if self.rhythm is not None:
            if self.begin is not None:
                raise ValueError("[rhythm] tells itself how it begins, and stands without begin")
            if self.world.observation != FELT:
                raise ValueError(f"observation must be contacts, for [rhythm], got {', '.join(self.world.observation)}")
            object.__setattr__(self, "rhythm", gains_of(self.rhythm, "key of [rhythm]"))
        elif self.algorithm == SEARCH:
            tasks = (NAME,) if self.begin is None else TASKS
            validate.choice(f"task, for {SEARCH} without [rhythm],", self.world.task, tasks)
            for entry in self.world.observation:
                validate.choice(f"entry of observation, for {SEARCH},", entry, SEARCHED)


def configuration(preset: Preset) -> dict[str, Any]:
    """Say what belongs to a run, however long it is.

    Args:
        preset: of the run.

    Returns:
        What JSON can say, without the number of steps, and of its world without noises and shapes that are as usual,
        of which runs from before there were any do not tell.
    """
    usual = asdict(TrainingWorld())
    later = (*NOISES, "shapes", "rotation_jitter", "task", "soon", "wrist", "filtered")
    world = {name: value for name, value in asdict(preset.world).items() if name not in later or value != usual[name]}
    told = {**asdict(preset), "world": world, "steps": None}
    told = {name: value for name, value in told.items() if name not in ("rhythm", "begin") or value is not None}
    return json.loads(json.dumps(told))


def names() -> list[str]:
    """List the presets that ship.

    Returns:
        Their names, sorted.
    """
    return toml_presets.names(FOLDER)


def read(name: str) -> Preset:
    """Read a preset.

    Args:
        name: of one that ships, or the path of a TOML file.

    Returns:
        The preset.

    Raises:
        ValueError: for a file that cannot be read, or a preset that makes no sense.
    """
    path = toml_presets.path_of("preset", name, FOLDER)
    try:
        content = reading.toml(path)
    except (OSError, ValueError) as error:
        raise ValueError(f"{path}: {error}") from error
    world, sweep, rhythm = content.pop("world", {}), content.pop("sweep", None), content.get("rhythm", {})
    tables = (
        ("key", content, Preset),
        ("key of [world]", world, TrainingWorld),
        ("key of [sweep]", {} if sweep is None else sweep, SweepingMotion),
        ("key of [rhythm]", rhythm, None),
    )
    for what, given, made in tables:
        if not isinstance(given, dict):
            raise ValueError(f"{what.removeprefix('key of ')} in {path} must be a table, got {given!r}")
        for key in given:
            validate.choice(f"{what} in {path}", key, GAINS if made is None else [each.name for each in fields(made)])
    for key in ("algorithm", "learner"):
        if key not in content:
            raise ValueError(f"{path} must set {key}")
    lists: dict[str, Any] = {key: tuple(value) if isinstance(value, list) else value for key, value in world.items()}
    try:
        if "shapes" in lists:
            lists["shapes"] = shapes_of(lists["shapes"])
        return Preset(world=TrainingWorld(**lists), sweep=None if sweep is None else SweepingMotion(**sweep), **content)
    except ValueError as error:
        raise ValueError(f"{path}: {error}") from error
