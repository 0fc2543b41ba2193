"""Pictures look alike, and whoever draws them draws on as before."""

from __future__ import annotations

import matplotlib

from haptic_lab.style import RC, styled


def test_what_is_styled_draws_in_our_style_and_leaves_no_trace() -> None:
    def kept() -> dict[str, object]:
        return {name: matplotlib.rcParams[name] for name in RC}

    before = kept()
    assert before != RC

    assert styled(kept)() == RC
    assert kept() == before
