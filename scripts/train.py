"""Train a policy to name what the hand touches: the same as `haptic-slam train`."""

from haptic_lab.cli import run

if __name__ == "__main__":
    run("train")
