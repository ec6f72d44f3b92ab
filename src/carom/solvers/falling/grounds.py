"""What discs are in contact with: half-planes, and the straight faces of walls that end."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, NamedTuple

from carom.physics.feature_time_falling import arc_time_falling, foot_is_on
from carom.physics.features import Arc, Face
from carom.physics.wall_time import wall_gap
from carom.physics.wall_time_falling import descent_time

if TYPE_CHECKING:
    from collections.abc import Iterator

    from carom.disc_arrays import HalfPlane
    from carom.physics.features import Feature, Point
    from carom.physics.wall_features import WallFeature
    from carom.solvers.falling.bodies import FallingBodies
    from carom.solvers.plain.finite_walls import FiniteWall


class Ground(NamedTuple):
    """What a disc is in contact with.

    Attributes:
        wall: Number of the wall.
        plane: A point of its surface, and the unit normal; the surface goes on along the normal turned by -90 degrees.
        face: Of a finite wall, the face; the plane's point is where that begins.
        never_met: What of that wall a disc on the face does not meet, however it moves there.
        over: At each end of the face, the vertex there; None where the wall goes on smoothly.
    """

    wall: int
    plane: HalfPlane
    face: Face | None = None
    never_met: tuple[Feature, ...] = ()
    over: tuple[Arc | None, Arc | None] = (None, None)

    @property
    def normal(self) -> tuple[float, float]:
        """Unit vector from the surface to the disc."""
        return self.plane[2:]

    def gap_of(self, bodies: FallingBodies, i: int) -> float:
        """Return the distance of disc `i` from the surface, metres."""
        return float(wall_gap(bodies.x[i], bodies.y[i], bodies.radius[i], *self.plane)[0])

    def ends_after(self, bodies: FallingBodies, i: int, speed: float, rate: float) -> float:
        """Return after how many seconds disc `i` comes to an end of the face; infinity for never."""
        if self.face is None:
            return math.inf
        place, length = self._place(bodies, i), self.face.length[0]
        waits = (
            descent_time((place, 0.0), (speed, 0.0), (rate, 0.0)) if speed < 0.0 or rate < 0.0 else math.inf,
            descent_time((length - place, 0.0), (-speed, 0.0), (-rate, 0.0)) if speed > 0.0 or rate > 0.0 else math.inf,
        )
        return min(waits)

    def set_at_end(self, bodies: FallingBodies, i: int) -> Arc | None:
        """Set disc `i`, which has come to an end of the face, there; return the vertex, None where there is none."""
        nx, ny = self.normal
        if self.face is None:
            raise TypeError("a half-plane has no end")
        last = 2.0 * self._place(bodies, i) > self.face.length[0]
        (x, y), away = self.face.b if last else self.face.a, bodies.radius[i] + self.face.half_width
        bodies.x[i], bodies.y[i] = x + away * nx, y + away * ny
        return self.over[last]

    def flies_over(self, bodies: FallingBodies, i: int, vertex: Arc) -> bool:
        """Whether disc `i`, which is at the end of the face, flies off: ``u^2 >= P (R + half width)``.

        By the very numbers by which it would meet the vertex at once, if it did not.
        """
        return arc_time_falling(bodies.mover(i, self.wall), vertex, bodies.gravity, 0.0) > 0.0

    def _place(self, bodies: FallingBodies, i: int) -> float:
        qx, qy, nx, ny = self.plane
        return (bodies.x[i] - qx) * ny - (bodies.y[i] - qy) * nx


def ground_of(bodies: FallingBodies, k: int, feature: Feature | None = None) -> Ground | None:
    """Return what a disc may be in contact with of wall `k`, and of a finite one of a feature; None for none.

    That is nothing of a driven wall, and of a finite one straight faces alone.
    """
    wall, finite = bodies.walls[k], bodies.finite[k]
    if bodies.is_driven(k):
        return None
    if isinstance(wall, tuple):
        return Ground(k, wall)
    if finite is None or not isinstance(feature, Face):
        return None
    (nx, ny), h, ends = feature.normal, feature.half_width, (feature.a, feature.b)
    vertices = [part.feature for part in finite.features if isinstance(part.feature, Arc) and part.feature.is_vertex]
    over = [next((one for one in vertices if one == Arc.vertex(end, h)), None) for end in ends]
    backs = (part.feature for part in finite.features if isinstance(part.feature, Face))
    never = [face for face in backs if {face.a, face.b} == set(ends)]
    plane = (feature.a[0] + h * nx, feature.a[1] + h * ny, nx, ny)
    met = tuple(vertex for vertex in over if vertex is not None)
    # It comes to an arc that goes on smoothly where the face ends: which of both is told first, rounding would decide.
    smooth = [end for end, vertex in zip(ends, over, strict=True) if vertex is None]
    onward = (part.feature for part in finite.features if any(_arc_ends(finite, part, end) for end in smooth))
    return Ground(k, plane, feature, (*never, *met, *onward), (over[0], over[1]))


def _arc_ends(finite: FiniteWall, part: WallFeature, at: Point) -> bool:
    """Whether a feature is of an arc, and ends, or is, at a point."""
    edges, feature = finite.outline.edges, part.feature
    if not isinstance(feature, Arc) or feature.sector is None:
        return False
    ends = edges[part.edges[0]].a, edges[part.edges[-1]].b
    return at in (((feature.centre[0][0], feature.centre[1][0]),) if feature.is_vertex else ends)


def grounds_of(bodies: FallingBodies, i: int) -> Iterator[Ground]:
    """Yield what disc `i` may be in contact with where it is: half-planes, and the faces that its foot is on."""
    for k, finite in enumerate(bodies.finite):
        for feature in (None,) if finite is None else (part.feature for part in finite.features):
            on = isinstance(feature, Face) and foot_is_on(bodies.mover(i, k), feature, 0.0, bodies.gravity)
            if (on or feature is None) and (ground := ground_of(bodies, k, feature)) is not None:
                yield ground
