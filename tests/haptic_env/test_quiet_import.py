"""What is said on a machine without a display: nothing, unless a window is asked for."""

from __future__ import annotations

import os
import subprocess
import sys

import pytest

EXPLORE = """
import gymnasium, haptic_env, agents
env = gymnasium.make("HapticSLAM/TwoFinger-v0")
observation, _ = env.reset(seed=0)
env.step(agents.make("random_torque", env, seed=0).predict(observation)[0])
"""
DRAW = """
import gymnasium, haptic_env
env = gymnasium.make("HapticSLAM/TwoFinger-v0", render_mode="rgb_array")
env.reset(seed=0)
assert env.render().any()
env.close()
"""


WINDOW = """
import gymnasium, haptic_env
gymnasium.make("HapticSLAM/TwoFinger-v0", render_mode="human").reset(seed=0)
"""


def _run_without_display(program: str) -> subprocess.CompletedProcess[str]:
    hidden = ("DISPLAY", "WAYLAND_DISPLAY", "MUJOCO_GL")
    environment = {name: value for name, value in os.environ.items() if name not in hidden}
    command = [sys.executable, "-W", "always::UserWarning", "-c", program]
    ran = subprocess.run(command, env=environment, capture_output=True, text=True, check=False)
    said = [line for line in ran.stderr.splitlines() if not line.startswith("Compiling ")]  # the first time
    return subprocess.CompletedProcess(ran.args, ran.returncode, ran.stdout, "\n".join(said))


@pytest.mark.parametrize("program", [EXPLORE, DRAW], ids=["explore", "draw"])
def test_nothing_is_said_without_a_display(program):
    result = _run_without_display(program)
    if program is DRAW and "EGL" in result.stderr and not os.environ.get("CI"):
        pytest.skip("no offscreen rendering here")
    assert (result.returncode, result.stdout, result.stderr) == (0, "", "")


@pytest.mark.skipif(sys.platform != "linux", reason="only here is a display a matter of the environment")
def test_a_window_without_a_display_says_what_to_do():
    result = _run_without_display(WINDOW)
    assert result.returncode != 0
    assert 'RuntimeError: render_mode "human" opens a window and found no display; use "rgb_array"' in result.stderr
    assert "GLFWError" not in result.stderr
