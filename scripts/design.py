"""Say how many trials a subject must do so that two observers can be told apart: the same as `haptic-slam design`."""

from haptic_lab.cli import run

if __name__ == "__main__":
    run("design")
