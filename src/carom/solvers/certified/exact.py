"""Questions about the start of a scene that exact rational arithmetic answers: ties, grazes, and contact.

Times of impact on paths not yet changed are of the form ``(P - sqrt(Q)) / A`` with rational P, Q and A > 0, whatever
the bodies: for two discs P = -b, Q = D, A = a; for a wall P = (p - q).n, Q = r^2 n.n, A = -v.n.
"""

from __future__ import annotations

from fractions import Fraction
from typing import NamedTuple

from carom.scene import Scene
from carom.trace import wall_index

__all__ = [
    "exactly_grazing",
    "exactly_grazing_wall",
    "exactly_simultaneous",
    "gap_and_speed_at_wall",
    "gap_and_speed_of_pair",
    "pull_along_wall",
]


class _PairTerms(NamedTuple):
    """Coefficients of ``a t^2 + 2 b t + c`` for two discs at the start, and D = b^2 - a c."""

    a: Fraction
    b: Fraction
    c: Fraction
    d: Fraction


def _pair_terms(scene: Scene, i: int, j: int) -> _PairTerms:
    """Return the exact coefficients of two discs at the start."""
    p, q = scene.discs[i], scene.discs[j]
    dx, dy = (Fraction(q.position_m[k]) - Fraction(p.position_m[k]) for k in (0, 1))
    ux, uy = (Fraction(q.velocity_m_s[k]) - Fraction(p.velocity_m_s[k]) for k in (0, 1))
    reach = Fraction(p.radius_m) + Fraction(q.radius_m)
    a, b, c = ux * ux + uy * uy, dx * ux + dy * uy, dx * dx + dy * dy - reach * reach
    return _PairTerms(a, b, c, b * b - a * c)


def exactly_grazing(scene: Scene, i: int, j: int) -> bool:
    """Whether two discs on their first paths just touch in passing, or do not move at all: neither is an impact."""
    terms = _pair_terms(scene, i, j)
    return terms.d == 0 or terms.a == 0


def pull_along_wall(scene: Scene, k: int) -> int:
    """Return the sign of gravity's part along a wall's normal: below 0, it pulls discs to the wall."""
    return _sign(_along(scene.gravity_m_s2, scene.walls[k].normal))


def gap_and_speed_of_pair(scene: Scene, i: int, j: int) -> tuple[int, int]:
    """Return the signs of two discs' gap at the start, and of the speed at which it grows."""
    terms = _pair_terms(scene, i, j)
    return _sign(terms.c), _sign(terms.b)


def gap_and_speed_at_wall(scene: Scene, i: int, k: int) -> tuple[int, int]:
    """Return the signs of a disc's gap to a wall at the start, and of its speed along the wall's normal."""
    offset, rim2, toward = _wall_terms(scene, i, k)
    return _sign(offset * abs(offset) - rim2), -_sign(toward)


def exactly_grazing_wall(scene: Scene, i: int, k: int) -> bool:
    """Whether a disc on its first path, a parabola, turns back exactly where it touches a wall: no impact.

    ``s^2 = 2 a (P - r |n|)`` with s, a and P the speed, gravity and the centre's offset along n.
    """
    offset, rim2, toward = _wall_terms(scene, i, k)
    pull = _along(scene.gravity_m_s2, scene.walls[k].normal)
    left = 2 * pull * offset - toward * toward  # 2 a r |n|, if it does
    return _sign(left) == _sign(pull) and left * left == 4 * pull * pull * rim2


def exactly_simultaneous(scene: Scene, one: tuple[int, int], other: tuple[int, int]) -> bool:
    """Whether two impacts on first paths, each known to take place, are at the very same instant.

    ``(P1 - sqrt(Q1)) / A1 = (P2 - sqrt(Q2)) / A2`` is ``k + sqrt(C) = sqrt(B)`` with k = P2 A1 - P1 A2, C = A2^2 Q1 and
    B = A1^2 Q2, which squaring twice decides.
    """
    p1, q1, a1 = _root_form(scene, *one)
    p2, q2, a2 = _root_form(scene, *other)
    k, c, b = p2 * a1 - p1 * a2, a2 * a2 * q1, a1 * a1 * q2
    double_product = b - k * k - c  # 2 k sqrt(C), if they are the same
    if _sign(double_product) != _sign(k) * _sign(c) or double_product**2 != 4 * k * k * c:
        return False
    return k >= 0 or k * k <= c  # the left side, a root, is not negative


def _sign(number: Fraction) -> int:
    return (number > 0) - (number < 0)


def _along(vector: tuple[float, float], normal: tuple[float, float]) -> Fraction:
    return sum((Fraction(vector[c]) * Fraction(normal[c]) for c in (0, 1)), Fraction(0))


def _wall_terms(scene: Scene, i: int, k: int) -> tuple[Fraction, Fraction, Fraction]:
    """Return P, Q and A of a disc and a wall."""
    disc, wall = scene.discs[i], scene.walls[k]
    offset = _along(disc.position_m, wall.normal) - _along(wall.point_m, wall.normal)
    rim2 = Fraction(disc.radius_m) ** 2 * _along(wall.normal, wall.normal)
    return offset, rim2, -_along(disc.velocity_m_s, wall.normal)


def _root_form(scene: Scene, first: int, second: int) -> tuple[Fraction, Fraction, Fraction]:
    """Return P, Q and A of any two bodies."""
    if second < 0:
        return _wall_terms(scene, first, wall_index(second))
    terms = _pair_terms(scene, first, second)
    return -terms.b, terms.d, terms.a
