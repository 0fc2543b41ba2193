"""Measure what a sweep costs beyond its trials: the same as `haptic-slam scheduling`."""

from haptic_lab.cli import run

if __name__ == "__main__":
    run("scheduling")
