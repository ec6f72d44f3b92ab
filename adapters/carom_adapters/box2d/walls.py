"""Walls of a scene as Box2D shapes.

A half-plane becomes a deep polygon, and a chain becomes separate edges or a Box2D chain.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from itertools import pairwise
from typing import Any

from carom.engines.api import AdapterError, Chain, Scene, Setting, Wall
from carom_adapters.box2d.limits import SHORTEST_PIECE_M
from carom_adapters.shared.walls import build_rectangle, find_foot, list_points

#: Smallest size of a wall's polygon. `b2PolygonShape` merges corners that are closer than half of b2_linearSlop, 2.5e-3
#: m.
SMALLEST_WALL_M = 0.1

#: Relative rounding error of a 32-bit float.
ROUNDING = 2.0**-23

Point = tuple[float, float]


def build_wall_rectangle(scene: Scene, plane: Wall, centre: Point, radius: float) -> tuple[Point, list[Point]]:
    """Return the position of a half-plane's body, and the corners of its polygon relative to this position.

    The position is the half-plane's point that is nearest to `centre`. Box2D has no half-planes. A deep polygon
    replaces the half-plane, since fast discs would pass through an edge.

    Raises:
        AdapterError: The wall would be so long that rounding to 32-bit floats moves its corners by more than the
            smallest radius.
    """
    # The polygon's corners are relative to the body's position, so that corners near the scene are small numbers.
    foot, gap = find_foot(plane, centre)
    size = max(2.0 * (radius + gap), SMALLEST_WALL_M)
    smallest = min(disc.radius_m for disc in scene.discs)
    if not size * ROUNDING < smallest:
        raise AdapterError(
            f"Box2D: a disc can move up to {radius:.3g} m, and 32-bit floats move the ends of such a long wall by more "
            f"than the smallest radius, {smallest:.3g} m; shorten duration_s, or remove walls or heavy fast discs"
        )
    return foot, build_rectangle(plane.normal, size)


def list_shape_points(chain: Chain, settings: Mapping[str, Setting]) -> list[list[Point]]:
    """Return the points of each Box2D shape of a chain.

    With the setting ``chains`` the chain is one shape, otherwise each edge is a shape. If a closed chain is one shape,
    the last point repeats the first point.

    Raises:
        AdapterError: The setting ``chains`` is on, and a piece is shorter than Box2D accepts.
    """
    points = list_points(chain)
    all_points = [*points, points[0]] if chain.closed else points
    if not settings.get("chains", False):
        return [list(pair) for pair in pairwise(all_points)]
    shortest = min(math.dist(a, b) for a, b in pairwise(all_points))
    # The factor of 2 allows for the rounding of points to 32-bit floats.
    if not shortest > 2.0 * SHORTEST_PIECE_M:
        raise AdapterError(
            f"Box2D: the pieces of a chain must be longer than {2.0 * SHORTEST_PIECE_M:g} m, got {shortest:.3g} m; "
            "cut the chain into fewer pieces"
        )
    return [all_points]


def build_chain_shapes(box2d: Any, chain: Chain, settings: Mapping[str, Setting]) -> list[Any]:
    """Return Box2D's shapes of a chain."""
    pieces = list_shape_points(chain, settings)
    if not settings.get("chains", False):
        return [box2d.b2EdgeShape(vertices=points) for points in pieces]
    ((*points, last),) = pieces
    if chain.closed:
        return [box2d.b2ChainShape(vertices_loop=points)]
    return [box2d.b2ChainShape(vertices_chain=[*points, last])]
