"""Which label each hypothesis belongs to, and what is believed of labels where something is of hypotheses.

Shapes: C labels, K solids, V variants of each, H = K·V hypotheses.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from haptic_env.arrays import Array
from observer.resampling import log_sums
from observer.shape.distance_fields import Solids


class Hypotheses(NamedTuple):
    """What the object may be.

    Attributes:
        solids: of H hypotheses.
        log_probability: (H,).
        label: (H,) index of the label that each belongs to.
    """

    solids: Solids
    log_probability: Array
    label: NDArray[np.int64]


class OfLabels:
    """The solids that each label may be, all as probable."""

    def __init__(self, solids_of: Sequence[int], variants: int) -> None:
        """Lay hypotheses out.

        Args:
            solids_of: (C,) how many solids each label has.
            variants: V.
        """
        count = np.array(solids_of)
        self._log_count = np.log(count)
        self._label = np.repeat(np.arange(len(count)), count * variants)
        self._first = np.concatenate([[0], np.cumsum(count)[:-1]]) * variants

    def log_likelihood(self, log_evidence: Array) -> Array:
        """Add up hypotheses.

        Args:
            log_evidence: (H,), each with the share of its solid that it stands for.

        Returns:
            (C,) log likelihood of each label.
        """
        result = np.empty(len(self._first))
        log_sums(log_evidence, self._first, result)
        result -= self._log_count
        return result

    def hypotheses(self, solids: Solids, log_evidence: Array) -> Hypotheses:
        """Tell how probable hypotheses are.

        Args:
            solids: what they are, H of them.
            log_evidence: (H,), as above.

        Returns:
            The hypotheses.
        """
        log = log_evidence - self._log_count[self._label]
        return Hypotheses(solids, log - np.logaddexp.reduce(log), self._label)
