"""Small pictures of PIT's runs of the scenes of `carom play`; `make pictures` writes these pictures."""

from __future__ import annotations

import io
import shutil
import tempfile
from pathlib import Path

from PIL import Image
from playwright.sync_api import sync_playwright

from carom.catalogue import find_scenes
from carom.web.page import GALLERY, render_page

FOLDER = Path(__file__).resolve().parent / "throw"
_WIDTH, _QUALITY = 240, 40
#: Displayed time divided by the time of the first impact. The picture shows the discs just after this impact.
_AFTER = 1.15


def picture(name: str) -> Path:
    """Return the path of a scene's picture."""
    return FOLDER / f"{name.replace('/', '-')}.webp"


def write() -> None:
    """Write the pictures."""
    FOLDER.mkdir(exist_ok=True)
    chromium = shutil.which("chromium") or shutil.which("chromium-browser") or shutil.which("google-chrome")
    with tempfile.TemporaryDirectory() as folder, sync_playwright() as playwright:
        file = Path(folder) / "throw.html"
        file.write_text(render_page([one.scene for name in GALLERY for one in find_scenes([name])]), encoding="utf-8")
        browser = playwright.chromium.launch(executable_path=chromium, args=["--no-sandbox", "--disable-gpu"])
        page = browser.new_page(viewport={"width": 1000, "height": 900}, reduced_motion="reduce")
        page.goto(file.as_uri())
        page.wait_for_selector("#sentence:not(:empty)")
        for name in GALLERY:
            page.select_option("#scene", name)
            page.get_by_label("time", exact=True).evaluate(
                """(e, after) => {
                  const { truth, scene } = caromPage.state;
                  e.value = Math.min(1, (after * truth.impacts[0].time_s) / scene.duration_s);
                  e.dispatchEvent(new Event("input", { bubbles: true }));
                }""",
                _AFTER,
            )
            shot = Image.open(io.BytesIO(page.locator("canvas").nth(1).screenshot())).convert("RGB")
            shot.thumbnail((_WIDTH, _WIDTH))
            shot.save(picture(name), quality=_QUALITY, method=6)
        browser.close()


if __name__ == "__main__":
    write()
