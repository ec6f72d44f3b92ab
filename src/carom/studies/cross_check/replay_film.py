"""A replay as a film, which shows a run next to its reference at the same times.

The film becomes slow before the first fault, magnifies the fault, and pauses at it.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from carom.model.prescribed_motion import Drive
from carom.model.scene import Scene
from carom.model.trace import Trace
from carom.report.impact_rows import Json, build_impact_rows
from carom.report.picture import Limits, compute_limits, list_wall_shapes, set_limits
from carom.report.replay_data import ContactPoint, find_first_fault, find_pause_time, list_contact_points
from carom.report.shapes import draw_on_axes
from carom.report.svg import SERIES, SURFACE, WALL
from carom.report.tracks import (
    Track,
    build_exact_paths,
    build_observed_paths,
    build_observed_tracks,
    build_reference_tracks,
    compute_extent,
)
from carom.support.formatting import format_number

if TYPE_CHECKING:
    from matplotlib.animation import FuncAnimation
    from matplotlib.artist import Artist
    from matplotlib.axes import Axes
    from matplotlib.patches import Circle

    from carom.comparator import Score

#: Duration of the film without slow motion. The replay on a page has the same duration, and the same lead time and
#: pause.
_FILM_S = 6
#: Duration of the part before the first fault, at normal speed.
_LEAD_S = 0.6
#: Duration of the pause at the fault.
_PAUSE_S = 1.5
#: A frame of a GIF lasts a whole number of hundredths of a second, here 4.
FRAMES_PER_S = 25
#: Smallest speed of the slow motion, relative to normal speed.
_SLOWEST = 1.0 / 8.0
#: Duration of a flash. Discs flash at each step of the run.
_FLASH_S = 0.45
#: Largest number of flashes at once.
_MOST_FLASHES = 3
#: If a scene has more discs than this, only discs with a missed impact flash.
_MOST_FLASHING_DISCS = 4
#: Half the side of the magnified region, in disc radii. The inset has the same sizes in the replay on a page.
_MAGNIFIED_RADII = 2.5
#: Largest width and height of the magnifying inset, as fractions of the picture's width and height.
_INSET_SIZE = (0.42, 0.56)
#: Smallest magnification of the inset.
_LEAST_MAGNIFICATION = 1.4
#: Colour of exact positions, which is the same in the replay on a page.
_EXACT_COLOUR = "#74777c"
#: Colour of missed impacts, which is the same in the replay on a page.
_MISSED_COLOUR = "#d5452f"
#: Time for which the outcome of an impact is shown, as a fraction of the scene's duration.
_OUTCOME_SHOWN_FOR = 1.0 / 12.0

Array = NDArray[np.float64]


class _Moving(NamedTuple):
    """A circle of the film, with its position (shape ``(frames, 2)``) and opacity in each frame."""

    circle: Circle
    places_m: Array
    alphas: Array | None = None


def build_film(reference: Trace, observed: Trace, score: Score) -> FuncAnimation:
    """Return the reference and the run side by side as an animation, with the same times and the same scale.

    On the side of the run, the discs of the run are solid, exact positions are grey, and positions at the run's latest
    step are dashed. Discs flash at each step. A cross marks a missed impact, and text states the outcome of each
    impact.
    """
    from matplotlib.animation import FuncAnimation
    from matplotlib.figure import Figure
    from matplotlib.transforms import Affine2D

    scene, name = reference.scene, f"{observed.method} {observed.profile_shown}".strip()
    rows, places = list(build_impact_rows(reference, observed, score)), list(list_contact_points(reference))
    exact, run_tracks = build_reference_tracks(reference), build_observed_tracks(observed, compute_extent(reference))
    limits = compute_limits(scene, build_exact_paths(reference), build_observed_paths(observed))
    figure = Figure(figsize=(8.0, 4.4), dpi=80)
    clock = figure.suptitle("")
    left, right = figure.subplots(1, 2)
    pictures = [(left, limits), (right, limits)]
    failing, pause_at_s = list[int](), None
    near: list[Artist] = []  # the inset and its frame, shown while the film is slow
    if (fault := find_first_fault(rows)) is not None:
        failing, index = rows[fault]["bodies"], rows[fault].get("at")
        pause_at_s = find_pause_time(rows[fault], None if index is None else places[index].overlap_s, observed)
        first: Track = run_tracks[failing[0]]
        middle = first.positions_at(np.array([pause_at_s]))[0] if index is None else np.array(places[index][:2])
        reach = _MAGNIFIED_RADII * max(scene.discs[body].radius_m for body in failing if body >= 0)
        if _compute_inset_side(limits) >= _LEAST_MAGNIFICATION * 2.0 * reach:
            magnified = (middle - reach, middle + reach)
            inset, frame = _draw_inset(right, magnified, limits)
            near += [inset, frame]
            pictures.append((inset, magnified))
    times = _compute_frame_times(scene, pause_at_s)
    moving: list[_Moving] = []
    crosses: list[tuple[float, Artist]] = []
    driven: list[tuple[Axes, Drive, Artist]] = []
    for axes, region in pictures:
        axes.set(xticks=(), yticks=())  # tick labels would take most of the drawing time
        set_limits(axes, region)
        for wall in scene.walls:
            artists = draw_on_axes(axes, list_wall_shapes(wall, region))
            if wall.driven:
                driven += [(axes, wall.drive, artist) for artist in artists]
        moving += _draw_discs(axes, scene, exact if axes is left else run_tracks, times)
        if axes is left:
            continue
        moving += _draw_discs(axes, scene, exact, times, color=_EXACT_COLOUR, alpha=0.4, path=False)
        if observed.dt_s:
            moving += _draw_frames(axes, scene, run_tracks, times, observed.dt_s, failing)
        crosses += _draw_crosses(axes, rows, places)
    left.set_title("Exact")
    right.set_title(name)
    words = right.set_xlabel(" ")
    changes = [(row.get("reported", row.get("true")), row["became"]) for row in rows]

    def show(frame: int) -> Iterable[Artist]:
        time_s = times[frame]
        for circle, centres, alphas in moving:
            circle.set_center(centres[frame])
            if alphas is not None:
                circle.set_alpha(alphas[frame])
        for axes, drive, artist in driven:
            artist.set_transform(Affine2D().translate(*drive.moved_at(time_s)) + axes.transData)
        for since, cross in crosses:
            cross.set_visible(bool(time_s >= since))
        for artist in near:
            artist.set_visible(pause_at_s is not None and bool(abs(time_s - pause_at_s) <= _compute_lead_time(scene)))
        clock.set_text(f"{format_number(time_s, 4)} s of {format_number(scene.duration_s, 4)} s")
        shown_for_s = _OUTCOME_SHOWN_FOR * scene.duration_s
        recent = [became for at_s, became in changes if at_s is not None and 0 <= time_s - at_s < shown_for_s]
        words.set_text(f"impact {recent[-1]}" if recent else " ")
        return [circle for circle, *_ in moving]

    return FuncAnimation(figure, show, frames=len(times))


def _draw_crosses(axes: Axes, rows: Iterable[Json], places: Sequence[ContactPoint]) -> list[tuple[float, Artist]]:
    """Draw a cross at each missed impact. Return each cross with the time, in seconds, from which it is shown."""
    style: dict[str, Any] = {"color": _MISSED_COLOUR, "markersize": 12, "markeredgewidth": 3}
    missed = [row for row in rows if row["flag"] == "missed"]
    return [(row["true"], axes.plot(*places[row["at"]][:2], "x", **style)[0]) for row in missed]


def _compute_frame_times(scene: Scene, pause_at_s: float | None) -> Array:
    """Return the scene's time in each frame of the film, in seconds.

    The film is slower before the first fault, and pauses at the fault.
    """
    step_s, time_s, before = scene.duration_s / (_FILM_S * FRAMES_PER_S), 0.0, list[float]()
    while pause_at_s is not None and time_s < pause_at_s:
        before.append(time_s)
        speed = min(1.0, max(_SLOWEST, (pause_at_s - time_s) / _compute_lead_time(scene)))
        time_s = min(pause_at_s, time_s + step_s * speed)
    pause = [] if pause_at_s is None else [pause_at_s] * (round(_PAUSE_S * FRAMES_PER_S) - 1)
    after = np.linspace(time_s, scene.duration_s, max(1, round((scene.duration_s - time_s) / step_s)))
    return np.concatenate([before, pause, after])


def _compute_lead_time(scene: Scene) -> float:
    """Return for how many simulated seconds before the first fault the film is slower."""
    return scene.duration_s * _LEAD_S / _FILM_S


def _draw_discs(
    axes: Axes, scene: Scene, tracks: Sequence[Track], times: Array, *, path: bool = True, **style: Any
) -> Iterator[_Moving]:
    """Draw the discs of a run, and yield each disc with its positions at the given times."""
    from matplotlib.patches import Circle

    for k, (disc, track) in enumerate(zip(scene.discs, tracks, strict=True)):
        if disc.immovable and not path:
            continue
        color = WALL if disc.immovable else SERIES[k % len(SERIES)]
        places = track.positions_at(np.minimum(times, track.time_s[-1]))
        drawn = Circle(track.position_m[0], disc.radius_m, **({"color": color, "alpha": 0.8} | style))
        axes.add_patch(drawn)
        if path:
            axes.plot(*places.T, color=color, linewidth=0.8)
        yield _Moving(drawn, places)


def _draw_frames(
    axes: Axes, scene: Scene, tracks: Sequence[Track], times: Array, dt_s: float, failing: Sequence[int]
) -> Iterator[_Moving]:
    """Draw the discs at the run's latest step before each time.

    Also draw fading flashes of the discs at the last few steps.
    """
    # The added 1e-9 prevents rounding down to the previous step.
    latest_steps, frames = np.floor(times / dt_s + 1e-9), np.arange(len(times))
    yield from _draw_discs(axes, scene, tracks, latest_steps * dt_s, fill=False, linestyle="--", path=False)
    is_failing_only = len(scene.discs) > _MOST_FLASHING_DISCS and bool(failing)
    for steps_back in range(_MOST_FLASHES):
        since = frames - np.searchsorted(latest_steps, latest_steps - steps_back)
        alphas = np.clip(1.0 - since / (_FLASH_S * FRAMES_PER_S), 0.0, 1.0) * (latest_steps >= steps_back)
        step_time_s = np.maximum(latest_steps - steps_back, 0.0) * dt_s
        flashing = _draw_discs(axes, scene, tracks, step_time_s, fill=False, linewidth=2.5, path=False)
        movable = (k for k, disc in enumerate(scene.discs) if not disc.immovable)
        for k, moving in zip(movable, flashing, strict=True):
            yield moving._replace(alphas=np.zeros(len(times)) if is_failing_only and k not in failing else alphas)


def _compute_inset_side(limits: Limits) -> float:
    """Return the side length of the inset, in metres at the scale of the surrounding picture."""
    return float(np.min(np.array(_INSET_SIZE) * (limits[1] - limits[0])))


def _draw_inset(axes: Axes, region: Limits, limits: Limits) -> tuple[Axes, Artist]:
    """Draw an inset in the corner that is farthest from the magnified region, and a frame around this region.

    Return the inset and the frame.
    """
    from matplotlib.patches import Rectangle

    (low, high), side = limits, _compute_inset_side(limits)
    size, gap = region[1] - region[0], 0.02 * side
    corner = np.where(region[0] + size / 2.0 < (low + high) / 2.0, high - side - gap, low + gap)
    frame = axes.add_patch(Rectangle(tuple(region[0]), *size, fill=False, linestyle=":"))
    inset = axes.inset_axes((*corner.tolist(), side, side), transform=axes.transData, facecolor=SURFACE)
    inset.set_zorder(10)
    inset.spines[:].set_visible(True)
    return inset, frame
