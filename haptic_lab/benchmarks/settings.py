"""How much the benchmark measures, and of what; it is checked when it is made, as the flags of `bench` are called."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

from haptic_env import registration, shapes, validate
from haptic_lab.files import check_writable


@dataclass(frozen=True)
class BenchSize:
    """How much is measured.

    Attributes:
        few: particles of the small observer.
        many: of the large one.
        coarse: voxels along the longest edge of the small grid.
        fine: of the large one.
        steps: of the recording.
        seconds: of the whole trial.
        megabytes: that are copied, to measure the memory.
        candidates: of whoever names the object.
        together: environments side by side.
        decisions: of each.
    """

    few: int = 200
    many: int = 1000
    coarse: int = 32
    fine: int = 64
    steps: int = 120
    seconds: float = 10.0
    megabytes: int = 256
    candidates: int = 50
    together: int = 16
    decisions: int = 60


QUICK = BenchSize(
    few=20, many=40, coarse=16, fine=32, steps=40, seconds=1.0, megabytes=16, candidates=6, together=2, decisions=3
)


@dataclass(frozen=True)
class BenchSettings:
    """What the command line asks for.

    Attributes:
        env: id of the environment.
        shape: that is explored.
        objects: a set, of which whoever names an object has `candidates`.
        learner: measure nothing but the steps that a learner gets.
        sigma: noise of the felt angles, degrees.
        seed: of the exploration.
        rounds: repetitions of everything.
        quick: `QUICK` in place of `BenchSize()`.
        json: file for the figures.

    Raises:
        ValueError: for a value out of its range.
    """

    env: str
    shape: str
    sigma: float
    seed: int
    rounds: int
    quick: bool
    json: str | None
    objects: str = "fifty"
    learner: bool = False

    def __post_init__(self) -> None:
        registration.check("--env", self.env)
        shapes.default_size(shapes.check("--shape", self.shape))
        for name in shapes.read_set(self.objects):
            shapes.default_size(shapes.check("object of --objects", name))
        validate.number("--sigma", self.sigma, high=90.0, above=0.0, unit="degrees")
        validate.integer("--seed", self.seed, 0, 2**32 - 1)
        validate.integer("--rounds", self.rounds, 1, 1000)
        if self.json is not None:
            check_writable("--json", Path(self.json))
