"""Every control of the page of `carom play`."""

import json
import time
from pathlib import Path
from typing import NamedTuple

import pytest
from tests.browser.conftest import Window
from tests.processes import PATIENT_S

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


def test_every_control_changes_the_page(window: Window, toy_page: Path) -> None:
    """`CONTROLS` lists all controls of the play page, and each changes the page."""
    page = window(toy_page)
    page.wait_for_selector("#sentence:not(:empty)")
    run = page.evaluate
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
