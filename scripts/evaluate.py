"""Measure the observer between its brackets over many trials: the same as `haptic-slam evaluate`."""

from haptic_lab.cli import run

if __name__ == "__main__":
    run("evaluate")
