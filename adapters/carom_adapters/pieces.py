"""The pieces into which a chain of straight edges is cut for engines."""

from __future__ import annotations

from carom.adapter import Chain

__all__ = ["points_of"]

Point = tuple[float, float]


def points_of(chain: Chain) -> list[Point]:
    """Return the ends of all pieces in order; the first point of a closed chain is not told again at its end."""
    points = [point for edge in chain.outline.edges for point in _cut(edge.a, edge.b, chain.pieces)]
    return points if chain.closed else [*points, chain.points_m[-1]]


def _cut(a: Point, b: Point, pieces: int) -> list[Point]:
    """Return where the pieces of an edge begin."""
    parts = [k / pieces for k in range(pieces)]
    return [(a[0] + part * (b[0] - a[0]), a[1] + part * (b[1] - a[1])) for part in parts]
