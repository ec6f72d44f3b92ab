"""Demonstration: an engine misses an impact, and readers can throw the same discs on a web page."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

from carom.catalogue import all_scenes
from carom.errors import AdapterError, CaromError, InputError
from carom.execution.describe_engines import engines
from carom.execution.job import PIT_METHOD
from carom.solvers.pic import solve_pic
from carom.studies.cross_check.replay import Replay, replay
from carom.support import formatting
from carom.support.folders import build_temporary_path, write_file
from carom.web.installed_engines import DEFAULT_ENGINES, load_page_engines
from carom.web.open_page import open_page
from carom.web.page import add_gallery, render_page

_SCENE, _PROFILE = "paper/missed", "default"

#: The engine to try first, which has wheels for every version of CPython and starts quickly.
_FIRST = "pymunk"


@dataclass(frozen=True, repr=False)
class Demo:
    """Run of an engine that misses an impact, and the play page, on which readers can throw the same discs.

    Attributes:
        replay: Animation of the engine's run next to the exact run.
        page: Path of the play page.
        opened: Whether the page was opened in a browser.
    """

    replay: Replay
    page: Path
    opened: bool

    def __repr__(self) -> str:
        observed, missed = self.replay.observed, self.replay.score.missed
        method = observed.method if observed.method == PIT_METHOD.engine else f"{observed.method} with default settings"
        rate = f"{1 / observed.dt_s:g} steps per second"
        due = formatting.format_count(self.replay.score.expected, "impact")
        when = float(self.replay.reference.impacts["time_s"][missed[0]])
        first = f"the first is at {formatting.format_number(when, 4)} s"
        sentence = f"{method} misses {len(missed)} of {due} at {rate}; {first}."
        return f"{sentence}\nPlay page, to throw the discs yourself: {self.page}"

    def _repr_html_(self) -> str | None:
        return self.replay._repr_html_()


def demo(path: str | Path | None = None) -> Demo:
    """Run an engine that misses an impact, and open the play page of the same scene if there is a display.

    The engine is pymunk with default settings. If pymunk is not installed or misses no impact, another engine or PIT
    runs. In a notebook, the result shows a replay of the run next to the exact run.

    Args:
        path: Path of the page, ``.html`` (default: a file in a new temporary folder).

    Raises:
        AdapterError: No installed method misses the impact.
        InputError: The path does not end in ``.html``.
        OSError: The page can't be written.

    Examples:
        >>> shown = carom.demo("demo.html")
        >>> shown.page.name
        'demo.html'
    """
    if path is not None and Path(path).suffix != ".html":
        raise InputError(f"the demo page must end in .html, got {str(path)!r}")
    replay = _find_missing_replay()
    html = render_page(add_gallery(all_scenes()[_SCENE].scene), load_page_engines(DEFAULT_ENGINES, required=False))
    page = write_file(build_temporary_path("demo.html") if path is None else Path(path), html)
    return Demo(replay, page.resolve(), open_page(page.resolve()))


def _find_missing_replay() -> Replay:
    """Run methods until one of them misses an impact, and return its replay.

    PIT always misses an impact in the demo's scene.
    """
    reference = solve_pic(_SCENE)
    for name in _list_methods():
        try:
            found = replay(reference, name, profile=_PROFILE)
        except CaromError:  # skip an engine that is not installed or fails
            continue
        if found.score.missed:
            return found
    raise AdapterError(f"no installed method misses the impact of {_SCENE}")


def _list_methods() -> Iterator[str]:
    """Yield methods in the order in which they are tried.

    Other engines are looked up only if the first engine misses no impact, because the look-up takes time.
    """
    yield _FIRST
    yield from (info.name for info in engines() if info.available and info.engine != "Carom" and info.name != _FIRST)
    yield PIT_METHOD.engine
