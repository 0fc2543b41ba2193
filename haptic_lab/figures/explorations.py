"""Explorations that figures show (`ShownExploration`): belief and truth ten frames a second, in an archive each.

Shapes: T steps, F frames, J joints, P patches, C labels, (X, Y, Z) voxels. A frame is of one moment: its map is that in
hindsight of all that was felt until then, its pose the one that the fixed lag told of later.
"""

from __future__ import annotations

import hashlib
import io
import json
from collections.abc import Sequence
from dataclasses import asdict, dataclass, fields
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from haptic_env import reading, shapes
from haptic_env.arrays import Array
from haptic_env.grid import Grid
from haptic_env.shapes import Solid
from haptic_lab.analysis.summary import SLAM
from haptic_lab.files import part_of_name
from haptic_lab.sweeps.provenance import versions
from haptic_lab.sweeps.tasks import SweepTask, files_of
from haptic_lab.sweeps.worker import make_trial

FRAMES_PER_SECOND = 10
LARGEST = 4096 * reading.MIB  # bytes of a showing, which this program wrote itself


@dataclass(frozen=True, eq=False)
class ShownExploration:
    """One exploration.

    Attributes:
        step: (F,) steps of the frames, from 1.
        occupancy: (F, X, Y, Z) probabilities, the map at that step.
        grid_origin: (3,) m.
        grid_resolution: m.
        mean: (F, J) rad, of the belief of the pose.
        covariance: (F, J, J) rad², of the same.
        seconds: (T,).
        felt_angles: (T, J) rad.
        true_angles: (T, J) rad.
        lagged_angles: (T, J) rad, as inferred.
        contacts: (T, P).
        posterior: (T, C) of `labels`.
        labels: (C,).
        shape: of the object.
        size: (3,) m.
        position: (3,) m.
        quaternion: (4,) wxyz.
        sigma_deg: noise of the felt angles, degrees.
    """

    step: NDArray[np.int64]
    occupancy: NDArray[np.float16]
    grid_origin: Array
    grid_resolution: Array
    mean: Array
    covariance: Array
    seconds: Array
    felt_angles: Array
    true_angles: Array
    lagged_angles: Array
    contacts: NDArray[np.bool_]
    posterior: Array
    labels: NDArray[np.str_]
    shape: NDArray[np.str_]
    size: Array
    position: Array
    quaternion: Array
    sigma_deg: Array

    @property
    def grid(self) -> Grid:
        """Of the occupancy."""
        x, y, z = self.occupancy.shape[1:]
        return Grid(tuple(self.grid_origin.tolist()), float(self.grid_resolution), (x, y, z))

    @property
    def solid(self) -> Solid:
        """The object that was explored."""
        return shapes.make(str(self.shape), self.size, self.position, self.quaternion)

    def poses(self, frame: int, count: int = 100) -> Array:
        """Draw from what is believed of the pose.

        Args:
            frame: index of the frame.
            count: of the draws.

        Returns:
            (count, J) rad, the same for the same frame.
        """
        rng = np.random.default_rng(0)
        return rng.multivariate_normal(self.mean[frame], self.covariance[frame], count, method="cholesky")

    def frame_at(self, seconds: float) -> int:
        """Find a frame by its time.

        Args:
            seconds: of the exploration.

        Returns:
            Index of the last frame that is not after it; the first where all are.
        """
        return max(0, int(np.searchsorted(self.seconds[self.step - 1], seconds + 1e-9)) - 1)


def run_shown_explorations(tasks: Sequence[SweepTask]) -> list[tuple[SweepTask, bytes]]:
    """Explore, in a worker.

    Args:
        tasks: to explore one by one.

    Returns:
        Each with a `ShownExploration` as the content of an .npz file.
    """
    return [(task, _show(task)) for task in tasks]


def _show(task: SweepTask) -> bytes:
    trial = make_trial(task, naming=True)
    observer_run = trial.observer_runs[SLAM]
    slam: Any = observer_run.observer
    every = max(1, round(1.0 / (FRAMES_PER_SECOND * trial.step_seconds)))
    frames: list[tuple[Any, ...]] = []
    maps: dict[int, NDArray[np.float16]] = {}  # of the steps that the lag has not reached
    for step in trial:
        belief = observer_run.belief
        about = step - belief.lag_steps
        if step % every == 0:
            maps[step] = slam.map_now().astype(np.float16)
        if belief.lagged_contacts is not None and about % every == 0:
            frames.append((about, maps.pop(about), belief.lagged_joint_angles, belief.lagged_covariance))
    trial.env.close()
    exploration, traces = trial.finish()
    trace = traces[SLAM]
    belief, solid = trace.belief, exploration.solid
    last = belief.occupancy.astype(np.float16), belief.lagged_joint_angles, belief.lagged_covariance
    frames.append((len(exploration.seconds), *last))
    steps, occupancy, mean, covariance = (np.array(each) for each in zip(*frames, strict=True))
    showing = ShownExploration(
        step=steps,
        occupancy=occupancy,
        grid_origin=np.array(belief.grid.origin),
        grid_resolution=np.array(belief.grid.resolution),
        mean=mean,
        covariance=covariance,
        seconds=exploration.seconds,
        felt_angles=exploration.felt_angles,
        true_angles=exploration.true_angles,
        lagged_angles=trace.lagged_joint_angles,
        contacts=exploration.contacts,
        posterior=trace.posterior,
        labels=np.array(trace.labels),
        shape=np.array(solid.name),
        size=np.array(solid.size),
        position=np.array(solid.position),
        quaternion=np.array(solid.quaternion),
        sigma_deg=np.array(task.condition.sigma_deg),
    )
    file = io.BytesIO()
    # A map changes little from frame to frame: the differences of the bits are mostly zeros, which take no room.
    changes = np.diff(showing.occupancy.view(np.uint16), axis=0, prepend=np.uint16(0))
    np.savez_compressed(file, **{**vars(showing), "occupancy": changes})
    return file.getvalue()


def file_of(folder: Path, task: SweepTask) -> Path:
    """Say where an exploration is kept, under a name that no other task, and no other version of the code, has.

    Args:
        folder: of all explorations.
        task: that was explored.

    Returns:
        The path of the .npz file.
    """
    told = json.dumps([asdict(task), versions() | files_of(task.settings)], sort_keys=True)
    digest = hashlib.sha256(told.encode()).hexdigest()[:12]
    return folder / f"{part_of_name(task.shape)}_{task.condition.sigma_deg:g}_{digest}.npz"


def read(path: Path) -> ShownExploration:
    """Read an exploration.

    Args:
        path: of the .npz file.

    Returns:
        The exploration.

    Raises:
        ValueError: for a file that is corrupt.
    """
    try:
        kept = reading.npz(path, LARGEST)
        found = {each.name: kept[each.name] for each in fields(ShownExploration)}
        occupancy = np.cumsum(found["occupancy"], axis=0, dtype=np.uint16).view(np.float16)
        return ShownExploration(**{**found, "occupancy": occupancy})
    except (OSError, ValueError, KeyError) as error:
        raise ValueError(f"the exploration {path} is corrupt ({error}); delete it and run again") from error
