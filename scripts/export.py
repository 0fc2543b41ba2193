"""Make a model of Stable-Baselines3 one that runs nothing when it is read: the same as `haptic-slam export`."""

from haptic_lab.cli import run

if __name__ == "__main__":
    run("export")
