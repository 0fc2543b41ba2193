"""Exact Bayes for a pointer over a row of cells: every pose of a fine lattice times every map.

The model, in words: the joint angles do a Gaussian random walk from rest and are felt with Gaussian noise; a cell is
occupied or not; a touch is a noisy-OR of the one cell beside the pointer. Silence is taken to say nothing.
Shapes: T steps, J joints, A angles an axis of the lattice, C cells, W = 2^C maps.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from scipy.signal import fftconvolve

from tests.observer.hands import ARM, VOXEL


class Posterior(NamedTuple):
    """Of one step: `angles` (A,) rad of each axis, `pose` (A,) or (A, A) its probability, `occupied` (C,) of each
    cell, `log_evidence` of all that was felt up to this step (and of the angles felt up to `seen`)."""

    angles: np.ndarray
    pose: np.ndarray
    occupied: np.ndarray
    log_evidence: float


def posteriors(
    felt: np.ndarray,
    touched: np.ndarray,
    *,
    travel: np.ndarray,
    sigma: float,
    hit: float,
    false_alarm: float,
    prior: np.ndarray,
    seen: int | None = None,
    fine: int = 21,
    reach: float = 2.0,
) -> list[Posterior]:
    """p(q_k, m | touches up to k, angles felt up to k + seen) for every k (seen None: all angles).

    `felt` (T, J) rad, `touched` (T,); `travel` (J, J) a factor of the covariance of one step; the angles of the first
    step are the rest pose, 0; `prior` (C,) of each cell; `fine` lattice points a voxel, odd, so that none lies between
    two cells; they reach as far as `reach` times the row of cells.
    """
    steps, joints = felt.shape
    cells = len(prior)
    width = VOXEL / ARM
    half = int(np.ceil(reach * cells / 2 * fine))
    angles = np.arange(-half, half + 1) * width / fine
    axes = np.meshgrid(*[angles] * joints, indexing="ij")
    cell = np.floor(np.tan(sum(axes)) / width + cells / 2).astype(int)
    worlds = np.array(np.unravel_index(np.arange(2**cells), (2,) * cells))
    weight = np.prod(np.where(worlds == 1, prior[:, None], 1 - prior[:, None]), axis=0)
    silent = (1 - false_alarm) * (1 - hit * worlds)
    ring = np.concatenate([1 - silent, np.full((1, 2**cells), 1 - (1 - false_alarm) * (1 - 0.5 * hit))])
    ring = ring[np.where((cell >= 0) & (cell < cells), cell, cells)]  # axes..., W

    offsets = np.stack(np.meshgrid(*[np.arange(-half, half + 1) * width / fine] * joints, indexing="ij"), axis=-1)
    precision = np.linalg.inv(travel @ travel.T)
    kernel = np.exp(-0.5 * np.einsum("...i,ij,...j", offsets, precision, offsets))
    kernel /= kernel.sum()

    def likelihood(k):
        """Density of the angles felt at step k."""
        square = sum((felt[k, j] - axes[j]) ** 2 for j in range(joints)) / sigma**2
        return np.exp(-0.5 * square) / (np.sqrt(2 * np.pi) * sigma) ** joints

    def walk(f):
        """One step on: (axes..., any)."""
        return np.maximum(fftconvolve(f, kernel[..., None], mode="same", axes=range(joints)), 0.0)

    result = []
    forward = np.zeros((*cell.shape, 2**cells))
    forward[(half,) * joints] = weight
    for k in range(steps):
        if k > 0:
            forward = walk(forward)
        forward = forward * likelihood(k)[..., None]
        if touched[k]:
            forward = forward * ring
        later = np.ones((*cell.shape, 1))
        for t in range(min(steps - 1, k + seen if seen is not None else steps - 1), k, -1):
            later = walk(later * likelihood(t)[..., None])
        joint = forward * later
        total = joint.sum()
        joint = joint / total
        pose = joint.sum(axis=-1)
        occupied = worlds @ joint.reshape(-1, 2**cells).sum(axis=0)
        result.append(Posterior(angles, pose, occupied, float(np.log(total))))
    return result
