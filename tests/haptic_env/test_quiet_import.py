"""Importing and exploring say nothing on a machine without a display."""

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


@pytest.mark.parametrize("program", [EXPLORE, DRAW], ids=["explore", "draw"])
def test_nothing_is_said_without_a_display(program):
    hidden = ("DISPLAY", "WAYLAND_DISPLAY", "MUJOCO_GL")
    environment = {name: value for name, value in os.environ.items() if name not in hidden}
    result = subprocess.run(
        [sys.executable, "-W", "always::UserWarning", "-c", program], env=environment, capture_output=True, text=True
    )
    if program is DRAW and "EGL" in result.stderr and not os.environ.get("CI"):
        pytest.skip("no offscreen rendering here")
    assert (result.returncode, result.stdout, result.stderr) == (0, "", "")
