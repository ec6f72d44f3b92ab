"""Generated pages: their tables match the committed figures."""

import json
from pathlib import Path
from typing import Any

from docs.figures import contact, engine_pages, stress_tables, walls
from tests.cases import each

from carom.catalogue import scene_named
from carom.engines.registry import list_adapter_points
from carom.studies.stress.invariances import list_invariances
from carom.studies.stress.run import STRESS_TESTS

CONTACT_ROWS: list[dict[str, Any]] = json.loads(contact.FIGURES.read_text(encoding="utf-8"))
KNOWN = {(row["engine"], row["profile"]): row["scenes"] for row in CONTACT_ROWS}
SCENES = [scene_named(name) for name in contact.scenes_started()]


def test_contact_tables_match_their_figures() -> None:
    """The page on contact has exactly the tables generated from `contact.json`."""
    page = contact.PAGE.read_text(encoding="utf-8")
    assert contact.filled(page, CONTACT_ROWS) == page


def test_pit_is_sampled_or_better_in_contact_scenes() -> None:
    """In the figures PIT is graded exact, close or sampled in every contact scene from every start."""
    scenes = KNOWN["pit", "tuned"]
    assert set(scenes) == {scene.name.partition("/")[2] for scene in SCENES}
    assert all(set(known["grades"]) <= set("✓≃≈") for known in scenes.values())


ROWS: list[dict[str, Any]] = json.loads(walls.FIGURES.read_text(encoding="utf-8"))


def test_wall_tables_match_their_figures() -> None:
    """The page on walls has exactly the tables generated from `walls.json`, with a row for each wall type."""
    page = walls.PAGE.read_text(encoding="utf-8")
    assert walls.filled(page, ROWS) == page
    assert [(row["engine"], row["way"]) for row in ROWS] == [(way.engine, way.words) for way in walls.WAYS]


PAGES = sorted(engine_pages.PAGES.glob("*.md"))
#: Adapters that come with Carom.
SHIPPED = {name for name, point in list_adapter_points().items() if point.distribution == "carom"}
#: What is about all engines.
SHARED = {"README", "driven", "left-out"}


@each("page", PAGES)
def test_engine_pages_are_up_to_date(page: Path) -> None:
    """`python docs/figures/engine_pages.py` would change no page of an engine."""
    assert page.read_text(encoding="utf-8") == engine_pages.filled(page)


def test_every_adapter_has_a_page_with_the_same_headings() -> None:
    """Every engine that comes with Carom has a page with the four standard headings, and no other page exists."""
    own = {page.stem: page.read_text(encoding="utf-8") for page in PAGES if page.stem not in SHARED}
    assert set(own) == SHIPPED - {"pic", "pit"}
    for name, text in own.items():
        for heading in ("When to choose it", "Hazards", "Best settings", "What each profile finds"):
            assert f"\n## {heading}\n" in text, name


STRESS = stress_tables.PAGE.read_text(encoding="utf-8")


def test_stress_page_has_every_stress_test_and_invariance() -> None:
    """The tables of the page list every stress test and every invariance of the code, in order."""
    kept = stress_tables.kept(STRESS)
    assert [row[0] for row in kept["stress test"][2:]] == [stress_test.name for stress_test in STRESS_TESTS]
    assert [row[0] for row in kept["invariance"][2:]] == [invariance.name for invariance in list_invariances()]
    assert all(len({len(row) for row in rows}) == 1 for rows in kept.values())
