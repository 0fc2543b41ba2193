"""Which patches are really touched, and which work."""
