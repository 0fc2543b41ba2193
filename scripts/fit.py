"""Find what limits a subject: the same as `haptic-slam fit`."""

from haptic_lab.cli import run

if __name__ == "__main__":
    run("fit")
