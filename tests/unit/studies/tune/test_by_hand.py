"""The search, unaided and from the shipped defaults, against what people have written by hand."""

from __future__ import annotations

import pytest
from tests.unit.studies.tune.by_hand import assert_as_good, merits


@pytest.mark.long
def test_pymunks_settings_are_found_as_good_as_by_hand() -> None:
    """On `classics` at its own frame rates no more scenes are wrong, and no fewer exact or close, than with `tuned`."""
    found, written = merits("pymunk", ["tuned"], 60)
    assert_as_good(found, written)
