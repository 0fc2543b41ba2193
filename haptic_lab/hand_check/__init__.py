"""What `haptic-slam check-hand` tells of a hand."""
