"""Friction and spin against the law in rational numbers, written from Newton's laws and not from the code."""

import math
import random
from collections.abc import Sequence
from fractions import Fraction
from itertools import product

import numpy as np
import pytest
from tests.cases import each, release_after
from tests.random_scenes import KINDS, SMALL, draw_scene, number_of_impacts
from tests.scene_builders import require_value
from tests.validation.exact_impact import Body, Law, resolve_exact_impact

from carom import DiscArrays, solve_pic, solve_pit
from carom.core.impact_law import ContactFrictions, RoughBodies, resolve_impact, resolve_rough_impact
from carom.model.trace import IMPACT_DTYPE, SPIN_DTYPE
from carom.support.limits import LARGEST

core_functions = pytest.importorskip("tests.core_functions")

#: In units in the last place of the greatest speed (`measure_impact_error`): some twenty roundings of half a unit, of
#: which the normal, as it is recorded, has four.
ULPS = 12.0
COEFFICIENTS = (0.0, 0.01, 0.1, 0.5, 2.0, 1e19)


#: Units in the last place of 1.
ULP = 2.0**-52
#: Below this speed what underflows counts.
LEAST = 2.0**-900
#: Bits to which lengths are taken.
BITS = 120


def length_of(x: Fraction, y: Fraction) -> Fraction:
    """Return the length of a vector, to `BITS` bits or so of it."""
    square = x * x + y * y
    shift = BITS + abs(square.numerator.bit_length() - square.denominator.bit_length())
    return Fraction(math.isqrt(math.floor(square * Fraction(4) ** shift)), 2**shift)


def body_of(
    start: DiscArrays, body: int, velocity: Sequence[float], spin: float, arm: tuple[Fraction, Fraction]
) -> Body:
    """Return a disc or wall in the form that the exact impact law needs."""
    moving = (float(velocity[0]), float(velocity[1]))
    if body < 0 or math.isinf(start.mass_kg[body]):
        return Body(moving, spin, math.inf, math.inf, arm)
    mass, k = Fraction(float(start.mass_kg[body])), float(start.inertia[body])
    inertia = math.inf if math.isinf(k) else Fraction(k) * mass * Fraction(float(start.radius_m[body])) ** 2
    return Body(moving, spin, mass, inertia, arm)


def law_of(start: DiscArrays, second: int) -> Law:
    """Return the coefficients of an impact with a disc or a wall."""
    if second >= 0:
        return Law(start.restitution, start.friction, start.tangential_restitution)
    return Law(start.wall_restitution, start.wall_friction, start.wall_tangential_restitution)


def measure_impact_error(start: DiscArrays, impact: np.void, spins: np.void) -> float:
    """Return how far what an impact made of velocities and surface speeds is from the exact law, applied to its before.

    In units in the last place of the greatest speed in it. The arms are full radii along the recorded normal. Where the
    bodies slide, what rounding does to the approach, a unit of the relative speed, it does to friction, too, times its
    coefficient; and to a spin once more times 1/k.
    """
    first, second = int(impact["first"]), int(impact["second"])
    nx, ny = (Fraction(float(part)) for part in impact["normal"])
    length = length_of(nx, ny)
    bodies, radii = [], []
    for side, body, sign in (("first", first, 1), ("second", second, -1)):
        radius = Fraction(float(start.radius_m[body])) if body >= 0 else Fraction(1)
        arm = (sign * radius * nx / length, sign * radius * ny / length)
        bodies.append(body_of(start, body, impact[f"velocity_{side}_before"], float(spins[f"{side}_before"]), arm))
        radii.append(radius)
    law = law_of(start, second)
    one, two, slides = resolve_exact_impact(bodies[0], bodies[1], (nx, ny), law)
    off, scale = [], [Fraction(LEAST)]
    if slides:
        (ax, ay), (bx, by) = bodies[0].velocity, bodies[1].velocity
        relative = max(abs(Fraction(ax) - Fraction(bx)), abs(Fraction(ay) - Fraction(by)))
        least = min(float(start.inertia[body]) for body in (first, second) if body >= 0)
        scale.append(Fraction(law.friction) * relative * (1 if math.isinf(least) else 1 + 1 / Fraction(least)))
    for side, radius, before, exact in zip(("first", "second"), radii, bodies, (one, two), strict=True):
        seen = [Fraction(float(part)) for part in impact[f"velocity_{side}_after"]]
        off += [abs(a - Fraction(b)) for a, b in zip(seen, exact.velocity, strict=True)]
        off.append(radius * abs(Fraction(float(spins[f"{side}_after"])) - Fraction(exact.spin)))
        for state in (before, exact):
            scale += [*(abs(Fraction(v)) for v in state.velocity), radius * abs(Fraction(state.spin))]
    return float(max(off) / max(scale)) / ULP


def draw_pair(rng: random.Random) -> DiscArrays:
    """Return two discs, and a wall at the first, in contact or overlapping as PIT finds them, that approach."""
    while True:
        angle, depth = rng.uniform(0, 2 * math.pi), rng.choice([1.0, 1.0, 0.9, 0.5])
        radii = [rng.choice([0.25, 0.5, 1.0, rng.uniform(0.1, 2.0)]) for _ in range(2)]
        masses = [rng.choice([1.0, rng.uniform(0.1, 10.0), 10 ** rng.uniform(-6, 6), math.inf]) for _ in range(2)]
        x, y = (sum(radii) * depth * part for part in (math.cos(angle), math.sin(angle)))
        velocity = [(rng.gauss(0, 3), rng.gauss(0, 3)) if math.isfinite(m) else (0.0, 0.0) for m in masses]
        if (velocity[0][0] - velocity[1][0]) * x + (velocity[0][1] - velocity[1][1]) * y > 0.0:
            break
    inertia = [rng.choice([0.5, 0.4, 1.0, 10 ** rng.uniform(-6, 0), math.inf]) for _ in range(2)]
    turns = [math.isfinite(m) and math.isfinite(k) for m, k in zip(masses, inertia, strict=True)]
    distance = math.hypot(x, y)
    return DiscArrays(
        np.array([(0.0, 0.0), (x, y)]),
        np.array(velocity),
        np.array(radii),
        np.array(masses),
        ((x, y, -x / distance, -y / distance),),
        rng.choice([0.0, 0.5, 0.97, 1.0]),
        rng.choice([0.0, 0.5, 0.97, 1.0]),
        np.array([rng.gauss(0, 5) if turn else 0.0 for turn in turns]),
        np.array(inertia),
        rng.choice(COEFFICIENTS),
        rng.choice(COEFFICIENTS),
        rng.choice([0.0, 0.0, 0.44, 1.0, -1.0, -0.3]),
        rng.choice([0.0, 0.0, 0.44, 1.0, -1.0]),
    )


def collide_in_core(start: DiscArrays, *, on_wall: bool = False) -> tuple[np.void, np.void]:
    """Return the impact of two discs, or of the first and the wall, and its spins, by the law of the core."""
    wall = start.half_planes()[0] if on_wall else None
    velocity, spin = core_functions.collide(start, wall)
    normal = start.position_m[1] - start.position_m[0] if wall is None else -np.array(wall[2:])
    impact, spins = np.zeros(1, IMPACT_DTYPE), np.zeros(1, SPIN_DTYPE)
    impact["second"], impact["normal"] = -1 if on_wall else 1, normal / np.sqrt(np.sum(normal * normal))
    impact["velocity_first_before"], impact["velocity_first_after"] = start.velocity_m_s[0], velocity[0]
    spins["first_before"], spins["first_after"] = start.spins[0], spin[0]
    if wall is None:
        impact["velocity_second_before"], impact["velocity_second_after"] = start.velocity_m_s[1], velocity[1]
        spins["second_before"], spins["second_after"] = start.spins[1], spin[1]
    return impact[0], spins[0]


def collide_on_arrays(start: DiscArrays) -> tuple[np.void, np.void]:
    """Return the impact of two discs, and its spins, by the law on arrays, by which others are scored."""
    rows = (start.velocity_m_s, start.surface_speed_m_s, start.mass_kg, start.inertia)
    one, two = (RoughBodies(*(row[k : k + 1] for row in rows)) for k in (0, 1))
    line = (start.position_m[1] - start.position_m[0])[None]
    e, *grip = (np.array([x]) for x in (start.restitution, start.friction, start.tangential_restitution))
    after = resolve_rough_impact(one, two, line / np.hypot(*line[0]), e, ContactFrictions(*grip))
    impact, spins = np.zeros(1, IMPACT_DTYPE), np.zeros(1, SPIN_DTYPE)
    impact["second"], impact["normal"] = 1, line / np.hypot(*line[0])
    for name, begun, ended, radius in zip(("first", "second"), (one, two), after, start.radius_m, strict=True):
        impact[f"velocity_{name}_before"], impact[f"velocity_{name}_after"] = begun.velocity[0], ended.velocity[0]
        spins[f"{name}_before"], spins[f"{name}_after"] = begun.rim[0] / radius, ended.rim[0] / radius
    spins["first_before"], spins["second_before"] = start.spins
    smooth = resolve_rough_impact(one, two, line, e, ContactFrictions(np.zeros(1), np.zeros(1)))
    known = resolve_impact(one.velocity, one.mass, two.velocity, two.mass, line, e)
    assert all(np.array_equal(found.velocity, v) for found, v in zip(smooth, known, strict=True))
    assert (smooth[0].rim, smooth[1].rim) == (one.rim, two.rim)
    return impact[0], spins[0]


@each("count", release_after(1, [20, 10_000]))
def test_random_rough_impacts_match_the_rational_law(count: int) -> None:
    """Velocities and surface speeds after random impacts are within 12 ulp of the law in rational numbers."""
    rng = random.Random(count)
    worst, worst_as_arrays = 0.0, 0.0
    for number in range(count):
        start = draw_pair(rng)
        approach = (start.velocity_m_s[0] * start.half_planes()[0][2:]).sum()
        on_wall = number % 4 == 0 and start.movable[0] and approach < 0.0
        worst = max(worst, measure_impact_error(start, *collide_in_core(start, on_wall=on_wall)))
        worst_as_arrays = max(worst_as_arrays, measure_impact_error(start, *collide_on_arrays(start)))
    assert 0.5 < worst < ULPS
    assert 0.5 < worst_as_arrays < ULPS


@each("count", release_after(1, [40, 400]))
def test_rough_impacts_of_extreme_sizes_match_the_rational_law(count: int) -> None:
    """Impacts with masses, radii, speeds and spins from about 2^-199 to 2^199 are within 12 ulp of the exact law."""
    rng = random.Random(5)
    for number in range(count):
        angle, size, speed = rng.uniform(0, 2 * math.pi), 2.0 ** rng.uniform(-190, 190), 2.0 ** rng.uniform(-190, 190)
        radius = [size * 2.0 ** rng.uniform(-3, 3) for _ in range(2)]
        place = np.array([(0.0, 0.0), (sum(radius) * math.cos(angle), sum(radius) * math.sin(angle))])
        velocity = np.array([(rng.gauss(0, speed), rng.gauss(0, speed)) for _ in range(2)])
        if (velocity[0] - velocity[1]) @ (place[1] / sum(radius)) <= 0.0:
            velocity = velocity[::-1].copy()
        rims = [rng.gauss(0, 1) * min(speed * rng.choice([0.0, 1e-12, 1.0, 1e6]), 2.0**195) for _ in range(2)]
        start = DiscArrays(
            place,
            velocity,
            np.array(radius),
            np.array([2.0 ** rng.uniform(-199, 199) for _ in range(2)]),
            restitution=rng.random(),
            spin_rad_s=np.array(rims) / radius,
            inertia_factor=np.array([2.0 ** rng.uniform(-199, 0), rng.choice([0.5, 1e-6])]),
            friction=rng.choice([1e-300, 1e-19, 0.1, 10.0, 1e19, LARGEST]),
            tangential_restitution=rng.uniform(-1, 1),
        )
        assert measure_impact_error(start, *collide_in_core(start)) < ULPS, number


@each("numbers", release_after(1, [range(1, 2), *(range(k, k + 14) for k in range(0, 98, 14))]))
def test_each_impact_of_rough_runs_matches_the_rational_law(numbers: range) -> None:
    """Each impact of rough PIC and PIT runs is within 12 ulp of the rational law applied to the state before it."""
    for kind, number in product(KINDS, numbers):
        scene = draw_scene(kind, number, rough=True, gravity=(0.25, -1.0) if number % 3 == 1 else (0.0, 0.0))
        traces = [solve_pic(scene, max_impacts=min(number_of_impacts(number), 60))]
        traces += [solve_pit(scene, frame_rate_hz=20.0)] if kind in SMALL else []
        for trace in traces if scene.arrays.turns else []:
            impacts = zip(trace.impacts[:500], require_value(trace.spins), strict=False)
            worst = max((measure_impact_error(scene.arrays, *rows) for rows in impacts), default=0.0)
            assert worst < ULPS, (kind, number, trace.method)
