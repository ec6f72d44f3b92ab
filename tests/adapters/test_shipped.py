"""`default` is what an engine ships: its values are read from the engine, and its runs are those of the bare engine."""

from __future__ import annotations

from tests.adapters.shipped import OF_ALL, assert_default_is_shipped, worst_difference

from carom.adapter import Adapter


def test_default_uses_what_is_shipped(engine: Adapter) -> None:
    """Each value that `default` uses is the engine's own, read from it, but for what the profile lists as changed."""
    assert_default_is_shipped(engine, OF_ALL[engine.name]())


def test_default_runs_as_the_bare_engine(engine: Adapter) -> None:
    """Discs end where the bare engine has them, with only what is listed changed: to the bit, if free to turn."""
    shipped = OF_ALL[engine.name]()
    assert worst_difference(engine, shipped) <= shipped.roundings
