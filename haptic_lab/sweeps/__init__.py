"""Many trials: what they are, who runs them, and the table that they fill."""
