"""The tables of the page of stress results are a campaign's, and have every attack and relation of today."""

from __future__ import annotations

import re

import pytest
from docs.figures import stress_tables
from tests.documents.blocks import ROOT

from carom.studies.stress.relations import relations
from carom.studies.stress.run import attacks

PAGE = stress_tables.PAGE.read_text(encoding="utf-8")
CAMPAIGN = """# Carom: stress

## Where each method fails

| stress test | axis | pit tuned |
| --- | --- | --- |
| grazing | 1 - b/R | ~ 0.0032 0.061 |

The size.

## Invariances

| invariance | axis | pit tuned |
| --- | --- | --- |
| boost | velocity | = 1e-14 |

| reported bug | axis | pit tuned |
| --- | --- | --- |
| box2d-1094 | | x does it 2 |
"""


def test_the_tables_are_taken_from_a_campaign() -> None:
    """Each is the whole of it and no more; a campaign without one is refused."""
    filled = stress_tables.kept(stress_tables.filled(PAGE, CAMPAIGN))
    assert list(filled) == list(stress_tables.KINDS)
    assert [rows[2][0] for rows in filled.values()] == ["grazing", "boost", "box2d-1094"]
    assert [len(rows) for rows in filled.values()] == [3, 3, 3]
    assert [rows[2][1:] for rows in filled.values()] == [["~ 0.0032"], ["= 1e-14"], ["x does it"]]
    with pytest.raises(ValueError, match="no table of invariances"):
        stress_tables.filled(PAGE, CAMPAIGN.partition("## Invariances")[0])


def test_the_page_has_every_stress_test_and_invariance() -> None:
    """What was added since the campaign would be missing from its tables."""
    kept = stress_tables.kept(PAGE)
    assert [row[0] for row in kept["stress test"][2:]] == [attack.name for attack in attacks()]
    assert [row[0] for row in kept["invariance"][2:]] == [relation.name for relation in relations()]
    assert all(len({len(row) for row in rows}) == 1 for rows in kept.values())


def test_the_page_of_stress_is_short() -> None:
    """800 words without its commands."""
    text = (ROOT / "docs" / "stress.md").read_text(encoding="utf-8")
    assert len(re.sub(r"(?s)```.*?```", "", text).split()) <= 800
