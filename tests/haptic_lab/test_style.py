"""Pictures look alike, and whoever draws them draws on as before."""

from __future__ import annotations

import matplotlib
import pytest

from haptic_lab.style import RC, styled, with_article


def test_what_is_styled_draws_in_our_style_and_leaves_no_trace() -> None:
    def kept() -> dict[str, object]:
        return {name: matplotlib.rcParams[name] for name in RC}

    before = kept()
    assert before != RC

    assert styled(kept)() == RC
    assert kept() == before


@pytest.mark.parametrize(
    "title", ["a cube", "a torus(0.4)", "an ellipsoid(1, 1, 1.3)", "an L(0.4)", "a noise(7)", "a mug"]
)
def test_a_title_has_its_article(title: str) -> None:
    assert with_article(title.partition(" ")[2]) == title
