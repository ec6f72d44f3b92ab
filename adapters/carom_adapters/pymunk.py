"""Adapter of pymunk (Chipmunk2D): impulse-based, two-dimensional, 64-bit floats."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import TYPE_CHECKING, Any

import numpy as np

from carom.adapter import (
    AdapterError,
    Capabilities,
    Contact,
    ContactTimes,
    Engine,
    Knob,
    Observation,
    Profile,
    Scene,
    Setting,
    Stamp,
    StepClock,
    Wall,
    factored_frictions,
    factored_restitutions,
    oriented_contact,
    pair_of,
    reach,
    require_sound,
    require_supported,
    wall_body,
)
from carom_adapters.code import PYTHON_END, arguments, assignments, comment, steps_of
from carom_adapters.engine_adapter import NOT_TURNED, OF_THE_SCENE, EngineAdapter, located, tuned
from carom_adapters.pymunk_space import scene_of

if TYPE_CHECKING:
    import pymunk

__all__ = ["adapter"]

#: Attributes of `pymunk.Space`, by pymunk's own names; what a profile leaves out stays as pymunk ships it.
SPACE_SETTINGS = (
    "iterations",
    "damping",
    "collision_slop",
    "collision_bias",
    "collision_persistence",
    "idle_speed_threshold",
    "sleep_time_threshold",
)

#: Chipmunk compares squared distances with squared radii, and divides by masses. Between these bounds neither squares
#: nor quotients leave the range of 64-bit floats (1e-308 to 1e308), so that no hit is invented or lost.
LARGEST = 1e100
SMALLEST = 1e-100

#: Below these Chipmunk aborts, or makes no sense of them.
LEAST = dict.fromkeys(SPACE_SETTINGS, 0.0) | {"iterations": 1, "collision_persistence": 1, "dt_s": SMALLEST}

#: A contact point is off the line of centres by a rounding of its coordinates, and the push on it turns a disc by that
#: over its inertia: of discs 200 radii from the origin, 3e-9 of a spin here.
LEAST_INERTIA_FACTOR = 1e-6

#: Discs of this radius still fit, some way apart, within the greatest coordinates.
LARGEST_RADIUS_M = 1e98

CAPABILITIES = Capabilities(
    gravity=True,
    damping=True,
    restitution=(0.0, 1.0),
    spin=True,
    min_inertia_factor=LEAST_INERTIA_FACTOR,
    friction=(0.0, LARGEST),
    contact_times=ContactTimes.STEP,
    stamp=Stamp.END,
    max_speed_m_s=LARGEST,
    max_coordinate_m=LARGEST,
    min_radius_m=SMALLEST,
    max_radius_m=LARGEST_RADIUS_M,
    min_mass_kg=SMALLEST,
    max_mass_kg=LARGEST,
)


def _half_plane(wall: Wall, centre: tuple[float, float], radius: float) -> list[tuple[float, float]]:
    """Return the corners of a rectangle that no disc of the scene can tell from the half-plane.

    Chipmunk has no half-plane. Through a thin segment fast discs pass, and a thick one takes its normal from the depth
    of the overlap; a polygon's face has one normal, exact to rounding, and is as deep as it is made.
    """
    (px, py), (nx, ny) = wall.point_m, wall.normal
    along = (px - centre[0]) * ny - (py - centre[1]) * nx
    gap = abs((px - centre[0]) * nx + (py - centre[1]) * ny)
    foot_x, foot_y = px - along * ny, py + along * nx
    # Twice as wide and deep as a disc can get: whatever sinks in is still nearest to the face. And no smaller than the
    # coordinates themselves, for the face's direction is the difference of two corners, each rounded.
    size = max(2.0 * (radius + gap), abs(foot_x), abs(foot_y))
    return [
        (foot_x + (a * ny - b * nx) * size, foot_y - (a * nx + b * ny) * size)
        for a, b in ((1, 0), (-1, 0), (-1, 1), (1, 1))
    ]


def _corners_of_walls(scene: Scene, dt_s: float) -> list[list[tuple[float, float]]]:
    centre, radius = reach(scene, dt_s)
    corners = [_half_plane(wall, centre, radius) for wall in scene.half_planes()]
    # A face is placed to the rounding of its farthest corner.
    farthest = max((abs(value) for wall in corners for corner in wall for value in corner), default=0.0)
    smallest = min(disc.radius_m for disc in scene.discs)
    if not farthest * 2.0**-52 < smallest:  # NaN fails this too
        raise AdapterError(
            f"pymunk: a disc may get {farthest:.3g} m far, and a wall of that length is rounded by more than the "
            f"smallest radius, {smallest:.3g} m; shorten duration_s, or take walls or heavy fast discs out"
        )
    return corners


def _usable_step(scene: Scene, settings: Mapping[str, Setting]) -> float:
    """Return the step of settings, in seconds, once they and the scene are known to be what pymunk can do."""
    require_sound("pymunk", scene, settings, SPACE_SETTINGS, LEAST, {"dt_s": LARGEST})
    dt_s = float(settings["dt_s"])
    require_supported("pymunk", scene, CAPABILITIES, dt_s)
    return dt_s


class PymunkWorld:
    """One `pymunk.Space`."""

    def __init__(self, scene: Scene, settings: Mapping[str, Setting]) -> None:
        import pymunk

        dt_s = _usable_step(scene, settings)
        self._clock = StepClock(dt_s)
        self._arbiters: list[tuple[pymunk.Shape, pymunk.Shape]] | None = None
        self._space = pymunk.Space()
        self._space.gravity = scene.gravity_m_s2
        for name in SPACE_SETTINGS:
            if name in settings:
                setattr(self._space, name, settings[name])
        if scene.damping_per_s:
            self._space.damping = math.exp(-scene.damping_per_s)  # what is kept of a speed in a second
        self._turns = scene.arrays.turns
        # Friction is shipped as 0, and in a scene that turns nothing is left so.
        disc_friction, wall_friction = factored_frictions(scene) if self._turns else (0.0, 0.0)
        disc_elasticity, wall_elasticity = factored_restitutions(scene)
        self._bodies: list[pymunk.Body] = []
        self._movable: list[pymunk.Body] = []
        self._number: dict[pymunk.Shape, int] = {}
        for i, disc in enumerate(scene.discs):
            if disc.immovable:
                body = pymunk.Body(body_type=pymunk.Body.STATIC)
            else:
                # An infinite moment for a disc that does not turn, or has nothing to turn it.
                factor = disc.inertia_factor if self._turns else math.inf
                body = pymunk.Body(disc.mass_kg, factor * disc.mass_kg * disc.radius_m**2)
                body.velocity = disc.velocity_m_s
                body.angular_velocity = disc.spin_rad_s
                self._movable.append(body)
            body.position = disc.position_m
            self._add(body, pymunk.Circle(body, disc.radius_m), disc_elasticity, disc_friction, i)
            self._bodies.append(body)
        for k, corners in enumerate(_corners_of_walls(scene, dt_s)):
            body = pymunk.Body(body_type=pymunk.Body.STATIC)
            self._add(body, pymunk.Poly(body, corners), wall_elasticity, wall_friction, wall_body(k))

    def _add(self, body: pymunk.Body, shape: pymunk.Shape, elasticity: float, friction: float, number: int) -> None:
        shape.elasticity, shape.friction = elasticity, friction
        self._space.add(body, shape)
        self._number[shape] = number

    @property
    def settings(self) -> Mapping[str, Setting]:
        """The settings of the space, read back."""
        # The space knows no step before it has taken one.
        read: dict[str, Setting] = {"dt_s": self._space.current_time_step or self._clock.dt_s}
        return read | {name: getattr(self._space, name) for name in SPACE_SETTINGS}

    def advance(self, steps: int) -> None:
        """Call `Space.step` this many times, and nothing else."""
        step, dt_s = self._space.step, self._clock.dt_s
        for _ in range(steps):
            step(dt_s)
        self._clock.count(steps)
        self._arbiters = None

    def observe(self) -> Observation:
        """Read the bodies, and the arbiters that the last step left on them: no callback slows the step down.

        Chipmunk moves the bodies and then looks for contacts, so those of step k (from 0) stand at ``(k + 1) dt_s``.
        """
        found: list[Contact] = []
        for body in self._movable:
            body.each_arbiter(self._collect, found)
        return Observation(
            np.array([body.position for body in self._bodies], dtype=np.float64),
            np.array([body.velocity for body in self._bodies], dtype=np.float64),
            tuple(found),
            spin_rad_s=np.array([body.angular_velocity for body in self._bodies]) if self._turns else None,
        )

    def _collect(self, arbiter: pymunk.Arbiter, found: list[Contact]) -> None:
        """Note a contact, as seen by the body that was asked: it is the arbiter's first."""
        normal = arbiter.normal
        impulse = -arbiter.total_impulse.dot(normal)
        if impulse <= 0:  # Chipmunk keeps a contact while the shapes overlap, also when they separate already
            return
        asked, other = arbiter.shapes
        first, second = self._number[asked], self._number[other]
        if 0 <= second < first and other.body is not None and other.body.body_type == other.body.DYNAMIC:
            return  # that one was asked before, and told
        rub = -arbiter.total_impulse.dot(normal.perpendicular()) if self._turns else None
        found.append(oriented_contact(first, second, self._clock.now_s, (normal.x, normal.y), impulse, rub))

    def cut(self, dt_s: float) -> None:
        """Take steps of another length from here on.

        Chipmunk begins a contact that goes on with its last impulse times the ratio of the two steps, without limit; so
        shapes in contact are taken out and put back, which makes it forget.
        """
        self._clock.cut(dt_s)
        shapes = sorted({shape for pair in self._in_contact() for shape in pair}, key=self._number.__getitem__)
        if shapes:
            self._space.remove(*shapes)
            self._space.add(*shapes)

    def touching(self) -> frozenset[tuple[int, int]]:
        """Return the pairs of which Chipmunk kept an arbiter in the last step, at whose end it looked."""
        return frozenset(pair_of(self._number[a], self._number[b]) for a, b in self._in_contact())

    def _in_contact(self) -> list[tuple[pymunk.Shape, pymunk.Shape]]:
        if self._arbiters is None:
            found: list[tuple[pymunk.Shape, pymunk.Shape]] = []
            for body in self._movable:
                body.each_arbiter(lambda arbiter: found.append(arbiter.shapes))
            self._arbiters = found
        return self._arbiters

    def save(self) -> object:
        """Return positions, velocities and spins; whatever else a space keeps is of no effect on a tuned one."""
        bodies = [(body, body.position, body.velocity, body.angular_velocity) for body in self._movable]
        return (self._clock.now_s, bodies)

    def restore(self, state: Any) -> None:
        """Put positions, velocities and spins back."""
        time_s, bodies = state
        self._clock.restart(time_s)
        for body, position, velocity, spin in bodies:
            body.position, body.velocity, body.angular_velocity = position, velocity, spin

    def close(self) -> None:
        """Let go of the space; its memory goes with the last reference."""
        del self._space, self._bodies, self._movable, self._number


def _code(scene: Scene, settings: Mapping[str, Setting], heading: str) -> str:
    """Return the space that `PymunkWorld` makes as a program."""
    dt_s, turns = _usable_step(scene, settings), scene.arrays.turns
    friction, wall_friction = factored_frictions(scene) if turns else (0.0, 0.0)
    elasticity, wall_elasticity = factored_restitutions(scene)
    lines = []
    for disc in scene.discs:
        moment = (disc.inertia_factor if turns else math.inf) * disc.mass_kg * disc.radius_m**2
        kind = (
            "static=True"
            if disc.immovable
            else arguments(
                {"mass": disc.mass_kg, "moment": moment, "velocity": disc.velocity_m_s, "spin": disc.spin_rad_s}
            )
        )
        lines.append(f"add_disc({disc.position_m!r}, {disc.radius_m!r}, {kind})")
    lines += [f"add_wall({corners!r})" for corners in _corners_of_walls(scene, dt_s)]
    set_up = assignments("space", settings, SPACE_SETTINGS)
    if scene.damping_per_s:
        set_up += f"space.damping = {math.exp(-scene.damping_per_s)!r}  # what is kept of a speed in a second\n"
    end = PYTHON_END.format(step="space.step(dt)", state="*body.position, *body.velocity, body.angular_velocity")
    bodies = "\n".join(lines)
    return f"""{comment(heading)}
from math import inf

import pymunk

dt, steps = {dt_s!r}, {steps_of(scene, settings)}
space = pymunk.Space()
space.gravity = {scene.gravity_m_s2!r}
{set_up}discs = []


def add(body, shape, elasticity, friction):
    # pymunk multiplies the two coefficients of a pair.
    shape.elasticity, shape.friction = elasticity, friction
    space.add(body, shape)


def add_disc(position, radius, mass=0.0, moment=0.0, velocity=(0.0, 0.0), spin=0.0, static=False):
    body = pymunk.Body(body_type=pymunk.Body.STATIC) if static else pymunk.Body(mass, moment)
    body.position, body.velocity, body.angular_velocity = position, velocity, spin
    add(body, pymunk.Circle(body, radius), elasticity={elasticity!r}, friction={friction!r})
    discs.append(body)


def add_wall(corners):  # a deep polygon: discs pass through a thin segment
    body = pymunk.Body(body_type=pymunk.Body.STATIC)
    add(body, pymunk.Poly(body, corners), elasticity={wall_elasticity!r}, friction={wall_friction!r})


{bodies}
{end}"""


def _default(dt_s: float) -> dict[str, Setting]:
    return {"dt_s": dt_s}


def _tuned(dt_s: float) -> dict[str, Setting]:
    return {
        "dt_s": dt_s,
        # Discs in several contacts at once settle by iteration: a break of ten gains 2e-7 of its energy with the 10
        # iterations that pymunk ships, and 2e-14 with 20.
        "iterations": 20,
        # Chipmunk pushes overlapping bodies apart, on top of the bounce. This is the part of an overlap that is left
        # after a second, so 1 is never.
        "collision_bias": 1.0,
    }


adapter = EngineAdapter(
    name="pymunk",
    # 5.4.1 tells the adapter of no contact, though it bounces; 5.7.0 does.
    engine=Engine(
        "pymunk",
        module="pymunk",
        distribution="pymunk",
        install="pip install 'carom[pymunk]'",
        oldest="5.7",
        newest_tried="7.3",
    ),
    capabilities=CAPABILITIES,
    knobs={
        "iterations": Knob(1, 100, log=True),
        "collision_bias": Knob(0.0, 1.0),
        "collision_slop": Knob(1e-3, 1e3, log=True),
        "collision_persistence": Knob(1, 10),
    },
    profiles={
        "default": Profile(
            "What a user of pymunk gets: all as shipped (no damping), with the scene's restitution and friction.",
            _default,
            changed={"elasticity": OF_THE_SCENE, "friction": OF_THE_SCENE, "moment": NOT_TURNED},
        ),
        "tuned": tuned("overlaps are never pushed apart", _tuned),
        "located": located("Chipmunk's own collision test", _tuned),
    },
    world=PymunkWorld,
    code=_code,
    read=scene_of,
)
