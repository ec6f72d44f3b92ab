"""The page beside a report on which one throws the discs of its scenes, and the links of replays that lead there."""

from __future__ import annotations

from pathlib import Path

import pytest
from tests.stage import cross_checked, disc_at, staged

from carom import Scene
from carom.pages.grid import build_grid
from carom.pages.replay import scene_replays
from carom.scenes import all_scenes
from carom.studies.cross_check.document import write_report
from carom.studies.cross_check.thrown import THROWN, drag_link, thrown_page

PAIR = staged("mine/a pair & more", disc_at(0, 0, 1), disc_at(3, 0), duration_s=2.0)
#: One more than the page shows, of which two meet.
MANY = staged("many", disc_at(-1.5, 0, 1), *(disc_at(2 * k, 0) for k in range(10)), duration_s=1.0)


def test_a_link_names_the_scene_as_an_address_can() -> None:
    """Strokes, spaces and signs of its name are written so that the page reads the name back."""
    assert drag_link(PAIR) == "play.html#mine%2Fa%20pair%20%26%20more"


@pytest.mark.parametrize(
    "scene",
    [MANY, PAIR.model_copy(update={"table_deceleration_m_s2": 0.5})],
    ids=["eleven discs", "a table"],
)
def test_a_scene_that_the_page_does_not_show_has_no_link(scene: Scene) -> None:
    """Too many discs, and a table that slows them down: no link, and no page of these alone."""
    assert drag_link(scene) == ""
    assert thrown_page([scene]) == ""


@pytest.mark.parametrize("name", ["tables/box-of-edges", "driven/paddle", "contact/slide-to-roll"])
def test_a_scene_of_one_disc_and_any_wall_has_a_link(name: str) -> None:
    """Edges, driven walls and contact that lasts are no reason to have none."""
    assert drag_link(all_scenes()[name].scene)


def test_the_page_has_the_scenes_of_the_report_first() -> None:
    """And those of the catalogue that a reader is led to after them."""
    page = thrown_page([PAIR])
    assert 0 < page.index('"mine/a pair & more"') < page.index('"classics/bullet"')


@pytest.mark.parametrize(("scene", "linked"), [(PAIR, True), (MANY, False)])
def test_a_report_has_the_page_where_a_scene_of_it_can_be_thrown(scene: Scene, linked: bool, tmp_path: Path) -> None:
    """Beside `index.html`, and the replay's data has the link; elsewhere neither."""
    results = cross_checked([scene], ["pit"], dts=[1 / 24])
    write_report(results, tmp_path)
    assert (tmp_path / THROWN).exists() == linked
    (replay,) = scene_replays(results, build_grid(results), lambda _: "there")
    (bare,) = scene_replays(results, build_grid(results))
    assert replay != bare
