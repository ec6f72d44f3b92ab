"""Time until Chromium first shows a report's page, and the size of the page: ``python -m benchmarks.page``.

For each measurement, a new browser opens the file, as after a double click. The measured time is from the start of
loading to the browser's *first contentful paint*. For a replay, the time ends when the replay's pictures are drawn.
"""

from __future__ import annotations

import shutil
import statistics
from pathlib import Path

from benchmarks.arguments import count, parser, run

from carom.errors import InputError

SAMPLE = Path(__file__).resolve().parents[1] / "reports" / "sample" / "index.html"
_PAINT = "performance.getEntriesByName('first-contentful-paint')[0]?.startTime"
_REPLAY = "paper/missed/pymunk/tuned"


def main(page: Path, repeats: int) -> None:
    """Print the page's size, and the median and the worst of each time."""
    from playwright.sync_api import sync_playwright

    chromium = shutil.which("chromium") or shutil.which("chromium-browser") or shutil.which("google-chrome")
    if not page.is_file() or chromium is None:
        raise InputError(f"{page} can't be opened" if chromium else "there is no Chromium; install it")
    paints, replays = [], []
    with sync_playwright() as playwright:
        for _ in range(repeats):
            browser = playwright.chromium.launch(executable_path=chromium, args=["--no-sandbox", "--disable-gpu"])
            opened = browser.new_page(viewport={"width": 1280, "height": 900})
            opened.goto(page.resolve().as_uri())
            opened.wait_for_function(f"{_PAINT} !== undefined")
            paints.append(float(opened.evaluate(_PAINT)))
            before = float(opened.evaluate(f"location.hash = encodeURI('{_REPLAY}'), performance.now()"))
            opened.wait_for_selector("#replay[open] .timeline[data-time]")
            replays.append(float(opened.evaluate("performance.now()")) - before)
            browser.close()
    print(f"{page.stat().st_size / 1e6:.2f} MB")
    for name, times in (("first paint", paints), ("a replay", replays)):
        print(f"{name:<12} {statistics.median(times):6.0f} ms, at worst {max(times):.0f} ms of {repeats}")


if __name__ == "__main__":
    arguments = parser("benchmarks.page", __doc__)
    arguments.add_argument("--page", type=Path, default=SAMPLE, help="the page of a report")
    arguments.add_argument("--repeats", type=count, default=5, help="number of measurements")
    run(arguments, main)
