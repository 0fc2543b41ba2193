"""dm_control's MJCF composer, imported quietly: `from haptic_env.composer import mjcf`."""

from __future__ import annotations

import warnings

with warnings.catch_warnings():
    # dm_control looks for a display when it is imported and warns where there is none; nothing here renders with it.
    warnings.filterwarnings("ignore", module="glfw")
    from dm_control import mjcf

__all__ = ["mjcf"]
