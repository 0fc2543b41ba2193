"""The page in a browser, served and as a file."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from playwright.sync_api import Page

from haptic_lab.view.encoding import Encoder
from haptic_lab.view.history import History
from tests.haptic_lab.view.conftest import Shown, coloured, opened, picture, settled

SLOWED = """
([pictures, milliseconds]) => {
  Object.assign(now, {busy: true, mean: 0}); Object.assign(drawing, {share: 1, few: false, sharp: false});
  for (let k = 0; k < pictures; k++) { Object.assign(now, {changed: true, drawn: -milliseconds}); paced(0); }
  render();
  const told = [drawing.share, drawing.few, drawing.drawn.ghosts.length];
  Object.assign(now, {changed: false, drawn: -1000}); paced(0); render();
  const rested = [drawing.sharp, drawing.drawn.ghosts.length];
  Object.assign(drawing, {share: 1, few: false, sharp: false});
  return [...told, ...rested];
}
"""  # what is drawn after pictures that took so long each, and then at rest
FAULTS: list[str] = []  # what the browser complains about
AS_AT_FIRST = """
document.querySelectorAll('input[type=checkbox]').forEach((each) => { each.checked = each.defaultChecked; });
document.getElementById('threshold').value = 0.3;
follow();
"""


@pytest.fixture(scope="module", params=["served", "file"])
def loaded(request: pytest.FixtureRequest, lasting: Page, shown: Shown, serve: Any) -> Page:
    """The page with all of the exploration, from a server or, without any network, from a file."""
    lasting.on("pageerror", lambda error: FAULTS.append(str(error)))
    lasting.on("console", lambda told: FAULTS.append(told.text) if told.type == "error" else None)
    if request.param == "file":
        lasting.context.set_offline(True)
    opened(lasting, shown.file.as_uri() if request.param == "file" else serve(shown.history))
    return lasting


@pytest.fixture
def page(loaded: Page) -> Page:
    loaded.evaluate(AS_AT_FIRST)
    settled(loaded)
    return loaded


def test_hand_map_and_names_are_there(page: Page) -> None:
    seen = picture(page)
    assert (seen.min(axis=2) < 200).mean() > 0.03
    assert coloured(seen) > 50
    told = page.locator(".bar").all_inner_texts()
    assert [each.split()[0] for each in told] == ["cube", "sphere", "pyramid", "cylinder"]
    assert sum(int(each.split()[-2]) for each in told) == pytest.approx(100, abs=2)
    assert "takes it for a cube" in page.inner_text("#status")
    assert "2.20 s" in page.inner_text("#clock")
    assert FAULTS == []


def test_the_slider_changes_what_is_seen_of_the_map(page: Page) -> None:
    def at(threshold: float) -> int:
        page.locator("#threshold").fill(str(threshold))
        seen = coloured(picture(page))
        assert page.inner_text("#threshold-told") == f"{threshold:.2f}"
        return seen

    page.evaluate("for (const id of ['hand', 'ghosts']) document.getElementById('show-' + id).click()")
    low, middle, high = at(0.1), at(0.5), at(0.95)
    assert low > middle > high


def test_one_scrubs_through_what_was_recorded(page: Page, shown: Shown) -> None:
    end = picture(page)
    page.locator("#time").fill("30")
    begin = picture(page)
    assert (np.abs(end - begin).max(axis=2) > 30).sum() > 1000
    step = shown.moments[30].step
    assert page.inner_text("#clock").startswith(f"{step / shown.setting.control_hz:.2f} s")
    page.keyboard.press("ArrowRight")  # on the slider
    settled(page)
    assert page.locator("#time").input_value() == "31"
    page.locator("#live").click()
    assert (np.abs(picture(page) - end).max(axis=2) > 30).mean() < 0.001


def test_it_plays_from_the_beginning_and_pauses(page: Page) -> None:
    page.locator("#play").click()
    page.wait_for_function("now.plays && now.at > 3 && now.at < recorded.states.length - 1")
    page.keyboard.press("Escape")
    page.locator("#play").click()
    stopped = page.evaluate("now.at")
    page.wait_for_timeout(150)
    assert page.evaluate("now.at") == stopped


@pytest.mark.parametrize("layer", ["hand", "ghosts", "map", "surface", "truth"])
def test_a_layer_is_switched_on_and_off(page: Page, layer: str) -> None:
    page.locator("#time").fill("54")
    before = picture(page)
    page.locator(f"#show-{layer}").click()
    assert (np.abs(picture(page) - before).max(axis=2) > 12).sum() > 100


def test_what_is_drawn_too_slowly_is_drawn_coarser_until_it_rests(page: Page) -> None:
    """First of fewer pixels, then with half of the ghosts."""
    share, few, all_of_them, *_ = page.evaluate(SLOWED, [20, 30])
    assert (share, few) == (1, False)
    share, few, ghosts, *_ = page.evaluate(SLOWED, [4, 200])
    assert (share < 1, few, ghosts) == (True, False, all_of_them)
    share, few, ghosts, sharp, rested = page.evaluate(SLOWED, [40, 200])
    assert (0.3 < share < 0.42, few, ghosts) == (True, True, all_of_them / 2)
    assert (sharp, rested) == (True, all_of_them)


def test_dragging_turns_it_and_a_double_click_turns_it_back(page: Page) -> None:
    first = picture(page)
    page.mouse.move(200, 200)
    page.mouse.down()
    page.mouse.move(320, 240)
    page.mouse.up()
    turned = picture(page)
    assert (np.abs(turned - first).max(axis=2) > 30).sum() > 1000
    page.mouse.dblclick(200, 200)
    assert (np.abs(picture(page) - first).max(axis=2) > 30).mean() < 0.001


def test_names_of_objects_are_text(look: Page, shown: Shown, serve: Any) -> None:
    """Whatever an object is called, nothing of it runs."""
    evil = "<img src=x onerror=faulty()>"
    history, setting = History(), shown.setting._replace(labels=(evil, "b", "c", "d"), title=evil)
    encoder = Encoder(setting)
    history.add("scene", encoder.scene())
    history.add("state", encoder.state(shown.moments[0]))
    look.goto(serve(history))
    look.wait_for_selector(".bar")
    assert look.inner_text("#title") == evil
    assert look.locator("img").count() == 0


def test_a_page_that_is_no_longer_told_keeps_what_came(look: Page, shown: Shown, serve: Any) -> None:
    history = History()
    for text in shown.history.texts():
        if '"kind":"end"' not in text:
            history.add("", text)
    look.goto(serve(history))
    look.wait_for_selector(".bar")
    look.wait_for_function("document.getElementById('status').textContent === 'as it happens'")
    look.locator("#play").click()
    look.wait_for_function("document.getElementById('status').textContent.startsWith('paused')")
    history.close()
    look.wait_for_function("document.getElementById('status').textContent.startsWith('no longer connected')")
    assert coloured(picture(look)) > 50
