"""Beliefs, compared bit by bit as the observer's own tests do."""

from tests.observer.conftest import bits  # noqa: F401
