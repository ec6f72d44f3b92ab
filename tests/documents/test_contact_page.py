"""The page of contact has the tables of its figures, and what it says of engines is so in these."""

from __future__ import annotations

import json
from typing import Any

import pytest
from docs.figures import contact

from carom.scene import Scene
from carom.scenes import scene_named

ROWS: list[dict[str, Any]] = json.loads(contact.FIGURES.read_text(encoding="utf-8"))
KNOWN = {(row["engine"], row["profile"]): row["scenes"] for row in ROWS}
SCENES = [scene_named(name) for name in contact.scenes_started()]


def test_the_tables_are_those_of_the_figures() -> None:
    """The page is what `contact.json` makes it."""
    page = contact.PAGE.read_text(encoding="utf-8")
    assert contact.filled(page, ROWS) == page


def test_pit_is_no_worse_than_sampled_from_any_start() -> None:
    """In every scene, from all eight starts."""
    scenes = KNOWN["pit", "tuned"]
    assert set(scenes) == {scene.name.partition("/")[2] for scene in SCENES}
    assert all(set(known["grades"]) <= set("✓≃≈") for known in scenes.values())


@pytest.mark.parametrize("engine", ["box2d", "mujoco", "planck", "pybullet", "pymunk"])
def test_a_slide_ends_half_a_step_s_way_off(engine: str) -> None:
    """``v dt / 2`` of the fastest start, 3 m/s and 7/8 of a fiftieth more, at 240 steps a second."""
    fastest = 3.0 * (1.0 + 0.02 * 7 / 8)
    assert KNOWN[engine, "tuned"]["stops"]["place_m"] == pytest.approx(fastest / 480, rel=0.02)


@pytest.mark.parametrize("engine", ["box2d", "planck"])
def test_a_disc_is_held_off_the_floor_as_shipped(engine: str) -> None:
    """By 5 mm, where nothing moves."""
    assert KNOWN[engine, "default"]["holds"]["place_m"] == pytest.approx(0.005, rel=0.01)


def test_a_disc_creeps_that_friction_holds() -> None:
    """In MuJoCo as shipped, and in no other engine."""
    fast = {key: known["holds"]["rest_m_s"] for key, known in KNOWN.items() if "holds" in known and key[0] != "pit"}
    assert [key for key, rest in fast.items() if rest > 1e-3] == [("mujoco", "default")]


@pytest.mark.parametrize("scene", SCENES, ids=lambda scene: scene.name)
def test_starts_are_of_one_kind_and_differ(scene: Scene) -> None:
    """What lies on the wall does so at every start; what comes through the air begins further up."""
    starts = [contact.started(scene, start) for start in range(contact.STARTS)]
    assert starts[0].discs == scene.discs
    still = all(disc.velocity_m_s == (0.0, 0.0) and not disc.spin_rad_s for disc in scene.discs)
    assert len({start.discs for start in starts}) == (1 if still else contact.STARTS)
