"""Page for throwing discs: next to a report, with links from its replays, and as a demo."""

import base64
import gzip
import json
import re
import webbrowser
from pathlib import Path

import pytest
from tests.cases import each
from tests.command import carom_command
from tests.scene_builders import cross_checked, disc_at, staged

import carom
from carom import Scene
from carom.catalogue import all_scenes
from carom.studies.cross_check import demo as module
from carom.studies.cross_check.document import build_report
from carom.studies.cross_check.grid import build_grid
from carom.studies.cross_check.play_page import PLAY_PAGE, build_play_link, build_play_page
from carom.studies.cross_check.scene_sections import pack_replays
from carom.web.page import add_gallery

PAIR = staged("mine/a pair & more", disc_at(0, 0, 1), disc_at(3, 0), duration_s=2.0)
#: One more than the page shows, of which two meet.
MANY = staged("many", disc_at(-1.5, 0, 1), *(disc_at(2 * k, 0) for k in range(10)), duration_s=1.0)


def test_a_link_names_the_scene_as_an_address_can() -> None:
    """Strokes, spaces and signs of its name are written so that the page reads the name back."""
    assert build_play_link(PAIR) == "play.html#mine%2Fa%20pair%20%26%20more"


def test_a_scene_that_the_page_does_not_show_has_no_link() -> None:
    """Too many discs: no link, and no page of these alone."""
    assert build_play_link(MANY) == ""
    assert build_play_page([MANY]) == ""


def test_a_scene_on_a_table_that_slows_discs_has_a_link() -> None:
    """The page shows it."""
    assert build_play_link(PAIR.model_copy(update={"table_deceleration_m_s2": 0.5}))


@each("name", ["tables/box-of-edges", "driven/paddle", "contact/slide-to-roll"])
def test_a_scene_of_one_disc_and_any_wall_has_a_link(name: str) -> None:
    """Edges, driven walls and contact that lasts are no reason to have none."""
    assert build_play_link(all_scenes()[name].scene)


def test_the_page_has_the_scenes_of_the_report_first() -> None:
    """And those of the catalogue that a reader is led to after them."""
    names = [scene.name for scene in add_gallery(PAIR)]
    assert names[0] == "mine/a pair & more"
    assert "classics/bullet" in names


@each("scene, linked", [(PAIR, True), (MANY, False)])
def test_a_report_has_the_page_where_a_scene_of_it_can_be_thrown(scene: Scene, linked: bool, tmp_path: Path) -> None:
    """The report has the page, and the replay's data a link to it, only if one of its scenes can be thrown."""
    results = cross_checked([scene], ["pit"], dts=[1 / 24])
    build_report(results).write(tmp_path)
    assert (tmp_path / PLAY_PAGE).exists() == linked
    ((name, data),) = pack_replays(build_grid(results))
    replay = json.loads(gzip.decompress(base64.b64decode(data)))
    assert (name, bool(replay["drag"])) == (scene.name, linked)
    assert [run["key"] for run in replay["runs"]] == [
        f"{scene.name}/pit/{job.profile}" for job in {r.job for r in results.rows}
    ]


@pytest.fixture(autouse=True)
def opened(monkeypatch: pytest.MonkeyPatch) -> list[str]:
    """The pages that a browser was asked to open; none opens here."""
    pages: list[str] = []

    def note(page: str) -> bool:
        pages.append(page)
        return True

    monkeypatch.setattr(webbrowser, "open", note)
    return pages


@pytest.mark.usefixtures("in_process")
def test_the_demo_opens_a_page_of_an_engine_that_misses(
    monkeypatch: pytest.MonkeyPatch, opened: list[str], tmp_path: Path
) -> None:
    """Where there is a display the page to throw discs is opened, on a scene that an engine as shipped misses."""
    monkeypatch.setattr("carom.web.open_page.has_display", lambda: True)
    found = carom.demo(tmp_path / "mine.html")
    assert opened == [(tmp_path / "mine.html").as_uri()]
    assert found.opened
    assert found.replay.score.missed
    assert len(found.replay.reference.impacts) == 1
    assert found.replay.observed.method == "pymunk"
    text = found.page.read_text()
    assert f'id="scenes" data-first="{found.replay.reference.scene.name}">' in text
    assert "pymunk with default settings misses 1 of 1 impact at 24 steps per second" in repr(found)


@pytest.mark.usefixtures("in_process")
def test_without_a_display_the_page_is_written_and_named(
    monkeypatch: pytest.MonkeyPatch, opened: list[str], tmp_path: Path
) -> None:
    """Nothing is opened, not even a text browser, and the command prints the path of the page."""
    for name in ("DISPLAY", "WAYLAND_DISPLAY"):
        monkeypatch.delenv(name, raising=False)
    monkeypatch.setattr("sys.platform", "linux")
    monkeypatch.setenv("TMPDIR", str(tmp_path))
    monkeypatch.setattr("tempfile.tempdir", None)
    result = carom_command("demo")
    assert result.exit_code == 0, result.output
    (path,) = re.findall(r"Play page, to throw the discs yourself: (\S+)", result.output)
    assert Path(path).is_relative_to(tmp_path)
    assert Path(path).is_file()
    assert opened == []


@pytest.mark.long
def test_without_an_engine_carom_shows_its_own_pit(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    """Where no engine is installed PIT is shown, which checks once per step and misses by the scene's design."""
    monkeypatch.setattr(module, "_FIRST", "no-such-engine")
    monkeypatch.setattr(module, "engines", list)
    found = carom.demo(tmp_path / "pit.html")
    assert found.replay.observed.method == "pit"
    assert repr(found).startswith("pit misses 1 of 1 impact")


def test_a_page_of_another_kind_is_refused(tmp_path: Path) -> None:
    """The page ends in .html, and the message says so."""
    with pytest.raises(carom.CaromError, match=r"must end in \.html"):
        carom.demo(tmp_path / "demo.gif")
