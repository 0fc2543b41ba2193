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
from haptic_env.hand import Hand
from observer.kinematics import Tree
from observer.shape.contact_likelihood import PoseSamples, TouchModel, contact_likelihood, weigh
from observer.shape.distance_fields import Solids
from observer.shape.hypotheses import Variants
from observer.shape.null_model import NullModel
from observer.shape.skin import Skin, touches_of

SPREADS = (0.003, 0.006, 0.02)  # m, SDs of the surface of an object that is like a candidate, or hardly
LIKELIEST = 64  # hypotheses that are asked; the others hardly count
WORTH, WORTH_ANY_WAY = 0.035, 0.0122  # exponents of a look in three steps that is no news: the model of touch is wrong
# in the same way all along


def null_for(variants: Variants, hand: Hand, none: float, press: float) -> LooseFit | NullModel:
    """Choose what is said by whoever knows of none of the candidates.

    Args:
        variants: of the candidates.
        hand: that explores.
        none: prior probability of that.
        press: m, how deep what feels contact may lie inside.

    Returns:
        What has felt nothing yet.

    Raises:
        ValueError: for `none` above 0 where solids are unknown and contacts may lie inside, or a surface was felt.
    """
    if none and variants.unknown and press:
        raise ValueError(f"none with jitter needs press=0, got none={none!r} and press={press!r}")
    if none and variants.unknown and (variants.nominal.spread >= 0).any():
        raise ValueError(f"none with jitter needs candidates that are no learnt surfaces, got none={none!r}")
    return LooseFit(any_way=variants.turns.most > 0.0) if variants.unknown else NullModel(len(hand.patches))


class LooseFit:
    """How much better each look is foretold by the candidates that were likeliest before it if their surfaces are known
    no better than `SPREADS`: an object that is like one of them, yet none. A touch is a density of its gap, so that a
    loose surface pays for being loose.

    Attributes:
        gained: (3,) nats, of all looks so far, for each of `SPREADS`.
    """

    def __init__(self, any_way: bool) -> None:
        """Begin with nothing felt.

        Args:
            any_way: whether the solids lie any way, so that each look counts for more.
        """
        self._worth = WORTH_ANY_WAY if any_way else WORTH
        self.gained = np.zeros(len(SPREADS))

    def weight(self, temper: float, stride: int) -> float:
        """Tell the exponent of what `evidence` says against all candidates.

        Args:
            temper: exponent that the evidence of a look has already, of a touch that lasts.
            stride: steps for which a look stands.

        Returns:
            The exponent, with which a look counts as it would with any other `temper` and `stride`.
        """
        return self._worth * stride / (3.0 * temper)

    def evidence(self, candidates: Array, temper: float) -> float:
        """Tell the evidence of "none".

        Args:
            candidates: (C,) nats, that of each candidate.
            temper: exponent of the evidence of a look, which counts already.

        Returns:
            nats.
        """
        foretold = np.logaddexp.reduce(candidates) - np.log(len(candidates))
        return float(foretold + np.logaddexp.reduce(self.gained) - np.log(len(self.gained)))

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
        likeliest, share, foretold = solids.of(few), log_evidence[few], []
        tolerances = [np.hypot(model.tolerance, spread) for spread in (0.0, *SPREADS)]
        for tolerance in tolerances:
            kept, gained = weights[:, few].copy(), np.zeros(len(few))
            likelihood, of_links = np.empty_like(kept), model._replace(tolerance=tolerance)
            contact_likelihood(*hand, likeliest, samples, contacts, exponent, of_links, likelihood)
            weigh(kept, likelihood, temper, gained)
            foretold.append(np.logaddexp.reduce(share + gained))
        worth = exponent * touches_of(hand[1], contacts)
        paid = temper * np.log(tolerances[1:] / tolerances[0]) @ worth
        self.gained += np.array(foretold[1:]) - foretold[0] - paid
