"""List the objects that were learnt: the same as `haptic-slam library`."""

from haptic_lab.cli import run

if __name__ == "__main__":
    run("library")
