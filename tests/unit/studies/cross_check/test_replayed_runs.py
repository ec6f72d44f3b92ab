"""Replays: a notebook cell, a page and a film show the same two runs."""

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
from matplotlib.animation import FFMpegWriter, FuncAnimation
from matplotlib.patches import Circle
from PIL import Image

import carom
from carom.catalogue import find_scenes
from carom.errors import InputError, MissingExtraError
from carom.studies.cross_check import replay_film as films
from carom.studies.cross_check.replay import Replay

HOSTILE = "</script><b>'\""


@pytest.fixture(scope="module")
def missed_replay() -> Replay:
    """The paper's first case, whose one impact PIT misses, under a name that would end a script."""
    scene = find_scenes(["paper/missed"])[0].scene.model_copy(update={"name": HOSTILE})
    return carom.replay(carom.solve_pic(scene), carom.solve_pit(scene))


def build_film(replay: Replay) -> FuncAnimation:
    """Return the film of a replay, which does not warn if it is not shown."""
    made = films.build_film(replay.reference, replay.observed, replay.score)
    made._draw_was_started = True  # type: ignore[attr-defined]  # noqa: SLF001
    return made


def test_notebook_cell_is_a_sandboxed_iframe_with_the_page(missed_replay: Replay) -> None:
    """In a notebook, a replay is one sandboxed iframe that contains the page and may only run scripts."""
    cell = missed_replay._repr_html_()
    assert cell
    found = re.fullmatch(r'<iframe [^<>]*sandbox="allow-scripts"[^<>]* srcdoc="([^"<>]*)"></iframe>', cell)
    assert found
    assert unescape(found[1]) == missed_replay.html()


def test_replay_page_has_data_and_one_hashed_script(missed_replay: Replay, tmp_path: Path) -> None:
    """The page has one block of data and one script, allowed by its hash; the scene's name is escaped."""
    page = missed_replay.save(tmp_path / "replay.html").read_text(encoding="utf-8")
    assert page == missed_replay.html()
    (block,) = re.findall(r'<script type="text/plain" data-scene="[^"<>]*">([\w+/=]+)</script>', page)
    data = json.loads(gzip.decompress(base64.b64decode(block)))
    (run,) = data["runs"]
    assert [row["flag"] for row in run["impacts"]] == ["missed"]
    assert (data["name"], run["engine"], run["sampled"]) == (HOSTILE, "pit", True)
    assert page.count("<script") == 2
    assert HOSTILE not in page
    assert "script-src 'sha256-" in unescape(page)
    assert 'id="replay-alone"' in page


def test_replay_of_pic_is_not_marked_as_sampled(missed_replay: Replay) -> None:
    """A replay of PIC has the scene's frame as step and is not marked as sampled."""
    page = carom.replay(missed_replay.reference, missed_replay.reference).html()
    (block,) = re.findall(r'data-scene="[^"<>]*">([\w+/=]+)</script>', page)
    (run,) = json.loads(gzip.decompress(base64.b64decode(block)))["runs"]
    assert (run["dt"], run["sampled"]) == (pytest.approx(1 / 24), False)


@pytest.mark.long
def test_gif_pauses_at_the_missed_impact(
    missed_replay: Replay, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """The GIF has frames of 40 ms that differ, and one longer frame at the missed impact."""
    monkeypatch.setattr(films, "_FILM_S", 1)
    with Image.open(missed_replay.save(tmp_path / "replay.gif")) as film:
        lasts = []
        for frame in range(film.n_frames):  # type: ignore[attr-defined]
            film.seek(frame)
            lasts.append(film.info["duration"])
        film.seek(0)
        first = film.convert("RGB").tobytes()
        film.seek(5)
        assert film.convert("RGB").tobytes() != first
    assert min(lasts) == 40
    assert max(lasts) >= 1000 * (films._PAUSE_S - films._FLASH_S)  # noqa: SLF001 - while flashes fade frames differ
    assert sum(lasts) == 40 * len([*build_film(missed_replay).new_frame_seq()])


def test_film_shows_positions_and_magnifies_the_missed_impact(missed_replay: Replay) -> None:
    """The last frame has the final positions and a cross at the missed contact; an inset magnifies the contact."""
    reference, observed = missed_replay.reference, missed_replay.observed
    made = build_film(missed_replay)
    left, right = made._fig.axes[:2]  # type: ignore[attr-defined]  # noqa: SLF001
    (inset,) = right.child_axes
    (cross,) = [line for line in right.lines if line.get_marker() == "x"]
    is_visible = []
    for frame in made.new_frame_seq():
        made._func(frame)  # type: ignore[attr-defined]  # noqa: SLF001
        is_visible.append((cross.get_visible(), inset.get_visible()))
    assert is_visible[0] == (False, False)
    assert is_visible[-1][0]
    assert any(magnified for _, magnified in is_visible)
    (impact,), disc = reference.impacts, reference.scene.discs[0]
    centre = np.add(disc.position_m, impact["time_s"] * np.array(disc.velocity_m_s))
    (place,) = np.array(cross.get_xydata())
    assert np.hypot(*(place - centre)) == pytest.approx(disc.radius_m)
    corners = np.array([place - 2.5 * disc.radius_m, place + 2.5 * disc.radius_m])
    assert np.transpose([inset.get_xlim(), inset.get_ylim()]) == pytest.approx(corners)
    exact, seen = reference.final_position_m, observed.final_position_m
    for axes, expected in ((left, exact), (right, np.concatenate([seen, exact, seen]))):
        circles = [part for part in axes.patches if isinstance(part, Circle)]
        places = np.array([circle.get_center() for circle in circles[: len(expected)]])
        assert places == pytest.approx(expected, abs=1e-5)


@pytest.mark.long
def test_mp4_contains_every_frame(missed_replay: Replay, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Each frame of the film is passed to ffmpeg as a whole, and the output of ffmpeg is the file."""
    monkeypatch.setattr(films, "_FILM_S", 1)
    program = tmp_path / "ffmpeg"
    program.write_text(f"#!{sys.executable}\nimport sys\nopen(sys.argv[-1], 'wb').write(sys.stdin.buffer.read())\n")
    program.chmod(0o755)
    with rc_context({"animation.ffmpeg_path": str(program)}):
        frames = missed_replay.save(tmp_path / "replay.mp4").read_bytes()
    size = 4 * 640 * 352  # four bytes a pixel, 8 by 4.4 inches of 80
    assert len(frames) == size * len([*build_film(missed_replay).new_frame_seq()])
    assert frames[:size] != frames[-size:]


def test_unsupported_film_format_or_missing_ffmpeg_is_refused(
    missed_replay: Replay, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """An unknown file type, or .mp4 without ffmpeg, is refused with the reason, and no file is written."""
    with pytest.raises(InputError, match=r"\.html, \.gif or \.mp4, got '\.avi'"):
        missed_replay.save(tmp_path / "replay.avi")
    monkeypatch.setattr(FFMpegWriter, "isAvailable", classmethod(lambda _: False))
    with pytest.raises(MissingExtraError, match="needs the program ffmpeg"):
        missed_replay.save(tmp_path / "replay.mp4")
    assert list(tmp_path.iterdir()) == []


def test_replay_refuses_two_scenes_and_a_step_of_an_existing_run(missed_replay: Replay) -> None:
    """Traces of two different scenes, and a step for a run that already exists, are refused."""
    with pytest.raises(InputError, match="only traces of one scene"):
        carom.replay(missed_replay.reference, carom.solve_pic("paper/late"))
    with pytest.raises(InputError, match="dt is allowed only with an engine name"):
        carom.replay(missed_replay.reference, missed_replay.observed, dt=0.1)


@pytest.mark.long
def test_replay_accepts_names_of_scene_and_engine() -> None:
    """Given names of a scene and an engine, a replay runs the engine at the scene's frame or at the given step."""
    shown = carom.replay("paper/missed", "pit")
    assert shown.reference == carom.solve_pic("paper/missed")
    assert shown.observed.dt_s == 1 / shown.reference.scene.frame_rate_hz
    assert len(shown.score.missed) == 1
    assert carom.replay(shown.reference, "pit", dt=0.01).observed.dt_s == 0.01
