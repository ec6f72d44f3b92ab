"""A scene's bodies as plain floats: masses, walls, prescribed motions, restitutions and frictions."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np

from carom.comparator.slowing import Slowing
from carom.comparator.stepwise import body_states
from carom.core import primitives
from carom.core.impact_law import ContactFriction
from carom.core.input_rows import build_feature_row
from carom.core.wall_features import build_features
from carom.model.chain_geometry import Outline
from carom.model.disc_arrays import HalfPlane
from carom.model.prescribed_motion import Course
from carom.model.scene import Scene

#: Two bodies: the number of a disc, or ``n + k`` for wall k. The first body is always a disc.
Pair = tuple[int, int]


class FiniteWall:
    """A wall that is a chain of edges, or a circle. The features of a chain are its edges, ends and corners.

    If a disc meets several features at once, the feature with the lowest number counts.

    Attributes:
        outline: The wall.
        features: Object that computes the times at which discs meet the features, and the normals at these times.
    """

    def __init__(self, outline: Outline) -> None:
        self.outline = outline
        rows = [build_feature_row(part.feature, 0) for part in build_features(outline)]
        self.features = primitives.WallFeatures(rows)


class SceneBodies:
    """The bodies of a scene as plain floats."""

    def __init__(self, scene: Scene) -> None:
        arrays = scene.arrays
        self.n = len(scene.discs)
        self.radius: list[float] = arrays.radius_m.tolist()
        self.mass: list[float] = arrays.mass_kg.tolist()
        self.inverse_mass: list[float] = (1.0 / arrays.mass_kg).tolist()
        self.inverse_inertia_ratio: list[float] = (1.0 / arrays.inertia).tolist()
        self.walls: list[HalfPlane | FiniteWall] = [
            tuple(map(float, wall)) if isinstance(wall, tuple) else FiniteWall(wall)  # type: ignore[misc] # four floats
            for wall in arrays.walls
        ]
        self.wall_drives = [arrays.drive_of_wall(k) for k in range(len(arrays.walls))]
        self.disc_drives = dict(zip(arrays.driven_discs, arrays.disc_drives, strict=True))
        self.belts = arrays.belts_m_s
        self.fastest_wall = max((drive.fastest for drive in self.wall_drives), default=0.0)
        #: Whether the scene has bodies with a prescribed motion. Driven bodies give energy to discs, so a gain of
        #: energy alone is no fault.
        self.driven = arrays.driven
        self.gravity: tuple[float, float] = scene.gravity_m_s2
        self.pull = math.hypot(*scene.gravity_m_s2)
        self.slowing = Slowing.of(scene)
        # The list is stored, because every step of every window uses this list.
        self._moves: list[bool] = [inverse > 0.0 for inverse in self.inverse_mass] + [False] * len(self.walls)
        self._is_stationary = [drive.is_stationary for drive in self.wall_drives]
        drives = {**self.disc_drives, **dict(enumerate(self.wall_drives, self.n))}
        #: Motion of each body whose prescribed velocity changes.
        self._changing_drives = {body: drive for body, drive in drives.items() if len(drive.legs) > 1}
        self.slows = bool(self.slowing)
        #: Whether every disc moves along one straight line between impacts, at a constant velocity.
        self.moves_straight = not (self.pull or self.slows or self._changing_drives)
        self.pulls = [scene.gravity_m_s2 if self.is_pulled(disc) else (0.0, 0.0) for disc in range(self.n)]
        #: Greatest speed at the start, in metres per second; 0 without a table. On a table, rounding errors of
        #: velocities are proportional to this speed, because a slow disc may once have been this fast.
        self.fast = float(np.hypot(*arrays.velocity_m_s.T).max()) if self.slowing.table_m_s2 else 0.0
        self.rolling_resistance = scene.wall_rolling_resistance
        self.disc_restitution = scene.restitution
        self.wall_restitutions = [material.restitution for material in arrays.materials]
        self.disc_contact = ContactFriction(scene.friction, scene.tangential_restitution)
        self.wall_contacts = [
            ContactFriction(material.friction, scene.wall_tangential_restitution) for material in arrays.materials
        ]
        self.turns = bool(arrays.turns)
        self.numbers = body_states.BodyNumbers(self)

    def is_movable(self, body: int) -> bool:
        """Whether a body is a disc that impacts can move."""
        return self._moves[body]

    def is_driven(self, body: int) -> bool:
        """Whether the scene prescribes the motion of a body."""
        return body in self.disc_drives if body < self.n else not self._is_stationary[body - self.n]

    def is_pulled(self, body: int) -> bool:
        """Whether gravity acts on a body."""
        return self.pull > 0.0 and self.is_movable(body)

    def compute_table_acceleration(self, body: int, velocity: tuple[float, float]) -> tuple[float, float]:
        """Return the acceleration of a disc by the table, which is opposite to the disc's velocity; 0 at rest."""
        speed = math.hypot(*velocity)
        if not (speed and self.is_movable(body)):
            return 0.0, 0.0
        a = -self.slowing.table_m_s2
        return a * (velocity[0] / speed), a * (velocity[1] / speed)

    def restitution_of(self, pair: Pair) -> float:
        """Return the coefficient of restitution of two bodies."""
        return self.wall_restitutions[pair[1] - self.n] if pair[1] >= self.n else self.disc_restitution

    def contact_of(self, pair: Pair) -> ContactFriction:
        """Return the friction between two bodies."""
        return self.wall_contacts[pair[1] - self.n] if pair[1] >= self.n else self.disc_contact

    def measure_wall_distance(self, wall: int, x: float, y: float, time_s: float) -> tuple[float, float, float]:
        """Return the distance of a point from wall number `wall`, and the unit normal from the wall to the point.

        On the centre line of a finite wall, the normal is undefined. For points on the centre line, the normal (0, 0)
        is returned, so that the closing speed is 0, as in PIT. A moving wall is at its position at `time_s`.
        """
        shape = self.walls[wall]
        x, y = self.to_wall_frame(wall, x, y, time_s)
        if isinstance(shape, tuple):
            qx, qy, nx, ny = shape
            return (x - qx) * nx + (y - qy) * ny, nx, ny
        foot = shape.outline.find_nearest(x, y)
        dx, dy = x - foot.x, y - foot.y
        distance = math.sqrt(dx * dx + dy * dy)
        nx, ny = (dx / distance, dy / distance) if distance > 0.0 else (0.0, 0.0)
        return distance - shape.outline.half_width, nx, ny

    def to_wall_frame(self, wall: int, x: float, y: float, time_s: float) -> tuple[float, float]:
        """Return a point in coordinates that move with a wall."""
        if self._is_stationary[wall]:
            return x, y
        wx, wy = self.wall_drives[wall].leg_at(time_s * body_states.TOUCH).moved_at(time_s)
        return x - wx, y - wy

    def wall_velocity(self, wall: int, time_s: float) -> tuple[float, float]:
        """Return the velocity of a wall at a time.

        If the velocity changes at this time (or slightly later because of rounding), return the new velocity.
        """
        if self._is_stationary[wall]:
            return 0.0, 0.0
        return self.wall_drives[wall].velocity_at(time_s * body_states.TOUCH)

    def list_later_legs(self, pair: Pair, time_s: float) -> tuple[Course, ...]:
        """Return the parts of a pair's prescribed motion that begin after `time_s`, if there are any."""
        drive = next((self._changing_drives[body] for body in pair if body in self._changing_drives), None)
        return () if drive is None else drive.legs_from(time_s * body_states.TOUCH)[1:]

    def reach(self, pair: Pair) -> float:
        """Return the contact distance of a pair: from centre to centre, or from centre to wall."""
        return self.radius[pair[0]] + (self.radius[pair[1]] if pair[1] < self.n else 0.0)

    def list_pairs(self, bodies: Sequence[int]) -> list[Pair]:
        """Return all pairs of some discs with each other and with walls, unless both bodies are immovable."""
        walls = range(self.n, self.n + len(self.walls))
        return [
            (i, j)
            for k, i in enumerate(bodies)
            for j in (*bodies[k + 1 :], *walls)
            if self.is_movable(i) or self.is_movable(j)
        ]
