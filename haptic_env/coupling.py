"""Joints that follow another one: a finger's last joint that a bar or a tendon bends with the one before, a jaw that
mirrors the other.

Shapes: J joints, F of them followers. A follower's angle is a polynomial of its leader's; a leader may follow another
joint itself, and what leads it in the end, its root, follows none. The model of a hand has couplings as MuJoCo's
`<equality><joint>`, in radians of both.
"""

from __future__ import annotations

from collections.abc import Collection, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import NamedTuple

import mujoco
import numpy as np
from numpy.polynomial import polynomial
from numpy.typing import NDArray

from haptic_env.arrays import Array

MADE = 1e-6  # rad: what was put there by a coupling is no farther away, and sensors hardly ever are that near
DEGREES = 5  # coefficients of MuJoCo's polynomials
# About as stiff as contacts are: all of a finger's torque bends a coupling by some hundredths of a degree.
SOLREF, SOLIMP = (0.004, 1.0), (0.999, 0.9999, 0.001)


class Coupling(NamedTuple):
    """A joint that follows another.

    Attributes:
        follower: which joint.
        leader: which one it follows.
        coefficients: of the polynomial in the leader's angle (rad) that is the follower's, the constant first.
    """

    follower: int
    leader: int
    coefficients: tuple[float, ...]


@dataclass(frozen=True)
class Couplings:
    """Which joints of a hand follow which.

    Attributes:
        joints: J.
        each: (F,) the couplings, those of leaders before those of their followers.
    """

    joints: int
    each: tuple[Coupling, ...] = ()

    @classmethod
    def of(cls, model: mujoco.MjModel) -> Couplings:
        """Read the couplings of a hand's model.

        Args:
            model: whose joints turn or slide, each once at most on the left of a coupling.

        Returns:
            The couplings.
        """
        told = [
            Coupling(int(model.eq_obj1id[e]), int(model.eq_obj2id[e]), tuple(map(float, model.eq_data[e, :DEGREES])))
            for e in range(model.neq)
            if model.eq_type[e] == mujoco.mjtEq.mjEQ_JOINT and model.eq_obj2id[e] >= 0
        ]
        return cls(int(model.njnt), in_order(told))

    def __bool__(self) -> bool:
        return bool(self.each)

    @cached_property
    def follows(self) -> NDArray[np.bool_]:
        """(J,): whether each joint follows another one."""
        return np.isin(np.arange(self.joints), [coupling.follower for coupling in self.each])

    @cached_property
    def root(self) -> NDArray[np.int64]:
        """(J,) the joint that leads each in the end: itself, where it follows none."""
        root = np.arange(self.joints)
        for coupling in self.each:
            root[coupling.follower] = root[coupling.leader]
        return root

    @cached_property
    def together(self) -> NDArray[np.bool_]:
        """(J, J): whether two joints move as one."""
        return self.root[:, None] == self.root

    def follow(self, angles: Array) -> Array:
        """Put followers where their leaders have them.

        Args:
            angles: (..., J) rad.

        Returns:
            (..., J) rad.
        """
        angles = np.array(angles, dtype=np.float64)
        for follower, leader, coefficients in self.each:
            angles[..., follower] = polynomial.polyval(angles[..., leader], coefficients)
        return angles

    def own(self, felt: Array) -> Array:
        """Leave of readings those that joints have for themselves.

        A follower's that is where its leader's puts it was made of that one, and says nothing more.

        Args:
            felt: (J,) rad.

        Returns:
            (J,) rad; NaN what is not one's own.
        """
        made = self.follows & (np.abs(self.follow(felt) - felt) < MADE)
        return np.where(made, np.nan, felt) if made.any() else felt

    def without(self, names: Sequence[str], told: Collection[str]) -> list[str]:
        """List the joints of which something must be told: a follower may be left out.

        Args:
            names: (J,) of the joints.
            told: names of those of which something is.

        Returns:
            Names of those that are missing.
        """
        return [name for name, follows in zip(names, self.follows, strict=True) if name not in told and not follows]

    def slopes(self, angles: Array) -> Array:
        """Tell how fast joints go by their roots.

        Args:
            angles: (..., J) rad.

        Returns:
            (..., J) rad a radian of the root: 1 of those that follow none.
        """
        slopes: Array = np.ones(np.shape(angles))
        for follower, leader, coefficients in self.each:
            own = polynomial.polyval(np.asarray(angles)[..., leader], polynomial.polyder(coefficients))
            slopes[..., follower] = own * slopes[..., leader]
        return slopes

    def spread(self, angles: Array) -> Array:
        """Tell what the roots' ways do to all joints, to first order.

        Args:
            angles: (J,) rad.

        Returns:
            (J, J) rad a radian: joints by roots; columns of followers are zero.
        """
        spread = np.zeros((self.joints, self.joints))
        spread[np.arange(self.joints), self.root] = self.slopes(angles)
        return spread

    def along(self, angles: Array) -> Array:
        """Project small changes of (q, v) on those that couplings allow: what roots do is what counts.

        Args:
            angles: (J,) rad.

        Returns:
            (2J, 2J).
        """
        return np.asarray(np.kron(np.eye(2), self.spread(angles)), dtype=np.float64)


def in_order(couplings: list[Coupling]) -> tuple[Coupling, ...]:
    """Put couplings of leaders before those of their followers.

    Args:
        couplings: of different followers.

    Returns:
        The same.

    Raises:
        ValueError: where joints follow each other in a ring; it tells their numbers.
    """
    left, ordered = list(couplings), []
    while left:
        followers = {coupling.follower for coupling in left}
        ready = [coupling for coupling in left if coupling.leader not in followers]
        if not ready:
            raise ValueError(f"joints follow each other in a ring: {sorted(followers)}")
        ordered += ready
        left = [coupling for coupling in left if coupling not in ready]
    return tuple(ordered)
