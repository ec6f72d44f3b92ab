"""Shapes of pictures of scenes, drawn on axes of matplotlib or as an SVG element.

The SVG elements need no matplotlib. Loading matplotlib takes longer than running and drawing a scene.
"""

from __future__ import annotations

import html
import math
from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, NamedTuple
from zlib import crc32

import numpy as np
from numpy.typing import ArrayLike

from carom.report.svg import INK, SURFACE, WALL, as_page_colour
from carom.report.tracks import Array, select_points

if TYPE_CHECKING:
    from matplotlib.artist import Artist
    from matplotlib.axes import Axes

#: Order of the shapes that no other shape covers.
_TOP = 6.0
_NUMBER_PT = 8.0
#: Radius and opacity of the disc behind a number.
_NUMBER_RADIUS_PT, _NUMBER_OPACITY = 6.5, 0.8
#: Distance between the lines of a hatched area, and their width.
_HATCH_PT, _HATCH_WIDTH_PT = 6.0, 0.6
#: A point of a line is omitted if the line then moves by less than this distance, which is too small to see.
_TOLERANCE_PT = 0.05
#: Number of decimal places of coordinates in points.
_DIGITS = 2
#: Points that are farther than this from the picture's middle are moved towards the middle, because browsers draw
#: larger coordinates inaccurately.
_FARTHEST_PT = 1e6


@dataclass(frozen=True)
class Style:
    """Style of a shape.

    Attributes:
        order: A shape covers shapes with a lower order.
        fill: Colour of the area; empty for none.
        edge: Colour of the line; empty for none.
        width_pt: Width of the line.
        dashes_pt: Lengths of a dash and a gap; None for an unbroken line.
        opacity: 1 is opaque.
        hatched: Whether the area is hatched like a wall.
    """

    order: float
    fill: str = ""
    edge: str = ""
    width_pt: float = 1.0
    dashes_pt: tuple[float, float] | None = None
    opacity: float = 1.0
    hatched: bool = False


class Circle(NamedTuple):
    """A circle. Without a finite centre, nothing is drawn."""

    centre_m: ArrayLike
    radius_m: float
    style: Style


class Polygon(NamedTuple):
    """A closed polygon, from its corners."""

    corners_m: ArrayLike
    style: Style


class Line(NamedTuple):
    """A line through points, which is interrupted at points that are not finite."""

    points_m: ArrayLike
    style: Style


class Dots(NamedTuple):
    """A dot at each point."""

    points_m: ArrayLike
    diameter_pt: float
    style: Style


class Number(NamedTuple):
    """The number of a disc, which covers all shapes."""

    centre_m: ArrayLike
    number: int


Shape = Circle | Polygon | Line | Dots | Number


def draw_on_axes(axes: Axes, shapes: Iterable[Shape]) -> list[Artist]:
    """Draw shapes on axes of matplotlib, and return matplotlib's objects."""
    from matplotlib import patches

    artists: list[Artist] = []
    for shape in shapes:
        match shape:
            case Circle(centre, radius, style):
                x, y = np.asarray(centre, dtype=float)
                if math.isfinite(x) and math.isfinite(y):
                    artists.append(axes.add_artist(patches.Circle((x, y), radius, **_area_options(style))))
            case Polygon(corners, style):
                artists.append(axes.add_artist(patches.Polygon(np.asarray(corners), **_area_options(style))))
            case Line(points, style):
                look: dict[str, Any] = {"color": style.edge, "linewidth": style.width_pt, "alpha": style.opacity}
                look |= {"zorder": style.order, "solid_capstyle": "butt"}
                artists += axes.plot(*np.asarray(points).T, **look)
            case Dots(points, diameter, style):
                look = {"linestyle": "", "marker": "o", "markersize": diameter, "color": style.fill}
                artists += axes.plot(*np.asarray(points).T, zorder=style.order, **look)
            case Number(centre, number):
                x, y = np.asarray(centre, dtype=float)
                box = {"boxstyle": "circle,pad=0.15", "facecolor": SURFACE, "edgecolor": "none"}
                look = {"ha": "center", "va": "center", "fontsize": _NUMBER_PT, "color": INK, "zorder": _TOP}
                artists.append(axes.text(x, y, str(number), bbox=box | {"alpha": _NUMBER_OPACITY}, **look))
    return artists


def _area_options(style: Style) -> dict[str, Any]:
    """Return a style as options of matplotlib's areas."""
    return {
        "facecolor": style.fill or "none",
        "edgecolor": style.edge or "none",
        "linewidth": style.width_pt,
        "linestyle": (0, style.dashes_pt) if style.dashes_pt else "-",
        "alpha": style.opacity,
        "hatch": "////" if style.hatched else None,
        "zorder": style.order,
    }


def render_svg(shapes: Iterable[Shape], low: Array, high: Array, width_pt: float, label: str) -> str:
    """Return an SVG element that shows a region.

    Args:
        shapes: The shapes.
        low: Lower left corner of the region, in metres.
        high: Upper right corner of the region, in metres.
        width_pt: Width of the element.
        label: Accessible name of the element, which no other element of the page has.
    """
    scale = width_pt / float(high[0] - low[0])
    width, height = (high - low) * scale
    hatch = f"hatch{crc32(label.encode()):x}"
    drawn = [one for shape in shapes for one in _draw_svg(shape, low, high, scale, hatch)]
    drawn.sort(key=lambda one: one[0])
    size = f'width="{_HATCH_PT}" height="{_HATCH_PT}" patternTransform="rotate(45)"'
    stripe = f'<path d="M0 0V{_HATCH_PT}" stroke="{as_page_colour(WALL)}" stroke-width="{_HATCH_WIDTH_PT}"/>'
    lines = (
        f'<svg viewBox="0 0 {width:g} {height:g}" role="img" aria-label="{html.escape(label)}">',
        f'<pattern id="{hatch}" patternUnits="userSpaceOnUse" {size}>{stripe}</pattern>',
        *(element for _, element in drawn),
        "</svg>",
    )
    return "\n".join(lines)


def _draw_svg(shape: Shape, low: Array, high: Array, scale: float, hatch: str) -> Iterator[tuple[float, str]]:
    """Yield a shape's SVG elements, each with its order. `hatch` is the name of the pattern for hatched areas."""
    for placed in _place(shape[0], low, high, scale):
        x, y = placed[0]
        match shape:
            case Circle(_, radius, style):
                size = round(min(radius * scale, _FARTHEST_PT), _DIGITS)
                yield style.order, f'<circle cx="{x:g}" cy="{y:g}" r="{size:g}"{_format_look(style, hatch)}/>'
            case Polygon(_, style):
                yield style.order, f'<path d="M{_join(placed)}Z"{_format_look(style, hatch)}/>'
            case Line(_, style):
                path = f"M{_join(simplify_line(placed))}"
                yield style.order, f'<path d="{path}" stroke-linejoin="round"{_format_look(style, hatch)}/>'
            case Dots(_, diameter, style):
                # A line of length 0 with round ends is a dot.
                path = "".join(f"M{x:g} {y:g}h0" for x, y in placed.tolist())
                line = Style(style.order, edge=style.fill, width_pt=diameter, opacity=style.opacity)
                yield style.order, f'<path d="{path}" stroke-linecap="round"{_format_look(line, hatch)}/>'
            case Number(_, number):
                background = _format_look(Style(_TOP, fill=SURFACE, opacity=_NUMBER_OPACITY), hatch)
                yield _TOP, f'<circle cx="{x:g}" cy="{y:g}" r="{_NUMBER_RADIUS_PT}"{background}/>'
                place = f'x="{x:g}" y="{y:g}" text-anchor="middle" dominant-baseline="central"'
                colour = as_page_colour(INK)
                yield _TOP, f'<text {place} font-size="{_NUMBER_PT:g}" fill="{colour}">{number}</text>'


def _format_look(style: Style, hatch: str) -> str:
    """Return a style as attributes of an SVG element."""
    fill = f"url(#{hatch})" if style.hatched else as_page_colour(style.fill) if style.fill else "none"
    look = f' fill="{fill}"'
    if style.edge:
        look += f' stroke="{as_page_colour(style.edge)}" stroke-width="{style.width_pt:g}"'
    if style.dashes_pt:
        look += ' stroke-dasharray="{:g} {:g}"'.format(*style.dashes_pt)
    if style.opacity != 1.0:
        look += f' opacity="{style.opacity:g}"'
    return look


def _place(points: ArrayLike, low: Array, high: Array, scale: float) -> Iterator[Array]:
    """Yield points in coordinates of the SVG element. Points that are not finite separate the yielded groups."""
    middle = (low + high) / 2.0
    with np.errstate(over="ignore", invalid="ignore"):
        offset = (np.asarray(points, dtype=float).reshape(-1, 2) - middle) * scale
        far = np.hypot(*offset.T) / _FARTHEST_PT
        placed = (high - middle) * scale + offset / np.maximum(far, 1.0)[:, None] * (1.0, -1.0)
    finite = np.isfinite(placed).all(axis=1)
    for group in np.split(np.arange(len(placed)), np.flatnonzero(np.diff(finite)) + 1):
        if len(group) and finite[group].all():
            yield np.round(placed[group], _DIGITS)


def simplify_line(points: Array) -> Array:
    """Return a line without those points whose omission moves the line by less than the tolerance.

    Args:
        points: Points in the drawing's coordinates, shape ``(n, 2)``.
    """

    def measure_distances(begin: int, end: int) -> Array:
        chord, offsets = points[end] - points[begin], points[begin : end + 1] - points[begin]
        length = math.hypot(*chord)
        along = offsets @ (chord / length) if length else np.zeros(len(offsets))
        # Distances are measured from the chord and not from its infinite extension, because a line can go back over
        # itself.
        nearest = np.clip(along, 0.0, length)[:, None] * (chord / (length or 1.0))
        distances: Array = np.hypot(*(offsets - nearest).T)
        return distances

    return points[select_points(len(points), measure_distances, _TOLERANCE_PT)]


def _join(points: Array) -> str:
    return "L".join(f"{x:g} {y:g}" for x, y in points.tolist())
