"""Let simulated people of known parameters answer: the same as `haptic-slam simulate`."""

from haptic_lab.cli import run

if __name__ == "__main__":
    run("simulate")
