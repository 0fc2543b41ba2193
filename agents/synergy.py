"""Torques in a space of few joint synergies.

Hands move in few dimensions: two principal components hold four fifths of the variance of the postures in which people
grasp (Santello, Flanders & Soechting 1998, J. Neurosci. 18, 10105-10115). Shapes: J joints, S synergies, T steps of
recordings.
"""

from __future__ import annotations

import io
import os
import warnings
from pathlib import Path
from typing import Any

import gymnasium as gym
import numpy as np
from numpy.typing import NDArray

from agents.finger_kinematics import FingerKinematics
from agents.ornstein_uhlenbeck import OrnsteinUhlenbeck
from agents.policy import Policy, State
from haptic_env import hand_of, reading, validate
from haptic_env.arrays import Array
from haptic_env.hand import Hand
from haptic_env.recordings import checks

EXPLAINED = 0.9  # share of the variance that the components of recordings must hold


class Synergy(Policy):
    """An Ornstein–Uhlenbeck process in each synergy, of time constant `seconds` and stationary SD `sd`; the first one,
    flexion, has the mean `flexion`. Torques are the sum, clipped to their limits.

    `recordings`: a file of joint angles (T, J) rad, .npy or .csv, in the order of the hand's joints; synergies are its
    principal components, as many as hold nine tenths of the variance (or `synergies`), and the first is turned so that
    it closes the hand. None: `opposition_basis`, from the hand's kinematics.

    Raises `ValueError` for a value out of range, or recordings of other joints or of no angles.
    """

    blind = True

    def __init__(
        self,
        env: gym.Env[Any, Any],
        seed: int | None = None,
        *,
        recordings: str | os.PathLike[str] | None = None,
        synergies: int | None = None,
        flexion: float = 0.4,
        sd: float = 0.6,
        seconds: float = 0.3,
    ) -> None:
        super().__init__(env, seed)
        hand = hand_of(env)
        basis = opposition_basis(hand) if recordings is None else posture_basis(hand, recordings)
        count = validate.integer("synergies", len(basis) if synergies is None else synergies, 1, self.joints)
        if recordings is None and count > len(basis):
            raise ValueError(f"the hand {hand.name!r} has {len(basis)} synergies without recordings, got {synergies!r}")
        self.basis = basis[:count] if synergies is not None else basis
        self.mean = np.zeros(len(self.basis))
        self.mean[0] = validate.number("flexion", flexion, -1.0, 1.0)
        self.drive = OrnsteinUhlenbeck(env, len(self.basis), sd=sd, seconds=seconds)
        self.remembers = ((self.drive.size,),)

    def decide(self, observation: Any, state: State, deterministic: bool) -> tuple[NDArray[np.float32], State]:
        """As every policy's; `state` holds the process (S,). `deterministic` takes its mean step."""
        drive = self.drive.next(self.rng, state, deterministic)
        torque = np.clip((self.mean + drive) @ self.basis, -1.0, 1.0)
        return torque.astype(np.float32), (drive,)


def opposition_basis(hand: Hand) -> Array:
    """(S, J), the largest entry of each 1: all fingers close; then for each finger, it closes against the others, goes
    across, and curls. For two fingers these are flexion, opposition, and the ways along an object."""
    kinematics = FingerKinematics(hand)
    close, across, curl = kinematics.strokes(hand.rest_pose, hand.grasp_centre)
    together = close.sum(axis=0)
    against = [2.0 * each - together for each in close[1:]]
    return _scaled(np.array([together, *against, *across, *curl]))


def posture_basis(hand: Hand, path: str | os.PathLike[str]) -> Array:
    """(S, J), the largest entry of each 1: the principal components of the recorded angles in the file at `path`, all
    of those that are needed to hold `EXPLAINED` of the variance."""
    told = _read(path)
    if told.ndim != 2 or told.shape[1] != hand.joints or len(told) < 2:
        raise ValueError(
            f"recordings must be finite angles of shape (T, {hand.joints}), one column for each of "
            f"{', '.join(hand.joint_names)}; {path} has shape {told.shape}"
        )
    angles = checks.numbers(str(path), "joint_angles", told, told.shape, hand.joint_names)
    checks.angles(str(path), "joint_angles", angles, hand.joint_names)
    _, spread, components = np.linalg.svd(angles - angles.mean(axis=0), full_matrices=False)
    held = np.cumsum(spread**2) / max(float((spread**2).sum()), 1e-300)
    basis = components[: int(np.searchsorted(held, EXPLAINED)) + 1]
    closing = opposition_basis(hand)[0]
    basis *= np.where(basis @ closing < 0.0, -1.0, 1.0)[:, None]
    return _scaled(basis)


def _read(recordings: str | os.PathLike[str]) -> NDArray[Any]:
    if not isinstance(recordings, str | os.PathLike):
        raise ValueError(f"recordings must be a .npy or .csv file of joint angles, got {recordings!r}")
    path = Path(recordings)
    try:
        if path.suffix == ".npy":
            return np.atleast_2d(reading.npy(path))
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")  # that there is nothing in it, which its shape will tell
            return np.loadtxt(io.StringIO(reading.text(path)), delimiter=",", ndmin=2)
    except (OSError, ValueError) as error:
        raise ValueError(
            f"recordings must be a .npy or .csv file of joint angles, got {str(path)!r}: {error}"
        ) from error


def _scaled(basis: Array) -> Array:
    largest = np.abs(basis).max(axis=1, keepdims=True)
    return np.asarray(basis / np.where(largest > 0.0, largest, 1.0))
