"""What objects there are, and how far the physics is from what they are."""
