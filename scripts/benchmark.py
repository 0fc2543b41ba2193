"""Hold policies against each other in the worlds of the tasks: the same as `haptic-slam benchmark`."""

from haptic_lab.cli import run

if __name__ == "__main__":
    run("benchmark")
