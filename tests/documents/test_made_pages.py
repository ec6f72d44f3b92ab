"""Pages that are made: each has the tables of its figures, and what it says of engines is so in these."""

import dataclasses
import json
import re
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from docs.figures import contact, determinism, engine_pages, stress_tables, walls
from tests.cases import each, long_until
from tests.documents.code_blocks import ROOT

import carom
from carom.catalogue import all_scenes, scene_named
from carom.engines.registry import list_adapter_points, load_adapter
from carom.model.scene import Scene
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


@each("engine", ["box2d", "mujoco", "planck", "pybullet", "pymunk"])
def test_slides_end_half_a_step_off_in_the_figures(engine: str) -> None:
    """In the figures a slide ends ``v dt / 2`` off for the fastest start, at 240 steps per second."""
    fastest = 3.0 * (1.0 + 0.02 * 7 / 8)
    assert KNOWN[engine, "tuned"]["stops"]["place_m"] == pytest.approx(fastest / 480, rel=0.02)


@each("engine", ["box2d", "planck"])
def test_default_box2d_and_planck_hold_discs_5_mm_off_the_floor(engine: str) -> None:
    """In the figures a disc at rest is 5 mm off its position with default settings."""
    assert KNOWN[engine, "default"]["holds"]["place_m"] == pytest.approx(0.005, rel=0.01)


def test_only_default_mujoco_creeps_in_the_figures() -> None:
    """Of all methods in the figures only default MuJoCo creeps faster than 1 mm/s where friction holds."""
    fast = {key: known["holds"]["rest_m_s"] for key, known in KNOWN.items() if "holds" in known and key[0] != "pit"}
    assert [key for key, rest in fast.items() if rest > 1e-3] == [("mujoco", "default")]


@each("scene", SCENES)
def test_contact_starts_differ_unless_all_discs_rest(scene: Scene) -> None:
    """The eight starts of a contact scene differ, except in a scene whose discs are all at rest."""
    starts = [contact.started(scene, start) for start in range(contact.STARTS)]
    assert starts[0].discs == scene.discs
    still = all(disc.velocity_m_s == (0.0, 0.0) and not disc.spin_rad_s for disc in scene.discs)
    assert len({start.discs for start in starts}) == (1 if still else contact.STARTS)


ROWS: list[dict[str, Any]] = json.loads(walls.FIGURES.read_text(encoding="utf-8"))
SWEEPING = {"Box2D", "Box2D v3", "Havok", "Planck", "Rapier", "Rapier 2D"}
BY_ASKING = ("LinearCast", "useMaximalCoordinates", "eENABLE_CCD")
#: Found smooth on ten pieces at every start.
SMOOTH = {
    ("Box2D", "one chain"),
    ("Box2D v3", "one chain, with a ghost point at each end"),
    ("Jolt", "one compound, `mEnhancedInternalEdgeRemoval`"),
    ("Planck", "one chain"),
    ("pymunk", "`Segment`, `set_neighbors`"),
}


def test_wall_tables_match_their_figures() -> None:
    """The page on walls has exactly the tables generated from `walls.json`, with a row for each wall type."""
    page = walls.PAGE.read_text(encoding="utf-8")
    assert walls.filled(page, ROWS) == page
    assert [(row["engine"], row["way"]) for row in ROWS] == [(way.engine, way.words) for way in walls.WAYS]


def test_thin_wall_figures_match_their_closed_forms() -> None:
    """In the figures swept engines pass no thin wall, discrete ones as the closed form, some within bounds."""
    for row in ROWS:
        through = row["thin"]["through"]
        if row["engine"] in SWEEPING or any(asked in row["way"] for asked in BY_ASKING):
            assert through == [0] * len(walls.SPEEDS), row
        elif row["engine"] == "p2-es" and "boxes" in row["way"]:
            step = [q * (walls.THIN_RADIUS_M + walls.HALF_M) for q in walls.SPEEDS]
            if row["way"] == "boxes":
                assert through == pytest.approx([walls.THIN_PHASES * (1 - 2 * walls.HALF_M / s) for s in step], abs=1)
        elif row["engine"] == "Newton":  # contacts from 0.2 m, or from a step's way, a metre at most
            reach = walls.THIN_RADIUS_M + walls.HALF_M
            step = [q * reach for q in walls.SPEEDS]
            ahead = [max(0.2, min(s, 1.0)) if "speculative" in row["way"] else 0.2 for s in step]
            form = [walls.THIN_PHASES * max(0.0, 1 - (reach + a) / s) for a, s in zip(ahead, step, strict=True)]
            assert through == pytest.approx(form, abs=1), row
        elif row["engine"] == "Drake":  # a spring
            assert through[0] == 0
            assert through[3:] == [walls.THIN_PHASES] * 4
        elif (row["engine"], row["way"]) == ("DART", "capsules"):  # which its detector makes spheres of
            assert through == [walls.THIN_PHASES] * len(walls.SPEEDS)
        else:
            form = [walls.THIN_PHASES * max(0.0, 1 - 1 / q) for q in walls.SPEEDS]
            if row["engine"] == "PhysX":  # contacts from afar
                assert all(found <= most for found, most in zip(through, form, strict=True))
                assert through[-1] == pytest.approx(form[-1], abs=1)
            else:
                assert through == pytest.approx(form, abs=4), row
            assert through[0] == 0


def test_smooth_wall_types_are_those_listed() -> None:
    """In the figures exactly the wall types in `SMOOTH` deflect no disc at a joint from any start."""
    for row in ROWS:
        if (row["engine"], row["way"]) == ("DART", "capsules"):
            continue
        assert ((row["engine"], row["way"]) in SMOOTH) == (row["seams"]["other"] == [0, 0]), row


def test_wall_end_figures_are_in_their_ranges() -> None:
    """In the figures errors at wall ends are those of a step for discrete engines, and of the slop for Box2D."""
    looking = {"DART", "MuJoCo", "ODE", "p2-es", "pymunk"}
    for row in ROWS:
        median, worst = row["ends"]["median_deg"], row["ends"]["worst_deg"]
        if (row["engine"], row["way"]) in {
            ("DART", "capsules"),
            ("Box2D v3", "one chain, with a ghost point at each end"),
        }:
            assert median == pytest.approx([120.0, 36.4, 120.0, 36.4], abs=0.05)
        elif row["engine"] in {"Box2D", "Planck"}:
            assert worst == pytest.approx([2.3, 11.0, 2.3, 11.5], abs=0.1)
        elif row["engine"] in looking:
            assert 20 < worst[0] < 27
            assert worst[2] < 6


def test_corner_figures_are_exact_except_for_listed_engines() -> None:
    """In the figures discs leave a corner with errors below 1 mm/s, except in five engines with listed errors."""
    off = {"ODE": 0.02, "p2-es": 0.57, "cannon-es": 0.79, "Havok": 0.37, "PyBullet": 2.82}
    for row in ROWS:
        if (row["engine"], row["way"]) != ("DART", "capsules") and row["engine"] not in off:
            assert max(row["corners"]["worst_m_s"]) < 1e-3, row
    for engine, worst in off.items():
        found = max(max(row["corners"]["worst_m_s"]) for row in ROWS if row["engine"] == engine)
        assert found == pytest.approx(worst, abs=0.005)


@each("figure", long_until(1, ["corners", "thin", "seams", "ends"]))
def test_wall_figures_of_pymunk_are_reproducible(figure: str) -> None:
    """Running pymunk again gives its figures, if the installed release is the measured one."""
    (way,) = (way for way in walls.WAYS if way.key == "neighbours")
    (kept,) = (row for row in ROWS if (row["engine"], row["way"]) == (way.engine, way.words))
    if walls.version_of(way) != kept["version"]:
        pytest.skip("another release of pymunk was measured")
    found, expected = getattr(walls, figure)(way), kept[figure]
    assert found["other"] == expected["other"] if figure == "seams" else found == expected


def test_digest_changes_with_one_bit() -> None:
    """A copy of a run has the same digest, and a run with one velocity one float higher has another one."""
    trace = carom.solve_pic(all_scenes()["paper/late"].scene)
    moved = trace.final_velocity_m_s.copy()
    moved[0, 0] = np.nextafter(moved[0, 0], 1e9)
    other = dataclasses.replace(trace, final_velocity_m_s=moved)
    assert determinism.digest(dataclasses.replace(trace)) == determinism.digest(trace) != determinism.digest(other)


@pytest.mark.long
def test_determinism_page_has_the_measured_row_of_pic() -> None:
    """Measuring the determinism of PIC again gives the row on the page."""
    words = determinism.words_of("pic", "frame-by-frame")
    row = " | ".join(words[name] for name in (*determinism.COUNTED, "order"))
    assert f"| pic | frame-by-frame | 4 of 4 | {row} |" in determinism.PAGE.read_text(encoding="utf-8")


@pytest.mark.long
def test_run_that_ends_its_process_is_reported_as_ended() -> None:
    """A missing engine fails in a process of its own, and is shown as ended."""
    assert determinism.in_threads("no-such-engine", "default", "") == "ended"


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


def test_engine_pages_show_their_history() -> None:
    """Exactly the engines of the history page have a history section on their own page."""
    told = {page.stem for page in PAGES if "engine_pages.py: history -->" in page.read_text(encoding="utf-8")}
    text = engine_pages.HISTORY.read_text(encoding="utf-8")
    assert told == {name for name in SHIPPED if f"\n## {load_adapter(name).engine.name}\n" in text}
    for engine in told:
        assert not engine_pages.history_of(engine).startswith(" "), engine


def test_hazard_table_lists_only_scenes_with_errors() -> None:
    """A page's hazard table has the scenes with an error from some start; the others are listed below it."""
    text = engine_pages.hazards_of("box2d3")
    assert "| `engines/near-miss`: " in text
    assert "| 32 of 32 | 0.0272 to 0.086 | - |" in text
    assert "| 0 of 32 |" not in text
    assert "The error is at most 1 % at every phase in `hard-bounce`" in text


STRESS = stress_tables.PAGE.read_text(encoding="utf-8")
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
| box2d-1094 | | x seen 2 |
"""


def test_stress_tables_are_taken_from_a_campaign() -> None:
    """The page's tables are the first result columns of a campaign's tables; a campaign without one is refused."""
    filled = stress_tables.kept(stress_tables.filled(STRESS, CAMPAIGN))
    assert list(filled) == list(stress_tables.KINDS)
    assert [len(rows) for rows in filled.values()] == [3, 3, 3]
    results = [["grazing", "~ 0.0032"], ["boost", "= 1e-14"], ["box2d-1094", "x seen"]]
    assert [rows[2] for rows in filled.values()] == results
    with pytest.raises(ValueError, match="no table of invariances"):
        stress_tables.filled(STRESS, CAMPAIGN.partition("## Invariances")[0])


def test_stress_page_has_every_stress_test_and_invariance() -> None:
    """The tables of the page list every stress test and every invariance of the code, in order."""
    kept = stress_tables.kept(STRESS)
    assert [row[0] for row in kept["stress test"][2:]] == [stress_test.name for stress_test in STRESS_TESTS]
    assert [row[0] for row in kept["invariance"][2:]] == [invariance.name for invariance in list_invariances()]
    assert all(len({len(row) for row in rows}) == 1 for rows in kept.values())


def test_stress_page_has_at_most_800_words() -> None:
    """The reference page on stress has at most 800 words without its commands."""
    text = (ROOT / "docs" / "reference" / "stress.md").read_text(encoding="utf-8")
    assert len(re.sub(r"(?s)```.*?```", "", text).split()) <= 800
