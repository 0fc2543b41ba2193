"""An entry point of the public interface, and one call of it."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from typing import Any

from tests.properties.files import put, put_away
from tests.properties.parameters import Parameter, given
from tests.properties.rule import Allowed, Outcome, judge
from tests.properties.strategies import Strategy


@dataclass(frozen=True)
class Entry:
    """`call` by keyword with what `parameters` say, and what is `allowed` to come of it; `weight`: how many inputs it
    gets, as a multiple of what others do, less where a call takes long."""

    call: Callable[..., Any]
    parameters: Mapping[str, Parameter]
    allowed: Allowed = field(default_factory=Allowed)
    weight: float = 1.0

    @property
    def inputs(self) -> Strategy:
        """Arguments by name."""
        return given(self.parameters)

    def try_with(self, arguments: Mapping[str, Any]) -> Outcome:
        """What comes of one input."""
        placed = {name: put(value) for name, value in arguments.items()}
        try:
            return judge(lambda: self.call(**placed), placed, self.allowed)
        finally:
            put_away()
