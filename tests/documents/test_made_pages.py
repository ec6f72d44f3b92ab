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
from carom.studies.stress.relations import list_relations
from carom.studies.stress.run import list_attacks

CONTACT_ROWS: list[dict[str, Any]] = json.loads(contact.FIGURES.read_text(encoding="utf-8"))
KNOWN = {(row["engine"], row["profile"]): row["scenes"] for row in CONTACT_ROWS}
SCENES = [scene_named(name) for name in contact.scenes_started()]


def test_the_tables_of_contact_are_those_of_the_figures() -> None:
    """The page is what `contact.json` makes it."""
    page = contact.PAGE.read_text(encoding="utf-8")
    assert contact.filled(page, CONTACT_ROWS) == page


def test_pit_is_no_worse_than_sampled_from_any_start() -> None:
    """In every scene, from all eight starts."""
    scenes = KNOWN["pit", "tuned"]
    assert set(scenes) == {scene.name.partition("/")[2] for scene in SCENES}
    assert all(set(known["grades"]) <= set("✓≃≈") for known in scenes.values())


@each("engine", ["box2d", "mujoco", "planck", "pybullet", "pymunk"])
def test_a_slide_ends_half_a_step_s_way_off(engine: str) -> None:
    """``v dt / 2`` of the fastest start, 3 m/s and 7/8 of a fiftieth more, at 240 steps a second."""
    fastest = 3.0 * (1.0 + 0.02 * 7 / 8)
    assert KNOWN[engine, "tuned"]["stops"]["place_m"] == pytest.approx(fastest / 480, rel=0.02)


@each("engine", ["box2d", "planck"])
def test_a_disc_is_held_off_the_floor_as_shipped(engine: str) -> None:
    """By 5 mm, where nothing moves."""
    assert KNOWN[engine, "default"]["holds"]["place_m"] == pytest.approx(0.005, rel=0.01)


def test_a_disc_creeps_that_friction_holds() -> None:
    """In MuJoCo as shipped, and in no other engine."""
    fast = {key: known["holds"]["rest_m_s"] for key, known in KNOWN.items() if "holds" in known and key[0] != "pit"}
    assert [key for key, rest in fast.items() if rest > 1e-3] == [("mujoco", "default")]


@each("scene", SCENES)
def test_starts_are_of_one_kind_and_differ(scene: Scene) -> None:
    """What lies on the wall does so at every start; what comes through the air begins further up."""
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


def test_the_tables_are_those_of_the_figures() -> None:
    """The page is what `walls.json` makes it, with a row for each way of building a wall."""
    page = walls.PAGE.read_text(encoding="utf-8")
    assert walls.filled(page, ROWS) == page
    assert [(row["engine"], row["way"]) for row in ROWS] == [(way.engine, way.words) for way in walls.WAYS]


def test_who_passes_a_thin_wall_is_as_the_page_says() -> None:
    """What sweeps passes at no start, what looks once a step by the closed form to four starts, and p2 by its own."""
    for row in ROWS:
        through = row["thin"]["through"]
        if row["engine"] in SWEEPING or any(asked in row["way"] for asked in BY_ASKING):
            assert through == [0] * len(walls.SPEEDS), row
        elif row["engine"] == "p2-es" and "boxes" in row["way"]:
            step = [q * (walls.THIN_RADIUS_M + walls.HALF_M) for q in walls.SPEEDS]
            if row["way"] == "boxes":
                assert through == pytest.approx([walls.STARTS * (1 - 2 * walls.HALF_M / s) for s in step], abs=1)
        elif row["engine"] == "Newton":  # contacts from 0.2 m, or from a step's way, a metre at most
            reach = walls.THIN_RADIUS_M + walls.HALF_M
            step = [q * reach for q in walls.SPEEDS]
            ahead = [max(0.2, min(s, 1.0)) if "speculative" in row["way"] else 0.2 for s in step]
            form = [walls.STARTS * max(0.0, 1 - (reach + a) / s) for a, s in zip(ahead, step, strict=True)]
            assert through == pytest.approx(form, abs=1), row
        elif row["engine"] == "Drake":  # a spring
            assert through[0] == 0
            assert through[3:] == [walls.STARTS] * 4
        elif (row["engine"], row["way"]) == ("DART", "capsules"):  # which its detector makes spheres of
            assert through == [walls.STARTS] * len(walls.SPEEDS)
        else:
            form = [walls.STARTS * max(0.0, 1 - 1 / q) for q in walls.SPEEDS]
            if row["engine"] == "PhysX":  # contacts from afar
                assert all(found <= most for found, most in zip(through, form, strict=True))
                assert through[-1] == pytest.approx(form[-1], abs=1)
            else:
                assert through == pytest.approx(form, abs=4), row
            assert through[0] == 0


def test_who_is_smooth_over_joints_is_as_the_page_says() -> None:
    """Ways that the page calls smooth meet no joint at any start, and every other meets some, or no floor at all."""
    for row in ROWS:
        if (row["engine"], row["way"]) == ("DART", "capsules"):
            continue
        assert ((row["engine"], row["way"]) in SMOOTH) == (row["seams"]["other"] == [0, 0]), row


def test_what_comes_of_ends_is_as_the_page_says() -> None:
    """Who checks once per step is off by the step's way, Box2D and Planck by their slop, and v3's chain has no end."""
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


def test_who_comes_back_out_of_a_corner_is_as_the_page_says() -> None:
    """To a millimetre a second, except for the engines that the page names with their errors."""
    off = {"ODE": 0.02, "p2-es": 0.57, "cannon-es": 0.79, "Havok": 0.37, "PyBullet": 2.82}
    for row in ROWS:
        if (row["engine"], row["way"]) != ("DART", "capsules") and row["engine"] not in off:
            assert max(row["corners"]["worst_m_s"]) < 1e-3, row
    for engine, worst in off.items():
        found = max(max(row["corners"]["worst_m_s"]) for row in ROWS if row["engine"] == engine)
        assert found == pytest.approx(worst, abs=0.005)


@each("figure", long_until(1, ["corners", "thin", "seams", "ends"]))
def test_the_figures_are_those_of_the_engine(figure: str) -> None:
    """pymunk, run again, gives its row."""
    (way,) = (way for way in walls.WAYS if way.key == "neighbours")
    (kept,) = (row for row in ROWS if (row["engine"], row["way"]) == (way.engine, way.words))
    if walls.version_of(way) != kept["version"]:
        pytest.skip("another release of pymunk was measured")
    found, expected = getattr(walls, figure)(way), kept[figure]
    assert found["other"] == expected["other"] if figure == "seams" else found == expected


def test_one_bit_makes_another_digest() -> None:
    """A run has the digest of its copy, and not that of a run one of whose velocities is the next float."""
    trace = carom.solve_pic(all_scenes()["paper/late"].scene)
    moved = trace.final_velocity_m_s.copy()
    moved[0, 0] = np.nextafter(moved[0, 0], 1e9)
    other = dataclasses.replace(trace, final_velocity_m_s=moved)
    assert determinism.digest(dataclasses.replace(trace)) == determinism.digest(trace) != determinism.digest(other)


@pytest.mark.long
def test_pic_comes_to_the_bits_that_the_page_says() -> None:
    """Carom's own method, asked as `make determinism` asks, is the page's row."""
    words = determinism.words_of("pic", "frame-by-frame")
    row = " | ".join(words[name] for name in (*determinism.COUNTED, "order"))
    assert f"| pic | frame-by-frame | 4 of 4 | {row} |" in determinism.PAGE.read_text(encoding="utf-8")


@pytest.mark.long
def test_a_run_that_ends_its_process_is_not_the_same() -> None:
    """A missing engine fails in a process of its own, which is shown as ended and counts as not the same."""
    assert determinism.in_threads("no-such-engine", "default", "") == "ended"


PAGES = sorted(engine_pages.PAGES.glob("*.md"))
#: What is about all engines.
SHARED = {"README", "driven", "left-out"}


@each("page", PAGES)
def test_the_tables_of_a_page_are_those_that_were_measured(page: Path) -> None:
    """`python docs/figures/engine_pages.py` would change nothing."""
    assert page.read_text(encoding="utf-8") == engine_pages.filled(page)


def test_each_adapter_has_a_page() -> None:
    """Every engine that comes with Carom has one, with the same headings, and no other has."""
    own = {page.stem: page.read_text(encoding="utf-8") for page in PAGES if page.stem not in SHARED}
    assert set(own) == {name for name, point in list_adapter_points().items() if point.distribution == "carom"} - {
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
        for name, point in list_adapter_points().items()
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
    assert "No start has an error in `hard-bounce`" in text


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


def test_the_tables_are_taken_from_a_campaign() -> None:
    """Each is the whole of it and no more; a campaign without one is refused."""
    filled = stress_tables.kept(stress_tables.filled(STRESS, CAMPAIGN))
    assert list(filled) == list(stress_tables.KINDS)
    assert [rows[2][0] for rows in filled.values()] == ["grazing", "boost", "box2d-1094"]
    assert [len(rows) for rows in filled.values()] == [3, 3, 3]
    assert [rows[2][1:] for rows in filled.values()] == [["~ 0.0032"], ["= 1e-14"], ["x seen"]]
    with pytest.raises(ValueError, match="no table of invariances"):
        stress_tables.filled(STRESS, CAMPAIGN.partition("## Invariances")[0])


def test_the_page_has_every_stress_test_and_invariance() -> None:
    """What was added since the campaign would be missing from its tables."""
    kept = stress_tables.kept(STRESS)
    assert [row[0] for row in kept["stress test"][2:]] == [attack.name for _, attack in list_attacks()]
    assert [row[0] for row in kept["invariance"][2:]] == [relation.name for relation in list_relations()]
    assert all(len({len(row) for row in rows}) == 1 for rows in kept.values())


def test_the_page_of_stress_is_short() -> None:
    """800 words without its commands."""
    text = (ROOT / "docs" / "reference" / "stress.md").read_text(encoding="utf-8")
    assert len(re.sub(r"(?s)```.*?```", "", text).split()) <= 800
