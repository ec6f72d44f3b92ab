"""A replay under a finger: buttons are tapped, and the time is dragged."""

from __future__ import annotations

from pathlib import Path

import pytest
from playwright.sync_api import Locator, Page
from tests.browser.conftest import Window
from tests.browser.test_replay import LATE, clock, opened
from tests.stage import sure

pytestmark = pytest.mark.browser

#: The smallest target of a finger that WCAG 2.2 lets stand (2.5.8, level AA), pixels.
TARGET = 24


@pytest.fixture
def phone(window: Window, report: Path) -> Page:
    """A replay on a telephone's screen, which has touch and no mouse."""
    page = window(report, width=360, height=740, has_touch=True, is_mobile=True, reduced_motion="reduce")
    opened(page, LATE)
    return page


def drag(page: Page, thing: Locator, start: float, end: float) -> list[float]:
    """Draw a finger across a thing from one part of its width to another; return the times shown on the way."""
    thing.scroll_into_view_if_needed()
    box = sure(thing.bounding_box())
    session = page.context.new_cdp_session(page)
    times = []

    def touch(kind: str, part: float | None = None) -> None:
        points = [] if part is None else [{"x": box["x"] + part * box["width"], "y": box["y"] + box["height"] / 2}]
        session.send("Input.dispatchTouchEvent", {"type": kind, "touchPoints": points})
        times.append(clock(page))

    touch("touchStart", start)
    for step in range(1, 11):
        touch("touchMove", start + (end - start) * step / 10)
    touch("touchEnd")
    return times


def test_buttons_are_tapped(phone: Page) -> None:
    """Play, frames and impacts answer a tap, and each is large enough for a finger."""
    dialog = phone.locator("#replay")
    for name in ("One frame on", "One frame back", *2 * ("On to the next impact",), "Back to the impact before"):
        button, before = dialog.get_by_role("button", name=name), clock(phone)
        box = sure(button.bounding_box())
        assert min(box["width"], box["height"]) >= TARGET, name
        button.tap()
        assert clock(phone) != before, name
    play = dialog.get_by_role("button", name="Play or pause")
    play.tap()
    assert play.inner_text() == "pause"
    play.tap()
    assert play.inner_text() == "play"


@pytest.mark.parametrize("where", [".timeline", ".views canvas"])
def test_the_time_follows_a_finger(phone: Page, where: str) -> None:
    """Drawn across the picture or the line of time, a finger takes the time along, to where it is let go."""
    thing = phone.locator(f"#replay {where}").first
    end = float(phone.get_by_label("Time in the scene").get_attribute("max") or "nan")
    times = drag(phone, thing, 0.2, 0.8)
    assert times == sorted(times)
    assert len(set(times)) > 5
    box = sure(thing.bounding_box())
    assert times[-1] == pytest.approx(0.8 * end, abs=2 * end / box["width"])  # a finger is at whole pixels


def test_the_slider_follows_a_finger(phone: Page) -> None:
    """So does the slider's knob."""
    times = drag(phone, phone.get_by_label("Time in the scene"), 0.3, 0.9)
    assert times[0] < times[5] < times[-1]
