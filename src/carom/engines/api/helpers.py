"""What adapters of several engines need alike, for their authors to use: none of it is asked for by the harness."""

from __future__ import annotations

import math

from carom.engines.api.protocol import Contact
from carom.model.scene import Disc, Scene

Vector = tuple[float, float]

#: A coefficient whose square is 0 in 64-bit floats (the least positive one is 2**-1074), and a power of two, so that
#: multiplying and dividing by it is exact.
VANISHING = 2.0**-600

#: Impacts on driven bodies that a wall without half-planes is long enough for: no number is enough for a disc that is
#: crushed, and a paddle or a piston has few.
DRIVEN_IMPACTS = 32


class StepClock:
    """The time of a world that counts its steps: of equal length, until they are cut or a state is restored.

    Attributes:
        dt_s: Length of the coming steps, seconds.
    """

    def __init__(self, dt_s: float) -> None:
        self.dt_s = dt_s
        self._start_s, self._steps = 0.0, 0

    def count(self, steps: int) -> None:
        """Count steps that were taken."""
        self._steps += steps

    @property
    def now_s(self) -> float:
        """Seconds from the start."""
        return self._start_s + self._steps * self.dt_s

    @property
    def step_began_s(self) -> float:
        """When the last step began."""
        return self._start_s + (self._steps - 1) * self.dt_s

    def cut(self, dt_s: float) -> None:
        """Take steps of another length from here on."""
        self.restart(self.now_s)
        self.dt_s = dt_s

    def restart(self, time_s: float) -> None:
        """Come back to a time."""
        self._start_s, self._steps = time_s, 0


def factored_restitutions(scene: Scene) -> tuple[float, float]:
    """Return restitutions (of every disc, of every wall) whose products are the coefficients that a scene asks for."""
    return _factored(scene.restitution, scene.wall_restitution)


def factored_frictions(scene: Scene) -> tuple[float, float]:
    """Return coefficients of friction (of every disc, of every wall) whose products are those that a scene asks for."""
    return _factored(scene.friction, scene.wall_friction)


def _factored(pair: float, wall: float) -> tuple[float, float]:
    """Factor the coefficients of two discs, and of a disc and a wall, for an engine that multiplies those of bodies.

    A disc gets the root of the pair's coefficient. Where that is zero and the walls' is not, no ordinary factor would
    do; but the square of a tiny one vanishes, and its product with a huge one does not.
    """
    disc = math.sqrt(pair) if pair > 0 else VANISHING
    return disc, wall / disc


def reach(scene: Scene, dt_s: float) -> tuple[Vector, float]:
    """Return the middle of a scene, and how far from it any point of a disc can be at any time of the scene, metres.

    For an engine without half-planes, whose walls must be as long and deep as that. No impact adds energy, so no disc
    is ever faster than if it alone had all the energy of the scene, that of turning with it, or than gravity makes it
    besides. A driven body adds up to twice its speed at each impact: `DRIVEN_IMPACTS` of these are allowed for.
    """
    x, y = zip(*(disc.position_m for disc in scene.discs), strict=True)
    centre = (min(x) / 2 + max(x) / 2, min(y) / 2 + max(y) / 2)
    start = max(math.dist(disc.position_m, centre) + disc.radius_m for disc in scene.discs)
    movable = [disc for disc in scene.discs if not disc.immovable]
    lightest = min((disc.mass_kg for disc in movable), default=1.0)
    speeds = [math.sqrt(d.mass_kg / lightest) * math.hypot(*d.velocity_m_s) for d in movable]
    rims = [
        math.sqrt(d.inertia_factor * d.mass_kg / lightest) * d.radius_m * d.spin_rad_s for d in movable if d.spin_rad_s
    ]
    fastest = math.hypot(*speeds, *rims)
    driven = [body.drive.fastest for body in (*scene.discs, *scene.walls) if body.driven]
    belts = [abs(wall.surface_speed_m_s) for wall in scene.walls]
    fastest += 2.0 * DRIVEN_IMPACTS * max((*driven, *belts), default=0.0)
    duration_s = scene.duration_s + dt_s
    # What one disc gains by falling, impacts may pass on to a lighter one.
    gained = math.hypot(*scene.gravity_m_s2) * duration_s * math.sqrt(sum(d.mass_kg / lightest for d in movable))
    return centre, start + (fastest + gained) * duration_s


def is_fast(disc: Disc, dt_s: float) -> bool:
    """Whether a disc moves by more than its radius in a step: what continuous detection is for."""
    return disc.drive.fastest * dt_s > disc.radius_m


def pair_of(a: int, b: int) -> tuple[int, int]:
    """Return two bodies in the order of `Contact`: the disc of the lower number first, a wall second."""
    low, high = (a, b) if a < b else (b, a)
    return (high, low) if low < 0 else (low, high)


def flattened(normal: Vector, impulse_n_s: float) -> tuple[Vector, float]:
    """Return what of a push in space lies in the plane: its unit normal, and its impulse along that.

    For bodies that lean out of the plane. `normal` is the first two components of a unit vector; a push straight out of
    the plane, (0, 0), is none within it.
    """
    length = math.hypot(*normal)
    if length == 0.0:
        return (1.0, 0.0), 0.0
    return (normal[0] / length, normal[1] / length), impulse_n_s * length


def oriented_contact(
    a: int, b: int, time_s: float, normal: Vector, impulse_n_s: float, tangential_impulse_n_s: float | None = None
) -> Contact:
    """Return the contact of two bodies in either order; `normal` is from `a` to `b`, the tangential impulse on `b`.

    Of the two bodies exchanged, normal, tangent and impulse all turn round, and the tangential impulse is the same.
    """
    first, second = pair_of(a, b)
    nx, ny = normal
    oriented = (nx, ny) if first == a else (-nx, -ny)
    return Contact(first, second, time_s, oriented, impulse_n_s, tangential_impulse_n_s=tangential_impulse_n_s)
