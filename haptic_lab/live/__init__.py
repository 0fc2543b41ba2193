"""The observer beside a moving hand: streams in, beliefs out."""
