"""Watch a blind hand explore a hidden object, in the browser: the same as `haptic-slam demo`."""

from haptic_lab.cli import run

if __name__ == "__main__":
    run("demo")
