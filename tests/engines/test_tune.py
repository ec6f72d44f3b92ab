"""The search for settings on the engines that `make engines` installs, against what people have written by hand."""

from __future__ import annotations

from collections.abc import Callable

from tests.unit.studies.tune.by_hand import assert_as_good, merits

from carom.adapter import Adapter


def test_plancks_settings_are_found_as_good_as_by_hand(named: Callable[[str], Adapter]) -> None:
    """On `classics` no more scenes are wrong, and no fewer exact or close, than with any profile written by hand.

    So it finds by itself that with bullets and a slop of next to nothing Planck is event-driven.
    """
    named("planck")
    found, written = merits("planck", ["tuned", "swept", "event-driven"], 60)
    assert_as_good(found, written)
