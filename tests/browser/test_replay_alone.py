"""A replay by itself: as a saved page, and as the cell of a notebook."""

import math
from collections import Counter
from pathlib import Path

import pytest
from tests.browser.conftest import Window, hostile_scenes
from tests.scene_builders import require_value

import carom
from carom.catalogue import find_scenes
from carom.support.escaping import escape_controls

pytestmark = pytest.mark.browser


@pytest.mark.parametrize("width", [390, 500, 720, 1280])
@pytest.mark.parametrize("name", ["paper/missed", "paper/multiple", "classics/bullet"])
def test_replay_fits_the_frame_of_a_notebook_cell(window: Window, tmp_path: Path, name: str, width: int) -> None:
    """A notebook replay is visible without scrolling, with pictures side by side above 500 pixels."""
    cell = carom.replay(carom.solve_pic(name), carom.solve_pit(name))._repr_html_()
    path = tmp_path / "cell.html"
    path.write_text(f"<!DOCTYPE html><meta charset=utf-8><body style='margin:16px'>{cell}", encoding="utf-8")
    page = window(path, width=width, height=800)
    page.frame_locator("iframe").get_by_role("button", name="Play or pause").wait_for()
    inside = page.frames[-1]
    moving = ".views figure, .timeline, button[aria-label='Next impact']"
    below = f'[...document.querySelectorAll("{moving}")].map(one => one.getBoundingClientRect().bottom)'
    ends = inside.evaluate(below)
    assert len(ends) == 4
    assert max(ends) <= inside.evaluate("window.innerHeight")
    assert inside.evaluate("document.documentElement.scrollWidth <= window.innerWidth")
    tops = inside.evaluate(
        "[...document.querySelectorAll('.views figure')].map(one => one.getBoundingClientRect().top)"
    )
    assert (len(set(tops)) == 1) == (width > 500)


@pytest.mark.parametrize("number", range(4))
@pytest.mark.parametrize("cell", [False, True], ids=["page", "cell"])
def test_saved_replay_works_under_hostile_names(window: Window, tmp_path: Path, number: int, cell: bool) -> None:
    """A replay steps to its first impact as a file and in an isolated frame, and its name is shown as text."""
    scene = hostile_scenes()[number]
    reference = carom.solve_pic(scene)
    replay = carom.replay(reference, carom.solve_pit(scene))
    path = replay.save(tmp_path / "replay.html")
    if cell:
        path.write_text(f"<!DOCTYPE html><meta charset=utf-8>{replay._repr_html_()}", encoding="utf-8")
    page = window(path, width=1000, height=800)
    inside = page.frame_locator("iframe") if cell else page
    inside.get_by_role("button", name="Play or pause").wait_for()
    inside.get_by_role("slider", name="Time in the scene").press("Home")
    inside.get_by_role("button", name="Next impact").click()
    shown = float(inside.locator(".timeline").get_attribute("data-time") or "nan")
    assert shown == pytest.approx(reference.impacts["time_s"][0], abs=1e-9)
    assert inside.locator("h1").text_content() == escape_controls(scene.name)
    frame = page.frames[-1]
    assert frame.evaluate("window.reached") is None
    assert frame.evaluate("window.frameElement === null")  # a frame that shares nothing with its notebook can't see it


_RED = """() => [...document.querySelectorAll('.views canvas')].map(one => {
  const probe = document.createElement('canvas').getContext('2d');
  probe.fillStyle = getComputedStyle(one).getPropertyValue('--wrong-bar').trim();
  probe.fillRect(0, 0, 1, 1);
  const red = probe.getImageData(0, 0, 1, 1).data;
  const all = one.getContext('2d').getImageData(0, 0, one.width, one.height).data;
  let count = 0;
  for (let k = 0; k < all.length; k += 4) count += [0, 1, 2, 3].every(j => all[k + j] === red[j]);
  return count;
})"""


def test_missed_impact_stays_marked_at_the_end(window: Window, tmp_path: Path) -> None:
    """At the end of the run the missed impact is marked in PIT's picture and not in the exact one."""
    path = carom.replay(carom.solve_pic("paper/missed"), carom.solve_pit("paper/missed")).save(tmp_path / "replay.html")
    page = window(path, width=1000, height=800, watched=False)  # Chromium warns of who reads pixels
    time = page.get_by_role("slider", name="Time in the scene")
    time.press("Home")
    before = page.evaluate(_RED)
    time.press("End")
    after = page.evaluate(_RED)
    page.screenshot(path=tmp_path / "end.png")
    assert sorted(after)[0] == 0 < sorted(after)[1]
    assert before == [0, 0]


def test_replay_shows_pictures_without_scripts(window: Window, tmp_path: Path) -> None:
    """With JavaScript off a replay shows the paths of both runs as pictures, and the verdict."""
    path = carom.replay("paper/missed", "pit").save(tmp_path / "replay.html")
    page = window(path, width=360, height=740, java_script_enabled=False)
    assert [svg.bounding_box()["width"] > 200 for svg in page.locator("noscript svg").all()] == [True, True]  # type: ignore[index]
    assert "missed" in page.locator("noscript").inner_text()
    assert page.evaluate("document.documentElement.scrollWidth") <= 360


def test_strip_shows_the_contact_modes_of_a_disc(window: Window, tmp_path: Path) -> None:
    """The strip labels a disc's modes "slides" and "rolls", each as wide as it lasts."""
    scene = find_scenes(["contact/slide-to-roll"])[0].scene
    trace = carom.solve_pic(scene)
    path = carom.replay(trace, carom.solve_pit(scene)).save(tmp_path / "replay.html")
    spans = window(path, reduced_motion="reduce").locator(".modes .strip span")
    assert spans.all_inner_texts() == ["slides", "rolls"]
    slides, rolls = (span.bounding_box() for span in spans.all())
    part = require_value(trace.modes)["time_s"][1] / scene.duration_s
    assert require_value(slides)["width"] / (
        require_value(slides)["width"] + require_value(rolls)["width"]
    ) == pytest.approx(part, abs=0.02)


@pytest.mark.parametrize("name", ["paper/missed", "paper/late", "classics/inelastic-oblique", "classics/bullet"])
def test_step_slider_shows_the_result_of_solve_pit(window: Window, tmp_path: Path, name: str) -> None:
    """At forty steps the replay finds or misses the impact like `carom.solve_pit`, at the same time."""
    scene = find_scenes([name])[0].scene
    path = carom.replay(carom.solve_pic(scene), carom.solve_pit(scene)).save(tmp_path / "replay.html")
    page = window(path, reduced_motion="reduce")
    step = page.locator("input[aria-label='Step of PIT']")
    # Away from the ends: a twentieth of a frame of paper/missed is a tie, a look at the very instant of the impact.
    low, high = (float(step.get_attribute(name) or "nan") for name in ("min", "max"))
    found = Counter[int]()
    for k in range(40):
        step.evaluate(
            "(s, v) => { s.value = v; s.dispatchEvent(new Event('input')); }", low + (high - low) * (k + 0.5) / 40
        )
        impacts = carom.solve_pit(scene, frame_rate_hz=1.0 / math.exp(float(step.input_value()))).impacts
        said = page.locator(".fault").inner_text()
        found[len(impacts)] += 1
        if len(impacts):
            (impact,) = impacts
            assert float(page.locator(".timeline").get_attribute("data-time") or "nan") == pytest.approx(
                impact["time_s"]
            )
            assert "ms late" in said
        else:
            assert said.endswith("missed.")
    assert found[1] >= 5
    assert found[0] >= 5 or name != "paper/missed"
