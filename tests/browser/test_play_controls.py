"""Every control of the page of `carom play`, worked in Chromium and in Firefox; and what axe finds there."""

import json
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any, Literal, NamedTuple

import pytest
from tests.browser.conftest import A4_PX, Window, find_cut_off, find_violations
from tests.browser.test_play_in_firefox import Firefox, firefox  # noqa: F401 - a fixture
from tests.processes import PATIENT_S

from carom.catalogue import all_scenes
from carom.web.page import GALLERY, render_page

pytestmark = pytest.mark.browser


class Control(NamedTuple):
    """What a hand does to a control, and what of the page must have changed then, both as JavaScript."""

    act: str
    seen: str


def _slider(value: float, seen: str) -> Control:
    return Control(f"e.value = {value}; e.dispatchEvent(new Event('input', {{ bubbles: true }}))", seen)


def _select(value: str, seen: str) -> Control:
    return Control(f"e.value = '{value}'; e.dispatchEvent(new Event('change', {{ bubbles: true }}))", seen)


def _button(seen: str) -> Control:
    return Control("e.click()", seen)


_FIELDS = {
    "x": ("position_m[0]", -0.9),
    "y": ("position_m[1]", 0.05),
    "velocity x": ("velocity_m_s[0]", 0.5),
    "velocity y": ("velocity_m_s[1]", 0.75),
    "radius": ("radius_m", 0.125),
    "mass": ("mass_kg", 2.5),
    "spin": ("spin_rad_s", 1.5),
}
#: By its name, in the order in which they are worked. A control of the page that is not here fails the test.
CONTROLS = {
    "scene": _select("paper/late", "state.scene.discs"),
    "more": _button("state.scene.discs.length"),
    "fewer": _button("state.scene.discs.length"),
    "walls": _button("state.scene.walls"),
    "damping": _slider(0.5, "state.scene.damping_per_s"),
    "gravity": _button("[state.scene.gravity_m_s2, state.scene.damping_per_s]"),
    "frames per second": _slider(0.5, "state.scene.frame_rate_hz"),
    "frame offset": _slider(0.25, "state.scene.phase"),
    "restitution": _slider(0.5, "state.scene.restitution"),
    "friction": _slider(0.4, "state.scene.friction"),
    "method": _select("toy/default", "state.method"),
    "run": _button("state.playing"),
    "time": _slider(0.25, "state.time"),
    "speed": _select("1", "state.speed"),
    "copy": _button("[document.getElementById('copy').textContent, document.getElementById('problem').textContent]"),
    "save": _button("window.saved"),
    "Numbers of all discs": _button("document.querySelector('details').open"),
    "Exact run": Control(
        "e.focus(); e.dispatchEvent(new KeyboardEvent('keydown', { key: 'ArrowUp', bubbles: true }))",
        "state.scene.discs[0].position_m",
    ),
    **{
        f"disc {i}, {name}": _select(
            str(value * (1 - 2 * i) if name in {"x", "y"} else value), f"state.scene.discs[{i}].{field}"
        )
        for i in range(2)
        for name, (field, value) in _FIELDS.items()
    },
}
_LISTED = """() => JSON.stringify([...document.querySelectorAll(
  "#play :is(a, button, input, select, textarea, summary, [tabindex], [contenteditable])")].map(
  (e) => e.id || (e.getAttribute("aria-label") ?? e.textContent).split(":")[0]))"""
_FOUND = """[...document.querySelectorAll("#play *")].find(
  (e) => e.matches("a, button, input, select, textarea, summary, [tabindex]") &&
    (e.id || (e.getAttribute("aria-label") ?? e.textContent).split(":")[0]) === name)"""


def _write_page(tmp_path: Path) -> Path:
    """Write the page with an engine of eight lines, so that there is a second method to choose."""
    from carom.web.engine_script import PageEngine

    world = """caromEngines.toy.done(class {
      constructor(scene) { this.discs = scene.discs; }
      step() {}
      observe() {
        return {
          position_m: this.discs.map((d) => d.position_m),
          velocity_m_s: this.discs.map((d) => d.velocity_m_s),
          contacts: [],
        };
      }
    });"""
    toy = PageEngine("toy", "Toy", {"default": {}}, world, "of no licence")
    path = tmp_path / "play.html"
    path.write_text(render_page([all_scenes()[name].scene for name in GALLERY], [toy]), encoding="utf-8")
    return path


def _work_controls(run: Callable[[str], Any]) -> None:
    """Work each control, `run` evaluating JavaScript, and assert that the page followed."""
    run("window.saved = 0; const make = URL.createObjectURL; URL.createObjectURL = (b) => (window.saved++, make(b)); 0")
    assert sorted(json.loads(run(f"({_LISTED})()"))) == sorted(CONTROLS)
    for name, control in CONTROLS.items():
        seen = f"(() => {{ const state = caromPage.state; return JSON.stringify({control.seen}); }})()"
        before = run(seen)
        run(f"(() => {{ const name = {json.dumps(name)}; const e = {_FOUND}; {control.act}; }})()")
        until = time.monotonic() + PATIENT_S
        while run(seen) == before:
            assert time.monotonic() < until, f"{name} does nothing"
            time.sleep(0.05)


def test_every_control_works_in_chromium(window: Window, tmp_path: Path) -> None:
    """`CONTROLS` lists all controls of the play page, and each changes the page in Chromium."""
    page = window(_write_page(tmp_path))
    page.wait_for_selector("#sentence:not(:empty)")
    _work_controls(page.evaluate)


def test_every_control_works_in_firefox(firefox: Firefox, tmp_path: Path) -> None:  # noqa: F811 - the fixture
    """`CONTROLS` lists all controls, and each, as the mouse on a disc and its arrow, works in Firefox."""
    firefox.ask("WebDriver:Navigate", url=_write_page(tmp_path).as_uri())
    until = time.monotonic() + PATIENT_S
    while not firefox.run("() => document.getElementById('sentence')?.textContent ?? ''"):
        assert time.monotonic() < until, "the page does not start in Firefox"
        time.sleep(0.1)
    for where, moves in (("position_m", "position_m"), ("head", "velocity_m_s")):
        before = firefox.run(f"() => JSON.stringify(caromPage.state.scene.discs[1].{moves})")
        x, y = (round(part) for part in firefox.run(f"() => caromPage.spot(1, '{where}')"))
        steps = [
            {"type": "pointerMove", "x": x, "y": y, "duration": 0},
            {"type": "pointerDown", "button": 0},
            {"type": "pointerMove", "x": x + 5, "y": y - 25, "duration": 50},
            {"type": "pointerUp", "button": 0},
        ]
        mouse = {"type": "pointer", "id": "mouse", "parameters": {"pointerType": "mouse"}, "actions": steps}
        firefox.ask("WebDriver:PerformActions", actions=[mouse])
        assert firefox.run(f"() => JSON.stringify(caromPage.state.scene.discs[1].{moves})") != before
    _work_controls(lambda script: firefox.run(f"() => eval({json.dumps(script)})"))


@pytest.mark.parametrize("scheme", ["light", "dark"])
@pytest.mark.parametrize("width", [360, 1280])
def test_axe_finds_no_violation(window: Window, tmp_path: Path, scheme: Literal["light", "dark"], width: int) -> None:
    """`axe` finds no accessibility violation on a phone and on a screen, with the number fields open."""
    page = window(
        _write_page(tmp_path), width=width, height=800, color_scheme=scheme, reduced_motion="reduce", bypass_csp=True
    )
    page.wait_for_selector("#sentence:not(:empty)")
    page.click("summary")
    assert find_violations(page) == set()


def test_print_cuts_nothing_off(window: Window, tmp_path: Path) -> None:
    """Printed on A4 upright, no element of the play page is wider than the sheet."""
    page = window(_write_page(tmp_path), width=A4_PX, height=1000)
    page.wait_for_selector("#sentence:not(:empty)")
    assert find_cut_off(page, "#play *") == []
