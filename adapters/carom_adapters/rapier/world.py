"""World of Rapier: builds the bodies of a scene, takes steps, and reads states and contacts."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from carom.engines.api import (
    Chain,
    Contact,
    Observation,
    Ring,
    Scene,
    Setting,
    StepClock,
    Wall,
    oriented_contact,
    pair_of,
    wall_body,
)
from carom_adapters.rapier.limits import PARAMETERS, SOFTNESSES, check_inputs
from carom_adapters.shared.legs import Legs, Vector, find_first_velocity
from carom_adapters.shared.walls import compute_thickness, cut_chain, find_walls_in_pieces, sum_contacts

#: Relative rounding error of a 32-bit float.
ROUNDING = 2.0**-23


class RapierWorld:
    """One `PhysicsWorld` of balls that stay in a plane and don't turn."""

    def __init__(self, scene: Scene, settings: Mapping[str, Setting]) -> None:
        check_inputs(scene, settings)
        import rapier3d

        self._rapier: Any = rapier3d
        self._scene, self._requested_settings = scene, dict(settings)
        self._clock = StepClock(float(settings["dt_s"]))
        self._legs = Legs[int]()  # a body is given by its index in `_all`
        for body, scene_body in enumerate((*scene.discs, *scene.walls)):
            self._legs.add(body, scene_body)
        discs = [(disc.position_m, find_first_velocity(disc)) for disc in scene.discs]
        walls = [
            (wall.point_m if isinstance(wall, Wall) else (0.0, 0.0), find_first_velocity(wall)) for wall in scene.walls
        ]
        self._build([*discs, *walls])

    def _build(self, states: Any) -> None:
        """Build a world in which bodies have the positions and velocities `states`, discs first and then walls."""
        self._world, handles, self._body_number = self._build_world(states)
        self._all = [self._world.rigid_bodies[handle] for handle in handles]
        self._bodies = self._all[: len(self._scene.discs)]

    def _build_world(self, states: Any) -> tuple[Any, list[Any], dict[Any, int]]:
        rapier, scene, settings = self._rapier, self._scene, self._requested_settings
        world = rapier.PhysicsWorld(gravity=(*scene.gravity_m_s2, 0.0))
        parameters = world.integration_parameters
        parameters.dt = self._clock.dt_s
        for name in PARAMETERS:
            if name in settings:
                setattr(parameters, name, settings[name])
        for name, attribute in SOFTNESSES.items():
            if name in settings:
                softness = getattr(parameters, attribute)  # a copy
                softness.natural_frequency = settings[name]
                setattr(parameters, attribute, softness)
        handles, number = [], {}
        of_discs, of_walls = states[: len(scene.discs)], states[len(scene.discs) :]
        for i, (disc, (position, velocity)) in enumerate(zip(scene.discs, of_discs, strict=True)):
            body = self._create_held_body(disc.driven) if disc.immovable else rapier.RigidBody.dynamic()
            body = body.translation((*position, 0.0)).linvel((*velocity, 0.0))
            body = body.can_sleep(bool(settings["can_sleep"])).enabled_rotations((False, False, False))
            body = body.enabled_translations((True, True, False))
            if "soft_ccd_prediction" in settings:
                body = body.soft_ccd_prediction(settings["soft_ccd_prediction"])
            ball = rapier.Collider.ball(disc.radius_m).restitution(scene.restitution).friction(0.0)
            handles.append(world.add_body(body))
            number[world.add_collider(ball if disc.immovable else ball.mass(disc.mass_kg), handles[-1])] = i
        # Discs keep Rapier's default rule, the mean of two restitutions, since all have the same restitution. A wall
        # has the rule (MIN or MAX) that selects the wall's restitution, and has precedence over the mean.
        rule = rapier.CoefficientCombineRule
        for k, (wall, material) in enumerate(zip(scene.walls, scene.arrays.materials, strict=True)):
            position, velocity = of_walls[k]
            body = world.add_body(
                self._create_held_body(wall.driven).translation((*position, 0.0)).linvel((*velocity, 0.0))
            )
            handles.append(body)
            wins = rule.MIN if material.restitution < scene.restitution else rule.MAX
            for shape in self._build_shapes(wall):
                collider_shape = shape.friction(0.0).restitution(material.restitution).restitution_combine_rule(wins)
                number[world.add_collider(collider_shape, body)] = wall_body(k)
        return world, handles, number

    def _create_held_body(self, driven: bool) -> Any:
        """Return a body that impacts do not move: a body at rest or a driven body."""
        return self._rapier.RigidBody.kinematic_velocity_based() if driven else self._rapier.RigidBody.fixed()

    def _build_shapes(self, wall: Wall | Chain | Ring) -> list[Any]:
        """Return a wall's shapes: a half-space at its body's position, or a ball or capsules in scene coordinates."""
        collider = self._rapier.Collider
        if isinstance(wall, Wall):
            return [collider.halfspace((*wall.normal, 0.0))]
        radius = compute_thickness(self._scene, wall)
        if isinstance(wall, Ring):
            return [collider.ball(radius).translation((*wall.centre_m, 0.0))]
        return [collider.capsule_from_endpoints((*a, 0.0), (*b, 0.0), radius) for a, b in cut_chain(wall)]

    @property
    def settings(self) -> Mapping[str, Setting]:
        """The settings, including Rapier's defaults. Rapier reports all settings except the adapter's `first_part`."""
        parameters = self._world.integration_parameters
        read: dict[str, Setting] = {"dt_s": self._read_step()}
        read |= {name: getattr(parameters, name) for name in PARAMETERS}
        read |= {name: getattr(parameters, attribute).natural_frequency for name, attribute in SOFTNESSES.items()}
        body = self._bodies[0]
        # A body that can't sleep has a negative threshold.
        read["can_sleep"] = body.activation.linear_threshold >= 0
        read["soft_ccd_prediction"] = body.soft_ccd_prediction
        return self._requested_settings | read

    def _read_step(self) -> float:
        return float(self._world.integration_parameters.dt)

    def advance(self, steps: int) -> None:
        """Take steps. Between steps, set the prescribed velocities of driven bodies."""
        step = self._world.step
        for count, changes in self._legs.split_steps(steps, self._clock):
            self._set_velocities(changes)
            for _ in range(count):
                step()

    def _set_velocities(self, changes: Sequence[tuple[int, Vector]]) -> None:
        for body, velocity in changes:
            self._all[body].linvel = (*velocity, 0.0)

    def observe(self) -> Observation:
        """Return the state of every disc, and the contacts that the last step solved.

        Rapier finds contacts and then moves the bodies, so a contact of step k (counted from 0) has the time ``k
        dt_s``.
        """
        position = np.array([body.translation.to_tuple()[:2] for body in self._bodies], dtype=np.float64)
        velocity = np.array([body.linvel.to_tuple()[:2] for body in self._bodies], dtype=np.float64)
        return Observation(position, velocity, tuple(self._read_contacts()), self._find_warning(velocity))

    def _read_contacts(self) -> list[Contact]:
        at_s = self._clock.step_began_s
        contacts = []
        for pair in self._world.narrow_phase.contact_pairs():
            for manifold in pair.manifolds:
                impulse = sum(point.impulse for point in manifold.points)
                if impulse <= 0:  # Rapier also keeps contacts without an impulse
                    continue
                nx, ny, _ = manifold.data.normal.to_tuple()
                length = math.hypot(nx, ny)  # the normal's length is 1 only to the precision of 32-bit floats
                a, b = self._body_number[pair.collider1], self._body_number[pair.collider2]
                contacts.append(oriented_contact(a, b, at_s, (nx / length, ny / length), impulse))
        return list(sum_contacts(contacts, find_walls_in_pieces(self._scene)))

    def _find_warning(self, velocity: Any) -> str:
        # Impacts can accelerate a body to Rapier's limit. A running scene can't be refused, so the run gets a warning.
        parameters = self._world.integration_parameters
        limit = parameters.normalized_max_linear_velocity * parameters.length_unit
        if (fastest := float(np.hypot(*velocity.T).max())) > limit * (1 - 4 * ROUNDING):
            return f"Rapier limits the speed of a body to {limit:g} m/s, and a body has reached {fastest:g} m/s"
        if not self._world.quarantine.is_empty():
            return "Rapier disabled a body: its state was not finite"
        return ""

    def close(self) -> None:
        """Drop the references to the world, so that its memory is freed."""
        del self._all, self._bodies, self._body_number, self._world


class RapierCuttableWorld(RapierWorld):
    """A world whose steps can be shortened and undone. Each step is taken in two parts, of which the first is tiny.

    Rapier moves touching bodies with the velocities of an inelastic impact, and sets the velocities of the bounce only
    at the end of the step. The first part of a step is so short that bodies bounce before they move. In the second
    part, bodies move with their new velocities.
    """

    def __init__(self, scene: Scene, settings: Mapping[str, Setting]) -> None:
        super().__init__(scene, settings)
        self._first_part = float(settings["first_part"])
        self._solved_contacts: list[Contact] = []

    def advance(self, steps: int) -> None:
        """Take steps, each in two parts."""
        parameters, step, dt_s = self._world.integration_parameters, self._world.step, self._clock.dt_s
        for _ in range(steps):
            for _, changes in self._legs.split_steps(1, self._clock):
                self._set_velocities(changes)
            self._solved_contacts = []
            for part in (self._first_part, 1.0 - self._first_part):
                parameters.dt = part * dt_s
                step()
                self._solved_contacts += super()._read_contacts()

    def _read_step(self) -> float:
        return self._clock.dt_s

    def _read_contacts(self) -> list[Contact]:
        return self._solved_contacts

    def cut(self, dt_s: float) -> None:
        """Set the size of the following steps."""
        self._clock.cut(dt_s)

    def touching(self) -> frozenset[tuple[int, int]]:
        """Return the pairs that overlap by Rapier's narrow phase. The test uses a copy of the world."""
        world, _, number = self._build_world(self._read_states())
        world.detect_collisions()
        pairs = set()
        for pair in world.narrow_phase.contact_pairs():
            if any(point.dist < 0.0 for manifold in pair.manifolds for point in manifold.points):
                pairs.add(pair_of(number[pair.collider1], number[pair.collider2]))
        return frozenset(pairs)

    def _read_states(self) -> list[tuple[Any, Any]]:
        return [(body.translation.to_tuple()[:2], body.linvel.to_tuple()[:2]) for body in self._all]

    def save(self) -> object:
        """Return positions and velocities.

        With the settings of the profile `located`, later steps depend only on positions and velocities.
        """
        return (self._clock.now_s, self._legs.started, self._read_states(), self._solved_contacts)

    def restore(self, state: Any) -> None:
        """Build a new world with these positions and velocities, because a used world keeps data of contacts."""
        time_s, self._legs.started, states, self._solved_contacts = state
        self._clock.restart(time_s)
        self._build(states)
