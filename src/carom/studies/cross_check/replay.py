"""Animated replay of one run next to its reference: in a notebook, as a page, or as a film."""

from __future__ import annotations

import tempfile
from dataclasses import dataclass
from html import escape
from pathlib import Path

from carom.comparator import Score, compare
from carom.comparator.non_finite import find_non_finite
from carom.errors import InputError, MissingExtraError
from carom.execution.job import Job, Method, Status
from carom.execution.results import Row
from carom.model.scene import Scene, to_scene
from carom.model.trace import Trace
from carom.report.files import pack_data, require_report_extra
from carom.report.picture import draw_pair
from carom.report.render.html import render_replay_page
from carom.report.replay_data import build_replay_data, describe_run, format_run_command
from carom.report.svg import use_drawing_style
from carom.solvers.pic import solve_pic
from carom.studies.cross_check.replay_film import FRAMES_PER_S, build_film
from carom.studies.cross_check.run import run
from carom.support.checks import check_instance
from carom.support.escaping import escape_controls
from carom.support.folders import write_file
from carom.support.limits import MOST_DISCS_DRAWN

#: Largest number of impacts that a still picture can show.
_MOST_IMPACTS_DRAWN = 1000


@dataclass(frozen=True, repr=False)
class Replay:
    """A run next to its reference, as returned by `carom.replay`.

    Attributes:
        reference: The reference.
        observed: The run.
        score: The score of the run.
    """

    reference: Trace
    observed: Trace
    score: Score

    def __repr__(self) -> str:
        return f"Replay of {self.observed!r}"

    def html(self) -> str:
        """Return the replay as an HTML page in one file, with a table of all impacts.

        Raises:
            MissingExtraError: The extra `report` is not installed.
        """
        trace = self.observed
        job = Job(trace.scene, Method(trace.method, trace.profile, tuple(trace.overrides.items())), trace.dt_s)
        row = Row(job, Status.RAN, trace=trace, score=self.score)
        # A trace from a direct call of a solver has no profile, so no command can repeat it.
        command = format_run_command("scene.toml", job) if trace.profile else ""
        description = describe_run(row, trace.method, escape_controls(trace.scene.name), command)
        data = pack_data(build_replay_data(self.reference, [(trace, self.score, description)]))
        return render_replay_page(escape_controls(trace.scene.name), data, description["said"], self._draw_stills())

    def _draw_stills(self) -> list[tuple[str, str]]:
        """Return captions and SVG pictures for browsers without JavaScript; an empty list if they can't be drawn."""
        trace, name = self.observed, f"{self.observed.method} {self.observed.profile_shown}".strip()
        many = len(trace.scene.discs) > MOST_DISCS_DRAWN or len(trace.impacts) > _MOST_IMPACTS_DRAWN
        if many or find_non_finite(trace):
            return []
        labels = (f"Exact: {escape_controls(trace.scene.name)}", name)
        return list(zip(labels, draw_pair(self.reference, trace, self.score.missed, labels), strict=True))

    def _repr_html_(self) -> str | None:
        try:
            page = self.html()
        except MissingExtraError:
            return None
        # The sandbox isolates the page from the notebook. The height suffices for both pictures and the buttons on a
        # phone.
        frame = 'sandbox="allow-scripts" style="width:100%;height:54em;border:0"'
        return f'<iframe title="replay" {frame} srcdoc="{escape(page)}"></iframe>'

    def save(self, path: str | Path) -> Path:
        """Write the replay to a page (``.html``) or a film (``.gif``, ``.mp4``), and return its path.

        Raises:
            InputError: The path has another suffix.
            MissingExtraError: The extra `report`, or for ``.mp4`` the program ffmpeg, is not installed.
            OSError: The file can't be written.
        """
        path = Path(path)
        if path.suffix == ".html":
            return write_file(path, self.html())
        if path.suffix not in {".gif", ".mp4"}:
            suffix_text = repr(path.suffix) if path.suffix else "no suffix"
            raise InputError(f"a replay must be saved as .html, .gif or .mp4, got {suffix_text}")
        require_report_extra()
        from matplotlib.animation import FFMpegWriter, PillowWriter

        if path.suffix == ".mp4" and not FFMpegWriter.isAvailable():
            raise MissingExtraError(
                "an .mp4 needs the program ffmpeg, which is not installed", hints=[".gif and .html do not need it"]
            )
        writer = (PillowWriter if path.suffix == ".gif" else FFMpegWriter)(fps=FRAMES_PER_S)
        with tempfile.TemporaryDirectory() as folder, use_drawing_style():
            temporary_file = Path(folder) / path.name
            build_film(self.reference, self.observed, self.score).save(temporary_file, writer=writer)
            return write_file(path, temporary_file.read_bytes())


def replay(
    reference: Trace | Scene | str,
    observed: Trace | str,
    *,
    score: Score | None = None,
    dt: float | None = None,
    profile: str = "tuned",
) -> Replay:
    """Return a replay of a run next to its reference, to show in a notebook or to save.

    Args:
        reference: The reference (usually from `carom.solve_pic`), a scene, or the name of a catalogue scene.
        observed: The run, or the name of an engine to run the scene.
        score: The score of the run (default: computed by `carom.compare`).
        dt: Step size of the named engine, in seconds (default: the scene's frame).
        profile: Profile of the named engine.

    Raises:
        InputError: The traces can't be compared (see `carom.compare`), a number of the run is NaN or infinite, or `dt`
            is given with a run.
        UnknownNameError: The engine or the profile does not exist.
        AdapterError: The engine can't run the scene; see `carom.run`.

    Examples:
        >>> replay = carom.replay("paper/missed", "pit")
        >>> replay.score.missed
        (0,)
        >>> replay.save("missed.html").name
        'missed.html'
    """
    if isinstance(observed, str):
        scene = reference.scene if isinstance(reference, Trace) else to_scene(reference)
        observed = run(scene, observed, dt=dt, profile=profile)
    elif dt is not None:
        raise InputError("dt is allowed only with an engine name; a given run has its own step size")
    if not isinstance(reference, Trace):
        reference = solve_pic(reference)
    check_instance("observed", observed, Trace)
    if broken := find_non_finite(observed):
        raise InputError(f"{broken} in the run, so it can't be replayed")
    return Replay(reference, observed, compare(reference, observed) if score is None else score)
