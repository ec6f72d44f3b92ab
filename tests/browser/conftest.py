"""One report and one browser for all tests of the page."""

import fcntl
import os
import shutil
from collections import ChainMap
from collections.abc import Callable, Iterator
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest
from playwright.sync_api import Browser, Page
from tests.processes import PATIENT_S

import carom
from carom.catalogue import CatalogueScene, all_scenes
from carom.studies.cross_check.document import Report, build_report

#: Nothing is fetched, and nothing is asked of a graphics card or of a sandbox that a container does not allow.
FLAGS = (
    "--no-sandbox",
    "--disable-gpu",
    "--disable-quic",
    "--no-first-run",
    "--disable-background-networking",
    "--disable-component-update",
    "--disable-sync",
)
#: What would run, or turn the words after it round, if a name were ever taken for markup.
HOSTILE = (
    "<script>window.reached=1</script>",
    '"><img src=x onerror="window.reached=1">',
    "\u202egnorw",
    "a/b#c%20'\"&",
)


def _find_chromium() -> str:
    found = shutil.which("chromium") or shutil.which("chromium-browser") or shutil.which("google-chrome")
    assert found, "the page is tested in Chromium: install Debian's package chromium"
    return found


def hostile_scenes() -> list[carom.Scene]:
    """Return a plain scene under each of the hostile names."""
    discs = [
        carom.Disc(position_m=(0.0, 0.0), velocity_m_s=(2.0, 0.0), radius_m=0.25),
        carom.Disc(position_m=(1.5, 0.1), radius_m=0.25),
    ]
    return [carom.Scene(name=name, description=name, duration_s=1.0, discs=discs) for name in HOSTILE]


def make_report_once(tmp_path_factory: pytest.TempPathFactory, name: str, make: Callable[[], Report]) -> Path:
    """Return the page of a report, which the first process of the session makes and the others wait for."""
    base = tmp_path_factory.getbasetemp()
    shared = base.parent if "PYTEST_XDIST_WORKER" in os.environ else base
    page = shared / name / "index.html"
    with (shared / f"{name}.lock").open("w") as lock:
        fcntl.flock(lock, fcntl.LOCK_EX)
        if not page.exists():
            make().write(tmp_path_factory.mktemp(name)).parent.rename(page.parent)
    return page


@pytest.fixture(scope="session")
def report(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The page of every scene that has a name, and of the hostile ones, by PIC, PIT and pymunk at their best."""
    return make_report_once(tmp_path_factory, "report", build_scenes_report)


def build_scenes_report() -> Report:
    """Return the report of every scene that has a name, and of the hostile ones."""
    by_frame: dict[float, list[carom.Scene | CatalogueScene]] = {}
    for entry in all_scenes().values():
        by_frame.setdefault(1.0 / entry.scene.frame_rate_hz, []).append(entry)
    for scene in hostile_scenes():
        by_frame.setdefault(1.0 / scene.frame_rate_hz, []).append(scene)
    found = [
        carom.cross_check(scenes, ["pic", "pit", "pymunk"], profiles=["tuned"], dts=[dt], timing=False, jobs=2)
        for dt, scenes in by_frame.items()
    ]
    every = replace(
        found[0],
        rows=tuple(row for results in found for row in results.rows),
        references=ChainMap(*(dict(results.references) for results in found)),
        known=ChainMap(*(dict(results.known) for results in found)),
        certified=ChainMap(*(dict(results.certified) for results in found)),
        horizons=ChainMap(*(dict(results.horizons) for results in found)),
    )
    return build_report(every)


@pytest.fixture(scope="session")
def wide_report(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The page of four engines with three profiles each."""
    scenes = [entry for entry in all_scenes().values() if entry.name.startswith(("paper/", "gravity/"))]
    engines = ["pic", "pit", "box2d", "mujoco", "pybullet", "pymunk"]
    return make_report_once(
        tmp_path_factory, "wide", lambda: build_report(carom.cross_check(scenes, engines, timing=False, jobs=2))
    )


@pytest.fixture(scope="session")
def browser() -> Iterator[Browser]:
    """Chromium without a window."""
    from playwright.sync_api import expect, sync_playwright

    expect.set_options(timeout=1e3 * PATIENT_S)
    with sync_playwright() as playwright:
        yield playwright.chromium.launch(executable_path=_find_chromium(), args=list(FLAGS))


#: Opens a page: its path, the link within it, its width and height, and options of Playwright's window.
Window = Callable[..., Page]
#: 190 mm at 96 pixels an inch.
A4_PX = 718


class Faults(list[str]):
    """What went wrong on a page: errors of scripts, messages of the console, requests, and questions to the user."""

    def watch(self, page: Page) -> None:
        """Note all of it from now on."""
        page.on("pageerror", lambda error: self.append(f"error: {error}"))
        page.on("console", lambda message: self.append(f"{message.type}: {message.text}"))
        page.on("dialog", lambda dialog: self.append(f"dialog: {dialog.message}"))
        page.on("request", lambda request: self._note_request(request.url))

    def _note_request(self, url: str) -> None:
        if not url.startswith(("file:", "about:")):
            self.append(url)


@pytest.fixture
def window(browser: Browser) -> Iterator[Window]:
    """Open a page as by a double click; the test fails where a script of it does, or asks for anything."""
    faults, pages = Faults(), list[Page]()

    def open_(
        path: Path, link: str = "", *, width: int = 1280, height: int = 900, watched: bool = True, **options: Any
    ) -> Page:
        pages.append(browser.new_page(viewport={"width": width, "height": height}, **options))
        pages[-1].set_default_timeout(1e3 * PATIENT_S)
        if watched:
            faults.watch(pages[-1])
        pages[-1].goto(path.as_uri() + link)
        return pages[-1]

    yield open_
    for page in pages:
        page.close()
    assert not faults


@pytest.fixture
def page(window: Window, report: Path) -> Page:
    """The report."""
    return window(report)


def find_violations(page: Page, *impacts: str) -> set[str]:
    """Return the rules of accessibility that axe finds broken, of these impacts or of any."""
    from axe_playwright_python.sync_playwright import Axe  # type: ignore[import-untyped] # it publishes no types

    found = Axe().run(page).response["violations"]
    return {f"{one['id']}: {one['nodes'][0]['html'][:120]}" for one in found if one["impact"] in impacts or not impacts}


def find_cut_off(page: Page, things: str = "table, pre, svg") -> Any:
    """Return which of these things are wider than A4, upright with usual margins, on a page of that width."""
    page.emulate_media(media="print")
    seen = f"all => all.filter(one => one.checkVisibility() && one.getBoundingClientRect().right > {A4_PX})"
    return page.eval_on_selector_all(things, f"{seen}.map(one => one.className || one.outerHTML)")
