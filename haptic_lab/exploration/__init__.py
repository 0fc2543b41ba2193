"""One exploration before a person's eyes: `haptic-slam explore` and `replay`."""
