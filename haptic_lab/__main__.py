"""`python -m haptic_lab` is the command `haptic-slam`."""

from haptic_lab.cli import main

if __name__ == "__main__":
    main()
