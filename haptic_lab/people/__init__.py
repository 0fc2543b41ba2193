"""People beside the observers: their trials, what the observers believed in the same ones, and who explains whom."""
