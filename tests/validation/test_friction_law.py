"""Friction and spin against the law in rational numbers, written from Newton's laws and not from the code."""

import math
import random
from dataclasses import replace
from fractions import Fraction
from itertools import product

import numpy as np
import pytest
from tests.campaign.gases import draw_gas
from tests.cases import each, release_after
from tests.checker import Report, check, watch
from tests.random_scenes import KINDS, SMALL, draw_scene, draw_small_scene, number_of_impacts
from tests.validation.exact_impact import Body, Law, kinetic_energy_of, momentum, resolve_exact_impact
from tests.validation.rough_impacts import body_of, length_of, measure_impact_error, measure_largest_law_error

from carom import DiscArrays, solve_pic, solve_pit
from carom.core.impact_law import ContactFrictions, RoughBodies, resolve_impact, resolve_rough_impact
from carom.model.trace import IMPACT_DTYPE, SPIN_DTYPE
from carom.solvers.event_driven.run import EventDrivenRun
from carom.support.limits import LARGEST

core_functions = pytest.importorskip("tests.core_functions")

#: In units in the last place of the greatest speed (`measure_impact_error`): some twenty roundings of half a unit, of
#: which the normal, as it is recorded, has four.
ULPS = 12.0
COEFFICIENTS = (0.0, 0.01, 0.1, 0.5, 2.0, 1e19)


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


@pytest.mark.release
@each("wall", [False, True])
def test_stick_and_slide_on_dyadic_numbers_are_exact_to_the_bit(wall: bool) -> None:
    """On a lattice of dyadic numbers full of stick-slide ties the result equals the exact law, bit for bit."""
    # Along an axis, with k = 1 and both masses 1, all sums and quotients are dyadic: 1 + 1/k is 2.
    seen = {"stick": 0, "slide": 0, "tie": 0}
    one, two = Body((1, 0), 0, 1, 1, (1, 0)), Body((0, 0), 0, 1, 1, (-1, 0))
    if wall:
        two = Body((0, 0), 0, math.inf, math.inf, (0, 0))
    for across, spin, coefficient in product(range(-16, 17), range(-4, 5), (1, 2, 4)):
        friction = coefficient / 4
        impact, spins = collide_in_core(_build_axis_pair(across / 4, spin, friction), on_wall=wall)
        # With e = 1 the impulse is 2 on a wall, 1 on a disc; it takes half the slip, or a quarter, to end it.
        held, most = abs(across / 4 + spin) / (2 if wall else 4), friction * (2 if wall else 1)
        seen["tie" if held == most else "stick" if held < most else "slide"] += 1
        hitting = one._replace(velocity=(1, across / 4), spin=spin)
        first, second, slides = resolve_exact_impact(hitting, two, (1, 0), Law(1, friction, 0))
        assert slides == (held > most)
        assert tuple(impact["velocity_first_after"]) == first.velocity
        assert tuple(impact["velocity_second_after"]) == second.velocity
        assert spins.tolist() == (spin, 0.0, first.spin, second.spin)
    assert min(seen.values()) > 10


def _build_axis_pair(across: float, spin: float, friction: float) -> DiscArrays:
    return DiscArrays(
        np.array([(0.0, 0.0), (2.0, 0.0)]),
        np.array([(1.0, across), (0.0, 0.0)]),
        np.ones(2),
        np.ones(2),
        ((1.0, 9.0, -1.0, 0.0),),
        spin_rad_s=np.array([float(spin), 0.0]),
        inertia_factor=np.ones(2),
        friction=friction,
        wall_friction=friction,
    )


def relative_surface_velocity(one: Body, other: Body, axes: tuple[tuple[Fraction, Fraction], ...]) -> list[Fraction]:
    """Return the velocity of one surface past the other, along and across a normal."""
    surfaces = [
        (Fraction(x) - Fraction(w) * Fraction(ry), Fraction(y) + Fraction(w) * Fraction(rx))
        for (x, y), w, _, _, (rx, ry) in (one, other)
    ]
    return [sum((a - b) * n for a, b, n in zip(*surfaces, axis, strict=True)) for axis in axes]


def test_rational_law_conserves_momentum_and_gains_no_energy() -> None:
    """In 50 rational impacts momentum and angular momentum about the contact are conserved."""
    rng = random.Random(7)
    for _ in range(50):
        normal = rng.choice([(3, 4), (5, -12), (1, 0), (-8, 15)])
        length = math.isqrt(normal[0] ** 2 + normal[1] ** 2)
        nx, ny = (Fraction(c, length) for c in normal)
        bodies = []
        for side in (1, -1):
            radius, mass = Fraction(rng.randint(1, 9), 4), Fraction(rng.randint(1, 9), 3)
            inertia = rng.choice([Fraction(1, 2), Fraction(2, 5), Fraction(1)]) * mass * radius**2
            velocity = (Fraction(rng.randint(-9, 9), 2), Fraction(rng.randint(-9, 9), 2))
            arm = (side * radius * nx, side * radius * ny)
            bodies.append(Body(velocity, Fraction(rng.randint(-9, 9), 2), mass, inertia, arm))
        friction = rng.choice([Fraction(0), Fraction(1, 10), Fraction(1), Fraction(99)])
        law = Law(Fraction(rng.randint(0, 4), 4), friction, Fraction(rng.randint(-4, 4), 4))
        one, two, slides = resolve_exact_impact(bodies[0], bodies[1], normal, law)
        assert momentum(one, two) == momentum(*bodies)
        axes = ((nx, ny), (-ny, nx))
        (approach, slip), (left, slips) = (
            relative_surface_velocity(bodies[0], bodies[1], axes),
            relative_surface_velocity(one, two, axes),
        )
        if approach > 0:
            assert left == -law.e * approach
            assert slips == -law.b * slip or slides
        lost = kinetic_energy_of(*bodies) - kinetic_energy_of(one, two)
        assert lost >= 0
        if law.e == 1 and (law.friction == 0 or (law.b in (1, -1) and not slides)):
            assert lost == 0


@each("numbers", release_after(1, [range(1, 2), *(range(k, k + 14) for k in range(0, 98, 14))]))
def test_each_impact_of_rough_runs_matches_the_rational_law(numbers: range) -> None:
    """Each impact of rough PIC and PIT runs is within 12 ulp of the rational law applied to the state before it."""
    for kind, number in product(KINDS, numbers):
        scene = draw_scene(kind, number, rough=True, gravity=(0.25, -1.0) if number % 3 == 1 else (0.0, 0.0))
        if scene.arrays.turns:
            assert measure_largest_law_error(solve_pic(scene, max_impacts=min(number_of_impacts(number), 60))) < ULPS, (
                kind,
                number,
            )
            if kind in SMALL and len((trace := solve_pit(scene, frame_rate_hz=20.0)).impacts) < 500:
                assert measure_largest_law_error(trace) < ULPS, (kind, number)


def test_checker_computes_vector_lengths_to_30_digits() -> None:
    """The checker's square root gives 5 for (3, 4) and the root of 2 for (1, 1), to 30 digits."""
    assert abs(length_of(Fraction(3), Fraction(4)) - 5) < Fraction(1, 10**30)
    assert abs(length_of(Fraction(1), Fraction(1)) ** 2 - 2) < Fraction(1, 10**30)


def test_checker_detects_a_spin_off_by_1e_12() -> None:
    """A spin that is off by a part in 10^12, or has the wrong sign, is more than 120 ulp from the exact law."""
    scene = draw_small_scene(5, rough=True)
    trace = solve_pic(scene, max_impacts=5)
    assert trace.spins is not None
    k = next(k for k in range(len(trace.spins)) if trace.spins[k]["first_after"] != 0.0)
    for factor in (1.0 + 1e-12, -1.0):
        wrong = trace.spins.copy()
        wrong["first_after"][k] *= factor
        assert measure_impact_error(scene.arrays, trace.impacts[k], wrong[k]) > 10 * ULPS
    assert body_of(scene.arrays, -1, (0.0, 0.0), 0.0, (Fraction(0), Fraction(0))).mass == math.inf


@each("count", release_after(0, [40]))
def test_rough_gases_pass_the_campaign_checker(count: int) -> None:
    """Gases of the campaign with friction violate no rule of its checker."""
    for number in range(count):
        start = add_friction(draw_gas(number, most_discs=800).start, number)
        run, report = EventDrivenRun(start), Report()
        for stretch in watch(run, start, 1e6, 12_000):
            check(start, stretch, report)
        assert report.violations == [], number
        impacts, spins = run.log.array(), run.log.spins()
        assert spins is not None
        chosen = range(0, len(impacts), max(1, len(impacts) // 60))
        assert max(measure_impact_error(start, impacts[k], spins[k]) for k in chosen) < ULPS, number


def add_friction(start: DiscArrays, number: int) -> DiscArrays:
    """Return a start with friction, and with spins as fast at the rim as the discs are."""
    rng = np.random.default_rng(number)
    inertia = rng.choice([0.4, 0.5, 1.0, math.inf], len(start))
    spin = rng.normal(size=len(start)) * np.abs(start.velocity_m_s).max() / start.radius_m.min()
    return replace(
        start,
        spin_rad_s=np.where(start.movable & np.isfinite(inertia), spin, 0.0),
        inertia_factor=inertia,
        friction=rng.choice([0.0, 0.1, 0.5, 10.0]),
        wall_friction=rng.choice([0.1, 1.0]),
        tangential_restitution=rng.choice([0.0, 0.5, 1.0]),
        wall_tangential_restitution=rng.choice([0.0, 0.5, 1.0]),
    )
