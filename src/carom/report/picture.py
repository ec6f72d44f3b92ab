"""Pictures of runs next to the reference: the paths of the discs, and their impacts."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import replace
from itertools import pairwise
from typing import TYPE_CHECKING

import numpy as np

from carom.model.scene import Wall
from carom.model.trace import Trace
from carom.model.walls import move_wall
from carom.report.shapes import (
    Circle,
    Dots,
    Line,
    Number,
    Polygon,
    Shape,
    Style,
    draw_on_axes,
    render_svg,
)
from carom.report.svg import INK, MUTED, SERIES, WALL, build_figure, render, use_drawing_style
from carom.report.tracks import Array, Paths, build_exact_paths, build_observed_paths
from carom.support import formatting

if TYPE_CHECKING:
    from matplotlib.axes import Axes

    from carom.model.chain_geometry import Outline
    from carom.model.scene import Scene
    from carom.model.walls import AnyWall

Limits = tuple[Array, Array]
#: Discs of missed impacts, each with the positions at which a picture shows the disc.
_Misses = Sequence[tuple[int, Array]]

_WIDTH_PT, _PT_PER_IN = 237.6, 72.0
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
#: Diameters of the dots for impacts and for steps.
_IMPACT_DOT_PT, _FRAME_DOT_PT = 2.8, 1.6
#: Number of straight lines with which a whole circle is drawn. The lines differ from the circle by less than 1/2000 of
#: its radius.
ARC_PARTS = 100

#: Opacity with which a body with a prescribed motion is drawn at its final position.
_GONE = 0.3

#: Style of walls and immovable discs.
_SOLID = Style(1, edge=WALL, hatched=True)


def draw_pair(reference: Trace, observed: Trace, missed: Sequence[int], labels: tuple[str, str]) -> list[str]:
    """Draw a run next to its reference, to the same scale, and return both pictures as SVG.

    Args:
        reference: The reference trace.
        observed: The run.
        missed: Indices of the impacts of the reference that the run missed.
        labels: Accessible names of the drawings.
    """
    scene, right, found = reference.scene, build_exact_paths(reference), build_observed_paths(observed)
    axis, limits, dotted = _plan_pictures(scene, (right, found))
    if axis is not None:
        sides = zip((right, found), labels, strict=True)
        return [_render_over_time(scene, paths, axis, limits, label) for paths, label in sides]
    misses = _find_missed_frames(reference, found, missed) if len(missed) <= _MOST_MISSES else []
    low, high = _extend_to_shape(limits)
    return [
        render_svg(_list_shapes(scene, paths, (low, high), shown, dotted=dotted), low, high, _WIDTH_PT, label)
        for paths, shown, label in ((right, (), labels[0]), (found, misses, labels[1]))
    ]


def draw_traces(several: Sequence[Axes], traces: Sequence[Trace]) -> None:
    """Draw the paths, impacts and walls of several traces of one scene, to the same scale, each on its own axes.

    Usually the drawings show the plane in which the discs move. But if all discs of the first trace move along one
    line, the drawings show positions on this line against time.
    """
    scene, paths = traces[0].scene, [build_observed_paths(trace) for trace in traces]
    axis, limits, dotted = _plan_pictures(scene, paths)
    for axes, one in zip(several, paths, strict=True):
        if axis is not None:
            _draw_over_time(axes, scene, one, axis, limits)
        else:
            _draw_in_plane(axes, scene, one, limits, dotted=dotted)


def draw_start(axes: Axes, scene: Scene) -> None:
    """Draw the discs and walls of a scene at the start, with velocities as arrows."""
    start = scene.arrays
    paths = Paths(tuple((np.zeros(1), place[None]) for place in start.position_m))
    _draw_in_plane(axes, scene, paths, compute_limits(scene, paths, paths), dotted=False)
    if start.velocity_m_s.any():
        axes.quiver(*start.position_m.T, *start.velocity_m_s.T, angles="xy", color=INK, width=0.006, zorder=5)


def _plan_pictures(scene: Scene, several: Sequence[Paths]) -> tuple[int | None, Limits, bool]:
    """Return what all pictures of a scene have in common.

    Returns:
        The axis along which all discs move (see `_find_axis_of_motion`), the shown region, and whether the impacts are
        drawn as dots, because a picture has too many impacts for circles.
    """
    corners = [compute_limits(scene, several[0], other) for other in several]
    limits = np.min([low for low, _ in corners], axis=0), np.max([high for _, high in corners], axis=0)
    dotted = any(sum(len(times) for times, _ in one.impacts) > _MOST_IMPACT_POSITIONS for one in several)
    return _find_axis_of_motion(several[0], scene), limits, dotted


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


def _extend_to_shape(limits: Limits) -> Limits:
    """Return a region with the same middle that is neither too flat nor too tall for a picture."""
    low, high = limits
    width, height = high - low
    aspect = min(max(height / width, _FLATTEST), _TALLEST)
    spare = np.array([max(height / aspect - width, 0.0), max(width * aspect - height, 0.0)]) / 2.0
    return low - spare, high + spare


def _draw_in_plane(axes: Axes, scene: Scene, paths: Paths, limits: Limits, *, dotted: bool) -> None:
    set_limits(axes, limits)
    draw_on_axes(axes, _list_shapes(scene, paths, limits, dotted=dotted))
    axes.set(xlabel="x in m", ylabel="y in m")


def _list_shapes(scene: Scene, paths: Paths, limits: Limits, misses: _Misses = (), *, dotted: bool) -> Iterator[Shape]:
    """Yield the walls, the paths, and the discs at the start, at impacts and at the end."""
    for wall in scene.walls:
        yield from list_wall_shapes(wall, limits)
        if wall.driven:  # also draw the wall at its final position
            yield from list_wall_shapes(move_wall(wall, *wall.drive.moved_at(scene.duration_s)), limits, opacity=_GONE)
    for k, disc in enumerate(scene.discs):
        times, points = paths.lines[k]
        if disc.immovable:
            yield Circle(disc.position_m, disc.radius_m, _SOLID)
            if disc.driven:
                yield Circle(points[-1], disc.radius_m, replace(_SOLID, opacity=_GONE))
            continue
        yield Line(points, Style(2, edge=_colour_of(k), width_pt=1.1))
        yield from _list_disc_shapes(scene, k, points[0], Style(3, width_pt=0.9, opacity=0.0))
        yield from _list_disc_shapes(scene, k, points[-1], Style(3, width_pt=1.1, opacity=0.45))
        for end in (0, -1):
            yield from _mark_angle(scene, paths, k, points[end], float(times[end]))
        yield Number(points[0], k)
        if paths.sampled and len(points) <= _MOST_FRAMES:
            yield Dots(points, _FRAME_DOT_PT, Style(4, fill=_colour_of(k)))
    for k, times, points in _list_impacts_by_disc(scene, paths):
        if dotted:
            yield Dots(points, _IMPACT_DOT_PT, Style(4, fill=_colour_of(k)))
            continue
        for time_s, point in zip(times.tolist(), points, strict=True):
            yield from _list_disc_shapes(scene, k, point, Style(3.5, width_pt=1.5, opacity=0.16))
            yield from _mark_angle(scene, paths, k, point, time_s)
    for disc_number, centre in misses:
        style = Style(3.6, edge=_colour_of(disc_number), dashes_pt=(2.5, 2.0))
        yield Circle(centre, scene.discs[disc_number].radius_m, style)


def _list_disc_shapes(scene: Scene, disc: int, centre: Array, style: Style) -> Iterator[Shape]:
    """Yield a disc's area, with the style's opacity, and its opaque outline."""
    radius, colour = scene.discs[disc].radius_m, _colour_of(disc)
    if style.opacity:
        yield Circle(centre, radius, replace(style, fill=colour, width_pt=0.0))
    yield Circle(centre, radius, replace(style, edge=colour, opacity=1.0, order=style.order + 0.1))


def _mark_angle(scene: Scene, paths: Paths, disc: int, centre: Array, time_s: float) -> Iterator[Shape]:
    """Yield the outer part of a radius, which shows the angle of a turning disc."""
    if paths.turned:
        angle = paths.turned[disc].angle_at(time_s)
        radius_vector = scene.discs[disc].radius_m * np.array([math.cos(angle), math.sin(angle)])
        ends = [centre + 0.45 * radius_vector, centre + radius_vector]
        yield Line(ends, Style(3.7, edge=_colour_of(disc), width_pt=1.5))


def _list_impacts_by_disc(scene: Scene, paths: Paths) -> Iterator[tuple[int, Array, Array]]:
    """Yield each movable disc that has an impact, with the times and positions of its impacts."""
    for k, (times, points) in enumerate(paths.impacts):
        if len(times) and not scene.discs[k].immovable:
            yield k, times, points


def set_limits(axes: Axes, limits: Limits) -> None:
    """Set the limits of axes to a region, with equal scales in x and y."""
    low, high = limits
    axes.set(xlim=(low[0], high[0]), ylim=(low[1], high[1]), aspect="equal")


def list_wall_shapes(wall: AnyWall, limits: Limits, opacity: float = 1.0) -> Iterator[Shape]:
    """Yield the shapes of a wall in a region."""
    solid = replace(_SOLID, opacity=opacity)
    if not isinstance(wall, Wall):
        yield from _list_outline_shapes(wall.outline, solid)
        return
    low, high = limits
    reach = 4.0 * float(np.max(high - low))  # both ends of the line are outside the picture
    normal = np.array(wall.normal)
    along = np.array([-normal[1], normal[0]])
    # The wall's given point may be far away, so use its point nearest to the picture's middle.
    middle = (low + high) / 2.0
    foot = middle + normal * float((np.array(wall.point_m) - middle) @ normal)
    ends, behind = [foot - along * reach, foot + along * reach], normal * reach
    yield Polygon([*ends, ends[1] - behind, ends[0] - behind], solid)


def _list_outline_shapes(outline: Outline, solid: Style) -> Iterator[Shape]:
    points = np.array(list(outline.build_polyline(ARC_PARTS)))
    if outline.solid:
        yield Polygon(points, solid)
    yield Line(points, replace(solid, width_pt=1.5, hatched=False))
    width = outline.half_width
    if width == 0.0:
        return
    shade = Style(solid.order, fill=WALL, opacity=solid.opacity)
    for a, b in pairwise(points):
        along = (b - a) / (np.hypot(*(b - a)) or 1.0)
        across = width * np.array([-along[1], along[0]])
        yield Polygon([a + across, b + across, b - across, a - across], shade)
        yield Circle(a, width, shade)
    yield Circle(points[-1], width, shade)


def _render_over_time(scene: Scene, paths: Paths, axis: int, limits: Limits, label: str) -> str:
    with use_drawing_style():
        figure = build_figure(_WIDTH_PT / _PT_PER_IN, _WIDTH_PT / _PT_PER_IN)
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
        draw_on_axes(axes, [Number((along[0], 0.0), k)])
    for wall in scene.half_planes():
        if abs(wall.normal[axis]) > math.sqrt(0.5):  # the wall is perpendicular to the line of motion
            end = low if wall.normal[axis] > 0 else high
            begins_s = [leg.begin_s for leg in wall.drive.legs if leg.begin_s < scene.duration_s]
            times_s = [*begins_s, scene.duration_s]
            surface = [(wall.point_m[axis] + wall.drive.moved_at(time_s)[axis], time_s) for time_s in times_s]
            draw_on_axes(axes, [Polygon([*surface, (end, scene.duration_s), (end, 0.0)], _SOLID)])
    for k, times, points in _list_impacts_by_disc(scene, paths):
        places = np.column_stack([points[:, axis], times])
        draw_on_axes(axes, [Dots(places, _IMPACT_DOT_PT, Style(4, fill=_colour_of(k)))])
    axes.set(xlim=(low, high), ylim=(0.0, scene.duration_s), xlabel=f"{'xy'[axis]} in m", ylabel="time in s")
    axes.tick_params(length=2.5, color=MUTED)
    for side in (axes.xaxis, axes.yaxis):
        side.set_major_locator(MaxNLocator(5))
        side.set_major_formatter(lambda value, _: formatting.format_number(value, 3))
