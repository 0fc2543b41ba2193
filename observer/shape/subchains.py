"""The parts of a hand that are sampled apart: each finger with a copy of its own of what it hangs from.

Shapes: J joints, G parts, C columns. Fingers err independently but for the joints that they share, of a wrist say. Each
part takes what it felt into account for its own copy of those, so that a sample of a part is a whole chain from the
root to the tip; what the copies know of each other is given up.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from haptic_env.arrays import Array
from haptic_env.hand import Hand
from haptic_env.moved import renamed

__getattr__ = renamed(__name__, {"Parts": "Subchains"})

Index = NDArray[np.int64]


class Subchains(NamedTuple):
    """Which joint each column of a sample is.

    Attributes:
        joint: (C,) index of the joint.
        part: (C,) whose copy it is.
        column: (G, J) where each part finds each joint, its own copy if it has one.
    """

    joint: Index
    part: Index
    column: Index

    def follow(self, by_joint: Array) -> Array:
        """Tell how samples follow from samples.

        Args:
            by_joint: (J, J) how joints follow from joints.

        Returns:
            (C, C) the same between columns, each part reading the joints that it finds.
        """
        result = np.zeros((len(self.joint), len(self.joint)))
        result[np.arange(len(self.joint))[:, None], self.column[self.part]] = by_joint[self.joint]
        return result


def parts_of(hand: Hand) -> Subchains:
    """Find the parts of a hand, in the numbering of its `joint_group` and `link_group`.

    Args:
        hand: with J joints.

    Returns:
        The parts; for a hand whose fingers share no joint the columns are its joints.
    """
    group = hand.joint_group
    count = max(int(group.max()), int(hand.link_group.max())) + 1
    chains = np.array([hand.moves[hand.link_group == g].any(axis=0) | (group == g) for g in range(count)])
    part, joint = np.nonzero(chains)
    own = {(int(g), int(j)): c for c, (g, j) in enumerate(zip(part, joint, strict=True))}
    column = np.array([[own.get((g, j), own[int(group[j]), j]) for j in range(hand.joints)] for g in range(count)])
    return Subchains(joint.astype(np.int64), part.astype(np.int64), column.astype(np.int64))
