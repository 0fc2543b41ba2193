"""The configuration of one exploration: environment, object, sensor noise, particles, policy and seed, and their
defaults. It is checked when it is made, by the names of the flags of `haptic-slam explore`."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

from haptic_env import registration, rotation, shapes, validate
from haptic_lab import conditions
from haptic_lab.believed import BELIEVED, Believed
from haptic_lab.conditions import check_policy
from haptic_lab.exploration import learnt, offsets, surface
from haptic_lab.view.options import UNSEEN, ViewOptions

OBSERVER, RAW = "haptic_slam", "floor"
SECONDS = 10.0
DEFAULTS: dict[str, Any] = {
    "env": "HapticSLAM/TwoFinger-v0",
    "shape": None,
    "scale": 1.0,
    "sigma": 3.0,
    "particles": 200,
    "seed": 0,
    **conditions.DEFAULTS,
    **dict.fromkeys(BELIEVED),
}


@dataclass(frozen=True)
class ExplorationSettings(Believed):
    """What the command line asks for.

    Attributes:
        env: id of the environment.
        shape: name, or path of a mesh; None: a hidden one.
        scale: metres that the unit of a mesh file is long.
        sigma: SD of the noise of felt angles, degrees.
        seconds: how long is explored; None: 10, or as long as the recording.
        particles: of the observer.
        policy: name, or path of a model.
        seed: of everything random.
        out: folder for the results.
        trust: whether a model may run code when it is read.
        bias_deg: as `Condition` has it, and so are the other noises.
        drift_deg: degrees.
        drift_seconds: s.
        proportional: a fraction.
        motor_noise: a fraction.
        contact_miss: a probability.
        contact_false_alarm: a probability.
        contact_confusion: a probability.
        patches_stuck: patches, or the probability of each.
        patches_dead: likewise.
        save_offsets: path of a file for the offsets that are found, if they are to be kept.
        wrist: how the hand is held, "fixed" or "free"; None: as it usually is.
        candidates: what the object may be, each at its own size; None: the four shapes, and `shape` at the mean of its.
        view: how it is shown in the browser.
        objects: a set in place of these, of which the object is drawn where no shape is said.
        none: prior probability that it is none of them; 0: it is one.
        save_mesh: path of a file for the surface of what was touched, if it is to be drawn.
        size_jitter: how the object varies, as the environment's, and what is not known of the candidates.
        position_jitter: m, the same.
        yaw_jitter: degrees, the same.
        rotation_jitter: degrees, the same.
        library: folder of a library of objects, all of which are candidates; with `name`, to which this one is added.
        name: that the object is called by in it.
        replace: whether one that is called so gives way.

    Raises:
        ValueError: for a value out of its range.
    """

    env: str
    shape: str | None
    scale: float
    sigma: float
    seconds: float | None  # None: 10, or as long as the recording
    particles: int
    policy: str
    seed: int
    out: str
    trust: bool = False
    bias_deg: float = conditions.DEFAULTS["bias_deg"]
    drift_deg: float = conditions.DEFAULTS["drift_deg"]
    drift_seconds: float = conditions.DEFAULTS["drift_seconds"]
    proportional: float = conditions.DEFAULTS["proportional"]
    motor_noise: float = conditions.DEFAULTS["motor_noise"]
    contact_miss: float = conditions.DEFAULTS["contact_miss"]
    contact_false_alarm: float = conditions.DEFAULTS["contact_false_alarm"]
    contact_confusion: float = conditions.DEFAULTS["contact_confusion"]
    patches_stuck: float | str = conditions.DEFAULTS["patches_stuck"]
    patches_dead: float | str = conditions.DEFAULTS["patches_dead"]
    save_offsets: str | None = None
    wrist: str | None = None
    save_mesh: str | None = None
    candidates: Sequence[str] | None = None
    none: float = 0.0
    size_jitter: float = 0.0
    position_jitter: float = 0.0
    yaw_jitter: float = 0.0
    rotation_jitter: float = 0.0
    library: str | None = None
    name: str | None = None
    replace: bool = False
    objects: str | None = None
    view: ViewOptions = UNSEEN

    def __post_init__(self) -> None:
        registration.check("--env", self.env)
        registration.check_wrist(self.env, self.wrist)
        if self.shape is not None:
            shapes.default_size(shapes.check("--shape", self.shape), self.scale)
        for name in self.among or ():
            shapes.default_size(shapes.check("--candidates", name), self.scale)
        validate.number("--none", self.none, 0.0, 0.99)
        validate.number("--scale", self.scale, above=0.0, unit="m")
        validate.number("--sigma", self.sigma, 0.0, 90.0, unit="degrees")
        if self.seconds is not None:
            validate.number("--seconds", self.seconds, 0.0, 3600.0, above=0.0, unit="s")
        validate.integer("--particles", self.particles, 1, 100_000)
        check_policy(self.policy, self.trust)
        validate.integer("--seed", self.seed, 0, 2**32 - 1)
        conditions.check_noise(self.noise)
        conditions.check_contacts(self.env, self.noise)
        self.check_believed()
        self.check_told(self.env, self.noise)
        if self.save_offsets is not None:
            offsets.check(self.save_offsets, self.out, self.believed_noise)
        if self.save_mesh is not None:
            surface.check(self.save_mesh, self.out)
        validate.number("--size-jitter", self.size_jitter, 0.0, 0.5)
        validate.number("--position-jitter", self.position_jitter, 0.0, 0.05, unit="m")
        validate.number("--yaw-jitter", self.yaw_jitter, 0.0, 180.0, unit="degrees")
        rotation.jitter(self.rotation_jitter, self.yaw_jitter)
        learnt.check(self)
        self.view.check(self.out)

    @property
    def jitter(self) -> dict[str, Any]:
        """How the object varies: keyword arguments of the environment and of `ShapePosterior`."""
        return {name: getattr(self, name) for name in learnt.JITTER}

    @property
    def among(self) -> Sequence[str] | None:
        """Names of what the object may be; None: as usual."""
        return self.candidates if self.objects is None else shapes.read_set(self.objects)

    @property
    def noise(self) -> dict[str, Any]:
        """Keyword arguments of the environment."""
        return conditions.noise_of(self) | {"sigma_deg": self.sigma}

    @property
    def believed_noise(self) -> dict[str, Any]:
        """What observers are told, whatever the hand: keyword arguments."""
        return self.told(self.noise)
