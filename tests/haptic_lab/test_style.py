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


@pytest.mark.parametrize(
    ("label", "title", "called"),
    [
        ("k1", "k1", "k1"),
        ("my mug", "my mug", "my mug"),
        ("none", "none", "none of these"),
        ("cube", "cube", "a cube"),
        ("noise", "noise", "a noise"),
        ("ellipsoid(1, 1, 1.3)", "ellipsoid(1, 1, 1.3)", "an ellipsoid(1, 1, 1.3)"),
        ("gone/mug.stl(scale=0.001)", "mug", "a mug"),
        ("gone/daily.toml:egg", "egg", "an egg"),
        ("mine.shapes:Egg(0.3)", "mine.shapes:Egg(0.3)", "a mine.shapes:Egg(0.3)"),
    ],
)
def test_a_name_that_was_learnt_has_none(label: str, title: str, called: str) -> None:
    assert with_article(title, label) == called
