"""Experiments that have been done with people, to be done with the observers: what is explored, and what was published."""
