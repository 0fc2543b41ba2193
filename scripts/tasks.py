"""What a sweep runs in a worker: one exploration, seen by all observers, and the rows that it gives."""

from __future__ import annotations

import hashlib
import importlib.metadata
import io
import platform
from collections.abc import Hashable, Iterable, Mapping, Sequence
from dataclasses import asdict, astuple, dataclass
from functools import lru_cache
from pathlib import Path
from typing import Any, NamedTuple

import gymnasium as gym
import numpy as np
from conditions import Condition
from files import part_of_name
from numpy.typing import NDArray
from results import KEY, Key, listed
from trial import TRUE_POSE, Account, Exploration, Trial, candidates_of, guided, make_observers

import agents
import haptic_env
import observer as observer_package
from haptic_env import reading, shapes, validate
from haptic_env.grid import Grid
from observer import ShapePosterior, metrics, variants
from observer.classifiers import CLASSIFIERS, MapClassifier

EXEMPLAR_SEED = 2_000_000_000
STREAM = "shape_posterior"  # the name of what names the object from the whole stream of beliefs
AFTER_SECONDS = (2, 5, 10)  # when the name is asked for
GUIDE_VARIANTS = 24  # of each solid: enough to say where to go
FIRST_SECONDS = 5  # over which how soon it is right is averaged
PACKAGES = ("haptic-slam", "gymnasium", "mujoco", "numba", "numpy", "scipy", "scikit-learn")
MEASURES = (
    "pose_error_online_deg",
    "pose_error_lagged_deg",
    "pose_error_touching_deg",
    "coverage_90",
    "coverage_90_lagged",
    *(f"surface_{what}_{n}" for n in (1, 2) for what in ("precision", "recall", "f_score")),
    "surface_coverage",
    "growing_f_score_1",
    "growing_brier",
    "occupancy_ece",
    "occupancy_brier",
    "skin_ece",
    "skin_brier",
    "skin_log_loss",
    "touching_share",
    "n_eff",
    "time_to_decision",
    "step_accuracy",
    f"step_accuracy_{FIRST_SECONDS}s",
    *(f"correct_{seconds}s" for seconds in AFTER_SECONDS),
)
OF_MAPS = tuple(name for name in MEASURES if name.startswith(("surface_", "occupancy_")))
Exemplars = tuple[tuple[tuple[str, bytes], ...], ...]  # for each draw, name and content of the file of each shape
HISTOGRAMS = ("ranks_online", "ranks_lagged", "cells", "cells_predicted", "cells_observed")  # numbers with spaces
COURSES = ("course_p", "course_correct")  # likewise: the shape posterior of the truth, and whether it is the largest
COURSE_SECONDS = 0.25  # from one of these to the next


@dataclass(frozen=True)
class Settings:
    """What is the same for all trials of a table.

    `size_jitter`, `position_jitter` (m) and `yaw_jitter` (degrees): how the object varies, as the environment's.
    `believed_sigma`: the observers are told so many times the true sigma. `classifiers`: of finished maps.
    `trust`: policies whose files may run code are read.
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
    believed_sigma: float = 1.0
    trust: bool = False

    def __post_init__(self) -> None:
        validate.choice("--env", self.env, haptic_env.ENVIRONMENTS)
        validate.integer("--particles", self.particles, 1, 100_000)
        validate.integer("--exemplars", self.exemplars, 1, 1000)
        validate.integer("--first-seed", self.first_seed, 0, EXEMPLAR_SEED - 1)
        validate.number("--size-jitter", self.size_jitter, 0.0, 0.5)
        validate.number("--position-jitter", self.position_jitter, 0.0, 0.05, unit="m")
        validate.number("--yaw-jitter", self.yaw_jitter, 0.0, 180.0, unit="degrees")
        validate.number("--believed-sigma", self.believed_sigma, 0.1, 10.0)
        validate.number("--scale", self.scale, above=0.0, unit="m")
        for name in self.shapes:
            shapes.default_size(shapes.check("--shapes", name), self.scale)
        for name in self.observers:
            variants.check("--observers", name)
        for what, given, valid in (
            ("shape", self.shapes, self.shapes or tuple(shapes.SHAPES)),
            ("observer", self.observers, self.observers or variants.NAMES),
            ("classifier", self.classifiers, CLASSIFIERS),
        ):
            for name in given:
                validate.choice(f"--{what}s", name, valid)
            if not given and what != "classifier":
                raise ValueError(f"--{what}s must name at least one of {', '.join(sorted(valid))}")
            if len(set(given)) < len(given):
                raise ValueError(f"--{what}s must name each {what} once, got {', '.join(given)}")

    @property
    def namers(self) -> tuple[str, ...]:
        """What names the object."""
        return (STREAM, *self.classifiers)


@dataclass(frozen=True)
class Task:
    """One exploration: a trial, or an exemplar that is kept as a map."""

    settings: Settings
    condition: Condition
    shape: str
    seed: int

    @property
    def key(self) -> Key:
        """What tells it from the other trials of the table."""
        return (*astuple(self.condition), self.shape, self.seed)

    @property
    def told_sigma(self) -> float:
        """Degrees: the sigma that its observers believe in."""
        return self.condition.sigma_deg * self.settings.believed_sigma

    @property
    def name(self) -> str:
        """The same as the name of a file."""
        told = [f"{name}={part_of_name(value)}" for name, value in asdict(self.condition).items()]
        return "_".join([*told, part_of_name(self.shape), str(self.seed)])


def bundles(tasks: Iterable[Task]) -> list[tuple[Task, ...]]:
    """`tasks` put together where they are the same exploration but for the sigma at which it is felt: hands that do not
    heed what they feel move alike at each, so that the world and the ceiling are run once for all."""
    together: dict[Hashable, list[Task]] = {}
    for task in tasks:
        sigma, *others = task.key
        heeded = None if agents.find(task.condition.policy).blind else sigma
        together.setdefault((task.settings, heeded, *others), []).append(task)
    return [tuple(each) for each in together.values()]


def explore(tasks: Sequence[Task], naming: bool) -> tuple[Exploration, dict[Task, dict[str, Account]]]:
    """Run the exploration of `tasks`, which are a bundle; for each of them what every observer made of it."""
    first, *further = tasks
    trial = make_trial(first, naming, further)
    trial.run()
    trial.env.close()
    exploration, accounts = trial.finish()
    told = {first: {name: accounts[name] for name in first.settings.observers}}
    for task in further:
        told[task] = {name: accounts[_felt_by(task, name)] for name in first.settings.observers}
    return exploration, told


def _felt_by(task: Task, observer: str) -> str:
    """The name of `observer` in the trial of a bundle in which `task` is not the first."""
    return observer if observer == TRUE_POSE else f"{observer} at {task.condition.sigma_deg}"


def make_trial(task: Task, naming: bool, further: Sequence[Task] = ()) -> Trial:
    """The exploration of `task` and of those that are in one bundle with it, not begun."""
    settings, condition = task.settings, task.condition
    env = gym.make(
        settings.env,
        shape=task.shape,
        scale=settings.scale,
        **condition.noise,
        episode_seconds=condition.seconds,
        size_jitter=settings.size_jitter,
        position_jitter=settings.position_jitter,
        yaw_jitter=settings.yaw_jitter,
        reveal_truth=True,
    )
    hand = env.unwrapped.hand  # type: ignore[attr-defined]
    observers = make_observers(settings.observers, hand, task.told_sigma, settings.particles)
    felt_at: dict[str, float] = {}
    for other in further:
        mine = [name for name in settings.observers if name != TRUE_POSE]
        made = make_observers(mine, hand, other.told_sigma, settings.particles)
        renamed = {_felt_by(other, name): each for name, each in made.items()}
        observers |= renamed
        felt_at |= dict.fromkeys(renamed, other.condition.sigma_deg)
    posterior = shape_posterior(settings)
    env = guided(env, condition.policy, task.told_sigma, shape_posterior(settings, GUIDE_VARIANTS))
    named = None if naming else ()
    return Trial(
        env, condition.policy, observers, posterior, task.seed, naming=named, felt_at=felt_at, trust=settings.trust
    )


@lru_cache(maxsize=8)
def shape_posterior(settings: Settings, variants: int = 240) -> ShapePosterior:
    """The namer: the candidates are the explored shapes at the grasp centre; it knows how much they vary, not how, and
    tries `variants` of each."""
    hand = gym.make(settings.env).unwrapped.hand  # type: ignore[attr-defined]
    return ShapePosterior(
        hand,
        candidates_of(hand, settings.shapes, scale=settings.scale),
        size_jitter=settings.size_jitter,
        yaw_jitter=settings.yaw_jitter,
        position_jitter=settings.position_jitter,
        variants=variants,
    )


def run_exemplars(bundle: Sequence[Task]) -> list[tuple[Task, bytes]]:
    """Explore once for all tasks of `bundle`; for each of them the map that every observer ends with, as the content of
    an .npz file."""
    _, accounts = explore(bundle, naming=False)
    made = []
    for task in bundle:
        maps: dict[str, Any] = {name: account.belief.occupancy for name, account in accounts[task].items()}
        file = io.BytesIO()
        np.savez_compressed(file, **maps)
        made.append((task, file.getvalue()))
    return made


def run_trials(bundle: Sequence[Task], *exemplars: Exemplars) -> list[list[dict[str, Any]]]:
    """Explore once for all tasks of `bundle`; for each of them a row for each observer. The classifiers learn from its
    `exemplars`, a tuple for each draw."""
    exploration, accounts = explore(bundle, naming=True)
    places = Places.of(exploration, next(iter(accounts[bundle[0]].values())).belief.grid)
    # An observer that does not feel the noise has one account for the whole bundle.
    distinct = {id(account): account for each in accounts.values() for account in each.values()}
    measured = {key: _measured(exploration, places, account) for key, account in distinct.items()}
    return [
        [_row(task, name, account, measured[id(account)], learnt) for name, account in accounts[task].items()]
        for task, learnt in zip(bundle, exemplars, strict=True)
    ]


class Places(NamedTuple):
    """What is true of the world of an exploration: the steps (T,) at which the hand was `touching`, the places (M, 3) m
    that it `touched`, which voxels (X, Y, Z) it could reach, `cells`, and in which the object had the centre
    `occupied`; `beside` the skin: those that it swept or that share a face with one, and which the object `reached`;
    the places (S, 3) m of the whole `surface`."""

    touching: NDArray[np.bool_]
    touched: NDArray[np.float64]
    cells: NDArray[np.bool_]
    occupied: NDArray[np.bool_]
    beside: NDArray[np.bool_]
    reached: NDArray[np.bool_]
    surface: NDArray[np.float64]

    @classmethod
    def of(cls, exploration: Exploration, grid: Grid) -> Places:
        """Those of `exploration`, in voxels of `grid`."""
        hand, truth, contacts, solid = (
            exploration.hand,
            exploration.true_angles,
            exploration.contacts,
            exploration.solid,
        )
        swept = metrics.swept(hand, truth, grid)
        return cls(
            np.asarray(contacts.any(axis=1)),
            metrics.touched_places(hand, truth, contacts, solid),
            metrics.neighbourhood(swept),
            solid.occupancy(grid),
            metrics.neighbourhood(swept, faces=True),
            metrics.reached_into(solid, grid),
            metrics.surface_places(solid, grid),
        )


def _measured(exploration: Exploration, places: Places, account: Account) -> dict[str, Any]:
    """What `account` is worth: the columns of a row that have nothing to do with how it was asked for."""
    truth, (touching, touched, cells, occupied, beside, reached, surface) = exploration.true_angles, places
    grid, solid = account.belief.grid, exploration.solid
    occupancy = account.belief.occupancy
    calibration = metrics.reliability(occupancy, occupied, cells)
    beside_skin = metrics.reliability(occupancy, reached, beside)
    right = account.posterior.argmax(axis=1) == account.labels.index(solid.name)
    row: dict[str, Any] = {
        "pose_error_online_deg": metrics.pose_rmse_deg(account.joint_angles, truth),
        "pose_error_lagged_deg": metrics.pose_rmse_deg(account.lagged_joint_angles, truth),
        "pose_error_touching_deg": metrics.pose_rmse_deg(account.lagged_joint_angles[touching], truth[touching]),
        "coverage_90": metrics.credible_coverage(account.joint_angles, account.joint_std, truth),
        "coverage_90_lagged": metrics.credible_coverage(account.lagged_joint_angles, account.lagged_joint_std, truth),
        "surface_coverage": metrics.surface_recall(occupancy, grid, surface),
        "occupancy_ece": calibration.ece,
        "occupancy_brier": calibration.brier,
        **{f"skin_{what}": getattr(beside_skin, what) for what in ("ece", "brier", "log_loss")},
        "growing_f_score_1": metrics.surface_score(account.growing, grid, solid, touched).f_score,
        "growing_brier": metrics.reliability(account.growing, reached, beside).brier,
        "touching_share": float(touching.mean()),
        "n_eff": float(account.n_eff.mean()),
        "time_to_decision": metrics.time_to_decision(exploration.seconds, account.posterior),
        "step_accuracy": float(right.mean()),
        f"step_accuracy_{FIRST_SECONDS}s": float(right[exploration.seconds <= FIRST_SECONDS + 1e-9].mean()),
    }
    histograms = (
        metrics.rank_counts(account.joint_angles, account.joint_std, truth),
        metrics.rank_counts(account.lagged_joint_angles, account.lagged_joint_std, truth),
        calibration.cells,
        calibration.predicted,
        calibration.observed,
    )
    row |= {what: _spaced(numbers) for what, numbers in zip(HISTOGRAMS, histograms, strict=True)}
    row |= {what: _spaced(numbers) for what, numbers in zip(COURSES, course(exploration, account), strict=True)}
    for n in (1, 2):
        score = metrics.surface_score(occupancy, grid, solid, touched, n)
        row |= {f"surface_{what}_{n}": value for what, value in score._asdict().items()}
    row |= {f"correct_{after}s": correct_after(exploration, account, after) for after in AFTER_SECONDS}
    return row | {f"p_{label}": float(p) for label, p in zip(account.labels, account.posterior[-1], strict=True)}


def _row(
    task: Task, observer: str, account: Account, measured: Mapping[str, Any], exemplars: Exemplars
) -> dict[str, Any]:
    """The row of one `observer` in one trial."""
    row = {**dict(zip(KEY, (*task.key, observer), strict=True)), **measured}
    named = {STREAM: [account.name]}
    if observer in variants.WITHOUT_MAP:
        row |= dict.fromkeys(OF_MAPS, float("nan"))
        named |= {namer: [] for namer in task.settings.classifiers}
    else:
        for namer in task.settings.classifiers:
            fitted = classifiers(namer, observer, task.settings.shapes, exemplars)
            named[namer] = [each.predict(account.belief.occupancy) for each in fitted]
    for namer, names in named.items():
        row[namer] = listed(names)
        row[f"{namer}_correct"] = float(np.mean([each == task.shape for each in names])) if names else float("nan")
    return row | constants(task.settings)


def _spaced(numbers: np.ndarray) -> str:
    return " ".join(f"{each:.6g}" for each in numbers)


def correct_after(exploration: Exploration, account: Account, seconds: float) -> float:
    """1 where the shape posterior found the true shape the most probable after `seconds`, else 0; NaN where the
    exploration is shorter."""
    steps = int(np.searchsorted(exploration.seconds, seconds - 1e-9))
    if steps == len(exploration.seconds):
        return float("nan")
    return float(account.labels[int(np.argmax(account.posterior[steps]))] == exploration.solid.name)


def course(exploration: Exploration, account: Account) -> tuple[np.ndarray, np.ndarray]:
    """After each `COURSE_SECONDS`: the probability of the true shape, and 1 where no other is more probable, else 0."""
    times = np.arange(COURSE_SECONDS, exploration.seconds[-1] + 1e-9, COURSE_SECONDS)
    posterior = account.posterior[np.searchsorted(exploration.seconds, times - 1e-9)]
    truth = account.labels.index(exploration.solid.name)
    return posterior[:, truth], (posterior.argmax(axis=1) == truth).astype(float)


@lru_cache(maxsize=128)
def classifiers(namer: str, observer: str, labels: Sequence[str], exemplars: Exemplars) -> list[MapClassifier]:
    """The classifier `namer`, fitted once on each draw of the observer's `exemplars`, one for each of `labels`."""
    fitted = []
    for draw in exemplars:
        maps = []
        for name, content in draw:
            try:
                maps.append(reading.Arrays(content, name)[observer])
            except (ValueError, KeyError) as error:
                raise ValueError(f"the exemplar {name} is corrupt ({error}); delete it and run again") from error
        fitted.append(CLASSIFIERS[namer]().fit(maps, list(labels)))
    return fitted


def exemplar_tasks(settings: Settings, condition: Condition) -> list[list[Task]]:
    """For each draw, one exploration of each shape, of seeds that no trial has; none where nothing learns from them."""
    count = len(settings.shapes)
    return [
        [
            Task(settings, condition, shape, EXEMPLAR_SEED + draw * count + index)
            for index, shape in enumerate(settings.shapes)
        ]
        for draw in range(settings.exemplars if settings.classifiers else 0)
    ]


@lru_cache
def constants(settings: Settings) -> dict[str, str]:
    """What every row says of how it was made."""
    told = {name: listed(value) if isinstance(value, tuple) else str(value) for name, value in asdict(settings).items()}
    told = {("candidates" if name == "shapes" else name): value for name, value in told.items()}
    return told | versions()


@lru_cache
def versions() -> dict[str, str]:
    """What the figures may depend on: packages, interpreter, and a digest of this project's own code."""
    digest = hashlib.sha256()
    for package in (haptic_env, observer_package, agents):
        root = Path(str(package.__file__)).parent
        for path in sorted(root.rglob("*.py")):
            digest.update(path.relative_to(root).as_posix().encode() + path.read_bytes())
    found = {f"version_{name}": importlib.metadata.version(name) for name in PACKAGES}
    return found | {"version_python": platform.python_version(), "code": digest.hexdigest()[:12]}


def files_of(settings: Settings) -> dict[str, str]:
    """A digest of each mesh file that is explored: another content under the same name is another object."""
    meshes = [name for name in settings.shapes if name not in shapes.SHAPES]
    return {f"file {name}": hashlib.sha256(Path(name).read_bytes()).hexdigest()[:12] for name in meshes}


def columns(settings: Settings) -> tuple[list[str], list[str]]:
    """The columns of the table, and those that hold numbers."""
    correct = [f"{namer}_correct" for namer in settings.namers]
    numbers = [*MEASURES, *(f"p_{shape}" for shape in settings.shapes), *correct]
    keys = [name for name in KEY if name not in ("policy", "shape", "observer")]
    return [*KEY, *numbers, *HISTOGRAMS, *COURSES, *settings.namers, *constants(settings)], [*numbers, *keys]
