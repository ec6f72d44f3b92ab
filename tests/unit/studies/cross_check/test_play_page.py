"""Play page: next to a report, linked from its replays, and as a demo."""

import base64
import gzip
import json
import re
import webbrowser
from pathlib import Path

import pytest
from tests.cases import each
from tests.command import carom_command
from tests.scene_builders import disc_at, run_cross_check, staged

import carom
from carom import Scene
from carom.catalogue import all_scenes
from carom.studies.cross_check import demo as module
from carom.studies.cross_check.document import build_report
from carom.studies.cross_check.grid import build_grid
from carom.studies.cross_check.sections.scenes import PLAY_PAGE, build_play_link, pack_replays

PAIR = staged("mine/a pair & more", disc_at(0, 0, 1), disc_at(3, 0), duration_s=2.0)
#: One more than the page shows, of which two meet.
MANY = staged("many", disc_at(-1.5, 0, 1), *(disc_at(2 * k, 0) for k in range(10)), duration_s=1.0)


def test_play_link_percent_encodes_the_scene_name() -> None:
    """The link to the play page percent-encodes slashes, spaces and symbols of the scene's name."""
    assert build_play_link(PAIR) == "play.html#mine%2Fa%20pair%20%26%20more"


@each("scene, linked", [(PAIR, True), (all_scenes()["driven/paddle"].scene, True), (MANY, False)])
@pytest.mark.usefixtures("blank_pages")
def test_report_has_play_page_only_if_a_scene_supports_it(scene: Scene, linked: bool, tmp_path: Path) -> None:
    """A report includes and links the play page only if one of its scenes can be thrown."""
    results = run_cross_check([scene], ["pit"], dts=[1 / 24])
    build_report(results).write(tmp_path)
    assert (tmp_path / PLAY_PAGE).exists() == linked
    ((name, data),) = pack_replays(build_grid(results))
    replay = json.loads(gzip.decompress(base64.b64decode(data)))
    assert (name, bool(replay["drag"])) == (scene.name, linked)
    keys = {f"{scene.name}/pit/{row.job.profile}" for row in results.rows}
    assert [run["key"] for run in replay["runs"]] == [*keys]


@pytest.fixture(autouse=True)
def opened_pages(monkeypatch: pytest.MonkeyPatch) -> list[str]:
    """Record the pages that would open in a browser."""
    pages: list[str] = []
    monkeypatch.setattr(webbrowser, "open", lambda page: pages.append(page) or True)  # type: ignore[func-returns-value] # None
    return pages


@pytest.mark.usefixtures("in_process")
def test_demo_opens_page_of_engine_that_misses_an_impact(
    monkeypatch: pytest.MonkeyPatch, opened_pages: list[str], tmp_path: Path
) -> None:
    """The demo opens the play page of a scene in which default pymunk misses an impact, in the browser a user names."""
    monkeypatch.setattr("sys.platform", "linux")
    for name in ("DISPLAY", "WAYLAND_DISPLAY"):
        monkeypatch.delenv(name, raising=False)
    monkeypatch.setenv("BROWSER", "a browser that the user names")
    found = carom.demo(tmp_path / "mine.html")
    assert opened_pages == [(tmp_path / "mine.html").as_uri()]
    observed, reference, score = found.replay.observed, found.replay.reference, found.replay.score
    assert found.opened
    assert score.missed
    assert (len(reference.impacts), observed.method) == (1, "pymunk")
    assert f'id="scenes" data-first="{reference.scene.name}">' in found.page.read_text()
    assert "pymunk with default settings misses 1 of 1 impact at 24 steps per second" in repr(found)


@pytest.mark.usefixtures("in_process")
def test_demo_without_display_prints_path_of_page(
    monkeypatch: pytest.MonkeyPatch, opened_pages: list[str], tmp_path: Path
) -> None:
    """With no display and no named browser, the demo writes the page, prints its path and opens no browser."""
    for name in ("BROWSER", "DISPLAY", "WAYLAND_DISPLAY"):
        monkeypatch.delenv(name, raising=False)
    monkeypatch.setattr("sys.platform", "linux")
    monkeypatch.setenv("TMPDIR", str(tmp_path))
    monkeypatch.setattr("tempfile.tempdir", None)
    result = carom_command("demo")
    assert result.exit_code == 0, result.output
    (path,) = re.findall(r"Play page, to throw the discs yourself: (\S+)", result.output)
    assert Path(path).is_relative_to(tmp_path)
    assert Path(path).is_file()
    assert opened_pages == []


@pytest.mark.long
def test_demo_without_engine_shows_pit(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    """Without an installed engine, the demo shows PIT, which misses the impact."""
    monkeypatch.setattr(module, "_FIRST", "no-such-engine")
    monkeypatch.setattr(module, "engines", list)
    found = carom.demo(tmp_path / "pit.html")
    assert found.replay.observed.method == "pit"
    assert repr(found).startswith("pit misses 1 of 1 impact")


def test_demo_file_must_end_in_html(tmp_path: Path) -> None:
    """A demo file that does not end in .html is refused with a message that states the ending."""
    with pytest.raises(carom.CaromError, match=r"must end in \.html"):
        carom.demo(tmp_path / "demo.gif")
