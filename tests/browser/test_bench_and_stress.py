"""The pages of a bench and of a stress campaign: numbers of points, and links to the evidence."""

import json
from pathlib import Path
from typing import Any

import pytest
from playwright.sync_api import Locator, Page
from tests.browser.conftest import Window

from carom.support import formatting

pytestmark = pytest.mark.browser


def read_tip(page: Page) -> dict[str, str]:
    """Return the shown numbers of a point by name."""
    names = page.locator(".tip dt").all_inner_texts()
    return dict(zip(names, page.locator(".tip dd").all_inner_texts(), strict=True))


def load_points(pages: dict[str, Path]) -> list[Any]:
    """Return the points in the file of the bench."""
    (scene,) = json.loads((pages["bench"].parent / "bench.json").read_text())["scenes"]
    return [point for curve in scene["curves"] for point in curve["points"]]


def assert_point_agrees(shown: dict[str, str], point: dict[str, Any]) -> None:
    """Assert that the shown numbers of a point are those of the file, to the digits shown."""
    error = formatting.format_number(point["error"]) if point["error"] else "exact"
    assert shown["error"].split()[0] == error
    assert ("(-1)" in shown["error"]) == (point["missed"] == 1)
    assert float(shown["all steps, ms"]) == pytest.approx(1e3 * point["timing"]["advance_s"]["median"], rel=5e-3)
    assert float(shown["prepare, ms"]) == pytest.approx(1e3 * point["timing"]["prepare_s"]["median"], rel=5e-3)
    method = f"-e {point['engine']} -p {point['profile']} --dt {point['dt_s']!r}"
    assert shown["command"] == f"carom bench paper/late {method}"


def locate_points(page: Page, diagram: int) -> Locator:
    """Return the points of a diagram."""
    return page.locator(".charts svg:visible").nth(diagram).locator("a")


def test_hovered_point_shows_its_numbers(window: Window, pages: dict[str, Path]) -> None:
    """A hovered point of a bench diagram shows the error, times and command of the file; Escape hides them."""
    opened = window(pages["bench"])
    every = load_points(pages)
    assert opened.locator(".charts svg:visible").count() == 3
    for diagram in range(3):
        assert locate_points(opened, diagram).count() == len(every)
        locate_points(opened, diagram).nth(40).hover(force=True)
        assert_point_agrees(read_tip(opened), every[40])
        opened.keyboard.press("Escape")
        assert not opened.locator(".tip").is_visible()


def test_keyboard_moves_from_point_to_point(window: Window, pages: dict[str, Path]) -> None:
    """A diagram is one tab stop; arrow keys move through its points, and Enter leads to the table row of a point."""
    opened = window(pages["bench"])
    every = load_points(pages)
    assert opened.locator(".charts svg:visible a[tabindex='0']").count() == 3
    locate_points(opened, 0).first.focus()
    for k in range(12):
        assert_point_agrees(read_tip(opened), every[k])
        assert opened.locator(".tip b").inner_text() == opened.evaluate("document.activeElement.ariaLabel")
        opened.keyboard.press("ArrowRight")
    opened.keyboard.press("Enter")
    row = opened.locator("tr:has(:target)")
    assert row.is_visible()
    names = opened.locator("table.cells thead th").all_inner_texts()
    assert_point_agrees(dict(zip(names, row.locator("> *").all_inner_texts(), strict=True)), every[12])


def test_points_link_to_table_rows_without_scripts(window: Window, pages: dict[str, Path]) -> None:
    """With JavaScript off, a click on a point leads to its table row, which has the command."""
    page = window(pages["bench"], java_script_enabled=False)
    locate_points(page, 0).nth(20).click(force=True)
    row = page.locator("tr:has(:target)")
    assert row.is_visible()
    assert "carom bench paper/late" in row.inner_text()


def test_cell_links_to_its_evidence(window: Window, pages: dict[str, Path]) -> None:
    """A click on a cell opens the row of that method with its scene file and the command that repeats the number."""
    opened = window(pages["stress"])
    opened.locator("table.grid td a[href='#tunnelling/pit/tuned']").click()
    row = opened.locator("tr:has(:target)")
    row.wait_for(state="visible")
    assert "carom run scenes/tunnelling-pit-tuned.toml -e pit -p tuned" in row.inner_text()
    assert row.locator("a[href='scenes/tunnelling-pit-tuned.toml']").count() == 1


@pytest.mark.parametrize("name", ["bench", "growth"])
def test_diagrams_fit_a_phone_without_scrolling(window: Window, pages: dict[str, Path], name: str) -> None:
    """At 390 pixels each diagram fits its frame, and each text in it is inside and at least 9 pixels high."""
    opened = window(pages[name], width=390, height=800)
    diagrams = opened.locator(".charts figure")
    assert diagrams.evaluate_all("all => Math.max(...all.map(one => one.scrollWidth - one.clientWidth))") == 0
    for diagram in opened.locator(".charts svg:visible").all():
        frame = diagram.bounding_box()
        assert frame is not None
        words = diagram.locator("text").evaluate_all(
            "all => all.map(one => one.getBoundingClientRect()).map(one => [one.left, one.right, one.height])"
        )
        left, right, height = zip(*words, strict=True)
        assert min(left) >= frame["x"]
        assert max(right) <= frame["x"] + frame["width"]
        assert min(height) >= 9
