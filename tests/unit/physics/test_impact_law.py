"""The impact law: momentum, restitution, energy, immovable bodies, and what an observer must not matter."""

from __future__ import annotations

import math
from fractions import Fraction
from typing import Any, NamedTuple

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from numpy.typing import NDArray
from tests.lengths import each

from carom.errors import InputError
from carom.physics.impact_law import resolve_impact

#: Relative rounding of one operation.
U = Fraction(1, 2**53)
#: `resolve_impact` rounds at most 20 times on the way to one component of a velocity change: 7 times in the normal, 4
#: in the approach speed, 4 in the impulse, 2 in the push, 1 in the new velocity, and two inverses. No number on that
#: way is above twice ``S = |v1| + |v2|``, once masses have cancelled. So each component is off by less than 40 units of
#: relative rounding times S, and the same count holds for the momentum handed over, in units of the smaller mass.
ROUNDINGS = 40

# Nothing between 0 and 1e-9: products that underflow are not what these laws are about.
components = st.floats(-100, 100).map(lambda v: v if abs(v) > 1e-9 else 0.0)
velocities = st.tuples(components, components)
masses = st.floats(1e-3, 1e3)
coefficients = st.floats(0, 1)
normals = velocities.filter(lambda n: math.hypot(*n) > 1e-3)

Exact = tuple[Fraction, Fraction]
Vector = tuple[float, float]


class Impact(NamedTuple):
    """The arguments of `resolve_impact`."""

    v1: Vector
    m1: float
    v2: Vector
    m2: float
    normal: Vector
    e: float


impacts = st.builds(Impact, velocities, masses, velocities, masses, normals, coefficients)


def exact(vector: NDArray[np.float64] | Vector) -> Exact:
    """Return the vector in rational numbers."""
    return Fraction(float(vector[0])), Fraction(float(vector[1]))


def dot(a: Exact, b: Exact) -> Fraction:
    """Scalar product."""
    return a[0] * b[0] + a[1] * b[1]


def minus(a: Exact, b: Exact) -> Exact:
    """Difference."""
    return a[0] - b[0], a[1] - b[1]


def span(*vectors: Vector) -> Fraction:
    """Sum of the lengths, rounded up: the S of the tolerances."""
    return Fraction(sum(math.hypot(*vector) for vector in vectors)) * Fraction(101, 100) + Fraction(1, 10**300)


def approach(v1: Vector, v2: Vector, normal: Vector) -> Fraction:
    """Approach speed times the length of the normal, exactly."""
    return dot(minus(exact(v1), exact(v2)), exact(normal))


# Known answers --------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("impact", "after"),
    [
        pytest.param(Impact((3, 0), 2, (-1, 0), 2, (1, 0), 1.0), [(-1, 0), (3, 0)], id="equal masses exchange"),
        # 2 kg at 3 m/s against 1 kg at rest with e = 1/2 hand over 3 N s.
        pytest.param(Impact((3, 0), 2, (0, 0), 1, (1, 0), 0.5), [(1.5, 0), (3, 0)], id="masses and restitution"),
        # At e = 0 both go on along the normal as one, and keep what they had across it.
        pytest.param(Impact((4, 5), 1, (0, 7), 3, (1, 0), 0.0), [(1, 5), (1, 7)], id="no restitution"),
    ],
)
def test_head_on(impact: Impact, after: list[Vector]) -> None:
    """On one line every number is known, and exact."""
    np.testing.assert_array_equal(resolve_impact(*impact), after)


def test_oblique_3_4_5() -> None:
    """At 2 m/s along x on a normal of (.8, .6) the struck disc leaves along the normal, the other at a right angle."""
    tolerance = float(ROUNDINGS * 2 * U)
    found = resolve_impact([2, 0], 1, [0, 0], 1, [4, 3])
    np.testing.assert_allclose(found, [(0.72, -0.96), (1.28, 0.96)], rtol=0, atol=tolerance)


# Laws -----------------------------------------------------------------------------------------------------------------


@given(impacts)
def test_momentum_is_conserved(impact: Impact) -> None:
    """Total momentum is the same before and after, at any restitution, to the rounding derived above."""
    v1, m1, v2, m2, normal, e = impact
    after1, after2 = (exact(v) for v in resolve_impact(v1, m1, v2, m2, normal, e))
    before1, before2 = exact(v1), exact(v2)
    # Besides the momentum handed over, each new velocity (3 S at most) is rounded once, and weighed with its mass.
    tolerance = U * span(v1, v2) * (ROUNDINGS * Fraction(min(m1, m2)) + 3 * (Fraction(m1) + Fraction(m2)))
    for axis in (0, 1):
        change = Fraction(m1) * (after1[axis] - before1[axis]) + Fraction(m2) * (after2[axis] - before2[axis])
        assert abs(change) <= tolerance


@given(impacts)
def test_the_normal_relative_velocity_turns_into_minus_e_times_itself(impact: Impact) -> None:
    """Newton's law of restitution holds along the normal, and across it neither velocity changes."""
    v1, m1, v2, m2, normal, e = impact
    before = approach(v1, v2, normal)
    after1, after2 = (exact(v) for v in resolve_impact(v1, m1, v2, m2, normal, e))
    n = exact(normal)
    across = (-n[1], n[0])
    length = Fraction(math.hypot(*normal)) * Fraction(101, 100)
    tolerance = 2 * ROUNDINGS * U * span(v1, v2) * length  # of two velocities, each with both components
    if before <= 0:
        assert (after1, after2) == (exact(v1), exact(v2))
        return
    separation = dot(minus(after2, after1), n)
    assert abs(separation - Fraction(e) * before) <= 2 * tolerance
    assert abs(dot(minus(after1, exact(v1)), across)) <= tolerance
    assert abs(dot(minus(after2, exact(v2)), across)) <= tolerance


@given(impacts)
def test_the_energy_lost_is_that_of_the_restitution(impact: Impact) -> None:
    """Kinetic energy falls by half the reduced mass times (1 - e^2) times the approach speed squared: not at e = 1."""
    v1, m1, v2, m2, normal, e = impact
    mass1, mass2, s = Fraction(m1), Fraction(m2), span(v1, v2)
    n = exact(normal)
    approach_squared = max(approach(v1, v2, normal), Fraction(0)) ** 2 / dot(n, n)
    lost = mass1 * mass2 / (mass1 + mass2) * (1 - Fraction(e) ** 2) * approach_squared / 2
    after1, after2 = (exact(v) for v in resolve_impact(v1, m1, v2, m2, normal, e))
    before = (mass1 * dot(exact(v1), exact(v1)) + mass2 * dot(exact(v2), exact(v2))) / 2
    after = (mass1 * dot(after1, after1) + mass2 * dot(after2, after2)) / 2
    # Half m v^2 moves by m |v| dv; |v| is 3 S at most, and dv 40 U S in each of two components.
    tolerance = (mass1 + mass2) * 3 * s * 2 * ROUNDINGS * U * s
    assert abs(before - lost - after) <= tolerance


@given(velocities, velocities, masses, normals, coefficients)
def test_an_immovable_body_keeps_its_velocity_and_reflects_the_other(
    v1: Vector, v2: Vector, m: float, normal: Vector, e: float
) -> None:
    """Infinite mass does not change its velocity by a bit; the other's mass does not matter."""
    after1, after2 = resolve_impact(v1, m, v2, math.inf, normal, e)
    np.testing.assert_array_equal(after2, v2)
    n = exact(normal)
    length2 = dot(n, n)
    push = (1 + Fraction(e)) * max(approach(v1, v2, normal), Fraction(0)) / length2
    for axis in (0, 1):
        truth = exact(v1)[axis] - push * n[axis]
        assert abs(exact(after1)[axis] - truth) <= ROUNDINGS * U * span(v1, v2)
    mirrored2, mirrored1 = resolve_impact(v2, math.inf, v1, m, (-normal[0], -normal[1]), e)
    np.testing.assert_array_equal(mirrored1, after1)
    np.testing.assert_array_equal(mirrored2, v2)


@given(impacts, velocities)
def test_a_moving_observer_sees_the_same_impact(impact: Impact, boost: Vector) -> None:
    """Adding one velocity to both bodies adds it to both results (Galilean invariance)."""
    v1, m1, v2, m2, normal, e = impact
    still = resolve_impact(v1, m1, v2, m2, normal, e)
    moved = resolve_impact(np.add(v1, boost), m1, np.add(v2, boost), m2, normal, e)
    # Two results of 40 roundings each, and the rounding of the boosted inputs, which an impact at most triples; where
    # rounding decides whether they approach at all, the impulse is of that size, too.
    tolerance = (2 * ROUNDINGS + 8) * U * span(v1, v2, boost, boost)
    for one, other in zip(still, moved, strict=True):
        for axis in (0, 1):
            assert abs(exact(one)[axis] + exact(boost)[axis] - exact(other)[axis]) <= tolerance


@given(impacts, st.integers(-60, 60))
def test_neither_the_length_of_the_normal_nor_the_unit_of_mass_matters(impact: Impact, k: int) -> None:
    """Scaling the normal, or both masses, by a power of two changes no bit."""
    v1, m1, v2, m2, normal, e = impact
    scale = 2.0**k
    plain = resolve_impact(v1, m1, v2, m2, normal, e)
    scaled = resolve_impact(v1, m1 * scale, v2, m2 * scale, np.multiply(normal, scale), e)
    np.testing.assert_array_equal(plain, scaled)


@pytest.mark.parametrize("v1", [(-1.0, 0.0), (0.0, 0.0), (0.0, 5.0)])
def test_bodies_that_do_not_approach_are_returned_as_they_were(v1: Vector) -> None:
    """Separating, at rest or sliding along each other, there is no impact."""
    after1, after2 = resolve_impact(v1, 1, [0, 0], 2, [1, 0])
    np.testing.assert_array_equal(after1, v1)
    np.testing.assert_array_equal(after2, [0, 0])


# Arrays and errors ----------------------------------------------------------------------------------------------------


def test_arrays_broadcast_and_give_what_single_calls_give() -> None:
    """Any argument may bring the leading axes; each item is the answer of its own pair."""
    rng = np.random.default_rng(5)
    v1, v2 = rng.normal(size=(4, 1, 2)), rng.normal(size=(3, 2))
    m1, m2, e = rng.uniform(1, 2, (4, 1)), math.inf, rng.uniform(0, 1, 3)
    normal = rng.normal(size=2)
    after1, after2 = resolve_impact(v1, m1, v2, m2, normal, e)
    assert after1.shape == after2.shape == (4, 3, 2)
    for i in range(4):
        for j in range(3):
            single = resolve_impact(v1[i, 0], m1[i, 0], v2[j], m2, normal, e[j])
            np.testing.assert_array_equal([after1[i, j], after2[i, j]], single)


GOOD: dict[str, Any] = {"v1": [1, 0], "m1": 1.0, "v2": [0, 0], "m2": 1.0, "normal": [1, 0], "restitution": 1.0}


@each(
    ("name", "value", "says"),
    [
        ("v1", [math.nan, 0], "v1 must be finite everywhere, got nan"),
        ("v2", [0, math.inf], "v2 must be finite everywhere, got inf"),
        ("v1", [1, 2, 3], "v1 must have x and y along its last axis, got shape (3,)"),
        ("normal", 1.0, "normal must have x and y along its last axis, got shape ()"),
        ("normal", [0.0, 0.0], "normal must not be of length zero"),
        ("normal", [math.inf, 0.0], "normal must be finite everywhere, got inf"),
        ("m1", 0.0, "m1 must be above 0 (infinity is immovable), got 0.0"),
        ("m2", [1.0, -3.0], "m2 must be above 0 (infinity is immovable), got -3.0"),
        ("m2", math.nan, "m2 must be above 0 (infinity is immovable), got nan"),
        ("restitution", 1.25, "restitution must lie in 0 to 1, got 1.25"),
        ("restitution", -0.5, "restitution must lie in 0 to 1, got -0.5"),
        ("restitution", math.nan, "restitution must lie in 0 to 1, got nan"),
    ],
)
def test_bad_input_is_refused_by_name_and_value(name: str, value: object, says: str) -> None:
    """An argument outside the law's domain is refused by its name, with the value found."""
    with pytest.raises(InputError) as caught:
        resolve_impact(**{**GOOD, name: value})
    assert str(caught.value) == says


def test_two_immovable_bodies_are_refused() -> None:
    """Between two infinite masses there is no answer, and the message says why."""
    with pytest.raises(InputError, match="m1 and m2 must not both be infinite"):
        resolve_impact([1, 0], math.inf, [0, 0], math.inf, [1, 0])
