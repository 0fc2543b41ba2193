"""Say what people answered, and hold them against observers: the same as `haptic-slam people`."""

from haptic_lab.cli import run

if __name__ == "__main__":
    run("people")
