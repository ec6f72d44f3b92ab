"""A start in which bodies overlap is refused, in a scene and in arrays alike, and the bodies are named."""

import itertools
import math
from fractions import Fraction

import numpy as np
from hypothesis import assume, given
from hypothesis import strategies as st
from numpy.typing import NDArray
from tests.cases import each

from carom.model.disc_arrays import DiscArrays
from carom.model.overlap import find_overlaps, require_apart

INF = math.inf


def build_discs(position: NDArray[np.float64], radius: NDArray[np.float64], mass: float = 1.0) -> DiscArrays:
    n = len(position)
    return DiscArrays(position, np.zeros((n, 2)), radius, np.full(n, mass))


def list_overlaps(start: DiscArrays) -> list[tuple[int, int]]:
    return [(overlap.disc, overlap.other) for overlap in find_overlaps(start, "disc {}", "wall {}")[0]]


@given(st.integers(0, 2**32 - 1), st.sampled_from([1.0, 30.0]), st.integers(2, 40))
def test_first_ten_overlaps_are_listed(seed: int, spread: float, n: int) -> None:
    """At most ten overlaps are listed, ordered by the higher disc and then the lower, with a flag for more."""
    rng = np.random.default_rng(seed)
    radius = rng.uniform(0.1, 1.0, n) * rng.uniform(1.0 / spread, 1.0, n)
    start = build_discs(rng.uniform(-8, 8, (n, 2)), radius)
    overlapping = [
        (j, i)
        for j, i in itertools.product(range(n), repeat=2)
        if i < j and math.dist(start.position_m[i], start.position_m[j]) < radius[i] + radius[j] - 1e-12
    ]
    assert list_overlaps(start) == overlapping[:10]
    assert find_overlaps(start, "", "")[1] == (len(overlapping) > 10)


@given(
    angle=st.floats(0, 2 * math.pi),
    x=st.floats(-1e3, 1e3),
    y=st.floats(-1e3, 1e3),
    radii=st.tuples(st.floats(1e-6, 1e3), st.floats(1e-6, 1e3)),
    units=st.integers(-40, 40),
)
def test_overlap_within_rounding_is_accepted(
    angle: float, x: float, y: float, radii: tuple[float, float], units: int
) -> None:
    """An overlap of up to 3 units in the last place of the largest number is accepted, one of over 9 refused."""
    # Six units are tolerated, and the computed gap is within 3 units of the exact one.
    reach = sum(radii) - units * math.ulp(max(abs(x), abs(y), *radii))
    assume(reach > 0)
    place = (x + reach * math.cos(angle), y + reach * math.sin(angle))
    unit = Fraction(math.ulp(max(map(abs, (x, y, *place, *radii)))))
    distance2 = sum((Fraction(b) - Fraction(a)) ** 2 for a, b in zip((x, y), place, strict=True))
    contact = Fraction(radii[0]) + Fraction(radii[1])
    refused = bool(list_overlaps(build_discs(np.array([(x, y), place]), np.array(radii))))
    if contact <= 3 * unit or distance2 >= (contact - 3 * unit) ** 2:
        assert not refused
    if contact > 9 * unit and distance2 < (contact - 9 * unit) ** 2:
        assert refused


@each("immovable", [False, True])
@each("walls", [1, 3])
def test_movable_discs_in_walls_are_listed(walls: int, immovable: bool) -> None:
    """Movable discs that reach into walls are listed with each wall, up to ten; immovable ones are accepted."""
    n = 30
    place = np.stack([np.arange(n) * 2.0, np.where(np.arange(n) % 7 == 3, 0.25, 1.0)], axis=1)
    start = DiscArrays(
        place, np.zeros((n, 2)), np.full(n, 0.5), np.full(n, INF if immovable else 1.0), ((0.0, 0.0, 0.0, 1.0),) * walls
    )
    found, more = find_overlaps(start, "disc {}", "wall {}")
    inside = [] if immovable else [(i, k) for i in (3, 10, 17, 24) for k in range(walls)]
    assert [(overlap.disc, overlap.other) for overlap in found] == inside[:10]
    assert more == (len(inside) > 10)
    assert all("reaches 0.25 m into it" in overlap.message for overlap in found)


def test_immovable_and_tiny_discs_may_overlap() -> None:
    """Discs that never move may overlap, and so may discs smaller than the rounding of their positions."""
    require_apart(build_discs(np.zeros((20_000, 2)), np.full(20_000, 0.5), INF))
    require_apart(build_discs(np.ones((20_000, 2)), np.full(20_000, 1e-17)))
