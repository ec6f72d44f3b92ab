"""One run beside its reference, moving: as a notebook's cell, a page, a GIF or a film."""

from __future__ import annotations

import tempfile
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass
from html import escape
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from carom.comparator import Score, compare
from carom.comparator.finite import not_finite
from carom.driving import Drive
from carom.errors import InputError, MissingExtraError
from carom.folders import write_file
from carom.limits import MOST_DISCS_DRAWN
from carom.pages import wording
from carom.pages.files import packed, require_report_extra
from carom.pages.grid import mark_of, reasons_of
from carom.pages.paths import exact_paths, extent_of, observed_paths
from carom.pages.picture import draw_pair, draw_walls, limits_of
from carom.pages.render.html import replay_page
from carom.pages.replay import first_fault, held_at_s, impact_rows, meetings, replay_data, run_command
from carom.pages.svg import SERIES, WALL, drawing
from carom.pages.tracks import Track, observed_tracks, reference_tracks
from carom.runs.job import Job, Method, Status
from carom.runs.results import Row
from carom.scene import Scene, as_scene
from carom.solvers.pic import solve_pic
from carom.studies.cross_check.run import run
from carom.text import visible
from carom.trace import Trace

if TYPE_CHECKING:
    from matplotlib.animation import FuncAnimation
    from matplotlib.artist import Artist
    from matplotlib.axes import Axes
    from matplotlib.patches import Circle

#: A film lasts about as long as the page's replay at the speed that it chooses, and is held as long at what failed
#: first; a GIF counts hundredths of a second, four a frame.
_FILM_S, _HELD_S, _FRAMES_PER_S = 6, 1.5, 25
#: Colours of what must happen, and of an impact that is missed, as in the page.
_GHOST, _WRONG = "#74777c", "#d5452f"
#: What became of an impact stays in the picture for this part of the scene, as in the page.
_SAID_FOR = 1.0 / 12.0
#: With more, a still picture shows nothing.
_MOST_IMPACTS_DRAWN = 1000


@dataclass(frozen=True, repr=False)
class Replay:
    """A run beside its reference, as `carom.replay` makes it.

    Attributes:
        reference: What must happen.
        observed: What did.
        score: How they compare.
    """

    reference: Trace
    observed: Trace
    score: Score

    def __repr__(self) -> str:
        return f"Replay of {self.observed!r}"

    def html(self) -> str:
        """Return the replay as a page in one file, with every impact in a table.

        Raises:
            MissingExtraError: The extra `report` is not installed.
        """
        trace = self.observed
        job = Job(trace.scene, Method(trace.method, trace.profile, tuple(trace.tried.items())), trace.dt_s)
        row = Row(job, Status.RAN, trace=trace, score=self.score)
        mark = mark_of(row)
        said = {
            "engine": trace.method,
            "profile": trace.profile_shown,
            "key": visible(trace.scene.name),
            "word": mark.word,
            "symbol": mark.symbol,
            "css": mark.css,
            "said": [wording.capitalised(reason) + "." for reason in reasons_of(row)],
            "command": run_command("scene.toml", job)
            if trace.profile
            else "",  # a solver called directly has no profile
        }
        data = packed(replay_data(self.reference, [(trace, self.score, said)]))
        return replay_page(visible(trace.scene.name), data, said["said"], self._stills())

    def _stills(self) -> list[tuple[str, str]]:
        """Return captions and pictures, SVG, of both sides for where no script runs; none of what can't be drawn."""
        trace, name = self.observed, f"{self.observed.method} {self.observed.profile_shown}".strip()
        many = len(trace.scene.discs) > MOST_DISCS_DRAWN or len(trace.impacts) > _MOST_IMPACTS_DRAWN
        if many or not_finite(trace):
            return []
        labels = (f"What must happen in {visible(trace.scene.name)}", f"What {name} makes of it")
        return list(zip(labels, draw_pair(self.reference, trace, self.score.missed, labels), strict=True))

    def _repr_html_(self) -> str | None:
        try:
            page = self.html()
        except MissingExtraError:
            return None
        # Nothing of the page reaches the notebook, nor the other way round.
        # Tall enough for pictures and buttons, one above the other on a phone; what is written below them may scroll.
        frame = 'sandbox="allow-scripts" style="width:100%;height:54em;border:0"'
        return f'<iframe title="replay" {frame} srcdoc="{escape(page)}"></iframe>'

    def save(self, path: str | Path) -> Path:
        """Write the replay to a file and return its path: a page (``.html``), or a film (``.gif``, ``.mp4``).

        Raises:
            InputError: The path ends otherwise.
            MissingExtraError: The extra `report`, or for ``.mp4`` the program ffmpeg, is not installed.
            OSError: The file can't be written.
        """
        path = Path(path)
        if path.suffix == ".html":
            return write_file(path, self.html())
        if path.suffix not in {".gif", ".mp4"}:
            raise InputError(f"a replay is saved as .html, .gif or .mp4, not as {path.suffix or 'nothing'!r}")
        require_report_extra()
        from matplotlib.animation import FFMpegWriter, PillowWriter

        if path.suffix == ".mp4" and not FFMpegWriter.isAvailable():
            raise MissingExtraError(
                "an .mp4 needs the program ffmpeg, which is not installed", hints=[".gif and .html need none"]
            )
        writer = (PillowWriter if path.suffix == ".gif" else FFMpegWriter)(fps=_FRAMES_PER_S)
        with tempfile.TemporaryDirectory() as folder, drawing():
            made = Path(folder) / path.name
            _film(self).save(made, writer=writer)
            return write_file(path, made.read_bytes())


def replay(
    reference: Trace | Scene | str,
    observed: Trace | str,
    *,
    score: Score | None = None,
    dt: float | None = None,
    profile: str = "tuned",
) -> Replay:
    """Return a run beside its reference, to be looked at in a notebook or saved.

    Args:
        reference: What must happen, as a rule from `carom.solve_pic`; or a scene, or its name in the catalogue.
        observed: The run; or the name of an engine, which then runs the scene.
        score: How they compare; found by `carom.compare` where it is not given.
        dt: Step of an engine that is named, seconds; the scene's frame by default.
        profile: Its profile.

    Raises:
        InputError: The traces can't be compared: see `carom.compare`; or a number of the run is NaN or infinite; or
            `dt` is given with a run.
        UnknownNameError, AdapterError: The engine that is named can't run the scene: see `carom.run`.
    """
    if isinstance(observed, str):
        scene = reference.scene if isinstance(reference, Trace) else as_scene(reference)
        observed = run(scene, observed, dt=dt, profile=profile)
    elif dt is not None:
        raise InputError("dt is the step of an engine that is named; a run that is given has its own")
    if not isinstance(reference, Trace):
        reference = solve_pic(reference)
    if broken := not_finite(observed):
        raise InputError(f"{broken} in the run: what has no place can't be played")
    return Replay(reference, observed, compare(reference, observed) if score is None else score)


def _times(scene: Scene, held_s: float | None) -> NDArray[np.float64]:
    """Return the time of the scene that each frame shows, seconds: evenly, and for a while at what failed first."""
    times = np.linspace(0.0, scene.duration_s, _FILM_S * _FRAMES_PER_S)
    if held_s is None:
        return times
    return np.insert(times, np.searchsorted(times, held_s), np.full(round(_HELD_S * _FRAMES_PER_S), held_s))


def _film(shown: Replay) -> FuncAnimation:
    """Return both runs side by side on one clock, to one scale; what became of an impact is said when it happens.

    Solid is the run that a side is of, grey the exact one, dashed the last look, and a cross an impact missed.
    """
    from matplotlib.animation import FuncAnimation
    from matplotlib.figure import Figure
    from matplotlib.transforms import Affine2D

    reference, observed = shown.reference, shown.observed
    scene, name = reference.scene, f"{observed.method} {observed.profile_shown}".strip()
    rows, places = list(impact_rows(reference, observed, shown.score)), list(meetings(reference))
    k = first_fault(rows)
    at = None if k is None else rows[k].get("at")
    held_s = None if k is None else held_at_s(rows[k], None if at is None else places[at][2], observed)
    times = _times(scene, held_s)
    figure = Figure(figsize=(8.0, 4.4), dpi=80)
    clock = figure.suptitle("")
    limits = limits_of(scene, exact_paths(reference), observed_paths(observed))
    exact, seen = reference_tracks(reference), observed_tracks(observed, extent_of(reference))
    left, right = figure.subplots(1, 2)
    driven: list[tuple[Axes, Drive, Artist]] = []
    for axes, title in ((left, "What must happen"), (right, f"What {name} does")):
        axes.set(title=title, xticks=(), yticks=())  # numbers would take most of the time to draw
        drawn = zip(scene.walls, draw_walls(axes, scene, limits, ends=False), strict=True)
        driven += [(axes, wall.drive, artist) for wall, artists in drawn if wall.driven for artist in artists]
    moving = [*_discs(left, scene, exact, times), *_discs(right, scene, seen, times)]
    moving += _discs(right, scene, exact, times, color=_GHOST, alpha=0.4, path=False)
    if observed.dt_s:
        # The last look at or before each frame; rounding of the quotient must not lose the look that a frame is at.
        looks = np.floor(times / observed.dt_s + 1e-9) * observed.dt_s
        moving += _discs(right, scene, seen, looks, fill=False, linestyle="--", alpha=0.8, path=False)
    crosses = [
        (row["true"], right.plot(*places[row["at"]][:2], "x", color=_WRONG, markersize=12, markeredgewidth=3)[0])
        for row in rows
        if row["flag"] == "missed"
    ]
    words = right.set_xlabel(" ")
    told = [(row.get("reported", row.get("true")), row["became"]) for row in rows]

    def show(frame: int) -> Iterable[Artist]:
        now = times[frame]
        for circle, where in moving:
            circle.set_center(where[frame])
        for axes, drive, artist in driven:
            artist.set_transform(Affine2D().translate(*drive.moved_at(now)) + axes.transData)
        for since, cross in crosses:
            cross.set_visible(bool(now >= since))
        clock.set_text(f"{now:.4g} s of {scene.duration_s:.4g} s")
        said = [became for when, became in told if when is not None and 0 <= now - when < _SAID_FOR * scene.duration_s]
        words.set_text(f"impact {said[-1]}" if said else " ")
        return [circle for circle, _ in moving]

    return FuncAnimation(figure, show, frames=len(times))


def _discs(
    axes: Axes,
    scene: Scene,
    tracks: Sequence[Track],
    times: NDArray[np.float64],
    *,
    path: bool = True,
    alpha: float = 0.8,
    **style: Any,
) -> Iterator[tuple[Circle, NDArray[np.float64]]]:
    """Draw the discs of a run and yield each with where it is at each of some times."""
    from matplotlib.patches import Circle

    for k, (disc, track) in enumerate(zip(scene.discs, tracks, strict=True)):
        if disc.immovable and not path:
            continue
        colour = WALL if disc.immovable else SERIES[k % len(SERIES)]
        places = track.at(np.minimum(times, track.time_s[-1]))
        drawn = Circle(track.position_m[0], disc.radius_m, alpha=alpha, **({"color": colour} | style))
        axes.add_patch(drawn)
        if path:
            axes.plot(*places.T, color=colour, linewidth=0.8)
        yield drawn, places
