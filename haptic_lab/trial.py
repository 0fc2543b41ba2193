"""One exploration, seen by several observers at once: same torques, same felt angles, same contacts for all.

Shapes: T steps, J joints, P patches, C labels. Step 0 is the reset; arrays over time hold steps 1 to T.
"""

from __future__ import annotations

import copy
from collections.abc import Callable, Collection, Iterator, Mapping, Sequence
from typing import Any

import gymnasium as gym
import numpy as np
from numpy.typing import NDArray

import agents
import haptic_env  # noqa: F401 - registers the environments
from agents.policy import Policy
from agents.sb3 import Sb3, asks_of
from haptic_env import hand_env
from haptic_env.arrays import Array
from haptic_env.hand import Hand
from haptic_env.pose import Pose
from haptic_lab.limits import INFORMED, Limits, plain
from haptic_lab.limits import NONE as NO_LIMITS
from haptic_lab.observer_run import ObserverRun
from haptic_lab.records import BeliefTrace, Exploration, SensorReading, StepInput
from haptic_lab.worlds import solid_of
from observer import ObserverWrapper, ShapePosterior
from observer.variants import Observer, make_observer
from observer.wrappers.observer_wrapper import check_rate

GUIDE = "one_particle"  # of a policy that reads beliefs: names and poses need no more
TRUE_POSE = "ceiling"  # the one observer that is handed the true angles


class Trial:
    """Iterate over it to explore, one control step a turn (it may be left at any turn), then `finish`."""

    def __init__(
        self,
        env: gym.Env[Any, Any],
        policy: str | Policy,
        observers: Mapping[str, Observer],
        shape: ShapePosterior,
        seed: int,
        naming: Collection[str] | None = None,
        felt_at: Mapping[str, float] | None = None,
        trust: bool = False,
        courses: bool = False,
        limits: Limits = NO_LIMITS,
        maps_every: float | None = None,
    ) -> None:
        """Set up an exploration; it is begun by the first turn.

        Args:
            env: with `reveal_truth=True`; the truth goes to the record and to the observer `TRUE_POSE`, to no other.
            policy: a policy of `env`, or the name of one.
            observers: by name.
            shape: of which every observer that names has a copy.
            seed: fixes the world as `env.reset(seed=seed)` does, and from it the policy's and the observers' chance.
            naming: observers that name the object; None: all.
            felt_at: of some observers the sigma, in degrees, at which they feel the angles, in place of that of `env`.
            trust: whether a model may run code when it is read.
            courses: whether log posteriors through time are kept.
            limits: of the observers that are called limited.
            maps_every: s from one map that is kept to the next; None: none is but the last.

        Raises:
            ValueError: for a policy or an observer that does not fit `env`.
        """
        self.env, self.seed = env, seed
        base = hand_env(env)
        self.hand, self.steps, self.step_seconds = base.hand, base.episode_steps, 1.0 / base.control_hz
        for each in observers.values():
            check_rate(env, each)
        self._policy_seed, self._observer_seed = map(int, np.random.SeedSequence(seed).generate_state(2))
        told = {"trust": trust} if agents.is_model(policy) else {}
        self.policy = agents.make(policy, env, self._policy_seed, **told) if isinstance(policy, str) else policy
        # Copies share the tables of the candidates, which are never changed.
        self.observer_runs = {
            name: ObserverRun(
                each,
                limits.namer(name, shape, base.control_hz) if naming is None or name in naming else None,
                course=[] if courses else None,
                attention=limits.attention(name, self.hand, base.control_hz, self._observer_seed),
                maps_every=None if maps_every is None else maps_every / self.step_seconds,
            )
            for name, each in observers.items()
        }
        self._felt_at = dict(felt_at or {})
        self._record: list[tuple[NDArray[Any], ...]] = []
        self._roots: list[Pose | None] = []
        self._offsets: list[Array | None] = []

    def __iter__(self) -> Iterator[int]:
        """Explore; yields the number of the step just taken, from 1."""
        for step, turn in enumerate(self._explore(), 1):
            for name, observer_run in self.observer_runs.items():
                observer_run.step(step, name, turn)
            yield step

    def run(self) -> None:
        """Explore to the end, then let one observer after the other watch: the same as to iterate, but each has the
        processor's caches to itself, which saves some 15 % of the time of ten observers."""
        turns = list(self._explore())
        for name, observer_run in self.observer_runs.items():
            for step, turn in enumerate(turns, 1):
                observer_run.step(step, name, turn)

    def true_angles(self, step: int) -> Array:
        """Look up the true pose, for whoever shows or judges; observers are not told.

        Args:
            step: that was taken; 0 is the reset.

        Returns:
            (J,) rad; NaN where nobody knows.
        """
        return np.asarray(self._start.true_angles if step == 0 else self._record[step - 1][2])

    def _explore(self) -> Iterator[StepInput]:
        """What the hand does and feels, and the record of it."""
        observation, info = self.env.reset(seed=self.seed)
        # Of a recording with measured touch nobody knows the truth, and what was touched only where somebody says so.
        unknown = {"joint_angles": np.full(self.hand.joints, np.nan)}
        self.solid = solid_of(info["truth"]) if "truth" in info else info["solid"]
        felt, true = observation["joint_angles"], info.get("truth", unknown)["joint_angles"]
        self._start = SensorReading(true, felt, observation["contacts"] == 1)
        world: Any = self.env.unwrapped
        others = {sigma: world.felt_at(sigma) for sigma in self._felt_at.values()}
        detection = getattr(world, "contact_detection", None)
        self._faults = None if detection is None else np.array([detection.stuck, detection.dead])
        for name, angles in self._told(felt, true, others).items():
            self.observer_runs[name].reset(self._observer_seed, angles)
        state = None
        for _ in range(self.steps):
            torque, state = agents.act(self.policy, observation, state)
            observation, _, _, _, info = self.env.step(torque)
            truth = info.get("truth", unknown)
            felt, contacts, true = observation["joint_angles"], observation["contacts"], truth["joint_angles"]
            root = info.get("root")
            self._record.append((torque, felt, true, contacts == 1))
            self._roots.append(root)
            self._offsets.append(truth.get("joint_offset"))
            yield StepInput(torque, contacts, root, self._told(felt, true, others))

    def _told(self, felt: Array, true: Array, others: Mapping[float, Callable[[Array], Array]]) -> dict[str, Array]:
        """The angles (J,) rad that each observer is told at a step, by its name; `others` feel them at other sigmas."""
        also = {sigma: each(true) for sigma, each in others.items()}
        told = {name: also[self._felt_at[name]] if name in self._felt_at else felt for name in self.observer_runs}
        return {name: true if plain(name) == TRUE_POSE else angles for name, angles in told.items()}

    def finish(self) -> tuple[Exploration, dict[str, BeliefTrace]]:
        """Flush the observers' lag.

        Returns:
            What happened so far, and what each observer made of it, by name.
        """
        torques, felt, true, contacts = (np.array(each) for each in zip(*self._record, strict=True))
        steps = len(self._record)
        seconds = self.step_seconds * np.arange(1, steps + 1, dtype=np.float64)
        roots = tuple(root for root in self._roots if root is not None) or None
        known = [each for each in self._offsets if each is not None]
        offset = np.array(known) if known else None
        exploration = Exploration(
            self.hand, self.solid, seconds, torques, felt, true, contacts, self._start, roots, offset, self._faults
        )
        return exploration, {name: observer_run.trace(steps) for name, observer_run in self.observer_runs.items()}


def guided(
    env: gym.Env[Any, Any],
    policy: str | type[Policy],
    sigma_deg: float | None,
    shape: ShapePosterior,
    **keywords: Any,
) -> gym.Env[Any, Any]:
    """Give a policy what it reads: where that is beliefs, an observer of `GUIDE`, and where it asks what the object may
    be, a namer.

    They are the policy's own, so that the exploration is the same whichever observers watch it.

    Args:
        env: that is explored.
        policy: name, or path of a model; or a class.
        sigma_deg: that the observer is told, degrees; None: it finds it out.
        shape: the namer, which is copied.
        **keywords: of the observer, what else it is told.

    Returns:
        An `ObserverWrapper`, or `env` where the policy reads nothing.
    """
    kind = agents.find(policy) if isinstance(policy, str) else policy
    beliefs, names = asks_of(str(policy)) if agents.is_model(policy) else (kind.guided, kind.asks_shape)
    if not beliefs:
        return env
    base = hand_env(env)
    observer = make_observer(GUIDE, base.hand, sigma_deg, particles=1, control_hz=base.control_hz, **keywords)
    return ObserverWrapper(env, observer, copy.copy(shape) if names else None)


def check_model(env: gym.Env[Any, Any], policy: str, shape: ShapePosterior, trust: bool) -> None:
    """Refuse a trained model that does not fit, while nothing is compiled yet; policies of other kinds pass.

    Args:
        env: that is explored.
        policy: name, or path of a model.
        shape: the namer, whose labels the model may be shown.
        trust: whether a model may run code when it is read.

    Raises:
        ValueError: where it was trained for another hand or observation.
    """
    if issubclass(agents.find(policy), Sb3):
        told = {"trust": trust} if agents.is_model(policy) else {}
        agents.make(policy, guided(env, policy, 1.0, shape), **told)


def make_observers(
    names: Sequence[str],
    hand: Hand,
    sigma_deg: float | None,
    particles: int,
    limits: Limits = NO_LIMITS,
    candidates: ShapePosterior | None = None,
    **keywords: Any,
) -> dict[str, Observer]:
    """Make observers.

    Args:
        names: of observers or variants.
        hand: that explores.
        sigma_deg: that they are told, degrees; None: they find it out.
        particles: of the ones that have any.
        limits: of those that are called limited.
        candidates: what the object may be, for those that are called informed; they take a copy.
        **keywords: of all.

    Returns:
        The observers by name.
    """
    informed = {name: {"solids": candidates} if INFORMED in name else {} for name in names}
    return {
        name: make_observer(plain(name), hand, sigma_deg, particles, **keywords | told, **limits.keywords(name))
        for name, told in informed.items()
    }
