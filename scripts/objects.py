"""Compare objects with what the physics can touch of them: the same as `haptic-slam objects`."""

from haptic_lab.cli import run

if __name__ == "__main__":
    run("objects")
