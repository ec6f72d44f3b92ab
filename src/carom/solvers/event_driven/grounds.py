"""Grounds: the half-planes and straight faces on which a disc can slide, roll or rest under gravity."""

from __future__ import annotations

from collections import defaultdict
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from carom.core.wall_features import Arc, Face
from carom.model.chain_geometry import Outline

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from carom.core.wall_features import Point, WallFeature
    from carom.model.disc_arrays import DiscArrays

#: Marks an end of a face at which the wall continues smoothly, without a vertex: `NO_OBSTACLE` of pic/state.h.
NO_OBSTACLE = -1


class Grounds(NamedTuple):
    """Data of each feature of all walls for lasting contact.

    Attributes:
        rows: Shape ``(features, 4)``: whether a disc can be in lasting contact with the feature, the numbers of the
            vertices at its two ends, and the number of features in `never_met`.
        never_met: For one ground after another, the numbers of the features that a disc on it never meets.
    """

    rows: NDArray[np.float64]
    never_met: NDArray[np.float64]


def grounds_of(start: DiscArrays, features: dict[int, tuple[Outline, WallFeature]], walls: list[int]) -> Grounds:
    """Return the grounds of a scene's walls.

    Driven walls are not grounds. Finite walls have only straight faces as grounds.

    Args:
        start: The discs and walls.
        features: The features of finite walls, by number.
        walls: The wall of each feature, by number.
    """
    rows = np.tile(np.array([0, NO_OBSTACLE, NO_OBSTACLE, 0], np.float64), (len(walls), 1))
    never_met: list[int] = []
    of_wall: defaultdict[int, dict[int, WallFeature]] = defaultdict(dict)
    for number, (_, part) in features.items():
        of_wall[walls[number]][number] = part
    surroundings = {
        wall: _Surroundings(outline, parts)
        for wall, parts in of_wall.items()
        if isinstance(outline := start.walls[wall], Outline) and outline.edges  # a circle has no edges
    }
    for number, wall in enumerate(walls):
        belt = 0.0 if start.belts_m_s is None else start.belts_m_s[wall]
        if belt or not start.drive_of_wall(wall).stands:
            continue
        if number not in features:  # a half-plane
            rows[number, 0] = 1
        elif isinstance(feature := features[number][1].feature, Face):
            over, never = surroundings[wall].of_face(feature)
            rows[number] = (1, *over, len(never))
            never_met += never
    return Grounds(rows, np.array(never_met, np.float64))


class _Surroundings:
    """Features of a finite wall, indexed by position."""

    def __init__(self, outline: Outline, parts: dict[int, WallFeature]) -> None:
        self._vertices: dict[tuple[Point, float], int] = {}
        self._faces: defaultdict[frozenset[Point], list[int]] = defaultdict(list)
        self._arcs: defaultdict[Point, list[int]] = defaultdict(list)
        for number, part in parts.items():
            feature = part.feature
            if isinstance(feature, Face):
                self._faces[frozenset((feature.a, feature.b))].append(number)
                continue
            at = (feature.centre[0][0], feature.centre[1][0])
            if feature == Arc.vertex(at, feature.half_width):
                self._vertices.setdefault((at, feature.half_width), number)
            elif feature.sector is not None:
                ends = {outline.edges[part.edges[0]].a, outline.edges[part.edges[-1]].b}
                for end in {at} if feature.is_vertex else ends:
                    self._arcs[end].append(number)

    def of_face(self, face: Face) -> tuple[tuple[int, int], list[int]]:
        """Return the vertices at the ends of a face, and the features that a disc on this face never meets.

        These features are both sides of the face, the vertices, and arcs that continue the wall smoothly. Without this
        rule, rounding would decide whether the disc meets the arc or the face first.
        """
        first, last = (self._vertices.get((end, face.half_width), NO_OBSTACLE) for end in (face.a, face.b))
        never = [*self._faces[frozenset((face.a, face.b))]]
        for end, vertex in ((face.a, first), (face.b, last)):
            never += self._arcs[end] if vertex == NO_OBSTACLE else [vertex]
        return (first, last), never
