"""Replays, played, by mouse, by keyboard and under a finger."""

import base64
import cmath
import gzip
import json
import math
import re
from collections import Counter
from collections.abc import Sequence
from pathlib import Path
from typing import Any
from urllib.parse import quote

import pytest
from playwright.sync_api import Locator, Page
from tests.browser.conftest import HOSTILE, Window
from tests.scene_builders import require_value

from carom.support.escaping import escape_controls

pytestmark = pytest.mark.browser

#: Colours of the reference's picture at points of the scene.
COLOURS = """(points) => {
    const canvas = document.querySelector(".views canvas"), {scale, x: left, y: down} = canvas.dataset;
    const {data, width} = canvas.getContext("2d").getImageData(0, 0, canvas.width, canvas.height);
    return points.map(([x, y]) => {
        const first = 4 * (Math.round(Number(down) - scale * y) * width + Math.round(Number(left) + scale * x));
        return [...data.slice(first, first + 4)].join();
    });
}"""

MISSED = "paper/missed/pymunk/tuned"
LATE = "paper/late/pit/tuned"


def open_replay(page: Page, key: str) -> None:
    """Open a replay by its address, as a link that was sent."""
    page.evaluate("key => { location.hash = encodeURI(key); }", key)
    page.wait_for_function("key => document.querySelector('#replay[open] select')?.value === key", arg=key)


def read_clock(page: Page) -> float:
    """Return the time that is shown, in seconds."""
    return float(page.locator(".timeline").get_attribute("data-time") or "nan")


def read_circles(page: Page, circles: Sequence[tuple[float, float, float]], count: int) -> list[list[str]]:
    """Return colours of the reference's picture on circles, each with its centre and radius, read at once."""
    # Chromium warns of pages that are read several times, and a warning fails the test.
    turns = [cmath.rect(1.0, math.tau * k / count) for k in range(count)]
    points = [[x + radius * turn.real, y + radius * turn.imag] for x, y, radius in circles for turn in turns]
    colours: list[str] = page.evaluate(COLOURS, points)
    return [colours[count * k : count * (k + 1)] for k in range(len(circles))]


def load_scene_data(report: Path, scene: str) -> dict[str, Any]:
    """Return what the page holds of a scene."""
    source = report.read_text(encoding="utf-8")
    found = re.search(f'data-scene="{re.escape(scene)}">([^<]*)<', source)
    data: dict[str, Any] = json.loads(gzip.decompress(base64.b64decode(require_value(found)[1])))
    return data


def test_every_replay_plays_without_errors(page: Page) -> None:
    """Each replay of the report opens and steps to its impacts and its end; the console stays empty."""
    keys = page.eval_on_selector_all("table.grid td a", "links => links.map(a => decodeURIComponent(a.hash.slice(1)))")
    assert len(keys) > 3 * 60  # 61 scenes and the hostile ones, three methods each, less what one can't do
    for key in keys:
        open_replay(page, key)
        page.keyboard.press("End")
        end = read_clock(page)
        page.keyboard.press("Home")
        assert read_clock(page) == 0.0
        page.keyboard.press("Shift+ArrowRight")
        page.keyboard.press("ArrowRight")
        assert 0.0 < read_clock(page) <= end


@pytest.mark.parametrize("scene", ["paper/late", "classics/head-on", "classics/oblique-3-4-5", "gravity/box"])
def test_discs_are_drawn_at_the_reference_position_of_an_impact(page: Page, report: Path, scene: str) -> None:
    """At the first impact, points inside each disc have its colour, and points outside its rim have not."""
    data = load_scene_data(report, scene)
    open_replay(page, f"{scene}/pic/event-driven")
    page.keyboard.press("Home")
    page.keyboard.press("Shift+ArrowRight")
    when, first, second = data["impacts"][0]
    assert read_clock(page) == pytest.approx(when, abs=1e-12)
    circles = []
    for disc in (body for body in (first, second) if body >= 0):
        times, xs, ys = data["reference"][disc]
        knot, radius = times.index(when), data["discs"][disc][0]
        circles += [(xs[knot], ys[knot], part * radius) for part in (0.75, 1.2)]
    colours = read_circles(page, circles, 24)
    for inside, outside in zip(colours[::2], colours[1::2], strict=True):
        colour, times_seen = Counter(inside).most_common(1)[0]  # a path or a flag may be on a disc
        assert times_seen >= len(inside) / 2
        assert colour.split(",")[3] != "0"
        assert outside.count(colour) == 0


def test_replay_controls_work_by_mouse_and_keyboard(page: Page, report: Path) -> None:
    """Play, pause, frames, impacts, speed, overlay and time do what their labels say, by mouse and keyboard."""
    open_replay(page, LATE)
    run = next(run for run in load_scene_data(report, "paper/late")["runs"] if run["key"] == LATE)
    dialog = page.locator("#replay")
    assert dialog.get_by_role("button", name="Play or pause").inner_text() == "pause"
    before = read_clock(page)
    page.wait_for_function("before => Number(document.querySelector('.timeline').dataset.time) > before", arg=before)
    dialog.get_by_role("button", name="Play or pause").click()
    stopped = read_clock(page)
    page.wait_for_timeout(200)
    assert read_clock(page) == stopped
    page.keyboard.press("Home")
    dialog.get_by_role("button", name="Next frame").click()
    dialog.get_by_role("button", name="Next frame").click()
    dialog.get_by_role("button", name="Previous frame").click()
    assert read_clock(page) == pytest.approx(run["dt"], rel=1e-9)
    page.keyboard.press("Home")
    dialog.get_by_role("button", name="Next impact").click()
    assert read_clock(page) == pytest.approx(run["impacts"][0]["true"], rel=1e-12)
    dialog.get_by_role("button", name="Next impact").click()
    assert read_clock(page) == pytest.approx(run["impacts"][0]["reported"], rel=1e-12)
    dialog.get_by_role("button", name="Previous impact").click()
    assert read_clock(page) == pytest.approx(run["impacts"][0]["true"], rel=1e-12)
    chosen = dialog.get_by_label("Speed").input_value()
    page.keyboard.press("+")
    assert float(dialog.get_by_label("Speed").input_value()) == 2 * float(chosen)
    dialog.get_by_label("Speed").select_option("1")
    dialog.get_by_label("overlay both").check()
    assert page.locator(".views.over figure").first.is_hidden()
    dialog.get_by_label("Time in the scene").fill("0.25")
    assert read_clock(page) == 0.25


def test_both_pictures_and_the_timeline_are_visible(window: Window, report: Path) -> None:
    """On a phone, a tablet and a screen both pictures and the timeline are in the window, and aligned."""
    for width, height in ((360, 740), (768, 900), (1280, 900)):
        page = window(report, width=width, height=height, reduced_motion="reduce")
        open_replay(page, "paper/multiple/pymunk/tuned")
        boxes = [one.bounding_box() for one in page.locator("#replay canvas").all()]
        truth, seen, line = (box for box in boxes if box)
        assert truth["y"] > 0
        assert line["y"] + line["height"] < height
        assert truth["y"] == seen["y"] or truth["x"] == seen["x"]


def test_replay_shows_the_evidence_of_a_missed_impact(page: Page, report: Path) -> None:
    """A missed impact is described, is in the table with its cause and sets the clock; command and scene are shown."""
    open_replay(page, MISSED)
    run = next(run for run in load_scene_data(report, "paper/missed")["runs"] if run["key"] == MISSED)
    assert page.locator(".fault").inner_text() == run["fault"]["said"]
    row = page.locator("table.impacts tbody tr")
    assert "missed" in row.inner_text()
    assert row.locator("td").last.inner_text() == "checking once per step"
    row.get_by_role("button").click()
    assert read_clock(page) == pytest.approx(0.425, abs=1e-3)
    page.get_by_text("Repeat this run").click()
    assert page.get_by_label("Command").input_value().startswith("carom run paper/missed -e pymunk -p tuned --dt 0.04")
    assert 'name = "paper/missed"' in page.get_by_label("Scene file").input_value()


def test_link_opens_a_replay_and_escape_closes_it(page: Page, report: Path) -> None:
    """An address with a cell opens its replay at once; Escape closes it and removes it from the address."""
    page.goto(f"{report.as_uri()}#{quote(MISSED)}")
    page.reload()
    page.wait_for_selector("#replay[open]")
    assert page.locator("#replay-title").inner_text() == "paper/missed"
    page.keyboard.press("Escape")
    page.wait_for_selector("#replay", state="hidden")
    assert page.evaluate("location.hash") == ""


def test_hostile_scene_names_are_shown_as_text(page: Page) -> None:
    """Markup, quotes and right-to-left marks in a scene's name are shown as text and run no script."""
    for name in HOSTILE:
        open_replay(page, f"{escape_controls(name)}/pit/tuned")
        assert page.locator("#replay-title").inner_text() == escape_controls(name)
    assert page.evaluate("window.reached") is None


def test_replay_does_not_play_with_reduced_motion(window: Window, report: Path) -> None:
    """With reduced motion a replay stays at its start until a key is pressed."""
    page = window(report, reduced_motion="reduce")
    open_replay(page, LATE)
    page.wait_for_timeout(300)
    assert read_clock(page) == 0.0
    page.keyboard.press("ArrowRight")
    assert read_clock(page) > 0.0


def test_report_shows_pictures_and_tables_without_scripts(window: Window, report: Path) -> None:
    """With JavaScript off the report shows its pictures and tables, and no empty replay."""
    page = window(report, java_script_enabled=False)
    assert page.locator("figure.pair svg").count() >= 8
    assert page.locator("table.grid").is_visible()
    assert not page.locator("#replay").is_visible()


@pytest.mark.parametrize("key", ["Shift+ArrowRight", "End"])
def test_light_quarters_of_a_disc_show_its_rotation(page: Page, report: Path, key: str) -> None:
    """The two light quarters of a disc are turned by 6 rad/s up to the impact and by 4 rad/s afterwards."""
    data = load_scene_data(report, "spin/english-stick")
    open_replay(page, "spin/english-stick/pic/event-driven")
    rays, hit_s = 72, data["impacts"][0][0]
    page.keyboard.press("Home")
    page.keyboard.press(key)
    since = read_clock(page) - hit_s
    (colours,) = read_circles(page, [(0.0, -since, 0.7)], rays)
    turned = (6 * hit_s + 4 * since) * rays / (2 * math.pi)
    # Each quarter reaches nine rays to either side; two of them are left to its edge, and paths cross a few rays.
    for opposite in (0, rays // 2):
        light = [colours[round(turned + opposite + by) % rays] for by in range(-7, 8)]
        full = [colours[round(turned + opposite + rays // 4 + by) % rays] for by in range(-7, 8)]
        (of_light, seen_light), (of_full, seen_full) = (Counter(some).most_common(1)[0] for some in (light, full))
        assert of_light != of_full
        assert min(seen_light, seen_full) > len(light) / 2


#: The times shown, read every third frame from a replay's start until one of them comes again.
HELD = """async () => {
    const seen = [], line = document.querySelector(".timeline");
    const rest = () => new Promise(requestAnimationFrame);
    while (seen.length < 3 || seen.at(-1) !== seen.at(-2) || seen.at(-1) === 0) {
        seen.push(Number(line.dataset.time));
        for (const _ of [1, 2, 3]) await rest();
    }
    return seen;
}"""


def test_replay_pauses_at_a_missed_impact_and_goes_on(page: Page, report: Path) -> None:
    """While playing, the clock stops for a while in the middle of the missed overlap, and then goes on."""
    data = load_scene_data(report, "paper/missed")
    open_replay(page, MISSED)
    run = next(run for run in data["runs"] if run["key"] == MISSED)
    row = run["impacts"][run["fault"]["row"]]
    assert row["flag"] == "missed"
    moment = row["true"] + data["meetings"][row["at"]][2] / 2
    page.keyboard.press("Home")
    page.keyboard.press(" ")
    assert page.evaluate(HELD)[-1] == pytest.approx(moment, rel=1e-5)
    page.wait_for_function(
        "moment => Number(document.querySelector('.timeline').dataset.time) > moment * 1.01", arg=moment
    )


def test_replay_links_to_the_play_page_with_its_scene(page: Page) -> None:
    """The link of a replay opens the play page with that scene, without a request."""
    open_replay(page, MISSED)
    link = page.locator("#replay a", has_text="Open this scene")
    assert link.get_attribute("href") == "play.html#paper%2Fmissed"
    link.click()
    page.wait_for_selector("#sentence:not(:empty)")
    scene = page.evaluate("caromPage.state.scene")
    assert [disc["radius_m"] for disc in scene["discs"]] == [0.25, 0.25]
    assert page.locator("#problem").inner_text() == ""


def test_play_page_of_a_report_loads_most_scenes(page: Page, report: Path) -> None:
    """More than 30 scenes of the report's play page load without a message, and no script fails in the others."""
    page.goto((report.parent / "play.html").as_uri())
    page.wait_for_selector("#sentence:not(:empty)")
    names = page.evaluate("[...document.querySelectorAll('select option')].map((o) => o.value).filter(Boolean)")
    said = []
    for name in (name for name in names if "/" in name):
        page.select_option("#scene", name)
        said.append(page.inner_text("#problem"))
    assert len(said) > 40
    assert sum(not text for text in said) > 30


#: The smallest target of a finger by WCAG 2.2 (2.5.8, level AA), pixels.
TARGET = 24


@pytest.fixture
def phone(window: Window, report: Path) -> Page:
    """A replay on a telephone's screen, which has touch and no mouse."""
    page = window(report, width=360, height=740, has_touch=True, is_mobile=True, reduced_motion="reduce")
    open_replay(page, LATE)
    return page


def drag(page: Page, thing: Locator, start: float, end: float) -> list[float]:
    """Draw a finger across a thing from one part of its width to another; return the times shown on the way."""
    thing.scroll_into_view_if_needed()
    box = require_value(thing.bounding_box())
    session = page.context.new_cdp_session(page)
    times = []

    def touch(kind: str, part: float | None = None) -> None:
        points = [] if part is None else [{"x": box["x"] + part * box["width"], "y": box["y"] + box["height"] / 2}]
        session.send("Input.dispatchTouchEvent", {"type": kind, "touchPoints": points})
        times.append(read_clock(page))

    touch("touchStart", start)
    for step in range(1, 11):
        touch("touchMove", start + (end - start) * step / 10)
    touch("touchEnd")
    return times


def test_buttons_react_to_a_tap(phone: Page) -> None:
    """Play, frame and impact buttons react to a tap; frame and impact buttons are at least 24 pixels large."""
    dialog = phone.locator("#replay")
    for name in ("Next frame", "Previous frame", *2 * ("Next impact",), "Previous impact"):
        button, before = dialog.get_by_role("button", name=name), read_clock(phone)
        box = require_value(button.bounding_box())
        assert min(box["width"], box["height"]) >= TARGET, name
        button.tap()
        assert read_clock(phone) != before, name
    play = dialog.get_by_role("button", name="Play or pause")
    play.tap()
    assert play.inner_text() == "pause"
    play.tap()
    assert play.inner_text() == "play"


@pytest.mark.parametrize("where", [".timeline", ".views canvas"])
def test_time_follows_a_finger(phone: Page, where: str) -> None:
    """A finger that moves across the picture or the timeline sets the time, up to where it is lifted."""
    thing = phone.locator(f"#replay {where}").first
    end = float(phone.get_by_label("Time in the scene").get_attribute("max") or "nan")
    times = drag(phone, thing, 0.2, 0.8)
    assert times == sorted(times)
    assert len(set(times)) > 5
    box = require_value(thing.bounding_box())
    assert times[-1] == pytest.approx(0.8 * end, abs=2 * end / box["width"])  # a finger is at whole pixels
