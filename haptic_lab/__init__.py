"""What composes the environment, the observers and the policies: trials, replays, sweeps, figures, learning,
benchmarks, and the command `haptic-slam`."""
