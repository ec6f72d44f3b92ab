"""Walls and driven bodies as rows of numbers, which the core reads: see `core/feature.h` and `core/run_input.h`."""

from __future__ import annotations

from itertools import chain
from typing import TYPE_CHECKING

import numpy as np

from carom.core.wall_features import Face
from carom.model.trace import wall_body

if TYPE_CHECKING:
    from collections.abc import Iterable

    from numpy.typing import NDArray

    from carom.core.wall_features import Feature
    from carom.core.wall_parts import Pair
    from carom.model.chain_geometry import Outline
    from carom.model.disc_arrays import DiscArrays, HalfPlane
    from carom.model.prescribed_motion import Drive

#: Number of floats in the row of a feature.
FEATURE_NUMBERS = 22

#: Values of the enum `FeatureKind` in core/feature.h.
_PLANE, _FACE, _VERTEX, _OUTER_ARC, _INNER_ARC = range(5)
_NONE = (0.0, 0.0)


def build_feature_row(feature: Feature | HalfPlane, wall: int) -> tuple[float, ...]:
    """Return the row of numbers for a feature of a wall, or for a half-plane, as `feature_from` reads it."""
    pairs: tuple[Pair, ...]
    normal, half_width, fits_below, is_whole, reflex = _NONE, 0.0, 0.0, False, False
    if isinstance(feature, tuple):
        kind, (x, y, *along) = _PLANE, feature
        normal, pairs = (along[0], along[1]), ((x, 0.0), (y, 0.0))
    elif isinstance(feature, Face):
        kind, normal, half_width = _FACE, feature.normal, feature.half_width
        (ax, ay), (bx, by) = feature.a, feature.b
        pairs = ((ax, 0.0), (ay, 0.0), feature.length, *feature.along, (bx, 0.0), (by, 0.0))
    else:
        kind = _VERTEX if feature.is_vertex else _INNER_ARC if feature.inside else _OUTER_ARC
        half_width, fits_below, sector = feature.half_width, feature.fits_below, feature.sector
        pairs, is_whole = (*feature.centre, feature.radius), sector is None
        if sector is not None:
            pairs, reflex = (*pairs, *sector.first, *sector.last), sector.reflex
    parts = chain.from_iterable((*pairs, *[_NONE] * (7 - len(pairs))))
    return (kind, wall, is_whole, reflex, half_width, fits_below, *normal, *parts)


def build_chain_rows(walls: Iterable[HalfPlane | Outline]) -> tuple[list[tuple[float, ...]], list[tuple[float, ...]]]:
    """Return the rows of all walls (`RunInput.chains`) and of the edges of all finite walls (`RunInput.edges`)."""
    chains: list[tuple[float, ...]] = []
    edges: list[tuple[float, ...]] = []
    for wall in walls:
        if isinstance(wall, tuple):
            chains.append((0, 0.0, 0.0, *wall))
            continue
        chains.append((len(wall.stretches), wall.half_width, sum(map(abs, wall.lengths)), 0.0, 0.0, 0.0, 0.0))
        for stretch in wall.stretches:
            begin, end, bulge = stretch.edge
            centre, is_arc = stretch.centre or (0.0, 0.0), stretch.centre is not None
            edges.append((*begin, *end, bulge, *centre, stretch.radius, is_arc, stretch.whole))
    return chains, edges


def build_driven_rows(start: DiscArrays) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Return two arrays that the core reads: the driven bodies, and the legs of their paths.

    A leg is a part of a path with constant velocity. The first array has a row for each driven body and each conveyor:
    the body number (wall k is -1 - k), the number of legs, and the surface speed. Walls come first, then discs, both in
    ascending order. The second array has a row for each leg, path after path: the start and end of the leg, the
    displacement of the body when the leg begins (x and y), and the velocity (x and y). Units are seconds and metres.
    """
    rows: list[tuple[float, float, float]] = []
    legs: list[tuple[float, ...]] = []

    def add(body: int, drive: Drive, belt: float) -> None:
        path = () if drive.is_stationary else drive.legs
        if path or belt:
            rows.append((body, len(path), belt))
            legs.extend((leg.begin_s, leg.end_s, *leg.moved, *leg.velocity) for leg in path)

    for k in range(len(start.walls) if start.driven else 0):
        add(wall_body(k), start.drive_of_wall(k), start.belt_of_wall(k))
    for disc, drive in zip(start.driven_discs, start.disc_drives, strict=True):
        add(disc, drive, 0.0)
    return np.array(rows, np.float64).reshape(-1, 3), np.array(legs, np.float64).reshape(-1, 6)
