"""Observers beside an environment of Gymnasium."""
