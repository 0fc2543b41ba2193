"""The long run of `make fuzz`."""

from __future__ import annotations

import pytest

from tests.properties.fuzz import main


@pytest.mark.fuzz
def test_no_input_breaks_the_rule(capsys):
    with capsys.disabled():
        assert main([]) == 0
