"""Let a blind hand explore a hidden object, and name it: the same as `haptic-slam explore`."""

from haptic_lab.cli import run

if __name__ == "__main__":
    run("explore")
