"""Let a blind hand feel a new object, and keep it under a name: the same as `haptic-slam learn`."""

from haptic_lab.cli import run

if __name__ == "__main__":
    run("learn")
