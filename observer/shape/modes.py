"""Modes of where a solid lies, what is drawn about them, and the densities of that.

Shapes: M modes, D draws. Lengths in metres.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from haptic_env.arrays import Array


class Modes(NamedTuple):
    """Where a solid explains what was felt.

    Attributes:
        units: (M, 9) as of `Variants.draw`.
        spread: (M, 7, 7) covariances of size and place in units and of a turn in rad, with which touches leave them.
        fit: (M,) log likelihood of all that was felt.
    """

    units: Array
    spread: Array
    fit: Array

    def of(self, which: NDArray[np.int64]) -> Modes:
        """Choose some.

        Args:
            which: (K,) of them.

        Returns:
            Those.
        """
        return Modes(*(each[which] for each in self))


class Found(NamedTuple):
    """The posterior of one solid.

    Attributes:
        units: (D, 9) as of `Variants.draw`.
        log_weight: (D,) log of weights, whose sum is the evidence.
        fit: (D,) log likelihood of all that was felt.
        log_evidence: of the solid; no number where no draw explains anything.
        effective: how many draws matter; likewise.
    """

    units: Array
    log_weight: Array
    fit: Array
    log_evidence: float
    effective: float


def shares(fit: Array) -> Array:
    """Say how many draws are made about each mode.

    Args:
        fit: (M,) log likelihood.

    Returns:
        (M,) shares.
    """
    share = np.exp(0.5 * (fit - fit.max()))
    return np.asarray(share / share.sum())


def log_normal(off: Array, covariance: Array) -> Array:
    """Tell how probable it is to be so far from modes.

    Args:
        off: (M, D, k).
        covariance: (M, k, k).

    Returns:
        (M, D) log density of normals about 0.
    """
    size = covariance.shape[-1]
    factor = np.linalg.cholesky(covariance + 1e-12 * np.eye(size))
    scaled = np.linalg.solve(factor, off.transpose(0, 2, 1))
    log_det = np.log(np.diagonal(factor, axis1=1, axis2=2)).sum(axis=1)
    return np.asarray(-0.5 * (scaled**2).sum(axis=1) - log_det[:, None] - 0.5 * size * np.log(2.0 * np.pi))


def log_of_turns(turn: Array) -> Array:
    """Tell how many turns there are to a rotation vector.

    Args:
        turn: (..., 3) rad.

    Returns:
        (...) log of the share of all turns in a unit of volume, which is largest about 0.
    """
    angle = np.maximum(np.linalg.norm(turn, axis=-1), 1e-6)
    return np.asarray(np.log(2.0 * (1.0 - np.cos(angle)) / angle**2) - np.log(8.0 * np.pi**2))


def turns_between(turns: Array, modes: Array) -> Array:
    """Tell by what turn in the world each draw differs from each mode.

    Args:
        turns: (D, 4) quaternions xyzw.
        modes: (M, 4).

    Returns:
        (M, D, 3) rad, rotation vectors.
    """
    vector, real = turns[None, :, :3], turns[None, :, 3:]
    other, its_real = -modes[:, None, :3], modes[:, None, 3:]
    axis = real * other + its_real * vector + np.cross(vector, other)
    w = real * its_real - (vector * other).sum(axis=-1, keepdims=True)
    axis = np.where(w < 0.0, -axis, axis)
    sine = np.maximum(np.linalg.norm(axis, axis=-1, keepdims=True), 1e-12)
    return np.asarray(2.0 * np.arctan2(sine, np.abs(w)) / sine * axis)
