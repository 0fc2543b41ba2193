"""The commands of `haptic-slam`: each is a module with a `main`."""
