"""Do an experiment with the observers that was done with people: the same as `haptic-slam study`."""

from haptic_lab.cli import run

if __name__ == "__main__":
    run("study")
