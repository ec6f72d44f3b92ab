"""Writes the section "A first try" of docs/play.md, for readers who do not know PIT.

`make pictures` carries out these steps in Chromium, and writes text and pictures. tests/browser/test_play.py repeats
the steps, and asserts that the page still shows the same text.
"""

from __future__ import annotations

import io
import shutil
import tempfile
from collections.abc import Iterator
from pathlib import Path
from typing import TYPE_CHECKING

from PIL import Image
from playwright.sync_api import sync_playwright

from carom.catalogue import find_scenes
from carom.web.page import GALLERY, render_page

if TYPE_CHECKING:
    from playwright.sync_api import Browser, Page

FOLDER = Path(__file__).resolve().parent
DOCUMENT = FOLDER.parent / "play.md"
BEGIN, END = "<!-- made by docs/figures/walkthrough.py -->\n", "<!-- end -->"
_SLIDE = "(e, v) => { e.value = v; e.dispatchEvent(new Event('input', { bubbles: true })); }"
#: Positions of the slider of frames per second (0 to 1); drag of a disc, in pixels; and step of the frame offset.
_OFTENER, _OFTEN, _UP, _PHASE = 0.4, 0.48, 4, 0.1


def picture(name: str) -> Path:
    """Return the path of a picture."""
    return FOLDER / f"first-try-{name}.webp"


def _slid(page: Page, label: str, value: float) -> None:
    page.get_by_label(label, exact=True).evaluate(_SLIDE, value)


def _read(page: Page) -> str:
    return f"*{page.inner_text('#sentence')}*"


def _shown(page: Page, label: str) -> str:
    control = page.get_by_label(label, exact=True)
    return str(control.evaluate("e => e.parentElement.querySelector('output').textContent"))


def _share(page: Page) -> str:
    return page.locator(".says > div", has_text="PIT misses the first impact at").locator("b").inner_text()


def steps(page: Page, taken: bool = False) -> Iterator[str]:
    """Do each step on the page, and yield its description. If `taken` is given, also write the two pictures."""
    yield (
        f"The page opens. Below the pictures the page says: {_read(page)} On the right the discs go through each "
        "other, and a cross marks the missed impact."
    )
    _slid(page, "frames per second", _OFTENER)
    yield (
        f"Set *frames per second* to {_shown(page, 'frames per second')}. The page says: {_read(page)} The time "
        f"between "
        "frames is now shorter than the overlap."
    )
    x, y = page.evaluate("caromPage.spot(1)")
    page.mouse.move(x, y)
    page.mouse.down()
    page.mouse.move(x, y - _UP)
    page.mouse.up()
    if taken:
        _picture(page, "missed")
    yield (
        f"Drag disc 1 up by {_UP} pixels, so that the discs touch only at their edges. The page says: {_read(page)} "
        "The overlap is now so short that no frame is in its first half. A box on the page shows that PIT "
        f"misses the impact at {_share(page)} of all frame offsets."
    )
    phase = 0.0
    while "misses the impact" in page.inner_text("#sentence"):
        phase = round(phase + _PHASE, 10)
        _slid(page, "frame offset", phase)
    found = f"The frame offset is then {_shown(page, 'frame offset')}. The page says: {_read(page)}"
    _slid(page, "frame offset", 0)
    yield (
        f"Increase *frame offset* in steps of {_PHASE} until PIT finds the impact. {found} Set *frame offset* back "
        f"to 0. "
        f"The page says: {_read(page)}"
    )
    _slid(page, "frames per second", _OFTEN)
    if taken:
        _picture(page, "found")
    yield (
        f"Set *frames per second* to {_shown(page, 'frames per second')}. The page says: {_read(page)} The box shows "
        f"{_share(page)}: PIT misses the impact at no frame offset, but still finds the impact late."
    )


def _picture(page: Page, name: str) -> None:
    page.get_by_label("time", exact=True).evaluate(_SLIDE, 0.5)
    shot = Image.open(io.BytesIO(page.screenshot())).convert("RGB")
    shot.save(picture(name), quality=25, method=6)


def told(browser: Browser, taken: bool = False) -> str:
    """Do the steps on the present page, and return them as a Markdown list."""
    with tempfile.TemporaryDirectory() as folder:
        file = Path(folder) / "throw.html"
        file.write_text(render_page([one.scene for name in GALLERY for one in find_scenes([name])]), encoding="utf-8")
        page = browser.new_page(viewport={"width": 900, "height": 760}, reduced_motion="reduce")
        page.goto(file.as_uri())
        page.wait_for_selector("#sentence:not(:empty)")
        lines = [f"{k}. {text}" for k, text in enumerate(steps(page, taken), 1)]
        page.close()
    lines[2] += "\n\n   ![The page after the discs have passed through each other](figures/first-try-missed.webp)"
    lines[4] += "\n\n   ![The page at more frames per second: PIT finds the impact late](figures/first-try-found.webp)"
    return "\n".join(lines) + "\n"


def write(browser: Browser) -> None:
    """Write the section of docs/play.md and its pictures."""
    text = DOCUMENT.read_text(encoding="utf-8")
    before, _, rest = text.partition(BEGIN)
    DOCUMENT.write_text(before + BEGIN + told(browser, taken=True) + END + rest.partition(END)[2], encoding="utf-8")


if __name__ == "__main__":
    chromium = shutil.which("chromium") or shutil.which("chromium-browser") or shutil.which("google-chrome")
    with sync_playwright() as playwright:
        browser = playwright.chromium.launch(executable_path=chromium, args=["--no-sandbox", "--disable-gpu"])
        write(browser)
        browser.close()
