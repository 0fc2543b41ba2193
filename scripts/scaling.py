"""Measure how the time of an observer's step grows: the same as `haptic-slam scaling`."""

from haptic_lab.cli import run

if __name__ == "__main__":
    run("scaling")
