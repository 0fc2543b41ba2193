"""Experiments that were done with people, to be done with the observers: what is felt, and what was published."""
