"""What `explore.py --recording` explores: a hand that repeats a recording, and what its observers are told.

A recording that says what was felt is played back as it is. One that knows where hand and object were is followed by
the hand in the object's frame (kinematic replay). Any other drives the hand by joint servos (driven replay).
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import gymnasium as gym
import numpy as np

import haptic_env
from agents.follow_recording import LEAD_SECONDS, FollowRecording
from agents.policy import Policy
from agents.repeat_torques import RepeatTorques
from haptic_env import hand_of, hands, recordings, registration, shapes, validate
from haptic_env.grid import Grid
from haptic_env.hand import Hand
from haptic_env.hands import wrist
from haptic_env.recordings import ObserverInputs, Recording, Track, checks
from haptic_env.replay import KinematicReplay, Playback
from haptic_env.shapes import Solid
from haptic_env.shapes.mesh import Mesh, is_path
from haptic_lab.records import Exploration
from haptic_lab.worlds import Candidates, candidates_of
from observer import ContactModel, ShapePosterior

OBJECT = ("name", "size", "position", "quaternion")  # what settings say of the object of an exploration
SIMULATED = {"contacts": "simulated"}  # what they say where it is not the recording's own
VOXEL = 0.005  # metres, of a map in the object's frame
MARGIN = 0.03  # metres of a map about the object
GLOVE = "adroit"  # the hand that a glove moves where nothing is said
# Hands fitted to markers sink into what they hold, fingertips by 5 to 13 mm, and all of their skin with them.
SINKING = ContactModel(give=3.0, deep=1.0)
SINKING_NAMER: dict[str, Any] = {"press": 0.05, "tolerance": 0.003}


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
    """

    env: gym.Env[Any, Any]
    policy: str | Policy
    candidates: Candidates
    namer: ShapePosterior
    told: Mapping[str, Any] = field(default_factory=dict)
    informed: Mapping[str, Any] = field(default_factory=dict)
    followed: Recording | None = None
    simulated: bool = False

    @property
    def hand(self) -> Hand:
        """The hand that explores."""
        return hand_of(self.env)


def load(path: str, part: str | None, calibration: str | None, hand: str | None) -> Recording:
    """Read a recording.

    Args:
        path: of the file, .npz or a glove's .txt.
        part: which recording, of a file that holds several.
        calibration: path of a glove's calibration; None: the one that comes for `hand`.
        hand: that a glove moves, by its name.

    Returns:
        The recording.

    Raises:
        ValueError: for what is wrong with it.
        OSError: where it cannot be read.
    """
    meaning = None
    if Path(path).suffix.lower() == ".txt":
        name = hand or GLOVE
        meaning = recordings.read_calibration(calibration) if calibration else recordings.calibration_for(name)
    elif calibration is not None:
        raise ValueError(f"--glove-calibration is for a glove's text, not for {path}")
    return recordings.read(path, part=part, calibration=meaning)


def environment_of(recording: Recording) -> str:
    """Find the environment whose hand a recording is of.

    Args:
        recording: with the names of joints.

    Returns:
        Its id.

    Raises:
        ValueError: where no hand has these joints.
    """
    names, known = set(recording.joint_names), []
    for env_id, name in haptic_env.ENVIRONMENTS.items():
        try:
            hand = hands.make(name)
        except ImportError:  # of a hand that is not installed
            continue
        if names == set(hand.joint_names):
            return env_id
        known.append(hand)
    nearest = max(known, key=lambda hand: len(names & set(hand.joint_names)))
    if names & set(nearest.joint_names):
        recording.columns_of(nearest)  # raises, and says which joints are missing or unknown
    raise ValueError(
        f"{recording.source}: no hand has its joints, {validate.listed(recording.joint_names)}; "
        "say which it is by --hand"
    )


def session(settings: Any, recording: Recording, render_mode: str | None = None) -> ExplorationSession:
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
    if recording.felt is not None:
        return _playback(settings, recording)
    if recording.root is not None and recording.object is not None:
        return _kinematic(settings, recording, render_mode)
    return _driven(settings, recording, render_mode)


def _playback(settings: Any, recording: Recording) -> ExplorationSession:
    free = {"wrist": "free"} if {*wrist.NAMES} <= {*recording.joint_names} else {}  # as the hand explored
    hand = hands.make(registration.hand_name(settings.env), **free)
    solid, moved = _explored(recording)
    env = Playback(hand, recording, solid)
    policy = RepeatTorques(env, recording.felt.torques[1:, recording.columns_of(hand)])  # type: ignore[union-attr]
    if moved:
        return ExplorationSession(env, policy, *_in_object_frame(hand, solid), recording)
    candidates = candidates_of(hand, shapes.SHAPES, like=settings.shape, scale=settings.scale)
    if solid.name not in candidates and not is_path(solid.name):  # a mesh may lie elsewhere now
        candidates |= candidates_of(hand, (solid.name,))
    simulated = SIMULATED.items() <= recording.settings.items()
    return ExplorationSession(env, policy, candidates, ShapePosterior(hand, candidates), simulated=simulated)


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


def _kinematic(settings: Any, recording: Recording, render_mode: str | None) -> ExplorationSession:
    if settings.shape is None:
        known = f" ({recording.mesh})" if recording.mesh else ""
        raise ValueError(f"{recording.source}: say what was held{known}: --mesh FILE or --shape NAME")
    shape = shapes.find(settings.shape)
    # The middle of a mesh, in its file's frame.
    own = shape.centre * shape.scale(settings.scale) if isinstance(shape, Mesh) else np.zeros(3)
    solid = shapes.make(settings.shape, shapes.default_size(settings.shape, settings.scale), own)
    env = KinematicReplay(
        registration.hand_name(settings.env),
        recording,
        solid,
        **settings.noise,
        episode_seconds=recording.seconds if settings.seconds is None else settings.seconds,
        render_mode=render_mode,
    )
    return ExplorationSession(env, RepeatTorques(env, []), *_in_object_frame(env.hand, solid), env.recording)


def _in_object_frame(hand: Hand, solid: Solid) -> tuple[Candidates, ShapePosterior, dict[str, Any], dict[str, Any]]:
    """What the object may be, who names it, and what observers of a hand that is followed are told and informed of."""
    size = np.full(3, np.mean(solid.size))
    candidates = {name: [shapes.make(name, size, solid.position)] for name in shapes.SHAPES}
    grid = Grid.around(solid.position, np.asarray(solid.size) + 2.0 * MARGIN, VOXEL)
    # Skin that sinks in denies what it touches: in hindsight a map has more of the surface, but less of it is true.
    told = {"motion": "kinematic", "grid": grid, "contact_model": SINKING, "in_hindsight": False}
    # For the pose the surface counts as exactly as it is known: what is not known of the pose is the pose's own matter.
    surface = ShapePosterior(hand, candidates, press=SINKING_NAMER["press"])
    return candidates, ShapePosterior(hand, candidates, **SINKING_NAMER), told, {"solids": surface}


def _driven(settings: Any, recording: Recording, render_mode: str | None) -> ExplorationSession:
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
    policy = FollowRecording(env, recording)
    hand = hand_of(env)
    candidates = candidates_of(hand, shapes.SHAPES, like=settings.shape, scale=settings.scale)
    return ExplorationSession(env, policy, candidates, ShapePosterior(hand, candidates), simulated=True)


def as_recording(exploration: Exploration, settings: Mapping[str, Any], followed: Recording | None) -> Recording:
    """Keep an exploration, to be played back.

    Args:
        exploration: what happened.
        settings: of the exploration, as JSON can say them.
        followed: the recording that its hand followed, where it moved as a whole.

    Returns:
        The recording.
    """
    hand, solid, steps = exploration.hand, exploration.solid, len(exploration.seconds) + 1
    start = exploration.start

    def before(first: Any, rows: Any) -> Any:
        return np.concatenate([np.asarray(first)[None], rows])

    def path(track: Track | None) -> Track | None:
        return None if track is None else Track(track.position[:steps], track.quaternion[:steps])

    moved = followed if exploration.roots is not None else None
    return Recording(
        source="this exploration",
        time=before(0.0, exploration.seconds),
        joint_names=hand.joint_names,
        joint_angles=before(start.true_angles, exploration.true_angles),
        root=path(moved.root) if moved else None,
        root_body=moved.root_body if moved else "",
        object=path(moved.object) if moved else None,
        mesh=moved.mesh if moved else "",
        felt=ObserverInputs(
            before(np.zeros(hand.joints), exploration.torques).astype(np.float64),
            before(start.felt_angles, exploration.felt_angles).astype(np.float64),
            before(start.contacts, exploration.contacts),
        ),
        settings={
            **settings,
            "object": {
                "name": solid.name,
                "size": list(solid.size),
                "position": list(solid.position),
                "quaternion": list(solid.quaternion),
            },
            "in_object_frame": exploration.roots is not None,
        },
    )
