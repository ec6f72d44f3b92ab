"""The pages of a bench and of a campaign: what is pointed at says the file's numbers, and leads to its evidence."""

import json
import math
from pathlib import Path
from typing import Any, Literal

import pytest
from playwright.sync_api import Locator, Page
from tests.browser.conftest import A4_PX, Window, find_cut_off, find_violations
from tests.unit.studies.examples import build_bench, build_campaign_results, build_growth

from carom.report import formatting
from carom.studies.bench.document import build_bench_document, write_bench
from carom.studies.bench.growth_document import build_growth_document, write_growth
from carom.studies.stress.document import build_stress_document, write_stress

pytestmark = pytest.mark.browser

#: Two decimals of a per cent are left of a bar's length, and three digits of a time.
SHOWN = 1e-3


@pytest.fixture(scope="module")
def pages(tmp_path_factory: pytest.TempPathFactory) -> dict[str, Path]:
    """The page of a bench of one scene, that of a campaign, and that of a growth bench, of every method."""
    folder = tmp_path_factory.mktemp("pages")
    bench, stress, growth = build_bench(), build_campaign_results(), build_growth()
    return {
        "bench": write_bench(bench, build_bench_document(bench), folder / "bench"),
        "stress": write_stress(stress, build_stress_document(stress), folder / "stress"),
        "growth": write_growth(growth, build_growth_document(growth), folder / "growth"),
    }


@pytest.fixture(params=["bench", "stress", "growth"])
def path(request: pytest.FixtureRequest, pages: dict[str, Path]) -> Path:
    """Each of the pages."""
    return pages[request.param]


def read_tip(page: Page) -> dict[str, str]:
    """Return what is shown of a point: each number by its name."""
    names = page.locator(".tip dt").all_inner_texts()
    return dict(zip(names, page.locator(".tip dd").all_inner_texts(), strict=True))


def load_points(pages: dict[str, Path]) -> list[Any]:
    """Return every point of the bench's own file, in its order."""
    (scene,) = json.loads((pages["bench"].parent / "bench.json").read_text())["scenes"]
    return [point for curve in scene["curves"] for point in curve["points"]]


def assert_point_agrees(shown: dict[str, str], point: dict[str, Any]) -> None:
    """Fail unless what is shown of a point is what the file holds, to the digits shown."""
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


def test_bar_lengths_match_the_decades_survived(window: Window, pages: dict[str, Path]) -> None:
    """The bar of a stress test is as long as the file's decades from the harmless end to where the method failed."""
    opened = window(pages["stress"])
    content = json.loads((pages["stress"].parent / "stress.json").read_text())
    (table,) = [one for one in opened.locator("table.grid").all() if one.locator(".meter").count()]
    by_name = {line["name"]: line for line in content["lines"] if line["kind"] == "attack"}
    stress_tests = [by_name[name] for name in table.locator("tbody th").all_inner_texts()]  # worst first
    assert len(stress_tests) == len(by_name)
    ratio = "all => all.map(one => one.getBoundingClientRect().width / one.parentNode.getBoundingClientRect().width)"
    for row, line in zip(table.locator("tbody tr").all(), stress_tests, strict=True):
        ladder = [value for value in line["ladder"] if value > 0]
        whole = abs(math.log10(ladder[-1] / ladder[0])) + (len(line["ladder"]) - len(ladder))
        shown = row.locator(".meter i").evaluate_all(ratio)
        for length, cell in zip(shown, line["cells"], strict=True):
            if cell["ending"] == "stands":
                assert length == pytest.approx(1.0, abs=SHOWN)
            elif cell["ending"] == "never_stood":
                assert length < 0.05  # a sign that there is a bar
            else:
                stood = abs(math.log10(cell["passes_until"] / ladder[0])) / whole
                assert length == pytest.approx(max(stood, 0.0), abs=0.05)


def test_cell_links_to_its_evidence(window: Window, pages: dict[str, Path]) -> None:
    """A click on a cell opens the row of that method with its scene file and the command that repeats the number."""
    opened = window(pages["stress"])
    opened.locator("table.grid td a[href='#tunnelling/pit/tuned']").click()
    row = opened.locator("tr:has(:target)")
    row.wait_for(state="visible")
    assert "carom run scenes/tunnelling-pit-tuned.toml -e pit -p tuned" in row.inner_text()
    assert row.locator("a[href='scenes/tunnelling-pit-tuned.toml']").count() == 1


@pytest.mark.parametrize("width", [360, 768, 1280])
def test_page_fits_the_window_width(window: Window, path: Path, width: int) -> None:
    """At 360, 768 and 1280 pixels nothing is wider than the window; wider content scrolls in its frame."""
    opened = window(path, width=width, height=800)
    assert opened.evaluate("document.documentElement.scrollWidth") <= width
    if width == 360 and path.parent.name == "bench":
        locate_points(opened, 0).nth(30).focus()
        box = opened.locator(".tip").bounding_box()
        assert box is not None
        assert box["x"] >= 0
        assert box["x"] + box["width"] <= width


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


@pytest.mark.parametrize("scheme", ["light", "dark"])
def test_axe_finds_no_serious_violation(window: Window, path: Path, scheme: Literal["light", "dark"]) -> None:
    """`axe` finds no serious or critical accessibility violation, with the numbers of a point shown."""
    page = window(path, color_scheme=scheme, bypass_csp=True)
    page.locator(".charts svg:visible a, details a, details summary").first.focus()
    page.evaluate("document.querySelector('details')?.setAttribute('open', '')")
    assert find_violations(page, "serious", "critical") == set()


def test_print_cuts_nothing_off(window: Window, path: Path) -> None:
    """Printed on A4 upright, no table, code block or diagram is wider than the sheet."""
    assert find_cut_off(window(path, width=A4_PX, height=1000)) == []
