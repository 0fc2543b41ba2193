"""People held against the observer: their trials, what is said of these, and observers with human limits."""
