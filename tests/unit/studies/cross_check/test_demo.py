from __future__ import annotations

import re
import webbrowser
from pathlib import Path

import pytest
from tests.command import carom_command

import carom
from carom.studies.cross_check import demo as module


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
    monkeypatch.setattr("carom.live.opened.has_display", lambda: True)
    found = carom.demo(tmp_path / "mine.html")
    assert opened == [(tmp_path / "mine.html").as_uri()]
    assert found.opened
    assert found.replay.score.missed
    assert len(found.replay.reference.impacts) == 1
    assert found.replay.observed.method == "pymunk"
    text = found.page.read_text()
    assert f'<script type="application/json" id="scenes">{{"{found.replay.reference.scene.name}":' in text
    assert "pymunk as shipped misses 1 of 1 impact at 24 steps a second" in repr(found)


@pytest.mark.usefixtures("in_process")
def test_without_a_display_the_page_is_written_and_named(
    monkeypatch: pytest.MonkeyPatch, opened: list[str], tmp_path: Path
) -> None:
    """Nothing is opened, not even in a text browser, and the command prints where the page lies."""
    for name in ("DISPLAY", "WAYLAND_DISPLAY"):
        monkeypatch.delenv(name, raising=False)
    monkeypatch.setattr("sys.platform", "linux")
    monkeypatch.setenv("TMPDIR", str(tmp_path))
    monkeypatch.setattr("tempfile.tempdir", None)
    result = carom_command("demo")
    assert result.exit_code == 0, result.output
    (path,) = re.findall(r"Throw the discs yourself: (\S+)", result.output)
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
    with pytest.raises(carom.CaromError, match=r"ends in \.html"):
        carom.demo(tmp_path / "demo.gif")
