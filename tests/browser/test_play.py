"""The page of `carom play`: discs under mouse, keys and fingers, links, files, and the numbers of engines."""

import base64
import json
import math
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from docs.figures import walkthrough
from playwright.sync_api import Browser, Page
from tests.browser.conftest import Window
from tests.scene_builders import disc_at, drive_on_legs, require_value, staged, wall_at

import carom
from carom.catalogue import all_scenes
from carom.web.installed_engines import load_page_engines
from carom.web.packages import PACKAGES
from carom.web.page import GALLERY, render_page

pytestmark = pytest.mark.browser
#: Scenes of two discs that do not spin, in which what an engine does is one contact.
_PAIRS = ("paper/missed", "paper/late", "paper/wrong-direction", "classics/graze", "gravity/falling-pair")


#: Walls of every kind, with all that a wall can have.
_EVERY = staged(
    "every kind",
    disc_at(0.0, 1.0, 0.7, r=0.25),
    disc_at(-1.5, 1.0, r=0.25, m=math.inf, driven=True, **drive_on_legs((0.0, (0.5, 0.0)), (1.0, (-0.5, 0.0)))),
    carom.Chain(points_m=[(-3, -1), (3, -1), (3, 2)], bulges=[0.125, 0.0], half_width_m=0.05, restitution=0.5),
    carom.Chain(points_m=[(1, 2), (2, 2), (1.5, 3)], closed=True, solid=True, friction=0.25),
    carom.Ring(centre_m=(0.0, 0.0), radius_m=0.125, velocity_m_s=(0.25, 0.0)),
    wall_at(0.0, -2.0, 0.0, 1.0, surface_speed_m_s=0.5),
    wall_at(-3.0, 0.0, 1.0, 0.0, **drive_on_legs((0.0, (0.0, 0.0)), (0.5, (0.3, 0.0)))),
    wall_friction=0.1,
    wall_rolling_resistance=0.01,
    gravity_m_s2=(0.0, -2.0),
    duration_s=3.0,
)


#: With friction and spin.
_DAMPED = "contact/damped-slide"


@pytest.fixture(scope="module")
def play_page(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The page without engines."""
    path = tmp_path_factory.mktemp("play") / "play.html"
    scenes = [all_scenes()[name].scene for name in (*GALLERY, _DAMPED)]
    path.write_text(render_page([*scenes, _EVERY]), encoding="utf-8")
    return path


@pytest.fixture
def open_page(window: Window) -> Window:
    """Open the page, and wait for its first sentence."""

    def show(path: Path, link: str = "", **options: Any) -> Page:
        page = window(path, link, **options)
        page.wait_for_selector("#sentence:not(:empty)")
        return page

    return show


def _state(page: Page, what: str = "scene") -> Any:
    return json.loads(page.evaluate(f"JSON.stringify(caromPage.state.{what})"))


def _drag(page: Page, spot: list[float], by: tuple[float, float]) -> None:
    page.mouse.move(*spot)
    page.mouse.down()
    page.mouse.move(spot[0] + by[0], spot[1] + by[1], steps=4)
    page.mouse.up()


def _settle(page: Page) -> None:
    """Wait until the page has done what it put off: its timers come in the order of their times, however late."""
    page.evaluate("new Promise((done) => setTimeout(done, 500))")


def _choose(page: Page, method: str) -> None:
    """Choose a method, and wait until its engine is there and has run the scene."""
    page.select_option("#method", method)
    page.wait_for_function("m => caromPage.state.method === m && (m === 'pit' || caromPage.state.World)", arg=method)


def _set_slider(page: Page, label: str, value: float) -> None:
    page.get_by_label(label, exact=True).evaluate(
        "(e, v) => { e.value = v; e.dispatchEvent(new Event('input', { bubbles: true })); }", value
    )


def test_mouse_drags_a_disc_and_its_velocity(play_page: Path, open_page: Window) -> None:
    """Dragging the centre moves a disc, and the arrow's head changes its velocity; the result follows."""
    page = open_page(play_page)
    before, said = _state(page)["discs"][1], page.inner_text(".says")
    _drag(page, page.evaluate("caromPage.spot(1)"), (0, -30))
    moved = _state(page)["discs"][1]
    assert moved["position_m"][1] > before["position_m"][1]
    assert moved["velocity_m_s"] == before["velocity_m_s"]
    _drag(page, page.evaluate("caromPage.spot(1, 'head')"), (-25, 0))
    thrown = _state(page)["discs"][1]
    assert thrown["velocity_m_s"][0] < moved["velocity_m_s"][0]
    assert thrown["position_m"] == moved["position_m"]
    assert page.inner_text(".says") != said


def test_disc_cannot_be_dragged_into_another(play_page: Path, open_page: Window) -> None:
    """A disc that is dragged onto another one does not overlap it at the start."""
    page = open_page(play_page)
    spots = [page.evaluate(f"caromPage.spot({i})") for i in range(2)]
    _drag(page, spots[1], (spots[0][0] - spots[1][0], spots[0][1] - spots[1][1]))
    first, second = _state(page)["discs"]
    assert math.dist(first["position_m"], second["position_m"]) >= first["radius_m"] + second["radius_m"]


def test_keys_change_position_and_velocity(play_page: Path, open_page: Window) -> None:
    """A number key selects a disc, arrow keys move it, Ctrl changes its velocity, and Shift moves finely."""
    page = open_page(play_page)
    before = _state(page)["discs"][1]
    page.locator("canvas").first.focus()
    page.keyboard.press("1")
    page.keyboard.press("ArrowUp")
    up = _state(page)["discs"][1]["position_m"][1] - before["position_m"][1]
    page.keyboard.press("Shift+ArrowUp")
    finely = _state(page)["discs"][1]["position_m"][1] - before["position_m"][1] - up
    assert up == pytest.approx(before["radius_m"] / 5)
    assert finely == pytest.approx(up / 10)
    page.keyboard.press("Control+ArrowLeft")
    assert _state(page)["discs"][1]["velocity_m_s"][0] < before["velocity_m_s"][0]
    assert page.locator("canvas").first.get_attribute("aria-label")


@pytest.mark.parametrize("on_disc", [True, False])
def test_swipe_scrolls_unless_it_starts_on_a_disc(play_page: Path, open_page: Window, on_disc: bool) -> None:
    """A swipe next to the discs scrolls the page; a swipe that starts on a disc moves the disc and not the page."""
    page = open_page(play_page, width=360, height=640, has_touch=True, is_mobile=True)
    x, y = page.evaluate("caromPage.spot(0)")
    box = require_value(page.locator("canvas").first.bounding_box())
    start = (x, y) if on_disc else (box["x"] + box["width"] / 2, box["y"] + 10)
    before = page.evaluate(discs := "JSON.stringify(caromPage.state.scene.discs)")
    client = page.context.new_cdp_session(page)
    client.send("Input.dispatchTouchEvent", {"type": "touchStart", "touchPoints": [{"x": start[0], "y": start[1]}]})
    for step in range(1, 9):
        point = {"x": start[0], "y": start[1] - 12 * step}
        client.send("Input.dispatchTouchEvent", {"type": "touchMove", "touchPoints": [point]})
    client.send("Input.dispatchTouchEvent", {"type": "touchEnd", "touchPoints": []})
    page.wait_for_function(f"before => {discs} !== before" if on_disc else "scrollY > 0", arg=before)
    _settle(page)  # time for the other one, which must not happen
    assert (page.evaluate("scrollY") > 0) == (not on_disc)
    assert (page.evaluate(discs) != before) == on_disc


def test_clock_plays_pauses_and_is_set(play_page: Path, open_page: Window) -> None:
    """The clock plays at once unless reduced motion is preferred, the button pauses it, and the slider sets it."""
    page = open_page(play_page)
    assert page.inner_text("#run") == "pause"
    page.click("#run")
    _set_slider(page, "time", 0.5)
    assert _state(page, "time") == 0.5 * _state(page)["duration_s"]
    page.select_option("#speed", index=3)
    assert open_page(play_page, reduced_motion="reduce").inner_text("#run") == "play"


@pytest.mark.parametrize("name", ["spin/throw-stick", "every kind", _DAMPED])
def test_link_restores_a_changed_scene_to_the_bit(name: str, play_page: Path, open_page: Window) -> None:
    """Opening the link of a changed scene restores the scene and its impacts, to the bit."""
    page = open_page(play_page, f"#{name}")
    _set_slider(page, "frame offset", 0.137)
    _drag(page, page.evaluate("caromPage.spot(0)"), (-7, 3))
    _settle(page)
    link = page.evaluate("location.hash")
    assert link.startswith("#2=")
    other = open_page(play_page, link)
    for what in ("scene", "truth.impacts", "seen.impacts"):
        assert _state(other, what) == _state(page, what)


def test_link_of_version_1_is_still_read(play_page: Path, open_page: Window) -> None:
    """A link of format version 1, whose half-planes are four numbers each, is read."""
    page = open_page(play_page, _encode_link([[_DISC], [[1, 0, -1, 0]], *_REST[1:]], version=1))
    assert _state(page, "scene.walls") == [{"point_m": [1, 0], "normal": [-1, 0]}]
    assert _state(page, "truth.impacts.length") == 1


def _encode_link(values: Any, version: int = 2) -> str:
    return f"#{version}=" + base64.urlsafe_b64encode(json.dumps(values).encode()).decode().rstrip("=")


_DISC = [0, 0, 1, 0, 0.25, 1, 0, 0.5]
_REST = [[], [1, 1, 0, 0, 0, 0], [0, 0], 1, 24, 0, "pit"]
HOSTILE = {
    "text": [[["<img src=x onerror=window.reached=1>", *_DISC[1:]]], *_REST],
    "range": [[[1e300, *_DISC[1:]]], *_REST],
    "many": [[_DISC] * 11, *_REST],
    "endless": [[_DISC], [], _REST[1], [0, 0], 1e9, *_REST[4:]],
    "fast": [[_DISC], [], _REST[1], [0, 0], 1, 1e9, 0, "pit"],
    "wall": [[_DISC], [[0, -1, 0, 0]], *_REST[1:]],
    "no edge": [[_DISC], [[None, None, [[1, 1], [1, 1]], *[None] * 9]], *_REST[1:]],
    "short": [[_DISC]],
}


@pytest.mark.parametrize("case", [*HOSTILE, "version", "noise"])
def test_invalid_link_is_refused(case: str, play_page: Path, open_page: Window) -> None:
    """A link with invalid numbers is refused with a message; nothing in it runs, and the first scene shows."""
    link = {"version": "#3=W10", "noise": "#2=%00<b>"}.get(case) or _encode_link(HOSTILE[case])
    page = open_page(play_page, link)
    assert "does not contain a valid scene" in page.inner_text("#problem")
    assert page.evaluate("window.reached") is None
    assert _state(page)["discs"][0]["position_m"] == list(all_scenes()[GALLERY[0]].scene.discs[0].position_m)


@pytest.mark.parametrize(
    ("name", "phase"),
    [(name, phase) for name in ("paper/multiple", "every kind") for phase in (0, 0.3)] + [(_DAMPED, 0.3)],
)
def test_downloaded_scene_reproduces_the_impacts_of_the_page(
    name: str, phase: float, play_page: Path, open_page: Window, tmp_path: Path
) -> None:
    """The downloaded scene file loads, and PIC and PIT find in it the impacts of the page."""
    page = open_page(play_page, f"#{name}", accept_downloads=True)
    if name == "paper/multiple":
        page.check("#gravity")
    _set_slider(page, "frame offset", phase)
    with page.expect_download() as download:
        page.click("#save")
    download.value.save_as(tmp_path / "scene.toml")
    scene = carom.load_scene(tmp_path / "scene.toml")
    early = phase / _state(page)["frame_rate_hz"]
    for what, trace in (("truth", carom.solve_pic(scene)), ("seen", carom.solve_pit(scene))):
        times = _state(page, f"{what}.impacts.map((r) => r.time_s)")
        assert times
        # with a phase the start is advanced, once rounded
        assert trace.impacts["time_s"].tolist() == pytest.approx([t - early for t in times], abs=1e-9 if phase else 0)


def test_page_fits_a_phone_and_has_a_strict_policy(play_page: Path, open_page: Window) -> None:
    """At 360 pixels nothing is too wide; scripts are allowed by hash alone, and the page works without them."""
    for scheme in ("light", "dark"):
        page = open_page(play_page, width=360, height=740, color_scheme=scheme)
        assert page.evaluate("document.documentElement.scrollWidth") <= 360
    text = play_page.read_text(encoding="utf-8")
    assert "<noscript>" in text
    assert "'unsafe-eval'" not in text
    assert "script-src 'sha256-" in text


def test_altered_script_does_not_run(play_page: Path, browser: Browser, tmp_path: Path) -> None:
    """The security policy lists the page's scripts by hash, so a changed script does not run."""
    altered = tmp_path / "altered.html"
    text = play_page.read_text(encoding="utf-8")
    altered.write_text(text.replace("globalThis.caromUnpacked = ", "window.reached = 1; globalThis.caromUnpacked = "))
    page = browser.new_page()
    page.goto(altered.as_uri())
    assert page.evaluate("window.reached") is None
    assert page.locator("#sentence").count() == 0
    page.close()


@pytest.fixture(scope="module")
def engines_page(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The page with all the engines that it can have; skipped where `make engines` was not run."""
    engines = load_page_engines(PACKAGES, required=False)
    if len(engines) < len(PACKAGES):
        pytest.skip("the engines from npm are not installed: make engines")
    path = tmp_path_factory.mktemp("engines") / "play.html"
    scenes = dict.fromkeys((*GALLERY, *_PAIRS))
    path.write_text(render_page([all_scenes()[name].scene for name in scenes], engines), encoding="utf-8")
    return path


@pytest.mark.parametrize("name", PACKAGES)
def test_engine_impacts_in_the_page_equal_carom_run(name: str, engines_page: Path, open_page: Window) -> None:
    """Reported and effective impact times in the page equal those of `carom.run` for the same steps."""
    page = open_page(engines_page)
    page.evaluate("console.warn = () => {}")
    known = 0
    for scene in _PAIRS:
        page.evaluate("(scene) => { location.hash = scene; }", scene)
        page.wait_for_function("scene => document.querySelector('#scene').value === scene", arg=scene)
        _choose(page, f"{name}/default")
        trace = carom.run(scene, name, profile="default")
        found = _state(page, "seen.impacts.map((r) => [r.time_s, r.effective_s])")
        assert [time for time, _ in found] == pytest.approx(trace.impacts["time_s"].tolist(), abs=1e-12)
        instants = [math.nan if time is None else time for _, time in found]
        assert instants == pytest.approx(require_value(trace.effective_time_s).tolist(), abs=1e-9, nan_ok=True)
        known += sum(map(math.isfinite, instants))
    assert known > 0


def _wait_for_chart(page: Page, method: str) -> Any:
    """Return the chart of the present scene, when it is complete."""
    page.wait_for_function("(method) => caromPage.state.chart?.[method] != null", arg=method)
    return _state(page, "chart")


def test_chart_shows_pit_and_the_chosen_engine(engines_page: Path, open_page: Window) -> None:
    """The chart's misses of PIT follow the closed form, and the chosen engine has a point at each of 49 rates."""
    page = open_page(engines_page, "#paper/missed")
    page.select_option("#method", "planck/default")
    chart = _wait_for_chart(page, "planck/default")
    scene = all_scenes()["paper/missed"].scene
    (impact,) = carom.solve_pic(scene).impacts
    between = np.subtract(impact["velocity_second_before"], impact["velocity_first_before"])
    reach = scene.discs[0].radius_m + scene.discs[1].radius_m
    approach = abs(between @ impact["normal"]) * reach / (between @ between)
    for place, missed, _ in chart["pit"]:
        rate = page.evaluate("(v) => Math.round(10 * 5 * 200 ** v) / 10", place)
        assert missed == pytest.approx(max(0.0, 1.0 - approach * rate), abs=1 / 8)
    engine = [error for _, _, error in chart["planck/default"] if error is not None]
    assert len(chart["planck/default"]) == len(chart["pit"]) == 49
    assert engine
    assert all(map(math.isfinite, engine))


def test_engine_without_friction_does_not_run_rough_scenes(engines_page: Path, open_page: Window) -> None:
    """A scene with friction is not run by an engine without friction, and the page says so."""
    page = open_page(engines_page, "#spin/throw-stick")
    _choose(page, "matter/default")
    assert "has no friction here" in page.inner_text("#sentence")
    assert page.evaluate("caromPage.state.seen") is None


def test_every_method_runs_when_chosen(engines_page: Path, open_page: Window) -> None:
    """Each method of the list runs when chosen, and the page with two engines is smaller than 200 kB."""
    page = open_page(engines_page)
    page.evaluate("console.warn = () => {}")
    options = page.locator("#method option").all()
    for value in [option.get_attribute("value") for option in options]:
        _choose(page, require_value(value))
        assert page.inner_text("#problem") == ""
        assert _state(page, "seen.tracks.length") == len(_state(page)["discs"])
    small = render_page(
        [all_scenes()[name].scene for name in GALLERY], load_page_engines(("matter", "planck"), required=True)
    )
    assert len(small.encode()) < 200_000


def test_walkthrough_matches_the_page(browser: Browser) -> None:
    """The numbers and sentences of the documented first steps are the page's, and their pictures exist."""
    text = walkthrough.DOCUMENT.read_text(encoding="utf-8")
    assert walkthrough.told(browser) == text.partition(walkthrough.BEGIN)[2].partition(walkthrough.END)[0]
    assert all(walkthrough.picture(name).is_file() for name in ("missed", "found"))
