"""Where the hand is."""
