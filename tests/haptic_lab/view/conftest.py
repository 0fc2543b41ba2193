"""One small exploration, its lines, and a browser that shows them."""

from __future__ import annotations

import io
import os
import shutil
import threading
from collections.abc import Iterator
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
import pytest
from PIL import Image
from playwright.sync_api import Browser, Page, sync_playwright

from haptic_env import hand_of, registration
from haptic_lab.exploration.settings import OBSERVER
from haptic_lab.trial import Trial, make_observers
from haptic_lab.view.drawer import Drawer
from haptic_lab.view.history import History
from haptic_lab.view.listening import listen
from haptic_lab.view.moment import Moment, Pace, Setting, packed
from haptic_lab.view.options import ViewOptions
from haptic_lab.view.server import PageServer
from haptic_lab.view.trial_view import TrialView
from observer import Belief, ShapePosterior

SECONDS, SEED = 2.2, 900001
BROWSERS = ("chromium", "chromium-browser", "google-chrome")
SOFTWARE = ("--no-sandbox", "--enable-unsafe-swiftshader")  # as root, and without a graphics card


class Direct:
    """Draws in this process, and keeps what it was told."""

    def __init__(self) -> None:
        self.history, self.moments, self.setting = History(), [], None
        self.drawer = Drawer(self.history, behind=20)

    def begin(self, setting: Setting) -> None:
        self.setting, self._pace = setting, Pace(setting.control_hz)
        self.drawer.begin(setting)

    def truth(self, solid: Any, label: str | None) -> None:
        self.drawer.truth(solid, label)

    def wants(self, step: int) -> bool:
        return self._pace.frame(step)

    def show(self, *told: Any, **keywords: Any) -> None:
        self.moments.append(self._pace.take(*told, *(None,) * (4 - len(told)), **keywords))
        self.drawer.moment(*packed(self.moments[-1]))


class Shown(NamedTuple):
    """An exploration that was shown."""

    history: History
    setting: Setting
    moments: list[Moment]
    file: Path
    belief: Belief


@pytest.fixture(scope="session")
def shown(tmp_path_factory: pytest.TempPathFactory) -> Shown:
    env = registration.make(
        "HapticSLAM/TwoFinger-v0", shape="cube", sigma_deg=3.0, episode_seconds=SECONDS, reveal_truth=True
    )
    hand = hand_of(env)
    observers = make_observers((OBSERVER,), hand, 3.0, particles=20)
    trial = Trial(env, "random_torque", observers, ShapePosterior(hand), SEED)
    direct = Direct()
    view = TrialView(direct, trial, "Blind touch of a cube", lambda solid: solid.name)  # type: ignore[arg-type]
    for step in trial:
        view.show(step)
    exploration, traces = trial.finish()
    view.finish(exploration, traces[OBSERVER])
    env.close()
    direct.drawer.over("over: it takes it for a cube, 99% sure")
    file = tmp_path_factory.mktemp("view") / "cube.html"
    assert direct.drawer.write(str(file)) is None
    assert direct.setting is not None
    return Shown(direct.history, direct.setting, direct.moments, file, traces[OBSERVER].belief)


def chromium() -> str:
    """The path of a browser. Where there is none the test is skipped; in continuous integration it fails."""
    found = next(filter(None, map(shutil.which, BROWSERS)), None)
    if found is None:
        told = f"none of {', '.join(BROWSERS)} is installed"
        if os.environ.get("CI"):
            pytest.fail(told)
        pytest.skip(told)
    return found


@pytest.fixture(scope="module")  # while it is there, nothing else can run a loop of asyncio
def browser() -> Iterator[Browser]:
    found = chromium()
    with sync_playwright() as playwright:
        browser = playwright.chromium.launch(executable_path=found, args=list(SOFTWARE))
        yield browser
        browser.close()


def blank(browser: Browser) -> Iterator[Page]:
    """An empty page, in a window of its own."""
    context = browser.new_context(viewport={"width": 900, "height": 640})
    yield context.new_page()
    context.close()


look = pytest.fixture(blank)
lasting = pytest.fixture(blank, scope="module")


@pytest.fixture(scope="module")
def serve() -> Iterator[Any]:
    """Serves a history; returns the address."""
    servers = []

    def serving(history: History, token: str | None = None) -> str:
        listener = listen(ViewOptions(page=True, port=0))
        server = PageServer(listener, token, history)
        servers.append(server)
        threading.Thread(target=server.serve_forever, kwargs={"poll_interval": 0.05}, daemon=True).start()
        return f"http://127.0.0.1:{listener.getsockname()[1]}/"

    yield serving
    for server in servers:
        server.history.close()
        server.finish(2.0)


def opened(look: Page, address: str) -> None:
    """Go there, and wait until all is there."""
    look.goto(address)
    look.evaluate("paced = pace; pace = () => {}")  # all pictures as sharp as the machine can
    look.wait_for_selector(".bar")
    look.wait_for_function("recorded.end !== null")
    settled(look)


def settled(look: Page) -> None:
    """Wait until what has changed is drawn and told."""
    look.wait_for_function("!now.changed && !now.shown")


def picture(look: Page) -> np.ndarray:
    """(H, W, 3): the scene as it is seen."""
    settled(look)
    return np.asarray(Image.open(io.BytesIO(look.locator("#scene").screenshot())).convert("RGB")).astype(int)


def coloured(seen: np.ndarray) -> int:
    """How many pixels are warm, as the map is."""
    return int(((seen[..., 0] - seen[..., 2]) > 60).sum())
