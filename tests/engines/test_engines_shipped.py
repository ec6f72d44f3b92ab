"""`default` is what an engine ships, of the engines that `make engines` installs, too."""

from __future__ import annotations

import pytest
from tests.adapters.shipped import assert_default_is_shipped, worst_difference
from tests.engines.shipped import OF_ENGINES
from tests.engines.staged import Named


@pytest.mark.parametrize("name", OF_ENGINES)
def test_default_uses_what_is_shipped(name: str, named: Named) -> None:
    """Each value that `default` uses is the engine's own, read from it, but for what the profile lists as changed."""
    adapter = named(name)
    assert_default_is_shipped(adapter, OF_ENGINES[name]())


@pytest.mark.parametrize("name", OF_ENGINES)
def test_default_runs_as_the_bare_engine(name: str, named: Named) -> None:
    """Discs end where the bare engine has them, of which only what is listed is changed, to the roundings of a turn."""
    adapter = named(name)
    shipped = OF_ENGINES[name]()
    assert worst_difference(adapter, shipped) <= shipped.roundings
