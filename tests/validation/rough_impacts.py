"""Impacts with friction and spin, compared with the law in rational numbers."""

import math
from collections.abc import Sequence
from fractions import Fraction

import numpy as np
from tests.validation.exact_impact import Body, Law, resolve_exact_impact

from carom import DiscArrays, Mode, Trace

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


def measure_largest_law_error(trace: Trace) -> float:
    """Return the largest of `measure_impact_error` over a trace, whose states before must be those that it left.

    Raises:
        AssertionError: A velocity or spin before an impact, or at the end, is not the one that the disc had.
    """
    scene = trace.scene
    assert trace.spins is not None
    assert trace.final_spin_rad_s is not None
    assert len(trace.spins) == len(trace.impacts)
    falls = scene.gravity_m_s2 != (0.0, 0.0)
    spin = {i: disc.spin_rad_s for i, disc in enumerate(scene.discs)}
    velocity = {i: disc.velocity_m_s for i, disc in enumerate(scene.discs)}
    worst = 0.0
    modes = [] if trace.modes is None else list(trace.modes[::-1])
    rubbing = [False] * len(scene.discs)  # in contact a spin changes
    for k, (impact, spins) in enumerate(zip(trace.impacts, trace.spins, strict=True)):
        while modes and modes[-1]["impacts"] <= k:
            mode = modes.pop()
            rubbing[int(mode["disc"])] = bool(mode["after"] != Mode.FLIGHT)
        worst = max(worst, measure_impact_error(scene.arrays, impact, spins))
        for side in ("first", "second"):
            body = int(impact[side])
            if body < 0:
                assert spins[f"{side}_before"] == spins[f"{side}_after"] == 0.0
                continue
            assert rubbing[body] or spins[f"{side}_before"] == spin[body]
            assert falls or tuple(impact[f"velocity_{side}_before"]) == tuple(velocity[body])
            spin[body], velocity[body] = spins[f"{side}_after"], impact[f"velocity_{side}_after"]
    for mode in modes[::-1]:
        rubbing[int(mode["disc"])] = True
    assert all(rubbing[i] or end == spin[i] for i, end in enumerate(trace.final_spin_rad_s.tolist()))
    return worst
