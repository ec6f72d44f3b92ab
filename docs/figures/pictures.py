"""Pictures of the README and of docs/play.md, taken in Chromium by `make pictures`.

The pictures show the first screen of the sample report, a replay (animated), and the play page, each in light and dark
colours.
"""

from __future__ import annotations

import io
import shutil
import tempfile
from pathlib import Path
from typing import TYPE_CHECKING, Literal

from PIL import Image
from playwright.sync_api import sync_playwright

from carom.catalogue import find_scenes
from carom.web.page import GALLERY, render_page

if TYPE_CHECKING:
    from playwright.sync_api import Browser, Page

PAGE = Path(__file__).resolve().parents[2] / "reports" / "sample" / "index.html"
FOLDER = Path(__file__).resolve().parent
Scheme = Literal["light", "dark"]
SCHEMES: tuple[Scheme, Scheme] = ("light", "dark")

REPLAY = "paper/missed/pymunk/tuned"
#: Number of pictures of the replay, their total duration, and the duration of the last picture, in seconds.
_FRAMES, _LASTS_S, _LAST_S = 40, 5.0, 1.5
#: Fraction of the duration of paper/missed: at this time the discs have just met.
_AT = 0.46


def first_screen(scheme: Scheme) -> Path:
    """Return the path of the picture of the sample report's first screen."""
    return FOLDER / f"page-{scheme}.webp"


def replay(scheme: Scheme) -> Path:
    """Return the path of the animated picture of the replay."""
    return FOLDER / f"replay-{scheme}.webp"


def thrown(name: str) -> Path:
    """Return the path of a picture of the play page."""
    return FOLDER / f"throw-{name}.webp"


def _opened(browser: Browser, scheme: Scheme, width: int, height: int, key: str = "") -> Page:
    page = browser.new_page(viewport={"width": width, "height": height}, color_scheme=scheme, reduced_motion="reduce")
    page.goto(PAGE.as_uri() + (f"#{key}" if key else ""))
    return page


def _taken(page: Page, clip: dict[str, float] | None = None) -> Image.Image:
    shot = page.screenshot(clip=clip) if clip else page.screenshot()  # type: ignore[arg-type]
    return Image.open(io.BytesIO(shot)).convert("RGB")


def take_first_screen(browser: Browser, scheme: Scheme) -> None:
    """Write the picture of the sample report's first screen."""
    page = _opened(browser, scheme, 1280, 900)
    _taken(page).save(first_screen(scheme), quality=58, method=6)
    page.close()


def take_replay(browser: Browser, scheme: Scheme) -> None:
    """Write the animated picture of the replay, with both halves and the time line, at evenly spaced times."""
    page = _opened(browser, scheme, 900, 700, REPLAY)
    page.wait_for_selector("#replay[open] .views canvas")
    scrubber = page.get_by_label("Time in the scene")
    last = float(scrubber.get_attribute("max") or "nan")
    boxes = [page.locator(f"#replay {part}").bounding_box() for part in (".views", ".timeline")]
    assert all(boxes)  # noqa: S101 - both are on the page
    left, top = min(box["x"] for box in boxes), min(box["y"] for box in boxes)
    right, bottom = (max(box[a] + box[b] for box in boxes) for a, b in (("x", "width"), ("y", "height")))
    clip = {"x": left, "y": top, "width": right - left, "height": bottom - top}
    frames = []
    for k in range(_FRAMES):
        scrubber.fill(str(last * k / (_FRAMES - 1)))
        frames.append(_taken(page, clip))
    each = round(1000 * _LASTS_S / _FRAMES)
    times = [each] * (_FRAMES - 1) + [round(1000 * _LAST_S)]
    frames[0].save(
        replay(scheme), save_all=True, append_images=frames[1:], duration=times, loop=0, quality=45, method=6
    )
    page.close()


def take_thrown(browser: Browser, scheme: Scheme) -> None:
    """Write the picture of the play page just after the impact, and in light colours also one with a found impact."""
    with tempfile.TemporaryDirectory() as folder:
        file = Path(folder) / "throw.html"
        file.write_text(render_page([one.scene for name in GALLERY for one in find_scenes([name])]), encoding="utf-8")
        page = browser.new_page(viewport={"width": 900, "height": 760}, color_scheme=scheme, reduced_motion="reduce")
        page.goto(file.as_uri())
        page.wait_for_selector("#sentence:not(:empty)")
        slide = "(e, v) => { e.value = v; e.dispatchEvent(new Event('input', { bubbles: true })); }"
        page.get_by_label("time", exact=True).evaluate(slide, _AT)
        _taken(page).save(thrown(scheme), quality=18, method=6)
        if scheme == "light":
            page.get_by_label("frame offset", exact=True).evaluate(slide, 0.5)
            _taken(page).save(thrown("found"), quality=18, method=6)
        page.close()


if __name__ == "__main__":
    chromium = shutil.which("chromium") or shutil.which("chromium-browser") or shutil.which("google-chrome")
    with sync_playwright() as playwright:
        browser = playwright.chromium.launch(executable_path=chromium, args=["--no-sandbox", "--disable-gpu"])
        for scheme in SCHEMES:
            take_first_screen(browser, scheme)
            take_replay(browser, scheme)
            take_thrown(browser, scheme)
        browser.close()
