"""Features of walls as rows of numbers, which the core reads: see `core/feature.h`."""

from __future__ import annotations

from typing import TYPE_CHECKING

from carom.core.features import Face

if TYPE_CHECKING:
    from carom.core.features import Feature, Pair, Point
    from carom.model.disc_arrays import HalfPlane

#: Count of the numbers in a row.
FEATURE_NUMBERS = 22

#: `FeatureKind` of core/feature.h.
_PLANE, _FACE, _VERTEX, _OUTER_ARC, _INNER_ARC = range(5)
_NONE = (0.0, 0.0)


def numbers_of(feature: Feature | HalfPlane, wall: int) -> tuple[float, ...]:
    """Return a feature of a wall, or a half-plane, as the row of numbers that `feature_from` reads."""
    if isinstance(feature, tuple):
        x, y, *normal = feature
        return _row(_PLANE, wall, 0.0, (normal[0], normal[1]), (x, 0.0), (y, 0.0))
    if isinstance(feature, Face):
        (ax, ay), (bx, by) = feature.a, feature.b
        place = (ax, 0.0), (ay, 0.0), feature.length, *feature.along, (bx, 0.0), (by, 0.0)
        return _row(_FACE, wall, feature.half_width, feature.normal, *place)
    sector = feature.sector
    ends = () if sector is None else (*sector.first, *sector.last)
    kind = _VERTEX if feature.is_vertex else _INNER_ARC if feature.inside else _OUTER_ARC
    reflex = sector is not None and sector.reflex
    circle = *feature.centre, feature.radius
    whole, below = sector is None, feature.fits_below
    return _row(kind, wall, feature.half_width, _NONE, *circle, *ends, whole=whole, reflex=reflex, fits_below=below)


def _row(
    kind: int,
    wall: int,
    half_width: float,
    normal: Point,
    *pairs: Pair,
    whole: bool = False,
    reflex: bool = False,
    fits_below: float = 0.0,
) -> tuple[float, ...]:
    filled = (*pairs, *[_NONE] * (7 - len(pairs)))
    return (kind, wall, whole, reflex, half_width, fits_below, *normal, *(part for pair in filled for part in pair))
