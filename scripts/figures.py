"""Draw the figures of the paper, and those beyond it: the same as `haptic-slam figures`."""

from haptic_lab.cli import run

if __name__ == "__main__":
    run("figures")
