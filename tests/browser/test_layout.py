"""Layout, print and accessibility of every page."""

from collections.abc import Collection
from pathlib import Path
from typing import Literal

import pytest
from axe_playwright_python.sync_playwright import Axe  # type: ignore[import-untyped] # it publishes no types
from playwright.sync_api import Page
from tests.browser.conftest import Window
from tests.browser.test_replay import MISSED, open_replay

pytestmark = pytest.mark.browser

#: 190 mm at 96 pixels an inch.
A4_PX = 718
PAGES = ("report", "bench", "stress", "growth", "play")


@pytest.fixture(params=PAGES)
def path(request: pytest.FixtureRequest, pages: dict[str, Path], wide_report: Path, toy_page: Path) -> Path:
    """Each of the pages."""
    return {**pages, "report": wide_report, "play": toy_page}[request.param]


def find_violations(page: Page, impacts: Collection[str]) -> set[str]:
    """Return the rules of accessibility that axe reports as broken with one of these impacts."""
    violations = [one for one in Axe().run(page).response["violations"] if one["impact"] in impacts]
    return {f"{one['id']}: {one['nodes'][0]['html'][:120]}" for one in violations}


@pytest.mark.parametrize("width", [360, 768, 1280])
def test_page_fits_the_window_width(window: Window, path: Path, width: int) -> None:
    """Nothing is wider than the window at 360, 768 and 1280 pixels; wider content scrolls in its own frame."""
    opened = window(path, width=width, height=800)
    assert opened.evaluate("document.documentElement.scrollWidth") <= width
    if opened.locator(".charts svg:visible a").count() > 30:  # also with the numbers of a point
        opened.locator(".charts svg:visible a").nth(30).focus()
        assert opened.evaluate("document.documentElement.scrollWidth") <= width


@pytest.mark.parametrize(("scheme", "width"), [("light", 1280), ("dark", 360)])
def test_axe_finds_no_serious_violation(
    window: Window, path: Path, wide_report: Path, toy_page: Path, scheme: Literal["light", "dark"], width: int
) -> None:
    """`axe` finds no violation on the play page, and no serious one elsewhere, also with details and a replay open."""
    impacts = ("minor", "moderate", "serious", "critical") if path == toy_page else ("serious", "critical")
    page = window(path, width=width, color_scheme=scheme, reduced_motion="reduce", bypass_csp=True)
    page.locator(".charts svg:visible a, details a, details summary").first.focus()
    page.evaluate("document.querySelector('details')?.setAttribute('open', '')")
    assert find_violations(page, impacts) == set()
    if path == wide_report and width == 1280:
        open_replay(page, MISSED)
        assert find_violations(page, impacts) == set()


def test_print_cuts_nothing_off(window: Window, path: Path) -> None:
    """Printed on A4 upright, no table, code block, diagram or control is wider than the sheet."""
    page = window(path, width=A4_PX, height=1000)
    page.emulate_media(media="print")
    is_cut = f"one => one.checkVisibility() && one.getBoundingClientRect().right > {A4_PX}"
    names = f"all => all.filter({is_cut}).map(one => one.outerHTML)"
    assert page.eval_on_selector_all("table, pre, svg, #play *", names) == []
