"""An exploration as a recording that is played back to the same belief."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np

from haptic_env.recordings import ObserverInputs, Recording, Track
from haptic_lab.records import Exploration


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
