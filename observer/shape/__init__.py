"""What the object is."""
