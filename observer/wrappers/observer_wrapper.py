"""Run an observer beside an environment."""

from __future__ import annotations

import math
from typing import Any
from weakref import WeakKeyDictionary

import gymnasium as gym
import numpy as np
from numpy.typing import NDArray

from haptic_env import hand_of, validate
from haptic_env.arrays import Array
from haptic_env.hand import Hand
from observer.belief import Belief
from observer.fastslam import HapticSLAM
from observer.pose_only import PoseOnly
from observer.shape.posterior import ShapePosterior
from observer.wrappers.map_classification import EVERY, check_classifier, classify
from observer.wrappers.stepped_apart import SteppedApart

KINDS = {"observer": "a HapticSLAM or a PoseOnly", "shape": "a ShapePosterior, or None"}
FELT = ("joint_angles", "contacts")
SAME_RATE = 1e-4  # of a control rate: recordings' stamps are rounded
_trials: WeakKeyDictionary[object, object] = WeakKeyDictionary()  # which trial an observer is in, of all of a process


class ObserverWrapper(SteppedApart, gym.utils.RecordConstructorArgs):
    """Puts `info["belief"]` beside every observation, and with `shape` `info["posterior"]` (C,) of `shape.labels`; at
    the end of an episode the lag is flushed first. With `classifier` there is `info["map_posterior"]` (C,) of
    `classifier.classes_` too, of the map (`map_now`) of the reset, of every `classify_every` steps and of the end; the
    steps between have that of the last one.

    `belief`, `shape` and `map_now` are attributes too, which `env.get_wrapper_attr` finds through further wrappers:
    policies read them there (`agents.policy.Guided`). The observer hears the torque that reached the hand, whatever
    wrappers between the two make of an action.
    """

    belief: Belief | None

    def __init__(
        self,
        env: gym.Env[Any, Any],
        observer: HapticSLAM | PoseOnly,
        shape: ShapePosterior | None = None,
        classifier: Any = None,
        classify_every: int = EVERY,
    ) -> None:
        """Check that all are of one hand and one rate. Each environment needs an observer of its own.

        Args:
            env: to be observed.
            observer: a `HapticSLAM`, a `PoseOnly` or the like.
            shape: names the object from the stream of beliefs; None: nobody does.
            classifier: names it from the map, a fitted one of `observer.classifiers` or the like; None: nobody does.
            classify_every: control steps from one map that it is asked about to the next.

        Raises:
            ValueError: for an observer or a `shape` of another hand, an observer of another control rate, observations
                without what is felt, and a `classifier` that is not fitted to the observer's maps.
        """
        gym.Wrapper.__init__(self, env)
        if not all(hasattr(observer, name) for name in ("hand", "reset", "step", "flush")):
            raise ValueError(f"observer must be a HapticSLAM, a PoseOnly or the like, got {validate.shown(observer)}")
        if shape is not None:
            validate.instance("shape", shape, ShapePosterior, "a ShapePosterior, or None")
        hand_of(env)  # which it must have
        if not isinstance(env.observation_space, gym.spaces.Dict) or not set(FELT) <= set(env.observation_space):
            raise ValueError(
                f"an observer hears {' and '.join(FELT)}, got a space {type(env.observation_space).__name__}; put the "
                "ObserverWrapper inside the wrapper that changes them"
            )
        self._check_hand("observer", observer)
        if shape is not None:
            self._check_hand("shape", shape)
        check_rate(env, observer)
        self._every = validate.integer("classify_every", classify_every, 1)
        if classifier is not None:
            check_classifier(classifier, observer)
        gym.utils.RecordConstructorArgs.__init__(
            self,
            observer=observer,
            shape=shape,
            classifier=classifier,
            classify_every=classify_every,
            _disable_deepcopy=True,
        )
        self.observer, self.shape, self.classifier = observer, shape, classifier
        self.belief = None
        # Then no belief is made but of steps that are looked at.
        self._quick = isinstance(observer, PoseOnly) and (shape is None or shape.samples == 1)
        self._chance = np.random.SeedSequence()
        self._trial = object()  # another one at every reset

    def reset(self, *, seed: int | None = None, options: dict[str, Any] | None = None) -> tuple[Any, dict[str, Any]]:
        """Start an episode, and a trial of the observer.

        Args:
            seed: as the environment's.
            options: as the environment's.

        Returns:
            The observation, and the info with the first belief.
        """
        observation, info = self.env.reset(seed=seed, options=options)
        # Streams of their own, so that the observer's chance is fixed by the seed and apart from the environment's;
        # without a seed the next one follows from the last, as the environment's does.
        self._chance = self._chance.spawn(1)[0] if seed is None else np.random.SeedSequence(seed)
        mine, shapes = map(int, self._chance.generate_state(2))
        self._trial = object()
        for each in self._observing():
            _trials[each] = self._trial
        if self.shape is not None:
            self.shape.reset(seed=shapes)
        self._steps, self._over = 0, False
        self._hear(self.observer.reset(mine, observation["joint_angles"]))
        if self.classifier is not None:
            self._map_posterior = classify(self.classifier, self.map_now())
        self._inside = observation, info
        return self.told()

    def advance(self, action: NDArray[np.float32]) -> tuple[Any, bool, bool]:
        """Take a step, and tell the observer of it.

        Args:
            action: of the environment.

        Returns:
            Reward, whether terminated and whether truncated, as the environment gives them.

        Raises:
            ValueError: for an observer that has begun a trial in another environment since the reset, and where a
                wrapper inside takes more or less than one control step.
        """
        for each in self._observing():
            if _trials.setdefault(each, self._trial) is not self._trial:  # a copy is in none yet
                raise ValueError(
                    f"this {type(each).__name__} has begun a trial in another environment since the reset; every "
                    "environment needs one of its own"
                )
        base: Any = self.env.unwrapped
        before = getattr(base, "steps", None)
        reward, terminated, truncated = self.advance_inside(action)
        observation, info = self._inside = self.told_inside()
        if before is not None and base.steps != before + 1:
            raise ValueError(
                f"{self.env} went from control step {before} to {base.steps} at once, and an observer has to hear of "
                "each; put the ObserverWrapper inside the wrapper that skips steps or resets"
            )
        torque, q, z = getattr(base, "commanded", action), observation["joint_angles"], observation["contacts"]
        self.belief = None  # the last one's map would be computed just before it changes
        felt = torque, q, z, info.get("root")  # of a hand that moves as a whole
        if self._quick:
            assert isinstance(self.observer, PoseOnly)
            lagged = self.observer.advance(*felt)
            if self.shape is not None:
                self.shape.take(lagged)
        else:
            self._hear(self.observer.step(*felt))
        self._steps, self._over = self._steps + 1, terminated or truncated
        if self._over:
            for belief in self.observer.flush():
                self._hear(belief)
        if self.classifier is not None and (self._over or self._steps % self._every == 0):
            self._map_posterior = classify(self.classifier, self.map_now())
        return reward, terminated, truncated

    def told(self) -> tuple[Any, dict[str, Any]]:
        """Say what is to be seen and believed after the last step.

        Returns:
            The observation of the environment, and its info with the belief.
        """
        if self.belief is None:
            assert isinstance(self.observer, PoseOnly)
            self.belief = self.observer.belief
        observation, info = self._inside
        return observation, {**info, **self._believed()}

    def posterior_now(self) -> Array:
        assert self.shape is not None
        return self.shape.posterior

    def map_now(self) -> Array:
        """Draw the map of the episode so far, and end nothing.

        Returns:
            (X, Y, Z) probability that each voxel is occupied: the observer's `map_now`; that of the last belief once
            the episode is over, and where the observer has no map.

        Raises:
            ValueError: before the first reset.
        """
        if self.belief is None:
            raise ValueError("there is no map before the first reset; call reset() first")
        drawn = getattr(self.observer, "map_now", None)
        return self.belief.occupancy.copy() if self._over or drawn is None else drawn()

    def _observing(self) -> tuple[object, ...]:
        return (self.observer,) if self.shape is None else (self.observer, self.shape)

    def _check_hand(self, what: str, observing: Any) -> None:
        known = getattr(observing, "hand", None)
        if not isinstance(known, Hand):
            raise ValueError(f"{what} must be {KINDS[what]}, got {validate.shown(observing)}")
        hand = hand_of(self.env)
        if hand.joint_names != known.joint_names or len(hand.patches) != len(known.patches):
            raise ValueError(
                f"the {what} knows hand {known.name!r} with {len(known.patches)} patches, the environment has "
                f"{hand.name!r} with {len(hand.patches)}; make the {what} from env.unwrapped.hand"
            )

    def _hear(self, belief: Belief) -> None:
        self.belief = belief
        if self.shape is not None:
            self.shape.update(belief)

    def _believed(self) -> dict[str, Any]:
        told: dict[str, Any] = {"belief": self.belief}
        if self.shape is not None:
            told["posterior"] = self.shape.posterior
        if self.classifier is not None:
            told["map_posterior"] = self._map_posterior.copy()
        return told


def check_rate(env: gym.Env[Any, Any], observer: HapticSLAM | PoseOnly) -> None:
    """Check that an observer was told the control rate of an environment.

    Args:
        env: the environment.
        observer: the observer.

    Raises:
        ValueError: for another rate.
    """
    has, knows = getattr(env.unwrapped, "control_hz", None), getattr(observer, "control_hz", None)
    if has is not None and knows is not None and not math.isclose(has, knows, rel_tol=SAME_RATE):
        raise ValueError(
            f"the observer was told control_hz={knows:g}, the environment has control_hz={has:g}; make the observer "
            "with control_hz=env.unwrapped.control_hz"
        )
