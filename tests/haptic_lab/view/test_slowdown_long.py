"""What a view costs an observer, and how often a page that is told of it draws.

Explorations with and without a view by turns, the same seed for both. A second core that is idle, or a browser that
gives way (`nice`), is what a laptop has; where neither is, the time of this process's own says what the view costs it.
Beside them is told what it costs to have any other process on another core, one that counts and touches no memory: two
cores may be the threads of one, or share what keeps them fast.
"""

from __future__ import annotations

import io
import os
import subprocess
import sys
import time
import urllib.request
from collections.abc import Callable, Iterator

import numpy as np
import pytest
from rich.console import Console

from haptic_env import hand_of, registration
from haptic_lab.exploration.run import explore
from haptic_lab.exploration.settings import OBSERVER
from haptic_lab.trial import Trial, make_observers
from haptic_lab.view.options import ViewOptions
from haptic_lab.view.trial_view import TrialView
from haptic_lab.view.viewer import Viewer
from observer import ShapePosterior, warm_up
from tests.haptic_lab.view.conftest import SOFTWARE, chromium

pytestmark = pytest.mark.statistical
PAIRS, SECONDS = 5, 20.0
HOW = "alone", "beside another", "viewed"
COUNTS = "import os\nos.nice(10)\nwhile True: pass"
CLIENT = """
import sys
from playwright.sync_api import sync_playwright

with sync_playwright() as playwright:
    browser = playwright.chromium.launch(executable_path=sys.argv[1], args=sys.argv[3:])
    page = browser.new_page(viewport={"width": 1280, "height": 800})
    page.goto(sys.argv[2])
    page.evaluate("times = []; each = (clock) => { times.push(clock); requestAnimationFrame(each); }; each(0);")
    page.wait_for_function("recorded.states.length > 0", timeout=120000)
    page.evaluate("times.length = 0")
    print("there", flush=True)
    sys.stdin.readline()
    times = page.evaluate("times")
    print(len(times) / (times[-1] - times[0]) * 1000.0, page.evaluate("recorded.states.length"), flush=True)
"""


@pytest.fixture
def client() -> Iterator[Callable[[str], subprocess.Popen[str]]]:
    started: list[subprocess.Popen[str]] = []

    def start(address: str) -> subprocess.Popen[str]:
        command = [sys.executable, "-c", CLIENT, chromium(), address, *SOFTWARE]
        pipes = {"stdin": subprocess.PIPE, "stdout": subprocess.PIPE}
        started.append(subprocess.Popen(command, text=True, preexec_fn=lambda: os.nice(15), **pipes))
        return started[-1]

    yield start
    for each in started:
        each.kill()
        with each:  # closes its pipes
            pass


def trial_of(env_id: str, seed: int) -> Trial:
    env = registration.make(env_id, shape="cube", sigma_deg=3.0, episode_seconds=SECONDS, reveal_truth=True)
    hand = hand_of(env)
    slam = make_observers((OBSERVER,), hand, 3.0, particles=200, threads=1)
    return Trial(env, "random_torque", slam, ShapePosterior(hand), seed)


@pytest.mark.parametrize("env_id", ["HapticSLAM/TwoFinger-v0", "HapticSLAM/MyoHand-v0"])
@pytest.mark.parametrize("looked_at", [False, True], ids=["alone", "browser"])
def test_a_view_costs_a_tenth_at_most(
    env_id: str, looked_at: bool, client: Callable[[str], subprocess.Popen[str]]
) -> None:
    first = trial_of(env_id, 900010)
    warm_up(first.hand)
    explore(first, quiet())
    ratios, beside, frames, left_out = [], [], [], 0
    for pair in range(PAIRS):
        seed = 900011 + pair
        spent = {}
        for how in HOW if pair % 2 else HOW[::-1]:
            viewer = Viewer(ViewOptions(page=True, port=0)) if how == "viewed" else None
            other = subprocess.Popen([sys.executable, "-c", COUNTS]) if how == "beside another" else None
            trial = trial_of(env_id, seed)
            view = None if viewer is None else TrialView(viewer, trial, "a cube", lambda solid: solid.name)
            browser = client(viewer.address) if viewer is not None and looked_at else None
            steps, begun = 0, None
            for step in trial:
                if view is not None:
                    view.show(step)
                if step == 50:  # whoever draws is there, and the browser, and all is compiled
                    if viewer is not None:
                        drawn(viewer.address)
                    if browser is not None:
                        browser.stdout.readline()
                    begun = time.perf_counter(), time.process_time()
                steps = step
            assert begun is not None
            spent[how] = np.array([time.perf_counter() - begun[0], time.process_time() - begun[1]])
            if other is not None:
                other.kill()
                other.wait()
            if browser is not None:
                browser.stdin.write("\n")
                browser.stdin.flush()
                frames.append(float(browser.stdout.readline().split()[0]))
                browser.wait()
            trial.env.close()
            if viewer is not None:
                left_out += viewer.dropped
                viewer.close()
            assert steps == trial.steps
        ratios.append(spent["viewed"] / spent["alone"])
        beside.append(spent["beside another"] / spent["alone"])
    (wall, own), (_, others) = (np.median(each, axis=0) - 1.0 for each in (ratios, beside))
    told = f", {np.median(frames):.0f} frames a second of the page" if frames else ""
    told += f"; {left_out} moments left out, since nobody drew them" if left_out else ""
    told += f"; beside a process that counts {others:+.1%}"
    print(f"\n{env_id}: {wall:+.1%} of the time, {own:+.1%} of this process's own; load {os.getloadavg()[0]:.1f}{told}")
    assert own < 0.1


def drawn(address: str) -> None:
    with urllib.request.urlopen(address + "stream") as lines:
        while b'"kind":"state"' not in lines.readline():
            pass


def quiet() -> Console:
    return Console(file=io.StringIO())
