"""Pictures of runs next to the reference: the paths of the discs, and their impacts."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from itertools import pairwise
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from carom.model.scene import Wall
from carom.model.trace import Trace
from carom.model.walls import move_wall
from carom.report import formatting
from carom.report.paths import ImpactPosition, Paths, build_exact_paths, build_observed_paths
from carom.report.svg import INK, MUTED, SERIES, SURFACE, WALL, build_figure, render, use_drawing_style

if TYPE_CHECKING:
    from matplotlib.artist import Artist
    from matplotlib.axes import Axes

    from carom.model.chain_geometry import Outline
    from carom.model.scene import Scene
    from carom.model.walls import AnyWall

Limits = tuple[NDArray[np.float64], NDArray[np.float64]]
#: Discs with the positions at which a picture shows them for a missed impact.
_Misses = Sequence[tuple[int, NDArray[np.float64]]]

_WIDTH_IN = 3.3
#: Smallest and largest height of a picture, as a fraction of its width. A flat scene gets empty space above and below.
_FLATTEST, _TALLEST = 0.28, 1.0
_MARGIN = 0.06
#: Largest size of the shown region, divided by the extent of the reference. Without this limit, the scene would shrink
#: to a dot if an engine throws discs far away.
_WIDEST = 1.6
#: Largest number of impacts at which discs are drawn as circles. More circles would hide the paths, so dots are drawn
#: instead.
_MOST_IMPACT_POSITIONS = 8
#: Largest number of steps whose states are drawn as dots. More dots would merge into a line.
_MOST_FRAMES = 40
_MOST_MISSES = 4
#: Number of straight lines with which a whole circle is drawn. The lines differ from the circle by less than 1/2000 of
#: its radius.
ARC_PARTS = 100

#: Opacity with which a body with a prescribed motion is drawn at its final position.
_GONE = 0.3

#: Style of walls and immovable discs.
_SOLID: dict[str, Any] = {"facecolor": "none", "edgecolor": WALL, "hatch": "////", "linewidth": 1.0, "zorder": 1}


def draw_pair(reference: Trace, observed: Trace, missed: Sequence[int], labels: tuple[str, str]) -> list[str]:
    """Draw a run next to its reference, to the same scale, and return both pictures as SVG.

    Args:
        reference: The reference trace.
        observed: The run.
        missed: Indices of the impacts of the reference that the run missed.
        labels: Accessible names of the drawings.
    """
    scene, right, found = reference.scene, build_exact_paths(reference), build_observed_paths(observed)
    axis, limits = _find_axis_of_motion(right, scene), compute_limits(scene, right, found)
    if axis is not None:
        sides = zip((right, found), labels, strict=True)
        return [_render_over_time(scene, paths, axis, limits, label) for paths, label in sides]
    misses = _find_missed_frames(reference, found, missed) if len(missed) <= _MOST_MISSES else []
    dotted = max(len(right.impact_positions), len(found.impact_positions)) > _MOST_IMPACT_POSITIONS
    return _render_in_plane(scene, [(right, ()), (found, misses)], limits, labels, dotted=dotted)


def draw_traces(several: Sequence[Axes], traces: Sequence[Trace]) -> None:
    """Draw the paths, impacts and walls of several traces of one scene, to the same scale, each on its own axes.

    Usually the drawings show the plane in which the discs move. But if all discs of the first trace move along one
    line, the drawings show positions on this line against time.
    """
    scene, paths = traces[0].scene, [build_observed_paths(trace) for trace in traces]
    corners = [compute_limits(scene, paths[0], other) for other in paths]
    limits = np.min([low for low, _ in corners], axis=0), np.max([high for _, high in corners], axis=0)
    axis = _find_axis_of_motion(paths[0], scene)
    dotted = max(len(one.impact_positions) for one in paths) > _MOST_IMPACT_POSITIONS
    for axes, one in zip(several, paths, strict=True):
        if axis is not None:
            _draw_over_time(axes, scene, one, axis, limits)
        else:
            draw_walls(axes, scene, limits)
            _draw_paths(axes, scene, one, dotted=dotted)
            axes.set(xlabel="x in m", ylabel="y in m")


def draw_start(axes: Axes, scene: Scene) -> None:
    """Draw the discs and walls of a scene at the start, with velocities as arrows."""
    start = scene.arrays
    paths = Paths(tuple((np.zeros(1), place[None]) for place in start.position_m), ())
    draw_walls(axes, scene, compute_limits(scene, paths, paths))
    _draw_paths(axes, scene, paths, dotted=False)
    axes.set(xlabel="x in m", ylabel="y in m")
    if start.velocity_m_s.any():
        axes.quiver(*start.position_m.T, *start.velocity_m_s.T, angles="xy", color=INK, width=0.006, zorder=5)


def _find_axis_of_motion(paths: Paths, scene: Scene) -> int | None:
    """Return the axis along which all discs move (0: x, 1: y); None if there is none or a wall is not a half-plane."""
    if not all(isinstance(wall, Wall) for wall in scene.walls):
        return None
    movable = [k for k, disc in enumerate(scene.discs) if not disc.immovable]
    for axis in (0, 1):
        across = [paths.lines[k][1][:, 1 - axis] for k in movable]
        if across and max(float(np.ptp(line)) for line in across) < 1e-6 * min(disc.radius_m for disc in scene.discs):
            return axis
    return None


def compute_limits(scene: Scene, reference: Paths, observed: Paths) -> Limits:
    """Return the lower left and the upper right corner of the shown region, in metres."""
    radius = max(disc.radius_m for disc in scene.discs)
    low, high = reference.compute_bounds()
    low, high = low - radius, high + radius
    spare = (_WIDEST - 1.0) / 2.0 * float(np.max(high - low))
    other_low, other_high = observed.compute_bounds()
    low = np.maximum(np.minimum(low, other_low - radius), low - spare)
    high = np.minimum(np.maximum(high, other_high + radius), high + spare)
    margin = _MARGIN * float(np.max(high - low))
    return low - margin, high + margin


def _find_missed_frames(reference: Trace, observed: Paths, missed: Sequence[int]) -> _Misses:
    """Return the discs of each missed impact, with their positions at the steps just before and after the impact."""
    if not observed.sampled:
        return []
    disc_positions = []
    times, _ = observed.lines[0]
    for impact in reference.impacts[list(missed)]:
        after = int(np.searchsorted(times, impact["time_s"]))
        for frame in (after - 1, after):
            if 0 <= frame < len(times):
                discs = [int(body) for body in (impact["first"], impact["second"]) if body >= 0]
                disc_positions += [(disc, observed.lines[disc][1][frame]) for disc in discs]
    return disc_positions


def _colour_of(disc: int) -> str:
    return SERIES[disc % len(SERIES)]


def _render_in_plane(
    scene: Scene, sides: Sequence[tuple[Paths, _Misses]], limits: Limits, labels: Sequence[str], *, dotted: bool
) -> list[str]:
    """Return a picture of each of `sides`. They reuse one set of axes: creating axes takes longer than drawing."""
    drawings: list[str] = []
    low, high = limits
    width, height = high - low
    aspect = min(max(height / width, _FLATTEST), _TALLEST)
    # Both axes have the same scale, so the picture shows a larger region along its longer side.
    spare = np.array([max(height / aspect - width, 0.0), max(width * aspect - height, 0.0)]) / 2.0
    with use_drawing_style():
        figure = build_figure(_WIDTH_IN, _WIDTH_IN * aspect)
        axes = figure.add_axes((0.0, 0.0, 1.0, 1.0))
        axes.set_axis_off()
        for (paths, misses), label in zip(sides, labels, strict=True):
            draw_walls(axes, scene, (low - spare, high + spare))
            _draw_paths(axes, scene, paths, misses, dotted=dotted)
            drawings.append(render(figure, label))
            for artist in (*axes.patches, *axes.lines, *axes.texts):
                artist.remove()
    return drawings


def _draw_paths(axes: Axes, scene: Scene, paths: Paths, misses: _Misses = (), *, dotted: bool) -> None:
    from matplotlib.patches import Circle

    def draw_circle(
        disc: int, centre: NDArray[np.float64], alpha: float, line: str, linewidth: float, order: float
    ) -> None:
        if not np.isfinite(centre).all():
            return
        radius, colour = scene.discs[disc].radius_m, _colour_of(disc)
        if alpha:
            axes.add_artist(Circle(tuple(centre), radius, color=colour, alpha=alpha, linewidth=0, zorder=order))
        edge = {"edgecolor": colour, "linestyle": line, "linewidth": linewidth, "zorder": order + 0.1}
        axes.add_artist(Circle(tuple(centre), radius, fill=False, **edge))

    def mark(disc: int, centre: NDArray[np.float64], time_s: float) -> None:
        """Draw the outer part of a radius, which shows the angle of a turning disc."""
        if not paths.turned or not np.isfinite(centre).all():
            return
        angle = paths.turned[disc].angle_at(time_s)
        radius_vector = scene.discs[disc].radius_m * np.array([math.cos(angle), math.sin(angle)])
        ends = np.stack([centre + 0.45 * radius_vector, centre + radius_vector])
        axes.plot(*ends.T, color=_colour_of(disc), linewidth=1.5, zorder=3.7, solid_capstyle="butt")

    for k, disc in enumerate(scene.discs):
        times, points = paths.lines[k]
        if disc.immovable:
            axes.add_artist(Circle(disc.position_m, disc.radius_m, **_SOLID))
            if disc.driven:
                axes.add_artist(Circle(tuple(points[-1]), disc.radius_m, **(_SOLID | {"alpha": _GONE})))
            continue
        axes.plot(points[:, 0], points[:, 1], color=_colour_of(k), linewidth=1.1, zorder=2, solid_joinstyle="round")
        draw_circle(k, points[0], 0.0, "-", 0.9, 3)
        draw_circle(k, points[-1], 0.45, "-", 1.1, 3)
        for end in (0, -1):
            mark(k, points[end], float(times[end]))
        _draw_number(axes, k, points[0])
        if paths.sampled and len(points) <= _MOST_FRAMES:
            _draw_dots(axes, points, k, marker=".", size=3.2)
    for k, impact_positions in _group_by_disc(scene, paths):
        if dotted:
            _draw_dots(axes, np.array([point.position_m for point in impact_positions]), k)
        else:
            for point in impact_positions:
                draw_circle(k, point.position_m, 0.16, "-", 1.5, 3.5)
                mark(k, point.position_m, point.time_s)
    for disc_number, centre in misses:
        draw_circle(disc_number, centre, 0.0, (0, (2.5, 2.0)), 1.0, 3.5)  # type: ignore[arg-type] # a dash pattern


def _group_by_disc(scene: Scene, paths: Paths) -> Iterator[tuple[int, list[ImpactPosition]]]:
    for k, disc in enumerate(scene.discs):
        impact_positions = [point for point in paths.impact_positions if point.disc == k]
        if impact_positions and not disc.immovable:
            yield k, impact_positions


def _draw_dots(axes: Axes, points: NDArray[np.float64], disc: int, marker: str = "o", size: float = 2.8) -> None:
    axes.plot(*points.T, linestyle="", marker=marker, markersize=size, color=_colour_of(disc), zorder=4)


def _draw_number(axes: Axes, disc: int, centre: NDArray[np.float64]) -> None:
    style: dict[str, Any] = {"ha": "center", "va": "center", "fontsize": 8, "color": INK, "zorder": 6}
    background = {"boxstyle": "circle,pad=0.15", "facecolor": SURFACE, "edgecolor": "none", "alpha": 0.8}
    axes.text(centre[0], centre[1], str(disc), bbox=background, **style)


def draw_walls(axes: Axes, scene: Scene, limits: Limits, *, ends: bool = True) -> list[list[Artist]]:
    """Set the limits and equal scales of a picture, draw the walls, and return the artists of each wall.

    Walls are drawn at their initial position. If `ends` is true, moving walls are also drawn faintly at their final
    position.
    """
    low, high = limits
    axes.set_xlim(low[0], high[0])
    axes.set_ylim(low[1], high[1])
    axes.set_aspect("equal")
    if ends:
        for wall in scene.walls:
            if wall.driven:
                list(_draw_wall(axes, move_wall(wall, *wall.drive.moved_at(scene.duration_s)), limits, alpha=_GONE))
    return [list(_draw_wall(axes, wall, limits)) for wall in scene.walls]


def _draw_wall(axes: Axes, wall: AnyWall, limits: Limits, **style: float) -> Iterator[Artist]:
    """Draw a wall, and yield its artists. `style` is added to the style of walls."""
    from matplotlib.patches import Polygon

    if not isinstance(wall, Wall):
        yield from _draw_outline(axes, wall.outline, **style)
        return
    low, high = limits
    reach = 4.0 * float(np.max(high - low))  # both ends of the line are outside the picture
    normal = np.array(wall.normal)
    along = np.array([-normal[1], normal[0]])
    # The wall's given point may be far away, so use its point nearest to the picture's middle.
    middle = (low + high) / 2.0
    foot = middle + normal * float((np.array(wall.point_m) - middle) @ normal)
    ends, behind = [foot - along * reach, foot + along * reach], normal * reach
    corners = [*ends, ends[1] - behind, ends[0] - behind]
    yield axes.add_artist(Polygon(corners, **(_SOLID | style)))


def _draw_outline(axes: Axes, outline: Outline, **style: Any) -> Iterator[Artist]:
    from matplotlib.patches import Circle, Polygon

    points = np.array(list(outline.build_polyline(ARC_PARTS)))
    if outline.solid:
        yield axes.add_artist(Polygon(points, **(_SOLID | style)))
    yield from axes.plot(*points.T, color=WALL, linewidth=1.5, zorder=1, solid_capstyle="butt", **style)
    width = outline.half_width
    if width == 0.0:
        return
    shade = {"facecolor": WALL, "edgecolor": "none", "zorder": 1, **style}
    for a, b in pairwise(points):
        along = (b - a) / (np.hypot(*(b - a)) or 1.0)
        across = width * np.array([-along[1], along[0]])
        yield axes.add_artist(Polygon([a + across, b + across, b - across, a - across], **shade))
        yield axes.add_artist(Circle(a, width, **shade))
    yield axes.add_artist(Circle(points[-1], width, **shade))


def _render_over_time(scene: Scene, paths: Paths, axis: int, limits: Limits, label: str) -> str:
    with use_drawing_style():
        figure = build_figure(_WIDTH_IN, _WIDTH_IN)
        _draw_over_time(figure.add_axes((0.155, 0.135, 0.825, 0.845)), scene, paths, axis, limits)
        return render(figure, label)


def _draw_over_time(axes: Axes, scene: Scene, paths: Paths, axis: int, limits: Limits) -> None:
    """Draw positions on the line of motion against time.

    Each disc is drawn as a band of the disc's width, so that readers see when two discs touch.
    """
    from matplotlib.ticker import MaxNLocator

    low, high = limits[0][axis], limits[1][axis]
    for k, disc in enumerate(scene.discs):
        times, points = paths.lines[k]
        along = points[:, axis]
        colour = WALL if disc.immovable else _colour_of(k)
        edges = (along - disc.radius_m, along + disc.radius_m)
        axes.fill_betweenx(times, *edges, color=colour, alpha=0.18, linewidth=0)
        for edge in edges:
            axes.plot(edge, times, color=colour, linewidth=0.8, alpha=0.8)
        axes.plot(along, times, color=colour, linewidth=1.2)
        _draw_number(axes, k, np.array([along[0], 0.0]))
    for wall in scene.half_planes():
        if abs(wall.normal[axis]) > math.sqrt(0.5):  # the wall is perpendicular to the line of motion
            end = low if wall.normal[axis] > 0 else high
            begin = wall.point_m[axis]
            if wall.driven:
                begins_s = [leg.begin_s for leg in wall.drive.legs if leg.begin_s < scene.duration_s]
                times_s = [*begins_s, scene.duration_s]
                axes.fill_betweenx(times_s, [begin + wall.drive.moved_at(t)[axis] for t in times_s], end, **_SOLID)
            else:
                axes.axvspan(begin, end, **_SOLID)
    for k, impact_positions in _group_by_disc(scene, paths):
        _draw_dots(axes, np.array([(point.position_m[axis], point.time_s) for point in impact_positions]), k)
    axes.set_xlim(low, high)
    axes.set_ylim(0.0, scene.duration_s)
    axes.set_xlabel(f"{'xy'[axis]} in m")
    axes.set_ylabel("time in s")
    axes.tick_params(length=2.5, color=MUTED)
    for side in (axes.xaxis, axes.yaxis):
        side.set_major_locator(MaxNLocator(5))
        side.set_major_formatter(lambda value, _: formatting.format_number(value, 3))
