"""Draw a hand, list its joints, and say what is wrong with it: the same as `haptic-slam check-hand`."""

from haptic_lab.cli import run

if __name__ == "__main__":
    run("check-hand")
