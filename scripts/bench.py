"""Measure how fast it is: the same as `haptic-slam bench`."""

from haptic_lab.cli import run

if __name__ == "__main__":
    run("bench")
