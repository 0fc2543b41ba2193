"""What is said of contacts by whoever knows objects like the candidates, but none of these: where sizes or places of
solids are unknown, some of them fit nearly anything, and touch without any object is no rival.

Shapes: H hypotheses, M likeliest of them, G parts of the hand, S pose samples, L links, P patches. Lengths in metres.

References:
    Dawid 1984, J. R. Statist. Soc. A 147, 278-292 (models are judged by how well they foretell what comes next).
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from haptic_env.arrays import Array
from observer.kinematics import Tree
from observer.shape.contact_likelihood import PoseSamples, TouchModel, contact_likelihood, weigh
from observer.shape.distance_fields import Solids
from observer.shape.skin import Skin

SPREAD = 0.003  # m, SD of the surface of an object that is like a candidate
LIKELIEST = 64  # hypotheses that are asked; the others hardly count
WORTH = 0.15  # exponent: what is wrong with the model of touch is wrong in the same way all along


class LooseFit:
    """How much better each look is foretold by the candidates that were likeliest before it if their surfaces are known
    no better than `SPREAD`: an object that is like one of them, yet none. A touch is a density of its gap, so that a loose
    surface pays for being loose.

    Attributes:
        gained: nats, of all looks so far.
    """

    def __init__(self) -> None:
        """Begin with nothing felt."""
        self.gained = 0.0

    @staticmethod
    def weight(temper: float, stride: int) -> float:
        """Tell the exponent of what `evidence` says against all candidates.

        Args:
            temper: exponent of the evidence of a look, which counts already.
            stride: steps for which a look stands, likewise.

        Returns:
            `WORTH`.
        """
        return WORTH

    def evidence(self, candidates: Array, temper: float) -> float:
        """Tell the evidence of "none".

        Args:
            candidates: (C,) nats, that of each candidate.
            temper: exponent of the evidence of a look, which counts already.

        Returns:
            nats.
        """
        return float(np.logaddexp.reduce(candidates) - np.log(len(candidates))) + self.gained

    def take(
        self,
        hand: tuple[Tree, Skin],
        solids: Solids,
        weighed: tuple[Array, Array],
        felt: tuple[PoseSamples, NDArray[np.int8], Array, TouchModel],
        temper: float,
    ) -> None:
        """Take in a look.

        Args:
            hand: its kinematics and its skin.
            solids: the distance fields of H hypotheses.
            weighed: weights (G, H, S) of pose samples, and log evidence (H,) of hypotheses, before the look.
            felt: as `contact_likelihood` has it: samples, contacts (P,), exponents (L,) and the `TouchModel`.
            temper: exponent of the evidence of a look.
        """
        weights, log_evidence = weighed
        few = np.argsort(-log_evidence, kind="stable")[:LIKELIEST]
        samples, contacts, exponent, model = felt
        loose = model._replace(tolerance=np.hypot(model.tolerance, SPREAD))
        share, foretold = log_evidence[few], []
        for each in (model, loose):
            kept, gained = weights[:, few].copy(), np.zeros(len(few))
            likelihood = np.empty_like(kept)
            contact_likelihood(*hand, solids.of(few), samples, contacts, exponent, each, likelihood)
            weigh(kept, likelihood, temper, gained)
            foretold.append(np.logaddexp.reduce(share + gained))
        touched = np.concatenate([[0], np.cumsum(contacts > 0)])
        worth = exponent * np.diff(touched[hand[1].first_patch])
        paid = temper * float(worth @ np.log(loose.tolerance / model.tolerance))
        self.gained += foretold[1] - foretold[0] - paid
