"""Walls of a scene as pymunk shapes: a deep polygon for a half-plane, segments for a chain, and a circle for a ring."""

from __future__ import annotations

from typing import NamedTuple

from carom.engines.api import AdapterError, Chain, Scene, Wall, reach
from carom_adapters.shared.walls import build_rectangle, compute_thickness, find_foot, list_points

Point = tuple[float, float]


def _build_half_plane(wall: Wall, centre: Point, radius: float) -> list[Point]:
    """Return the corners of a rectangle that acts on the scene's discs like a half-plane.

    Chipmunk has no half-plane. A thin segment would not stop fast discs, and the normal of a thick segment depends on
    the overlap. A polygon can have any depth, and its face has only one normal.
    """
    (x, y), gap = find_foot(wall, centre)
    # The rectangle extends twice as far as any disc can reach. So the side nearest to an overlapping disc is always the
    # face. Chipmunk computes the direction of the face from two rounded corners. So the rectangle is at least as large
    # as its coordinates, to make the error of the direction small.
    size = max(2.0 * (radius + gap), abs(x), abs(y))
    return [(x + across, y + deep) for across, deep in build_rectangle(wall.normal, size)]


class _Segment(NamedTuple):
    """A straight piece of a chain from a to b, with the chain's points before a and after b."""

    a: Point
    b: Point
    before: Point
    after: Point


def _build_segments(chain: Chain) -> list[_Segment]:
    """Return the straight segments of a chain.

    At an open end, the neighbouring point is the end itself, as pymunk requires.
    """
    points = list_points(chain)
    last = len(points) - 1
    return [
        _Segment(
            points[k],
            points[(k + 1) % len(points)],
            points[k - 1] if k > 0 or chain.closed else points[k],
            points[(k + 2) % len(points)] if k + 2 <= last or chain.closed else points[k + 1],
        )
        for k in range(last + chain.closed)
    ]


class Post(NamedTuple):
    """A circle that discs hit from outside."""

    centre: Point
    radius: float


#: Shape of a wall: the corners of a polygon, segments and their radius, or a circle.
WallShape = list[Point] | tuple[list[_Segment], float] | Post


def build_wall_shapes(scene: Scene, dt_s: float) -> list[WallShape]:
    """Return the shapes of the scene's walls, in the order of the walls.

    Raises:
        AdapterError: A half-plane would be so long that rounding moves its corners by more than the smallest radius.
    """
    centre, radius = reach(scene, dt_s)
    shapes: list[WallShape] = []
    for wall in scene.walls:
        if isinstance(wall, Wall):
            shapes.append(_build_half_plane(wall, centre, radius))
        elif isinstance(wall, Chain):
            shapes.append((_build_segments(wall), wall.half_width_m))
        else:
            shapes.append(Post(wall.centre_m, compute_thickness(scene, wall)))
    # The corner with the largest coordinates has the largest rounding error.
    corners = [corner for shape in shapes if isinstance(shape, list) for corner in shape]
    farthest = max((abs(value) for corner in corners for value in corner), default=0.0)
    smallest = min(disc.radius_m for disc in scene.discs)
    if not farthest * 2.0**-52 < smallest:  # NaN is refused, too
        raise AdapterError(
            f"pymunk: a wall must reach up to {farthest:.3g} m, because discs can move that far, but there rounding "
            f"exceeds the smallest radius, {smallest:.3g} m; shorten duration_s, or remove walls or heavy fast discs"
        )
    return shapes


def compute_surface_velocity(wall: Wall) -> tuple[float, float]:
    """Return pymunk's `surface_velocity` for a conveyor wall. Positive speeds point to the left of the normal."""
    nx, ny = wall.normal
    return (-wall.surface_speed_m_s * ny, wall.surface_speed_m_s * nx)
