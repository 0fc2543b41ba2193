"""The jobs of a sweep: `SweepSettings` that all share, and a `SweepTask` for each exploration (condition, shape,
seed), bundled where explorations are the same but for the noise at which they are felt."""

from __future__ import annotations

import hashlib
from collections.abc import Hashable, Iterable
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np

import agents
from haptic_env import hand_of, hands, registration, rotation, shapes, validate
from haptic_env.hand import Hand
from haptic_env.shapes.names import NONE
from haptic_lab.believed import Believed
from haptic_lab.conditions import Condition
from haptic_lab.exploration.learnt import JITTER
from haptic_lab.files import part_of_name
from haptic_lab.limits import LIMITED, Limits, check_name
from haptic_lab.sweeps.results import Key
from observer import variants
from observer.classifiers import CLASSIFIERS

EXEMPLAR_SEED = 2_000_000_000
STREAM = "shape_posterior"  # the name of what names the object from the whole stream of beliefs


@dataclass(frozen=True)
class SweepSettings(Believed):
    """What is the same for all trials of a table.

    Attributes:
        env: id of the environment.
        particles: of observers that have any.
        shapes: that are explored, and the candidates where no others are said.
        observers: that watch.
        exemplars: draws from which classifiers learn.
        first_seed: of the trials.
        classifiers: of finished maps.
        scale: metres that the unit of mesh files is long.
        size_jitter: how the object varies, as the environment's.
        position_jitter: m, the same.
        yaw_jitter: degrees, the same.
        rotation_jitter: degrees, the same; None: 0, of which no table tells.
        believed_sigma: observers are told so many times the true sigma.
        trust: whether policies whose files may run code are read.
        among: candidates, what the object may be; None: what is explored.
        none: prior probability that it is none of them; None: 0, of which no table tells.
        recordings: paths of those that the hand repeats; None: it explores.
        courses: whether the table keeps what is believed of every name through time; None: not, of which no table
            tells.
        memory_seconds: s, of the observers that are called limited; None: they do not forget.
        attention_seconds: s, of the same; None: they heed all fingers.
        names_only: whether observers only name the object, and map nothing; None: not, of which no table tells.
        wrist: how the hand is held; None: as it usually is, of which no table tells.
        maps_every: s from one map that classifiers name to the next; None: the last alone, of which no table tells.
        meshes: whether the mesh of each belief is judged; None: not, of which no table tells.

    Raises:
        ValueError: for a value out of its range.
    """

    env: str
    particles: int
    shapes: tuple[str, ...]
    observers: tuple[str, ...]
    exemplars: int
    first_seed: int
    classifiers: tuple[str, ...]
    scale: float = 1.0
    size_jitter: float = 0.0
    position_jitter: float = 0.0
    yaw_jitter: float = 0.0
    rotation_jitter: float | None = None
    believed_sigma: float = 1.0
    trust: bool = False
    among: tuple[str, ...] | None = None
    none: float | None = None
    recordings: tuple[str, ...] | None = None
    courses: bool | None = None
    memory_seconds: float | None = None
    attention_seconds: float | None = None
    names_only: bool | None = None
    wrist: str | None = None
    maps_every: float | None = None
    meshes: bool | None = None

    def __post_init__(self) -> None:
        registration.check("--env", self.env)
        registration.check_wrist(self.env, self.wrist)
        validate.integer("--particles", self.particles, 1, 100_000)
        validate.integer("--exemplars", self.exemplars, 1, 1000)
        validate.integer("--first-seed", self.first_seed, 0, EXEMPLAR_SEED - 1)
        validate.number("--size-jitter", self.size_jitter, 0.0, 0.5)
        validate.number("--position-jitter", self.position_jitter, 0.0, 0.05, unit="m")
        validate.number("--yaw-jitter", self.yaw_jitter, 0.0, 180.0, unit="degrees")
        rotation.jitter(self.rotation_jitter or 0.0, self.yaw_jitter)
        validate.number("--believed-sigma", self.believed_sigma, 0.1, 10.0)
        self.check_believed()
        if self.believed_sigma != 1.0 and (self.believed, self.believed_sigma_deg) != (None, None):
            raise ValueError("--believed-sigma multiplies what is so: not with --believed or --believed-sigma-deg")
        validate.number("--scale", self.scale, above=0.0, unit="m")
        for name in self.shapes:
            shapes.default_size(shapes.check("--shapes", name), self.scale)
        for name in self.among or ():
            shapes.default_size(shapes.check("--candidates", name), self.scale)
        validate.number("--none", self.none or 0.0, 0.0, 0.99)
        if self.maps_every is not None:
            validate.seconds("--maps-every", self.maps_every)
            if not self.classifiers:
                raise ValueError("--maps-every is when maps are named, and there are no --classifiers to name them")
        for name in self.observers:
            check_name(name, recorded=self.recordings is not None)
        self._check_limits()
        for what, given, valid in (
            ("shape", self.shapes, self.shapes or tuple(shapes.SHAPES)),
            ("candidate", self.known, self.known or tuple(shapes.SHAPES)),
            ("observer", self.observers, self.observers or variants.NAMES),
            ("classifier", self.classifiers, CLASSIFIERS),
        ):
            for name in given:
                validate.choice(f"--{what}s", name, valid)
            if not given and what != "classifier":
                raise ValueError(f"--{what}s must name at least one of {', '.join(sorted(valid))}")
            if len(set(given)) < len(given):
                raise ValueError(f"--{what}s must name each {what} once, got {', '.join(given)}")

    def _check_limits(self) -> None:
        """Raise `ValueError` for limits that are no observer's, and for an observer that is limited by none."""
        self.limits  # noqa: B018 - checks them
        limited = [name for name in self.observers if LIMITED in name]
        given = [name for name in ("memory_seconds", "attention_seconds") if getattr(self, name) is not None]
        if given and not limited:
            flag = f"--{given[0].replace('_', '-')}"
            raise ValueError(f"{flag} is of limited observers: --observers must name one, such as haptic_slam{LIMITED}")
        if limited and not given:
            raise ValueError(f"{limited[0]} of --observers has no limits: say --memory-seconds or --attention-seconds")

    def make_hand(self) -> Hand:
        """Make the hand that explores.

        Returns:
            The hand, on its wrist.

        Raises:
            ImportError: for one that is not installed.
        """
        return hand_of(registration.make(self.env, wrist=self.wrist))

    @property
    def limits(self) -> Limits:
        """What observers are limited to that are called so."""
        return Limits(np.inf if self.memory_seconds is None else self.memory_seconds, self.attention_seconds)

    @property
    def jitter(self) -> dict[str, Any]:
        """How the object varies: keyword arguments of the environment and of `ShapePosterior`."""
        return {name: getattr(self, name) or 0.0 for name in JITTER}

    @property
    def known(self) -> tuple[str, ...]:
        """What the object may be, for all that observers know."""
        if self.among is not None:
            return self.among
        # Beside a recording's object the four shapes are as large as it is.
        return self.shapes if self.recordings is None else tuple(dict.fromkeys((*self.shapes, *shapes.SHAPES)))

    @property
    def labels(self) -> tuple[str, ...]:
        """What it may be called."""
        return (*self.known, *([NONE] if self.none else []))

    def right_name(self, shape: str) -> str:
        """Say what it is right to call an object.

        Args:
            shape: that is explored.

        Returns:
            Its name, or "none" where it is none of the candidates and may be.
        """
        return NONE if self.none and shape not in self.known else shape

    @property
    def namers(self) -> tuple[str, ...]:
        """What names the object."""
        return (STREAM, *self.classifiers)


@dataclass(frozen=True)
class SweepTask:
    """One exploration: a trial, or an exemplar that is kept as a map.

    Attributes:
        settings: what all trials share.
        condition: noise, policy and duration.
        shape: that is explored.
        seed: of everything random.
    """

    settings: SweepSettings
    condition: Condition
    shape: str
    seed: int

    @property
    def key(self) -> Key:
        """What tells it from the other trials of the table."""
        return (*self.condition.values, self.shape, self.seed)

    def told(self, hand: Hand) -> dict[str, Any]:
        """Say what its observers are told.

        Args:
            hand: that explores.

        Returns:
            Keywords: the noise that they believe in.
        """
        noise = self.condition.noise
        return self.settings.told(noise | {"sigma_deg": self.settings.believed_sigma * noise["sigma_deg"]}, hand)

    @property
    def name(self) -> str:
        """The same as the name of a file."""
        told = [f"{name}={part_of_name(value)}" for name, value in self.condition.named_by.items()]
        return "_".join([*told, part_of_name(self.shape), str(self.seed)])


def bundles(tasks: Iterable[SweepTask]) -> list[tuple[SweepTask, ...]]:
    """Put tasks together where they are the same exploration but for the sigma at which it is felt, or what people call
    it: hands that do not heed what they feel move alike at each, so that the world and the ceiling are run once for
    all.

    Args:
        tasks: of one or several settings.

    Returns:
        All of them, those that are one exploration together.
    """
    together: dict[Hashable, list[SweepTask]] = {}
    for task in tasks:
        sigma, *others = replace(task, condition=replace(task.condition, condition="")).key
        recorded = bool(task.condition.recording)
        heeded = None if not recorded and agents.find(task.condition.policy).blind else sigma
        together.setdefault((task.settings, heeded, *others), []).append(task)
    return [tuple(each) for each in together.values()]


def exemplar_tasks(settings: SweepSettings, condition: Condition) -> list[list[SweepTask]]:
    """List the explorations from which classifiers learn, of seeds that no trial has.

    Args:
        settings: what all trials share.
        condition: of the trials.

    Returns:
        For each draw one of each candidate; nothing where nothing learns.
    """
    count = len(settings.known)
    return [
        [
            SweepTask(settings, condition, shape, EXEMPLAR_SEED + draw * count + index)
            for index, shape in enumerate(settings.known)
        ]
        for draw in range(settings.exemplars if settings.classifiers else 0)
    ]


def files_of(settings: SweepSettings) -> dict[str, str]:
    """Tell objects and hands by what is in their files: another content under the same name is another one.

    Args:
        settings: with the shapes, and the hand.

    Returns:
        A digest of each object that a file says, and of the hand that one describes.
    """
    told = {name: shapes.origin(name) for name in dict.fromkeys((*settings.shapes, *settings.known))}
    if registration.is_file(settings.env):
        hand = hands.make(settings.env)
        told[settings.env] = repr((hand.xml, hand.patches.names, hand.rest_pose.tolist())).encode()
    told |= {path: Path(path).read_bytes() for path in settings.recordings or ()}
    return {f"file {name}": hashlib.sha256(said).hexdigest()[:12] for name, said in told.items() if said}
