"""The page around the replays: what fits, what filters, what a screen reader finds."""

from __future__ import annotations

import re
from itertools import combinations
from pathlib import Path
from typing import Literal

import pytest
from playwright.sync_api import Browser, Page
from tests.browser.test_replay import MISSED, opened

from carom.pages.grid import mark_read
from carom.pages.records import read_records
from carom.text import visible

pytestmark = pytest.mark.browser


@pytest.mark.parametrize("width", [360, 768, 1280])
def test_the_page_is_as_wide_as_the_window(browser: Browser, wide_report: Path, width: int) -> None:
    """Nothing sticks out of the window; what is wider scrolls within its own frame."""
    page = browser.new_page(viewport={"width": width, "height": 800})
    page.goto(wide_report.as_uri())
    assert page.evaluate("document.documentElement.scrollWidth") <= width
    page.close()


def test_the_heat_map_of_four_engines_fits_the_first_screen(browser: Browser, wide_report: Path) -> None:
    """At 1,280 pixels four engines with three profiles stand side by side, uncut; one click plays the worst scene."""
    page = browser.new_page(viewport={"width": 1280, "height": 900})
    page.goto(wide_report.as_uri())
    frame = page.locator(".scroll", has=page.locator("table.heat"))
    assert frame.evaluate("frame => frame.scrollWidth - frame.clientWidth") == 0
    assert frame.evaluate("frame => frame.getBoundingClientRect().bottom") < 900
    assert page.locator("table.heat thead th").count() >= 14
    page.locator("table.heat td a").last.click()
    page.wait_for_selector("#replay[open]")
    page.close()


def test_who_is_new_to_it_is_told_what_is_compared_and_shown_it(browser: Browser, wide_report: Path) -> None:
    """The first screen says in words what goes wrong; one click from there plays a run that misses an impact."""
    page = browser.new_page(viewport={"width": 1280, "height": 900})
    page.goto(wide_report.as_uri())
    chart = page.locator(".charts svg").first
    assert chart.evaluate("chart => chart.getBoundingClientRect().bottom") < 900
    said = page.locator("header .about").inner_text()
    assert all(word in said for word in ("once a step", "PIT", "PIC", "late"))
    page.locator("header .about a").click()
    page.wait_for_selector("#replay[open]")
    assert "missed" in page.locator("table.impacts").inner_text()
    page.close()


def test_no_words_of_the_first_chart_run_into_each_other(browser: Browser, wide_report: Path) -> None:
    """No two texts of the chart of what sampling costs overlap, as large as it is drawn and on a phone."""
    page = browser.new_page()
    for width in (360, 1280):
        page.set_viewport_size({"width": width, "height": 900})
        page.goto(wide_report.as_uri())
        texts = page.locator(".charts svg").first.locator("text")
        boxes = texts.evaluate_all(
            "all => all.map(one => one.getBoundingClientRect()).map(b => [b.x, b.y, b.right, b.bottom])"
        )
        assert len(boxes) > 14
        pairs = combinations(boxes, 2)
        assert not [1 for a, b in pairs if a[0] < b[2] and b[0] < a[2] and a[1] < b[3] and b[1] < a[3]]
    page.close()


def test_filters_leave_what_was_asked_for(page: Page) -> None:
    """Engine, profile, grade and group each cut the table down, and say how much of it is left."""
    page.locator(".filters").get_by_label(re.compile("^engine")).select_option("pymunk")  # a group has the word, too
    heads = page.locator("table.grid thead th:visible").all_inner_texts()
    assert {head.split()[0] for head in heads} == {"scene", "pymunk"}
    page.locator(".filters").get_by_label("profile").select_option("tuned")
    page.locator(".filters").get_by_label("group").select_option("paper")
    page.locator(".filters").get_by_label("grade").select_option("wrong")
    rows = page.locator("table.grid tbody tr:visible")
    assert rows.count() >= 1
    for text in rows.all_inner_texts():
        assert text.startswith("paper/")
        assert "wrong" in text
    every = page.locator("table.grid tbody tr").count()
    assert page.locator(".filters output").inner_text() == f"{rows.count()} of {every} scenes"
    assert rows.first.inner_text().startswith("paper/missed")  # the table's first row is a scene like any other
    page.locator(".filters").get_by_label("group").select_option("gravity")
    page.locator(".filters").get_by_label("grade").select_option("")
    assert all(text.startswith("gravity/") for text in rows.all_inner_texts())


def test_a_heading_sorts_the_worst_to_the_top_and_back(page: Page) -> None:
    """Clicked once, a column begins with what is wrong; clicked again, the order is the catalogue's."""
    names = page.locator("table.grid tbody th").all_inner_texts()
    heading = page.locator("table.grid thead th", has_text="PIT").first.get_by_role("button")
    heading.click()
    column = page.locator("table.grid thead th").all_inner_texts().index("PIT\ntuned")
    assert "wrong" in page.locator(f"table.grid tbody tr:first-child td:nth-child({column + 1})").inner_text()
    page.locator("table.grid thead th").first.get_by_role("button").click()
    assert page.locator("table.grid tbody th .word, table.grid tbody th").first.inner_text() != names[0]
    page.locator("table.grid thead th").first.get_by_role("button").click()
    heading.click()
    heading.click()
    assert page.locator("table.grid tbody th").all_inner_texts() == names


@pytest.mark.parametrize("scheme", ["light", "dark"])
def test_axe_finds_nothing_serious(browser: Browser, wide_report: Path, scheme: Literal["light", "dark"]) -> None:
    """No rule of accessibility that axe calls serious or critical is broken, on the page and in a replay."""
    from axe_playwright_python.sync_playwright import Axe  # type: ignore[import-untyped] # it publishes no types

    page = browser.new_page(color_scheme=scheme, reduced_motion="reduce", bypass_csp=True)
    page.goto(wide_report.as_uri())
    for key in ("", MISSED):
        if key:
            opened(page, key)
        found = Axe().run(page).response["violations"]
        serious = {
            f"{one['id']}: {one['nodes'][0]['html'][:120]}" for one in found if one["impact"] in {"serious", "critical"}
        }
        assert not serious
    page.close()


def test_on_paper_nothing_is_cut_off(browser: Browser, wide_report: Path) -> None:
    """Printed on A4, upright with usual margins, every table is as wide as the sheet at most."""
    page = browser.new_page(viewport={"width": 718, "height": 1000})  # 190 mm at 96 pixels an inch
    page.emulate_media(media="print")
    page.goto(wide_report.as_uri())
    seen = "all => all.filter(one => one.checkVisibility() && one.getBoundingClientRect().right > 718)"
    wide = page.eval_on_selector_all("table, pre, svg", f"{seen}.map(one => one.className)")
    assert wide == []
    page.close()


def test_every_cell_is_unpacked_when_it_is_opened_and_printed_then(page: Page, report: Path) -> None:
    """Opened, the table has a row for each line of results.jsonl, with its grade; the print shows it, too."""
    details = page.locator("details.packed")
    assert details.locator("tr").count() == 0
    details.locator("summary").click()
    details.locator("tbody tr").first.wait_for()
    _, lines = read_records(report.parent / "results.jsonl")
    scenes = details.locator("tbody th").all_inner_texts()
    assert scenes == [visible(line.scene) for line in lines]
    grades = details.locator("tbody tr td:nth-child(5)").all_inner_texts()
    said = [mark_read(line.status, line.grade, line.float_bits) for line in lines]
    assert grades == [f"{mark.symbol} {mark.word}" for mark in said]
    page.emulate_media(media="print")
    assert details.locator("tbody tr").last.is_visible()


def test_without_script_the_page_says_where_every_cell_is(browser: Browser, report: Path) -> None:
    """Where JavaScript is off, the opened part says so, and names the file that has the numbers."""
    page = browser.new_page(java_script_enabled=False)
    page.goto(report.as_uri())
    page.locator("details.packed summary").click()
    said = page.locator("details.packed noscript").inner_text()
    assert "JavaScript, which is switched off here" in said
    assert "results.jsonl" in said
    page.close()
