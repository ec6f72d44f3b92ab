"""The browser and the pages that tests share."""

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
from tests.unit.studies.examples import build_bench, build_campaign_results, build_growth

import carom
from carom.catalogue import CatalogueScene, all_scenes
from carom.studies.bench.document import build_bench_document, write_bench
from carom.studies.bench.growth_document import build_growth_document, write_growth
from carom.studies.cross_check.document import Report, build_report
from carom.studies.stress.document import build_stress_document, write_stress
from carom.web.engine_script import PageEngine
from carom.web.page import GALLERY, render_page

#: The browser fetches nothing, and uses no graphics card and no sandbox, which a container does not allow.
FLAGS = (
    "--no-sandbox",
    "--disable-gpu",
    "--disable-quic",
    "--no-first-run",
    "--disable-background-networking",
    "--disable-component-update",
    "--disable-sync",
)
#: Names that would run or reverse the text after them if they were read as markup.
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
    """The report of all catalogue scenes and the hostile ones, with PIC, PIT and tuned pymunk."""
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
def pages(tmp_path_factory: pytest.TempPathFactory) -> dict[str, Path]:
    """The page of a bench of one scene, that of a campaign, and that of a growth bench, of every method."""
    folder = tmp_path_factory.mktemp("pages")
    bench, stress, growth = build_bench(), build_campaign_results(), build_growth()
    return {
        "bench": write_bench(bench, build_bench_document(bench), folder / "bench"),
        "stress": write_stress(stress, build_stress_document(stress), folder / "stress"),
        "growth": write_growth(growth, build_growth_document(growth), folder / "growth"),
    }


#: An engine of a few lines, so that the play page has a second method.
TOY = """caromEngines.toy.done(class {
  constructor(scene) { this.discs = scene.discs; }
  step() {}
  observe() {
    const { discs } = this;
    return { position_m: discs.map((d) => d.position_m), velocity_m_s: discs.map((d) => d.velocity_m_s), contacts: [] };
  }
});"""


@pytest.fixture(scope="session")
def toy_page(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The play page with an engine that moves nothing."""
    toy = PageEngine("toy", "Toy", {"default": {}}, TOY, "of no licence")
    path = tmp_path_factory.mktemp("toy") / "play.html"
    path.write_text(render_page([all_scenes()[name].scene for name in GALLERY], [toy]), encoding="utf-8")
    return path


@pytest.fixture(scope="session")
def browser() -> Iterator[Browser]:
    """Chromium without a window."""
    from playwright.sync_api import expect, sync_playwright

    expect.set_options(timeout=1e3 * PATIENT_S)
    with sync_playwright() as playwright:
        yield playwright.chromium.launch(executable_path=_find_chromium(), args=list(FLAGS))


#: Opens a page: its path, the link within it, its width and height, and options of Playwright's window.
Window = Callable[..., Page]


class Faults(list[str]):
    """Faults of a page: errors of scripts, messages of the console, requests and dialogs."""

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
    """Open a page from its file; the test fails if a script fails or the page requests anything."""
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
