"""How much of what is felt counts for the name: looks are not independent, so that each has an exponent of at most 1.

What is felt again from one place is no news (`observer.novelty`). Besides, the error of the pose lasts: of what
touches, rho = 0.78 of it is left at the next look, 60 ms later (docs/notes/naming.md). n looks with an error of which
rho is left from one to the next (a first-order autoregression) say as much as

    1 + (n - 1) (1 - rho) / (1 + rho)

that are independent, the first all and each of the others an eighth. It is what `observer.novelty` takes for news of
looks that are alike in time by r = 2 rho / (1 + rho) from one to the next. So it is where solids lie any way, which few
touches have to tell apart; elsewhere every look has an exponent as small as that of those others.
"""

from __future__ import annotations

import numpy as np

from haptic_env import validate
from observer.shape.hypotheses import Variants

KNOWN, JITTERED, TURNED = 0.15, 0.07, 1.0  # of solids that are known, of unknown size or place, and that lie any way
LASTING = 0.46  # s, for which looks are alike in time, of the last: -0.06 / log(r)


def chosen(temper: float | None, variants: Variants, alike: float) -> tuple[float, float]:
    """Tell how much of what is felt counts.

    Args:
        temper: exponent of every look; None: the usual one.
        variants: the solids.
        alike: as `ShapePosterior`'s; 0: nothing is told apart from what is felt again.

    Returns:
        Exponent of a look that is all news, and the s for which looks are alike in time; 0: they are by place alone.

    Raises:
        ValueError: for an exponent out of range.
    """
    if temper is not None:
        return validate.number("temper", temper, 0.0, 1.0, above=0.0), 0.0
    if variants.turns.most and alike:
        return TURNED, LASTING
    return JITTERED if variants.unknown and not variants.turns.most else KNOWN, 0.0


def sustained(temper: float, lasting: float, seconds: float) -> float:
    """Tell what share of a touch that lasts is news at last: that which, with all before, has an exponent of one.

    Args:
        temper: exponent of what is all new.
        lasting: s, for which looks are alike in time; 0: they are by place alone.
        seconds: from look to look.

    Returns:
        In (0, 1].
    """
    return 1.0 / (1.0 + temper / float(np.expm1(seconds / lasting))) if lasting else 1.0
