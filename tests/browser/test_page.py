"""The page around the replays: what fits, what filters, what a screen reader finds."""

import re
from itertools import combinations
from pathlib import Path

import pytest
from playwright.sync_api import Page
from tests.browser.conftest import Window

from carom.report.outcome_marks import parse_mark
from carom.report.results_file.results_jsonl import read_records
from carom.support.escaping import escape_controls

pytestmark = pytest.mark.browser


def test_ranking_of_four_engines_fits_the_first_screen(window: Window, wide_report: Path) -> None:
    """At 1,280 pixels the sorted ranking of 13 methods fits above 900 pixels, and a bar opens a replay."""
    page = window(wide_report)
    frame = page.locator(".scroll", has=page.locator("table.methods"))
    assert frame.evaluate("frame => frame.scrollWidth - frame.clientWidth") == 0
    assert frame.evaluate("frame => frame.getBoundingClientRect().bottom") < 900
    rows = page.locator("table.methods tbody tr")
    assert rows.count() == 13
    tallies = rows.locator("td:nth-child(2)").all_inner_texts()
    right = [sum(map(int, re.findall(r"(\d+)[✓≃]", tally))) for tally in tallies]
    assert right == sorted(right, reverse=True)
    assert right[0] > right[-1]
    for row in rows.all():
        if "✗" in row.locator("td:nth-child(2)").inner_text():
            assert row.locator(".corner").count() >= 1
    assert 0 < page.locator("table.methods .corner").count() < page.locator("table.methods .share").count()
    page.locator("table.methods .share a").last.click()
    page.wait_for_selector("#replay[open]")


def test_bar_parts_match_the_number_of_scenes(window: Window, wide_report: Path) -> None:
    """Each part of a method's bar is as wide as its grade's share of scenes, with the best grade on the left."""
    page = window(wide_report)
    order = ["exact", "close", "sampled", "inaccurate", "diverged", "diverged-inaccurate", "wrong", "not-graded"]
    for cell in page.locator("table.methods tbody td:nth-child(2)").all():
        counts = [int(count) for count in re.findall(r"\d+", cell.inner_text())]
        parts = cell.locator(".bar i").evaluate_all("all => all.map(i => [i.className, i.offsetWidth])")
        grades = [order.index(name) for name, _ in parts if name in order]
        assert grades == sorted(grades)
        whole, spare = sum(width for _, width in parts), 1.5  # whole pixels: half a pixel here, one in all of them
        for count, (_, width) in zip(counts, parts, strict=True):
            assert abs(width - whole * count / sum(counts)) <= spare


def test_profile_switch_filters_both_tables(window: Window, wide_report: Path) -> None:
    """Choosing a profile, or the filter, shows its rows and columns and Carom's; without scripts all show."""
    page = window(wide_report)
    switch, profile_filter = page.locator("fieldset.switch"), page.locator(".filters").get_by_label("profile")
    assert switch.get_by_label("default").is_checked()  # as shipped, where a report has it
    assert profile_filter.input_value() == "default"
    assert page.locator("table.methods tbody tr:visible").count() == 5
    switch.get_by_label("all").check()
    every = page.locator("table.methods tbody tr:visible").count()
    for name in ("located", "default"):
        if name == "located":
            switch.get_by_label(name).check()
        else:
            profile_filter.select_option(name)
        assert profile_filter.input_value() == name
        assert switch.get_by_label(name).is_checked()
        methods = page.locator("table.methods tbody tr:visible th").all_inner_texts()
        assert [method for method in methods if not method.endswith(name)] == ["PIT"]
        heads = page.locator("table.grid thead th:visible").all_inner_texts()
        assert [head for head in heads if not head.endswith(name)][:2] == ["scene", "PIC"]
        assert (len(methods), len(heads)) == (5, 7)
    switch.get_by_label("all").check()
    assert page.locator("table.methods tbody tr:visible").count() == every
    plain = window(wide_report, java_script_enabled=False)
    assert plain.locator("table.methods tbody tr:visible").count() == every
    assert plain.locator("fieldset.switch").count() == 0


@pytest.mark.parametrize("name", ["methods", "grid"])
def test_phone_shows_every_cell_with_its_heading(window: Window, wide_report: Path, name: str) -> None:
    """At 360 pixels every cell of ranking and scenes is in the window, uncut, with its column's heading."""
    page = window(wide_report, width=360, height=740)
    page.locator("fieldset.switch").get_by_label("all").check()
    cells = page.locator(f"table.{name} tbody td:visible")
    assert cells.count() > (100 if name == "grid" else 60)
    right, cut = cells.evaluate_all(
        "all => [Math.max(...all.map(one => one.getBoundingClientRect().right)),"
        " all.filter(one => one.scrollWidth > one.clientWidth + 1).map(one => one.innerText)]"
    )
    assert right <= 360
    assert cut == []
    heads = cells.evaluate_all("all => all.map(one => getComputedStyle(one, '::before').content)")
    assert all(len(head) > len('""') for head in heads)
    page.locator("fieldset.switch").get_by_label("tuned").check()
    assert page.locator("table.methods tbody tr:visible").count() == 5


def test_texts_of_the_first_chart_do_not_overlap(window: Window, wide_report: Path) -> None:
    """No two texts of the chart of sampling costs overlap, at 360 and 1280 pixels."""
    for width in (360, 1280):
        texts = window(wide_report, width=width).locator(".charts svg:visible").first.locator("text")
        boxes = texts.evaluate_all(
            "all => all.map(one => one.getBoundingClientRect()).map(b => [b.x, b.y, b.right, b.bottom])"
        )
        assert len(boxes) > 14
        pairs = combinations(boxes, 2)
        assert not [1 for a, b in pairs if a[0] < b[2] and b[0] < a[2] and a[1] < b[3] and b[1] < a[3]]


def test_filters_select_rows_and_columns(page: Page) -> None:
    """The filters engine, profile, group and grade reduce the table, and the number of remaining scenes is shown."""
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


def test_column_heading_sorts_and_restores_the_order(page: Page) -> None:
    """A click on a heading sorts the worst grades to the top; a second click restores the catalogue's order."""
    names = page.locator("table.grid tbody th").all_inner_texts()
    heading = page.locator("table.grid thead th", has_text="PIT").first.get_by_role("button")
    heading.click()
    column = page.locator("table.grid thead th").all_inner_texts().index("PIT")
    assert "wrong" in page.locator(f"table.grid tbody tr:first-child td:nth-child({column + 1})").inner_text()
    page.locator("table.grid thead th").first.get_by_role("button").click()
    assert page.locator("table.grid tbody th .word, table.grid tbody th").first.inner_text() != names[0]
    page.locator("table.grid thead th").first.get_by_role("button").click()
    heading.click()
    heading.click()
    assert page.locator("table.grid tbody th").all_inner_texts() == names


def test_packed_table_has_every_record_when_opened(page: Page, report: Path) -> None:
    """Opened, the packed table has a row with the grade for each line of results.jsonl, also in print."""
    details = page.locator("details.packed")
    assert details.locator("tr").count() == 0
    details.locator("summary").click()
    details.locator("tbody tr").first.wait_for()
    _, lines = read_records(report.parent / "results.jsonl")
    assert details.locator("tbody th").all_inner_texts() == [escape_controls(line.scene) for line in lines]
    grades = details.locator("tbody tr td:nth-child(5)").all_inner_texts()
    said = [parse_mark(line.status, line.grade, line.float_bits) for line in lines]
    assert grades == [f"{mark.symbol} {mark.word}" for mark in said]
    page.emulate_media(media="print")
    assert details.locator("tbody tr").last.is_visible()
