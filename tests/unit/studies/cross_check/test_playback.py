"""A replay as an object: a cell, a page and a film of the same two runs."""

from __future__ import annotations

import base64
import gzip
import json
import re
import sys
from html import unescape
from pathlib import Path

import numpy as np
import pytest
from matplotlib import rc_context
from matplotlib.animation import FFMpegWriter
from matplotlib.patches import Circle
from PIL import Image

import carom
from carom import Scene
from carom.errors import InputError, MissingExtraError
from carom.scenes import find_scenes
from carom.studies.cross_check import playback
from carom.studies.cross_check.playback import Replay

HOSTILE = "</script><b>'\""


@pytest.fixture(scope="module")
def shown() -> Replay:
    """The paper's first case, whose one impact PIT misses, under a name that would end a script."""
    scene = find_scenes(["paper/missed"])[0].scene.model_copy(update={"name": HOSTILE})
    return carom.replay(carom.solve_pic(scene), carom.solve_pit(scene))


def test_it_is_scored_where_no_score_is_given(shown: Replay) -> None:
    """A score that is given is taken; without one the two are compared."""
    assert shown.score.missed == (0,)
    given = carom.compare(shown.reference, shown.observed, sampling=shown.observed)
    assert carom.replay(shown.reference, shown.observed, score=given).score is given


def test_the_cell_is_an_isolated_frame_that_holds_the_page(shown: Replay) -> None:
    """One iframe that may run scripts and nothing else; what is in it is the page to the letter."""
    cell = shown._repr_html_()
    assert cell
    found = re.fullmatch(r'<iframe [^<>]*sandbox="allow-scripts"[^<>]* srcdoc="([^"<>]*)"></iframe>', cell)
    assert found
    assert unescape(found[1]) == shown.html()


def test_the_page_holds_both_runs_and_one_script_by_its_hash(shown: Replay, tmp_path: Path) -> None:
    """The page has one block of data, that of the replay; the name is text; no other script may run."""
    path = shown.save(tmp_path / "replay.html")
    page = path.read_text(encoding="utf-8")
    assert page == shown.html()
    (block,) = re.findall(r'<script type="text/plain" data-scene="[^"<>]*">([\w+/=]+)</script>', page)
    data = json.loads(gzip.decompress(base64.b64decode(block)))
    (run,) = data["runs"]
    assert [row["flag"] for row in run["impacts"]] == ["missed"]
    assert (data["name"], run["engine"], run["sampled"]) == (HOSTILE, "pit", True)
    assert page.count("<script") == 2
    assert HOSTILE not in page
    assert "script-src 'sha256-" in unescape(page)
    assert 'id="replay-alone"' in page


def test_a_run_that_looks_at_no_frames_is_not_said_to(shown: Replay) -> None:
    """PIC has no step: the page steps by the scene's frames, and does not say that PIC looks at them."""
    page = carom.replay(shown.reference, shown.reference).html()
    (block,) = re.findall(r'data-scene="[^"<>]*">([\w+/=]+)</script>', page)
    (run,) = json.loads(gzip.decompress(base64.b64decode(block)))["runs"]
    assert (run["dt"], run["sampled"]) == (pytest.approx(1 / 24), False)


@pytest.mark.long
def test_a_gif_moves_and_is_held_where_the_impact_is_missed(
    shown: Replay, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """It has 25 frames a second, which differ, and one that stands longer, the time of the fault."""
    monkeypatch.setattr(playback, "_FILM_S", 1)
    with Image.open(shown.save(tmp_path / "replay.gif")) as film:
        lasts = []
        for frame in range(film.n_frames):  # type: ignore[attr-defined]
            film.seek(frame)
            lasts.append(film.info["duration"])
        film.seek(0)
        first = film.convert("RGB").tobytes()
        film.seek(5)
        assert film.convert("RGB").tobytes() != first
    assert min(lasts) == 40
    assert max(lasts) >= 1000 * playback._HELD_S  # noqa: SLF001
    assert sum(lasts) == 40 * (25 + 38)  # a second, and a second and a half at the miss


def test_a_film_shows_the_discs_where_they_are(shown: Replay) -> None:
    """At the end each circle is where its trace ends; the exact run goes along on the right, and the last look."""
    film = playback._film(shown)  # noqa: SLF001
    frames = playback._times(shown.reference.scene, 0.0)  # noqa: SLF001
    film._func(len(frames) - 1)  # type: ignore[attr-defined]  # noqa: SLF001
    left, right = film._fig.axes  # type: ignore[attr-defined]  # noqa: SLF001
    of = [[circle.get_center() for circle in axes.patches if isinstance(circle, Circle)] for axes in (left, right)]
    exact, seen = shown.reference.final_position_m, shown.observed.final_position_m
    assert np.array(of[0]) == pytest.approx(exact, abs=1e-5)
    assert np.array(of[1]) == pytest.approx(np.concatenate([seen, exact, seen]), abs=1e-5)
    film._draw_was_started = True  # type: ignore[attr-defined]  # noqa: SLF001 - it was looked at, and need not warn


def test_a_cross_stays_where_the_impact_is_missed(shown: Replay) -> None:
    """It is where the two would have touched, from that instant to the end, and not before."""
    film = playback._film(shown)  # noqa: SLF001
    (cross,) = [line for line in film._fig.axes[1].lines if line.get_marker() == "x"]  # type: ignore[attr-defined]  # noqa: SLF001
    (impact,) = shown.reference.impacts
    met_s, one = impact["time_s"], shown.reference.scene.discs[0]
    centre = np.add(one.position_m, met_s * np.array(one.velocity_m_s))
    assert np.hypot(*(np.ravel(cross.get_data()) - centre)) == pytest.approx(one.radius_m)
    times = playback._times(shown.reference.scene, 0.0)  # noqa: SLF001
    for frame, visible in ((0, False), (len(times) - 1, True)):
        film._func(frame)  # type: ignore[attr-defined]  # noqa: SLF001
        assert cross.get_visible() is visible
    film._draw_was_started = True  # type: ignore[attr-defined]  # noqa: SLF001 - it was looked at, and need not warn


def test_a_look_is_never_after_the_frame_that_shows_it(shown: Replay) -> None:
    """The run looks every 24th of a second: its dashed disc is where it was at the last of them."""
    film = playback._film(shown)  # noqa: SLF001
    times = playback._times(shown.reference.scene, None)  # noqa: SLF001 - before the film is held
    frame = int(np.searchsorted(times, 2.5 / 24))
    film._func(frame)  # type: ignore[attr-defined]  # noqa: SLF001
    dashed = [c for c in film._fig.axes[1].patches if isinstance(c, Circle) and not c.get_fill()]  # type: ignore[attr-defined]  # noqa: SLF001
    discs = shown.reference.scene.discs
    looked = [np.add(disc.position_m, 2 / 24 * np.array(disc.velocity_m_s)) for disc in discs]
    assert np.array([circle.get_center() for circle in dashed]) == pytest.approx(np.array(looked), abs=1e-5)
    film._draw_was_started = True  # type: ignore[attr-defined]  # noqa: SLF001 - it was looked at, and need not warn


@pytest.mark.long
def test_an_mp4_is_made_of_every_frame(shown: Replay, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """The program that matplotlib calls ffmpeg gets each frame whole, and what it writes is the file."""
    monkeypatch.setattr(playback, "_FILM_S", 1)
    program = tmp_path / "ffmpeg"
    program.write_text(f"#!{sys.executable}\nimport sys\nopen(sys.argv[-1], 'wb').write(sys.stdin.buffer.read())\n")
    program.chmod(0o755)
    with rc_context({"animation.ffmpeg_path": str(program)}):
        frames = shown.save(tmp_path / "replay.mp4").read_bytes()
    size = 4 * 640 * 352  # four bytes a pixel, 8 by 4.4 inches of 80
    assert len(frames) == size * (25 + 38)  # a second, and a second and a half at the miss
    assert frames[:size] != frames[-size:]


def test_what_cant_be_saved_is_said(shown: Replay, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Another ending is refused by name, an .mp4 without ffmpeg says what is missing, and no file is left."""
    with pytest.raises(InputError, match=r"\.html, \.gif or \.mp4, not as '\.avi'"):
        shown.save(tmp_path / "replay.avi")
    monkeypatch.setattr(FFMpegWriter, "isAvailable", classmethod(lambda _: False))
    with pytest.raises(MissingExtraError, match="needs the program ffmpeg"):
        shown.save(tmp_path / "replay.mp4")
    assert list(tmp_path.iterdir()) == []


def test_traces_of_two_scenes_are_refused(shown: Replay) -> None:
    """What can't be compared can't be played beside each other."""
    other: Scene = find_scenes(["paper/late"])[0].scene
    with pytest.raises(InputError, match="only traces of one scene"):
        carom.replay(shown.reference, carom.solve_pic(other))


@pytest.mark.long
def test_an_engine_is_named_in_place_of_its_run() -> None:
    """A scene by name and an engine by name make a replay of its run at the scene's frame, or at the step asked for."""
    shown = carom.replay("paper/missed", "pit")
    assert shown.reference == carom.solve_pic("paper/missed")
    assert shown.observed.dt_s == 1 / shown.reference.scene.frame_rate_hz
    assert len(shown.score.missed) == 1
    assert carom.replay(shown.reference, "pit", dt=0.01).observed.dt_s == 0.01


def test_a_run_that_is_given_has_a_step_of_its_own(shown: Replay) -> None:
    """A step beside a run that is there already would be of no effect, and is refused."""
    with pytest.raises(InputError, match="dt is the step of an engine that is named"):
        carom.replay(shown.reference, shown.observed, dt=0.1)
