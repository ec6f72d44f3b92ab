"""A scene in pymunk: one space with bodies, joints and shapes, run step by step."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import TYPE_CHECKING, Any

from carom.engines.api import (
    Contact,
    Observation,
    Scene,
    Setting,
    StepClock,
    Wall,
    oriented_contact,
    pair_of,
    wall_body,
)
from carom_adapters.pymunk.limits import NEIGHBORS, SPACE_SETTINGS, check_inputs
from carom_adapters.pymunk.walls import Post, build_wall_shapes, compute_surface_velocity
from carom_adapters.shared.legs import Driven, Legs, find_first_velocity
from carom_adapters.shared.quiet_steps import QuietSteps, to_rows
from carom_adapters.shared.walls import factor_walls

if TYPE_CHECKING:
    import pymunk
    from pymunk import Vec2d

    #: Normal of an arbiter (Chipmunk's name for a contact), and the impulses along and perpendicular to the normal, in
    #: newton seconds. The perpendicular impulse is None if no disc spins.
    ArbiterImpulse = tuple[Vec2d, float, float | None]

Pair = tuple[int, int]


class PymunkWorld(QuietSteps):
    """One `pymunk.Space` with the bodies of a scene."""

    def __init__(self, scene: Scene, settings: Mapping[str, Setting]) -> None:
        import pymunk

        dt_s = check_inputs(scene, settings)
        self._clock = StepClock(dt_s)
        self._arbiters: list[tuple[pymunk.Shape, pymunk.Shape]] | None = None
        self._space = pymunk.Space()
        self._space.gravity = scene.gravity_m_s2
        for name in SPACE_SETTINGS:
            if name in settings:
                setattr(self._space, name, settings[name])
        if scene.damping_per_s:
            self._space.damping = math.exp(-scene.damping_per_s)  # fraction of a speed that is left after a second
        self._turns = scene.arrays.turns
        self._neighbors = bool(settings.get(NEIGHBORS, 0))
        disc_elasticity, disc_friction, wall_materials = factor_walls(scene)
        self._bodies: list[pymunk.Body] = []
        self._movable: list[pymunk.Body] = []
        self._driven: list[pymunk.Body] = []
        self._legs = Legs[pymunk.Body]()
        self._body_number: dict[pymunk.Shape, int] = {}
        for i, disc in enumerate(scene.discs):
            if disc.immovable:
                body = self._build_immovable_body(disc, disc.spin_rad_s)
            else:
                # The moment of inertia is infinite if the disc can't turn, or if no disc of the scene turns.
                factor = disc.inertia_factor if self._turns else math.inf
                body = pymunk.Body(disc.mass_kg, factor * disc.mass_kg * disc.radius_m**2)
                body.velocity = disc.velocity_m_s
                body.angular_velocity = disc.spin_rad_s
                self._movable.append(body)
            body.position = disc.position_m
            self._space.add(body)
            if scene.table_deceleration_m_s2 and not disc.immovable:
                self._space.add(_build_table_joint(self._space, body, scene.table_deceleration_m_s2))
            self._add_shape(pymunk.Circle(body, disc.radius_m), disc_elasticity, disc_friction, i)
            self._bodies.append(body)
        for k, (wall_shape, material) in enumerate(zip(build_wall_shapes(scene, dt_s), wall_materials, strict=True)):
            body = self._build_immovable_body(wall := scene.walls[k])
            self._space.add(body)
            if isinstance(wall_shape, list):
                face = pymunk.Poly(body, wall_shape)
                if isinstance(wall, Wall) and wall.surface_speed_m_s:
                    face.surface_velocity = compute_surface_velocity(wall)
                self._add_shape(face, *material, wall_body(k))
                continue
            if isinstance(wall_shape, Post):
                self._add_shape(pymunk.Circle(body, wall_shape.radius, wall_shape.centre), *material, wall_body(k))
                continue
            for segment in wall_shape[0]:
                shape = pymunk.Segment(body, segment.a, segment.b, wall_shape[1])
                if self._neighbors:
                    shape.set_neighbors(segment.before, segment.after)
                self._add_shape(shape, *material, wall_body(k))

    def _build_immovable_body(self, disc_or_wall: Driven, spin: float = 0.0) -> pymunk.Body:
        """Return a body that no impact moves: a static body, or a kinematic body if the disc or wall is driven."""
        import pymunk

        if not disc_or_wall.driven:
            return pymunk.Body(body_type=pymunk.Body.STATIC)
        body = pymunk.Body(body_type=pymunk.Body.KINEMATIC)
        body.velocity, body.angular_velocity = find_first_velocity(disc_or_wall), spin
        self._driven.append(body)
        self._legs.add(body, disc_or_wall)
        return body

    def _add_shape(self, shape: pymunk.Shape, elasticity: float, friction: float, number: int) -> None:
        shape.elasticity, shape.friction = elasticity, friction
        self._space.add(shape)
        self._body_number[shape] = number

    @property
    def settings(self) -> Mapping[str, Setting]:
        """The settings that the space really contains."""
        # Before its first step, the space has no time step.
        read: dict[str, Setting] = {"dt_s": self._space.current_time_step or self._clock.dt_s}
        return read | {name: getattr(self._space, name) for name in SPACE_SETTINGS} | {NEIGHBORS: int(self._neighbors)}

    def advance(self, steps: int) -> None:
        """Call `Space.step` `steps` times. Between steps, set the prescribed velocities of driven bodies."""
        step, dt_s = self._space.step, self._clock.dt_s
        for count, changes in self._legs.split_steps(steps, self._clock):
            for body, velocity in changes:
                body.velocity = velocity
            for _ in range(count):
                step(dt_s)
        self._arbiters = None

    def observe(self) -> Observation:
        """Return the state of every disc, and the contacts of the last step.

        Contacts are read after the step, because callbacks would slow down the steps. Chipmunk moves the bodies and
        then tests for contacts, so a contact of step k (counted from 0) has the time ``(k + 1) dt_s``.
        """
        impulses: dict[Pair, list[ArbiterImpulse]] = {}
        for body in self._movable:
            body.each_arbiter(self._collect_impulse, impulses)
        contacts = [self._build_contact(pair, pair_impulses) for pair, pair_impulses in impulses.items()]
        numbers = to_rows(self.read())
        spins = numbers[:, 4] if self._turns else None
        return Observation(numbers[:, :2], numbers[:, 2:4], tuple(contacts), spin_rad_s=spins)

    def read(self) -> list[float]:
        """Return position, velocity and spin of each disc."""
        turns = self._turns
        numbers: list[float] = []
        for body in self._bodies:
            numbers += (*body.position, *body.velocity, body.angular_velocity if turns else 0.0)
        return numbers

    def has_contacts(self) -> bool:
        """Whether an impulse acted at a contact in the last step."""
        impulses: list[Vec2d] = []
        for body in self._movable:
            body.each_arbiter(lambda arbiter: impulses.append(arbiter.total_impulse))
        return any(impulse != (0.0, 0.0) for impulse in impulses)

    def _collect_impulse(self, arbiter: pymunk.Arbiter, impulses: dict[Pair, list[ArbiterImpulse]]) -> None:
        """Add the impulse of an arbiter (a contact) to `impulses`, unless the impulse has already been added."""
        normal = arbiter.normal
        total = -arbiter.total_impulse
        impulse = total.dot(normal)
        if impulse <= 0:  # Chipmunk keeps a contact while the shapes overlap, even if the bodies already separate
            return
        own_shape, other = arbiter.shapes
        first, second = self._body_number[own_shape], self._body_number[other]
        if 0 <= second < first and other.body is not None and other.body.body_type == other.body.DYNAMIC:
            return  # the other body has already added this impulse
        tangential = total.dot(normal.perpendicular()) if self._turns else None
        impulses.setdefault((first, second), []).append((normal, impulse, tangential))

    def _build_contact(self, pair: Pair, impulses: list[ArbiterImpulse]) -> Contact:
        """Return the contact of a pair. The impulse is the sum over all segments of a chain that push the disc."""
        if len(impulses) > 1:
            along = sum((impulse * normal for normal, impulse, _ in impulses[1:]), impulses[0][1] * impulses[0][0])
            across = [
                tangential * normal.perpendicular() for normal, _, tangential in impulses if tangential is not None
            ]
            normal = along.normalized()
            total = sum(across, along)
            impulses = [(normal, total.dot(normal), total.dot(normal.perpendicular()) if across else None)]
        ((normal, impulse, tangential),) = impulses
        return oriented_contact(*pair, self._clock.now_s, (normal.x, normal.y), impulse, tangential)

    def cut(self, dt_s: float) -> None:
        """Set the size of the following steps.

        For a lasting contact, Chipmunk starts each step with the last impulse, multiplied by the ratio of the present
        to the last step size. With shortened steps, the ratio of the step sizes can be arbitrarily large. So shapes in
        contact are removed and added again, which resets the impulse.
        """
        self._clock.cut(dt_s)
        touching = {shape for pair in self._list_contact_pairs() for shape in pair}
        # All segments of a chain have the same number. The sort keeps the order in which the segments were created.
        shapes = sorted((shape for shape in self._body_number if shape in touching), key=self._body_number.__getitem__)
        if shapes:
            self._space.remove(*shapes)
            self._space.add(*shapes)

    def touching(self) -> frozenset[tuple[int, int]]:
        """Return the pairs in contact after the last step. Chipmunk tests for contacts at the end of a step."""
        return frozenset(pair_of(self._body_number[a], self._body_number[b]) for a, b in self._list_contact_pairs())

    def _list_contact_pairs(self) -> list[tuple[pymunk.Shape, pymunk.Shape]]:
        if self._arbiters is None:
            shapes: list[tuple[pymunk.Shape, pymunk.Shape]] = []
            for body in self._movable:
                body.each_arbiter(lambda arbiter: shapes.append(arbiter.shapes))
            self._arbiters = shapes
        return self._arbiters

    def save(self) -> object:
        """Return positions, velocities and spins.

        With the settings of the profile `tuned`, later steps depend only on positions, velocities and spins.
        """
        moving = [*self._movable, *self._driven]
        bodies = [(body, body.position, body.velocity, body.angular_velocity) for body in moving]
        return (self._clock.now_s, bodies, self._legs.started)

    def restore(self, state: Any) -> None:
        """Restore positions, velocities and spins."""
        time_s, bodies, self._legs.started = state
        self._clock.restart(time_s)
        put = object.__setattr__  # pymunk's own function also checks types, and takes twice as long
        for body, position, velocity, spin in bodies:
            put(body, "position", position)
            put(body, "velocity", velocity)
            if self._turns:
                put(body, "angular_velocity", spin)

    def close(self) -> None:
        """Drop all references to the space, so that its memory is freed."""
        del self._space, self._bodies, self._movable, self._driven, self._legs, self._body_number


def _build_table_joint(space: pymunk.Space, body: pymunk.Body, deceleration_m_s2: float) -> pymunk.PivotJoint:
    """Return a joint that slows a body down like the friction of a table.

    The joint's force is limited to mass times deceleration.
    """
    import pymunk

    joint = pymunk.PivotJoint(space.static_body, body, body.position, (0.0, 0.0))
    joint.max_bias, joint.max_force = 0.0, deceleration_m_s2 * body.mass
    return joint
