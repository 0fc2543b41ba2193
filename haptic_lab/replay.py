"""What `explore.py --recording` explores: a hand that repeats a recording, and what its observers are told.

A recording with measured touch is told step by step, and nothing of it is simulated. One that says what was felt is
played back as it is. One that knows where hand and object were is followed by the hand in the object's frame (kinematic
replay). Any other drives the hand by joint servos (driven replay).
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from typing import Any

import gymnasium as gym
import numpy as np

from agents.follow_recording import LEAD_SECONDS, FollowRecording
from agents.policy import Policy
from agents.repeat_torques import RepeatTorques
from haptic_env import hand_of, hands, registration, shapes, validate
from haptic_env.grid import Grid
from haptic_env.hand import Hand
from haptic_env.hands import wrist
from haptic_env.measured_playback import MeasuredPlayback
from haptic_env.recordings import MeasuredTouch, Recording, checks
from haptic_env.recordings.foreign import of_felt
from haptic_env.replay import KinematicReplay, Playback, steady_rate
from haptic_env.shapes import Solid
from haptic_env.shapes.mesh import Mesh, is_path
from haptic_lab import possible
from haptic_lab.exploration import learnt
from haptic_lab.worlds import Candidates, candidates_of
from observer import ContactModel, ShapePosterior

OBJECT = ("name", "size", "position", "quaternion")  # what settings say of the object of an exploration
SIMULATED = {"contacts": "simulated"}  # what they say where it is not the recording's own
VOXEL = 0.005  # metres, of a map in the object's frame
MARGIN = 0.03  # metres of a map about the object
SMALL = 0.075  # metres, mean extent of an object whose map is drawn in hindsight, and that is touched seldom
# Hands fitted to markers sink into what they hold, fingertips by 5 to 13 mm, and all of their skin with them.
SINKING = ContactModel(give=3.0, deep=1.0)
SINKING_SMALL = replace(SINKING, touch=8.0, sustained=4.0, prior=0.1)  # few touches, each of which counts
SINKING_NAMER: dict[str, Any] = {"press": 0.05, "tolerance": 0.003}
# Where it is known to the millimetre how hand and object lay, and for seconds only, every step counts.
FOLLOWED_NAMER: dict[str, Any] = {"press": 0.05, "tolerance": 0.001, "stride": 1, "temper": 0.3}


@dataclass(frozen=True)
class ExplorationSession:
    """What is explored, by whom.

    Attributes:
        env: the environment.
        policy: moves the hand in it.
        candidates: what the object may be.
        namer: names it.
        told: keywords of all observers.
        informed: further keywords, of the one that is no bracket.
        followed: the recording at the control rate, of a hand that moved as a whole.
        simulated: whether the object is one that was named, of which the recording tells nothing, so that what was felt
            of it is simulated.
        measured: the recording, where touch was measured.
    """

    env: gym.Env[Any, Any]
    policy: str | Policy
    candidates: Candidates
    namer: ShapePosterior
    told: Mapping[str, Any] = field(default_factory=dict)
    informed: Mapping[str, Any] = field(default_factory=dict)
    followed: Recording | None = None
    simulated: bool = False
    measured: MeasuredTouch | None = None

    @property
    def hand(self) -> Hand:
        """The hand that explores."""
        return hand_of(self.env)


def session(settings: Any, recording: Recording | MeasuredTouch, render_mode: str | None = None) -> ExplorationSession:
    """Set up the replay of a recording.

    Args:
        settings: `ExplorationSettings`.
        recording: that the hand repeats.
        render_mode: of an environment that simulates the hand.

    Returns:
        What is explored, by whom.

    Raises:
        ValueError: where they do not fit together.
    """
    if isinstance(recording, MeasuredTouch):
        return _measured(settings, recording)
    if recording.felt is not None:
        return _playback(settings, recording) if recording.settings else _felt(settings, recording)
    if recording.root is not None and recording.object is not None:
        return _kinematic(settings, recording, render_mode)
    return _driven(settings, recording, render_mode)


def _measured(settings: Any, recording: MeasuredTouch) -> ExplorationSession:
    recording = recording.until(settings.seconds)
    hand = recording.hand
    solid = None if settings.shape is None else shapes.usual(settings.shape, hand, settings.scale)
    namer, candidates, told = of_measured(settings, hand, recording.torques is not None)
    env = MeasuredPlayback(recording, solid)
    policy = RepeatTorques(env, [] if recording.torques is None else recording.torques[1:])
    return ExplorationSession(env, policy, candidates, namer, told, measured=recording)


def of_measured(settings: Any, hand: Hand, torques: bool = False) -> tuple[ShapePosterior, Candidates, dict[str, Any]]:
    """Say who observes a hand whose touch is measured, in a file or as it comes.

    Args:
        settings: `ExplorationSettings`.
        hand: that moved.
        torques: whether it is known what was commanded; else joints are taken to move smoothly.

    Returns:
        The namer, what the object may be, and keywords of the observer.

    Raises:
        ValueError: for candidates that are none.
    """
    namer, candidates = learnt.naming(settings, hand, possible.chosen(settings, hand), **SINKING_NAMER)
    told = {"contact_model": SINKING, "in_hindsight": False}
    return namer, candidates, told if torques else {"motion": "kinematic", **told}


def _felt(settings: Any, recording: Recording) -> ExplorationSession:
    """What was felt with torques that are told, by a hand of which no exploration tells."""
    hand = hands.make(registration.hand_name(settings.env))
    told, torques = of_felt(recording, hand, steady_rate(recording)), recording.felt_of(hand).torques
    return _measured(settings, replace(told, torques=torques) if torques[1:].any() else told)


def _playback(settings: Any, recording: Recording) -> ExplorationSession:
    free = {"wrist": "free"} if {*wrist.NAMES} <= {*recording.joint_names} else {}  # as the hand explored
    hand = hands.make(registration.hand_name(settings.env), **free)
    solid, moved = _explored(recording)
    env = Playback(hand, recording, solid, settings.seconds)
    policy = RepeatTorques(env, recording.felt_of(hand).torques[1:])
    if moved:
        return ExplorationSession(env, policy, *_in_object_frame(settings, hand, solid), recording)
    candidates = dict(possible.chosen(settings, hand))
    if settings.among is None and solid.name not in candidates and not is_path(solid.name):
        candidates |= candidates_of(hand, (solid.name,))  # a mesh may lie elsewhere now
    simulated = SIMULATED.items() <= recording.settings.items()
    namer = ShapePosterior(hand, candidates, none=settings.none, **settings.jitter)
    return ExplorationSession(env, policy, candidates, namer, simulated=simulated)


def _explored(recording: Recording) -> tuple[Solid, bool]:
    """The object of an exploration, and whether the hand moved as a whole, by the settings that it was kept with."""
    told = recording.settings.get("object")
    try:
        if not isinstance(told, dict) or set(told) != set(OBJECT):
            raise ValueError(f"object must be a table of {', '.join(OBJECT)}, got {told!r}")
        moved = validate.boolean("in_object_frame", recording.settings.get("in_object_frame"))
        if moved and (recording.root is None or recording.object is None):
            raise ValueError("in_object_frame is true, but it does not say where the hand and the object were")
        validate.array("position of object", told["position"], (3,), "m", bound=checks.APART)
        return shapes.make(**told), moved
    except ValueError as error:
        raise ValueError(f"{recording.source}: its settings are not those that explore.py writes: {error}") from error


def world(
    settings: Any, recording: Recording, render_mode: str | None = None
) -> tuple[gym.Env[Any, Any], RepeatTorques | FollowRecording]:
    """Set up the environment in which a recording is repeated of which nothing was felt, and who moves the hand.

    Args:
        settings: `ExplorationSettings`.
        recording: that the hand repeats.
        render_mode: of the environment.

    Returns:
        The environment, and the policy.

    Raises:
        ValueError: where they do not fit together.
    """
    if recording.root is not None and recording.object is not None:
        env = _kinematic_world(settings, recording, render_mode)
        return env, RepeatTorques(env, [])
    return _driven_world(settings, recording, render_mode)


def _kinematic(settings: Any, recording: Recording, render_mode: str | None) -> ExplorationSession:
    env = _kinematic_world(settings, recording, render_mode)
    told = _in_object_frame(settings, env.hand, _held(settings, recording))
    return ExplorationSession(env, RepeatTorques(env, []), *told, env.recording)


def _held(settings: Any, recording: Recording) -> Solid:
    """The object of a recording, at its place in the frame of its path."""
    if settings.shape is None:
        known = f" ({recording.mesh})" if recording.mesh else ""
        raise ValueError(f"{recording.source}: say what was held{known}: --mesh FILE or --shape NAME")
    shape = shapes.find(settings.shape)
    # The middle of a mesh, in its file's frame.
    own = shape.centre * shape.scale(settings.scale) if isinstance(shape, Mesh) else np.zeros(3)
    return shapes.make(settings.shape, shapes.default_size(settings.shape, settings.scale), own)


def _kinematic_world(settings: Any, recording: Recording, render_mode: str | None) -> KinematicReplay:
    return KinematicReplay(
        registration.hand_name(settings.env),
        recording,
        _held(settings, recording),
        **settings.noise,
        episode_seconds=recording.seconds if settings.seconds is None else settings.seconds,
        render_mode=render_mode,
    )


def _in_object_frame(
    settings: Any, hand: Hand, solid: Solid
) -> tuple[Candidates, ShapePosterior, dict[str, Any], dict[str, Any]]:
    """What the object may be, who names it, and what observers of a hand that is followed are told and informed of."""
    candidates = possible.beside(settings, solid)
    grid = Grid.around(solid.position, np.asarray(solid.size) + 2.0 * MARGIN, VOXEL)
    # Skin that sinks in denies what it touches: in hindsight a map has more of the surface, but less of it is true. A
    # small object is touched so little at any one place that without hindsight its map has nothing at all.
    small = float(np.mean(solid.size)) < SMALL
    model = SINKING_SMALL if small else SINKING
    told = {"motion": "kinematic", "grid": grid, "contact_model": model, "in_hindsight": small}
    # For the pose the surface counts as exactly as it is known: what is not known of the pose is the pose's own matter.
    # A set without the object is not to pull the pose.
    surface = ShapePosterior(hand, candidates, press=FOLLOWED_NAMER["press"], none=settings.none or possible.DOUBT)
    none = possible.doubt_of(settings, solid, candidates)
    return candidates, ShapePosterior(hand, candidates, none=none, **FOLLOWED_NAMER), told, {"solids": surface}


def _driven(settings: Any, recording: Recording, render_mode: str | None) -> ExplorationSession:
    env, policy = _driven_world(settings, recording, render_mode)
    hand = hand_of(env)
    candidates = possible.chosen(settings, hand)
    namer = ShapePosterior(hand, candidates, none=settings.none)
    return ExplorationSession(env, policy, candidates, namer, simulated=True)


def _driven_world(
    settings: Any, recording: Recording, render_mode: str | None
) -> tuple[gym.Env[Any, Any], FollowRecording]:
    if settings.shape is None:
        raise ValueError(
            f"{recording.source}: it has joint angles alone, and does not tell of an object; name the one with which "
            "contacts are to be simulated: --shape NAME or --mesh FILE"
        )
    env = registration.make(
        settings.env,
        shape=settings.shape,
        scale=settings.scale,
        **settings.noise,
        episode_seconds=recording.seconds + LEAD_SECONDS if settings.seconds is None else settings.seconds,
        render_mode=render_mode,
        reveal_truth=True,  # for the observer's judge alone
    )
    return env, FollowRecording(env, recording)
