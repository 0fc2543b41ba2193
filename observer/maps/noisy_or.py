"""What a touch says of each cell that it may be due to: a noisy-OR (Pearl 1988)."""

from __future__ import annotations

import numpy as np

from haptic_env.compiled import part

DOUBT = 1e-9  # probability that a touch with a single suspect, and no false alarms, had another cause


@part()
def evidence(hits, clear, silent, weight, least):
    """`weight` times the log of the likelihood ratio of a touch, were the cell occupied rather than free, given what is
    known of the others; 0 where that is surely below `least`.

    At least one of the suspects is occupied, so that a single one gets all of the evidence, and one of many next to
    none. `hits`: probability that the cell rings the patch if it is occupied; `clear`: that it does not, whatever it
    is; `silent`: that nothing does. The ratio is 1 + hits · others / (1 - others), and others = silent / clear.
    """
    gain, rest = hits * silent, max(clear - silent, DOUBT)
    return weight * np.log1p(gain / rest) if weight * gain >= least * rest else 0.0
