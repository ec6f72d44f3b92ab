"""The law of impact in rational numbers: restitution along the normal."""

import math
from fractions import Fraction
from typing import Any, NamedTuple

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from numpy.typing import NDArray
from tests.cases import each
from tests.validation.exact_impact import Body, Law, resolve_exact_impact

from carom.core.impact_law import resolve_impact
from carom.errors import InputError

#: Relative rounding of one operation.
U = Fraction(1, 2**53)
#: `resolve_impact` rounds at most 20 times for one component of a velocity change. These are 7 in the normal, 4 in the
#: approach speed, 4 in the impulse, 2 in the push, 1 in the new velocity, and two inverses. No number on that way is
#: above twice ``S = |v1| + |v2|``, once masses have cancelled. So each component is off by less than 40 units of
#: relative rounding times S, and the same count holds for the exchanged momentum, in units of the smaller mass.
ROUNDINGS = 40

# Nothing between 0 and 1e-9: products that underflow are not what these laws are about.
components = st.floats(-100, 100).map(lambda v: v if abs(v) > 1e-9 else 0.0)
velocities = st.tuples(components, components)
masses = st.floats(1e-3, 1e3)
#: Masses of the second of two discs, which may be immovable.
second_masses = st.one_of(masses, st.just(math.inf))
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


impacts = st.builds(Impact, velocities, masses, velocities, second_masses, normals, coefficients)


def to_exact(vector: NDArray[np.float64] | Vector) -> Exact:
    """Return the vector in rational numbers."""
    return Fraction(float(vector[0])), Fraction(float(vector[1]))


def sum_lengths(*vectors: Vector) -> Fraction:
    """Sum of the lengths, rounded up: the S of the tolerances."""
    return Fraction(sum(math.hypot(*vector) for vector in vectors)) * Fraction(101, 100) + Fraction(1, 10**300)


# Known answers --------------------------------------------------------------------------------------------------------


@each(
    "impact, after",
    [
        pytest.param(Impact((3, 0), 2, (-1, 0), 2, (1, 0), 1.0), [(-1, 0), (3, 0)], id="equal masses exchange"),
        # 2 kg at 3 m/s against 1 kg at rest with e = 1/2 exchange 3 N s.
        pytest.param(Impact((3, 0), 2, (0, 0), 1, (1, 0), 0.5), [(1.5, 0), (3, 0)], id="masses and restitution"),
        # At e = 0 both go on along the normal as one, and keep what they had across it.
        pytest.param(Impact((4, 5), 1, (0, 7), 3, (1, 0), 0.0), [(1, 5), (1, 7)], id="no restitution"),
    ],
)
def test_head_on_impact_is_exact(impact: Impact, after: list[Vector]) -> None:
    """The velocities after a head-on impact are exact, for equal and unequal masses and e = 1, 0.5 and 0."""
    np.testing.assert_array_equal(resolve_impact(*impact), after)


# Laws -----------------------------------------------------------------------------------------------------------------


@given(impacts)
def test_velocities_after_impact_match_the_exact_law(impact: Impact) -> None:
    """Velocities after an impact equal those of the rational law within the derived rounding."""
    v1, m1, v2, m2, normal, e = impact
    found = resolve_impact(v1, m1, v2, m2, normal, e)
    smooth = Law(e, 0, 0)
    one, two, _ = resolve_exact_impact(
        Body(v1, 0, m1, math.inf, (0, 0)), Body(v2, 0, m2, math.inf, (0, 0)), normal, smooth
    )
    approaches = one.velocity != v1 or two.velocity != v2
    for after, before, mass, body in zip(found, (v1, v2), (m1, m2), (one, two), strict=True):
        if not approaches or mass == math.inf:
            np.testing.assert_array_equal(after, before)
        # A new velocity, 3 S at most, is rounded once more.
        tolerance = (
            U * sum_lengths(v1, v2) * (ROUNDINGS * Fraction(min(m1, m2)) / Fraction(mass) + 3) if mass < math.inf else 0
        )
        assert all(abs(to_exact(after)[axis] - Fraction(body.velocity[axis])) <= tolerance for axis in (0, 1))
    mirrored = resolve_impact(v2, m2, v1, m1, (-normal[0], -normal[1]), e)
    np.testing.assert_array_equal(mirrored[::-1], found)


@given(impacts, st.integers(-60, 60))
def test_scaling_normal_and_masses_changes_no_bit(impact: Impact, k: int) -> None:
    """Scaling the normal and both masses by a power of two changes no bit of the result."""
    v1, m1, v2, m2, normal, e = impact
    scale = 2.0**k
    plain = resolve_impact(v1, m1, v2, m2, normal, e)
    scaled = resolve_impact(v1, m1 * scale, v2, m2 * scale, np.multiply(normal, scale), e)
    np.testing.assert_array_equal(plain, scaled)


# Arrays and errors ----------------------------------------------------------------------------------------------------


def test_array_form_broadcasts_and_matches_single_calls() -> None:
    """Array arguments broadcast over their leading axes, and each item equals the result of a single call."""
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
    "name, value, says",
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
        ("restitution", 1.25, "restitution must be from 0 to 1, got 1.25"),
        ("restitution", -0.5, "restitution must be from 0 to 1, got -0.5"),
        ("restitution", math.nan, "restitution must be from 0 to 1, got nan"),
    ],
)
def test_invalid_argument_is_refused_with_name_and_value(name: str, value: object, says: str) -> None:
    """An argument outside its domain raises an InputError with its name and the value found."""
    with pytest.raises(InputError) as caught:
        resolve_impact(**{**GOOD, name: value})
    assert str(caught.value) == says


def test_two_immovable_bodies_are_refused() -> None:
    """Two infinite masses raise an InputError that names m1 and m2."""
    with pytest.raises(InputError, match="m1 and m2 must not both be infinite"):
        resolve_impact([1, 0], math.inf, [0, 0], math.inf, [1, 0])
