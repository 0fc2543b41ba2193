"""Draw a recorded hand, and the map that it built: the same as `haptic-slam picture-recording`."""

from haptic_lab.cli import run

if __name__ == "__main__":
    run("picture-recording")
