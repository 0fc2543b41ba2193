"""Say which observer explains a subject best: the same as `haptic-slam compare`."""

from haptic_lab.cli import run

if __name__ == "__main__":
    run("compare")
