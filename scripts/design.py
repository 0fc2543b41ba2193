"""Say how many trials tell two observers apart: the same as `haptic-slam design`."""

from haptic_lab.cli import run

if __name__ == "__main__":
    run("design")
