"""Replays, played, by mouse, by keyboard and under a finger."""

import base64
import gzip
import json
import math
import re
from collections import Counter
from pathlib import Path
from typing import Any
from urllib.parse import quote

import pytest
from playwright.sync_api import Locator, Page
from tests.browser.conftest import HOSTILE, Window
from tests.scene_builders import sure

from carom.support.escaping import escape_controls

pytestmark = pytest.mark.browser

#: Colours of the reference's picture on two circles round each disc, one within its rim and one beyond.
PIXELS = """(discs) => {
    const canvas = document.querySelector(".views canvas"), {scale, x: left, y: down} = canvas.dataset;
    const {data, width} = canvas.getContext("2d").getImageData(0, 0, canvas.width, canvas.height);
    const colour = ([x, y, radius], part, angle) => {
        const across = Math.round(Number(left) + scale * (x + part * radius * Math.cos(angle)));
        const below = Math.round(Number(down) - scale * (y + part * radius * Math.sin(angle)));
        return [...data.slice(4 * (below * width + across), 4 * (below * width + across) + 4)].join();
    };
    const around = (disc, part) => [...Array(24).keys()].map((k) => colour(disc, part, k * Math.PI / 12));
    return discs.map((disc) => [around(disc, 0.75), around(disc, 1.2)]);
}"""

MISSED = "paper/missed/pymunk/tuned"
LATE = "paper/late/pit/tuned"


def opened(page: Page, key: str) -> None:
    """Open a replay by its address, as a link that was sent."""
    page.evaluate("key => { location.hash = encodeURI(key); }", key)
    page.wait_for_function("key => document.querySelector('#replay[open] select')?.value === key", arg=key)


def clock(page: Page) -> float:
    """Return the time that is shown, seconds."""
    return float(page.locator(".timeline").get_attribute("data-time") or "nan")


def data_of(report: Path, scene: str) -> dict[str, Any]:
    """Return what the page holds of a scene."""
    source = report.read_text(encoding="utf-8")
    found = re.search(f'data-scene="{re.escape(scene)}">([^<]*)<', source)
    data: dict[str, Any] = json.loads(gzip.decompress(base64.b64decode(sure(found)[1])))
    return data


def test_every_replay_of_the_catalogue_plays_without_an_error(page: Page) -> None:
    """Each is opened, played, and walked through impact by impact to its end; the console stays empty."""
    keys = page.eval_on_selector_all("table.grid td a", "links => links.map(a => decodeURIComponent(a.hash.slice(1)))")
    assert len(keys) > 3 * 60  # 61 scenes and the hostile ones, three methods each, less what one can't do
    for key in keys:
        opened(page, key)
        page.keyboard.press("End")
        end = clock(page)
        page.keyboard.press("Home")
        assert clock(page) == 0.0
        page.keyboard.press("Shift+ArrowRight")
        page.keyboard.press("ArrowRight")
        assert 0.0 < clock(page) <= end


@pytest.mark.parametrize("scene", ["paper/late", "classics/head-on", "classics/oblique-3-4-5", "gravity/box"])
def test_discs_are_drawn_where_the_reference_has_them_at_an_impact(page: Page, report: Path, scene: str) -> None:
    """At the first impact, points inside each disc are of its colour, and points beyond its rim are not."""
    data = data_of(report, scene)
    opened(page, f"{scene}/pic/event-driven")
    page.keyboard.press("Home")
    page.keyboard.press("Shift+ArrowRight")
    when, first, second = data["impacts"][0]
    assert clock(page) == pytest.approx(when, abs=1e-12)
    discs = []
    for disc in (body for body in (first, second) if body >= 0):
        times, xs, ys = data["reference"][disc]
        knot = times.index(when)
        discs.append([xs[knot], ys[knot], data["discs"][disc][0]])
    for inside, outside in page.evaluate(PIXELS, discs):
        colour, times_seen = Counter(inside).most_common(1)[0]  # a path or a flag may be on a disc
        assert times_seen >= len(inside) / 2
        assert colour.split(",")[3] != "0"
        assert outside.count(colour) == 0


def test_play_pause_speed_frames_and_impacts(page: Page, report: Path) -> None:
    """Every control does what it says, by mouse and by keyboard."""
    opened(page, LATE)
    run = next(run for run in data_of(report, "paper/late")["runs"] if run["key"] == LATE)
    dialog = page.locator("#replay")
    assert dialog.get_by_role("button", name="Play or pause").inner_text() == "pause"
    before = clock(page)
    page.wait_for_function("before => Number(document.querySelector('.timeline').dataset.time) > before", arg=before)
    dialog.get_by_role("button", name="Play or pause").click()
    stopped = clock(page)
    page.wait_for_timeout(200)
    assert clock(page) == stopped
    page.keyboard.press("Home")
    dialog.get_by_role("button", name="Next frame").click()
    dialog.get_by_role("button", name="Next frame").click()
    dialog.get_by_role("button", name="Previous frame").click()
    assert clock(page) == pytest.approx(run["dt"], rel=1e-9)
    page.keyboard.press("Home")
    dialog.get_by_role("button", name="Next impact").click()
    assert clock(page) == pytest.approx(run["impacts"][0]["true"], rel=1e-12)
    dialog.get_by_role("button", name="Next impact").click()
    assert clock(page) == pytest.approx(run["impacts"][0]["reported"], rel=1e-12)
    dialog.get_by_role("button", name="Previous impact").click()
    assert clock(page) == pytest.approx(run["impacts"][0]["true"], rel=1e-12)
    chosen = dialog.get_by_label("Speed").input_value()
    page.keyboard.press("+")
    assert float(dialog.get_by_label("Speed").input_value()) == 2 * float(chosen)
    dialog.get_by_label("Speed").select_option("1")
    dialog.get_by_label("overlay both").check()
    assert page.locator(".views.over figure").first.is_hidden()
    dialog.get_by_label("Time in the scene").fill("0.25")
    assert clock(page) == 0.25


def test_both_pictures_are_in_sight_and_level(window: Window, report: Path) -> None:
    """Opened on a phone, both pictures and the line of time are in the window; side by side they are level."""
    for width, height in ((360, 740), (768, 900), (1280, 900)):
        page = window(report, width=width, height=height, reduced_motion="reduce")
        opened(page, "paper/multiple/pymunk/tuned")
        boxes = [one.bounding_box() for one in page.locator("#replay canvas").all()]
        truth, seen, line = (box for box in boxes if box)
        assert truth["y"] > 0
        assert line["y"] + line["height"] < height
        assert truth["y"] == seen["y"] or truth["x"] == seen["x"]


def test_the_evidence_of_a_cell_stands_below_it(page: Page) -> None:
    """A missed impact is in the table, with its cause; clicking it leads there; command and scene can be copied."""
    opened(page, MISSED)
    row = page.locator("table.impacts tbody tr")
    assert "missed" in row.inner_text()
    assert row.locator("td").last.inner_text() == "checking once per step"
    row.get_by_role("button").click()
    assert clock(page) == pytest.approx(0.425, abs=1e-3)
    page.get_by_text("Repeat this run").click()
    assert page.get_by_label("Command").input_value().startswith("carom run paper/missed -e pymunk -p tuned --dt 0.04")
    assert 'name = "paper/missed"' in page.get_by_label("Scene file").input_value()


def test_a_link_opens_a_cell_and_closing_takes_it_from_the_address(page: Page, report: Path) -> None:
    """An address with a cell shows it at once; Escape closes it, and gives the keyboard back to the page."""
    page.goto(f"{report.as_uri()}#{quote(MISSED)}")
    page.reload()
    page.wait_for_selector("#replay[open]")
    assert page.locator("#replay-title").inner_text() == "paper/missed"
    page.keyboard.press("Escape")
    page.wait_for_selector("#replay", state="hidden")
    assert page.evaluate("location.hash") == ""


def test_names_are_text_and_never_run(page: Page) -> None:
    """Markup, quotes and turned-round letters in a scene's name are shown as they are, and reach no script."""
    for name in HOSTILE:
        opened(page, f"{escape_controls(name)}/pit/tuned")
        assert page.locator("#replay-title").inner_text() == escape_controls(name)
    assert page.evaluate("window.reached") is None


def test_who_wants_no_motion_sees_none_until_asking(window: Window, report: Path) -> None:
    """With reduced motion a replay stands still at its start; its controls work."""
    page = window(report, reduced_motion="reduce")
    opened(page, LATE)
    page.wait_for_timeout(300)
    assert clock(page) == 0.0
    page.keyboard.press("ArrowRight")
    assert clock(page) > 0.0


def test_without_scripts_the_still_pictures_stand(window: Window, report: Path) -> None:
    """Where no script may run, the page shows its pictures and tables, and no empty window."""
    page = window(report, java_script_enabled=False)
    assert page.locator("figure.pair svg").count() >= 8
    assert page.locator("table.grid").is_visible()
    assert not page.locator("#replay").is_visible()


#: Whether the reference's picture shows another colour than the disc's along a ray from the centre, ray by ray.
RAYS = """([x, y, radius, rays]) => {
    const canvas = document.querySelector(".views canvas"), {scale, x: left, y: down} = canvas.dataset;
    const {data, width} = canvas.getContext("2d").getImageData(0, 0, canvas.width, canvas.height);
    return [...Array(rays).keys()].map((k) => {
        const angle = 2 * Math.PI * k / rays;
        const across = Math.round(Number(left) + scale * (x + 0.7 * radius * Math.cos(angle)));
        const below = Math.round(Number(down) - scale * (y + 0.7 * radius * Math.sin(angle)));
        return [...data.slice(4 * (below * width + across), 4 * (below * width + across) + 4)].join();
    });
}"""


@pytest.mark.parametrize("key", ["Shift+ArrowRight", "End"])
def test_two_light_quarters_of_a_disc_stand_where_it_has_turned_to(page: Page, report: Path, key: str) -> None:
    """It has turned by 6 rad/s up to the impact, at the origin, and by 4 rad/s since, going down at 1 m/s."""
    data = data_of(report, "spin/english-stick")
    opened(page, "spin/english-stick/pic/event-driven")
    rays, hit_s = 72, data["impacts"][0][0]
    page.keyboard.press("Home")
    page.keyboard.press(key)
    since = clock(page) - hit_s
    colours = page.evaluate(RAYS, [0.0, -since, 1.0, rays])
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


def test_it_holds_where_the_impact_is_missed_and_goes_on(page: Page, report: Path) -> None:
    """Played, the clock stops at the middle of the approach in overlap for a while, and ends at the end."""
    data = data_of(report, "paper/missed")
    opened(page, MISSED)
    run = next(run for run in data["runs"] if run["key"] == MISSED)
    row = run["impacts"][run["fault"]["row"]]
    assert row["flag"] == "missed"
    moment = row["true"] + data["meetings"][row["at"]][2] / 2
    page.keyboard.press("Home")
    page.keyboard.press(" ")
    seen = page.evaluate(HELD)
    assert seen[-1] == pytest.approx(moment, rel=1e-5)
    page.wait_for_function(
        "moment => Number(document.querySelector('.timeline').dataset.time) > moment * 1.01", arg=moment
    )


def test_what_is_off_is_said_and_each_sign_explained(page: Page, report: Path) -> None:
    """The sentence of the first failure is below the signs, as Python words it; a command leads to throwing it."""
    opened(page, MISSED)
    run = next(run for run in data_of(report, "paper/missed")["runs"] if run["key"] == MISSED)
    assert page.locator(".fault").inner_text() == run["fault"]["said"]
    signs = page.locator(".signs span").all_inner_texts()
    assert len(signs) == len(set(signs)) == 6
    page.get_by_text("Repeat this run").click()
    assert page.get_by_label("To drag this scene, save it as scene.toml").count() == 0  # there is a link


def test_a_replay_leads_to_the_page_on_which_its_discs_are_thrown(page: Page) -> None:
    """The link opens the page next to the report with that scene, without a request."""
    opened(page, MISSED)
    link = page.locator("#replay a", has_text="Open this scene")
    assert link.get_attribute("href") == "play.html#paper%2Fmissed"
    link.click()
    page.wait_for_selector("#sentence:not(:empty)")
    scene = page.evaluate("caromPage.state.scene")
    assert [disc["radius_m"] for disc in scene["discs"]] == [0.25, 0.25]
    assert page.locator("#problem").inner_text() == ""


def test_every_scene_that_a_report_links_to_is_taken_or_refused_by_name(page: Page, report: Path) -> None:
    """Scenes with numbers that the page does not take, the hostile ones among them, say which; no script fails."""
    page.goto((report.parent / "play.html").as_uri())
    page.wait_for_selector("#sentence:not(:empty)")
    names = page.evaluate("[...document.querySelectorAll('select option')].map((o) => o.value).filter(Boolean)")
    said = [
        page.evaluate(
            """name => {
                const has = (select) => [...select.options].some((option) => option.value === name);
                const select = [...document.querySelectorAll("select")].find(has);
                select.value = name;
                select.dispatchEvent(new Event("change"));
                return document.getElementById("problem").textContent;
            }""",
            name,
        )
        for name in names
        if "/" in name
    ]
    assert len(said) > 40
    assert sum(not text for text in said) > 30


#: The smallest target of a finger by WCAG 2.2 (2.5.8, level AA), pixels.
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
    for name in ("Next frame", "Previous frame", *2 * ("Next impact",), "Previous impact"):
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
    """The slider's knob does so, too."""
    times = drag(phone, phone.get_by_label("Time in the scene"), 0.3, 0.9)
    assert times[0] < times[5] < times[-1]
