"""Observe a hand as it moves, from streams: the same as `haptic-slam live`."""

from haptic_lab.cli import run

if __name__ == "__main__":
    run("live")
