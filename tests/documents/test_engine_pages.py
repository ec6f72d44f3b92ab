"""The engines' pages hold what was measured, one page an adapter."""

from __future__ import annotations

from pathlib import Path

import pytest
from docs.figures import engine_pages

from carom.registry import adapter_points, load_adapter

PAGES = sorted(engine_pages.PAGES.glob("*.md"))
#: What is about all engines.
SHARED = {"README", "driven", "left-out"}


@pytest.mark.parametrize("page", PAGES, ids=lambda page: page.stem)
def test_the_tables_of_a_page_are_those_that_were_measured(page: Path) -> None:
    """`python docs/figures/engine_pages.py` would change nothing."""
    assert page.read_text(encoding="utf-8") == engine_pages.filled(page)


def test_each_adapter_has_a_page() -> None:
    """Every engine that comes with Carom has one, with the same headings, and no other has."""
    own = {page.stem: page.read_text(encoding="utf-8") for page in PAGES if page.stem not in SHARED}
    assert set(own) == {name for name, point in adapter_points().items() if point.distribution == "carom"} - {
        "pic",
        "pit",
    }
    for name, text in own.items():
        for heading in ("When to choose it", "Hazards", "Best settings", "What each profile finds"):
            assert f"\n## {heading}\n" in text, name


def test_an_engine_that_has_a_history_tells_it_on_its_page() -> None:
    """Each engine of the page of histories, and no other, has its sentences on its own page."""
    names = {
        name: load_adapter(name).engine.name
        for name, point in adapter_points().items()
        if point.distribution == "carom"
    }
    told = {page.stem for page in PAGES if "engine_pages.py: history -->" in page.read_text(encoding="utf-8")}
    text = engine_pages.HISTORY.read_text(encoding="utf-8")
    assert told == {name for name, engine in names.items() if f"\n## {engine}\n" in text}
    for engine in told:
        assert not engine_pages.history_of(engine).startswith(" "), engine


def test_a_hazard_is_what_is_off_at_some_start() -> None:
    """A row is one of the table of hazards, of which some start is off; what no start shows is named apart."""
    text = engine_pages.hazards_of("box2d3")
    assert "| `engines/near-miss`: " in text
    assert "| 32 of 32 | 0.0272 to 0.086 | - |" in text
    assert "| 0 of 32 |" not in text
    assert "No start is off in `hard-bounce`" in text
