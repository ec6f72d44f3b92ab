"""Exact tests in rational numbers: whether impacts are simultaneous, discs only graze, or bodies touch at the start.

For bodies on their initial paths, times of impact have the form ``(P - sqrt(Q)) / A`` with rational P, Q and A > 0. For
two discs whose squared distance minus the squared sum of their radii is ``a t^2 + 2 b t + c``, these are ``P = -b``,
``Q = b^2 - a c`` and ``A = a``. For a disc of radius r, centre p and velocity v, and a wall through q with normal n,
``P = (p - q).n``, ``Q = r^2 n.n`` and ``A = -v.n``.
"""

from __future__ import annotations

from collections.abc import Mapping
from fractions import Fraction

import numpy as np

from carom.core.wall_parts import Plane, Round, cross, dot, subtract, to_exact
from carom.model.broad_phase import find_near_pairs, find_near_walls
from carom.model.scene import Scene
from carom.model.trace import wall_body, wall_index
from carom.solvers.certified.ball_arithmetic import SLACK
from carom.solvers.certified.disc_states import BallBodies
from carom.solvers.certified.result import Degeneracy, Degenerate


def find_contact_at_start(bodies: BallBodies, grounds: Mapping[int, int]) -> Degeneracy | None:
    """Return the first pair of bodies that touch or overlap at the start and approach each other; None for no pair.

    If bodies touch and approach at the start, their further motion is uncertain. A disc's lasting contact with the wall
    below it is ignored. `grounds` maps the number of each disc in lasting contact to the disc's wall. Finite walls are
    not checked here.
    """
    for i, j in _find_near_bodies(bodies):
        body = bodies.trace_body(j)
        if grounds.get(i) == body:
            continue
        if j >= 0:
            spread, speed, gap = _build_pair_polynomial(bodies.scene, i, j)
            pull = _find_curvature_sign(bodies.scene, i, j, spread)
        else:
            offset, rim2, toward = _find_root_form(bodies, i, j)
            gap, speed, pull = offset * abs(offset) - rim2, -toward, bodies.pulls[wall_index(j)]
        if gap <= 0 and speed < 0:
            kind = Degenerate.TOUCHING_START if gap == 0 else Degenerate.OVERLAPPING_START
        elif gap <= 0 and speed == 0 and pull < 0:  # the disc rests on the wall
            kind = Degenerate.RESTING_CONTACT
        else:
            continue
        return Degeneracy(kind, (min(i, body), max(i, body)), 0.0, 0.0, proven=True, bits=0)
    return None


def do_graze(bodies: BallBodies, i: int, body: int) -> bool:
    """Return whether a disc on its initial path only grazes a disc, a vertex, or an arc from outside.

    A graze is no impact. The condition is ``u^2 (R + r)^2 = (d x u)^2``, with the relative position d and velocity u. R
    is the radius of the arc; 0 without an arc. For two discs, r is the sum of their radii. For a wall, r is the disc's
    radius plus the half width. The condition has the form ``A + B R = 0`` with rational A, B and R^2, so squaring gives
    an exact test. If the velocities are equal, the condition is true too.
    """
    is_curved = bodies.is_driven(wall_index(body)) if body < 0 else bodies.is_curved(i) or bodies.is_curved(body)
    if is_curved or not bodies.are_at_start(i, body):
        return False
    disc, velocity = bodies.scene.discs[i], (0.0, 0.0)
    if body >= 0:
        other = bodies.scene.discs[body]
        centre, velocity, radius2 = to_exact(other.position_m), other.drive.velocity_at(0.0), Fraction(0)
        thick = Fraction(disc.radius_m) + Fraction(other.radius_m)
    else:
        obstacle = bodies.obstacles[wall_index(body)]
        assert isinstance(obstacle.shape, Round)  # noqa: S101 - callers pass round obstacles only
        centre, radius2 = obstacle.shape.centre, obstacle.shape.radius2
        thick = Fraction(disc.radius_m) + obstacle.half_width
    d = subtract(to_exact(disc.position_m), centre)
    u = subtract(to_exact(disc.drive.velocity_at(0.0)), to_exact(velocity))
    rest, slope = dot(u, u) * (radius2 + thick * thick) - cross(d, u) ** 2, 2 * dot(u, u) * thick
    return rest <= 0 and rest * rest == slope * slope * radius2


def does_graze_wall(bodies: BallBodies, i: int, k: int) -> bool:
    """Return whether a disc on its initial path turns back under gravity exactly where it touches a half-plane.

    With the normal n, the condition is ``s^2 = 2 a (P - r |n|)``. Here s, a and P are the components along n of the
    velocity, gravity and the centre's offset, and r is the radius.
    """
    offset, rim2, toward = _find_root_form(bodies, i, wall_body(k))
    pull = dot(to_exact(bodies.scene.gravity_m_s2), _plane_of(bodies, wall_body(k)).normal)
    left = 2 * pull * offset - toward * toward  # 2 a r |n| if the disc turns back where it touches the half-plane
    return _sign(left) == _sign(pull) and left * left == 4 * pull * pull * rim2


def are_simultaneous(bodies: BallBodies, one: tuple[int, int], other: tuple[int, int]) -> bool:
    """Return whether two impacts on initial paths are at exactly the same instant.

    Both impacts must certainly happen. If an impact is on a finite wall, the result is False.

    The condition ``(P1 - sqrt(Q1)) / A1 = (P2 - sqrt(Q2)) / A2`` is equivalent to ``k + sqrt(C) = sqrt(B)`` with ``k =
    P2 A1 - P1 A2``, ``C = A2^2 Q1`` and ``B = A1^2 Q2``. Squaring twice makes this equation rational.
    """
    if any(body < 0 and bodies.obstacles[wall_index(body)].kind is not None for body in (one[1], other[1])):
        return False
    (p1, q1, a1), (p2, q2, a2) = _find_root_form(bodies, *one), _find_root_form(bodies, *other)
    k, c, b = p2 * a1 - p1 * a2, a2 * a2 * q1, a1 * a1 * q2
    double_product = b - k * k - c  # 2 k sqrt(C) if the instants are equal
    if _sign(double_product) != _sign(k) * _sign(c) or double_product**2 != 4 * k * k * c:
        return False
    return k >= 0 or k * k <= c  # sqrt(B) is not negative


def _plane_of(bodies: BallBodies, body: int) -> Plane:
    shape = bodies.obstacles[wall_index(body)].shape
    assert isinstance(shape, Plane)  # noqa: S101 - callers pass no finite walls
    return shape


def _sign(number: Fraction) -> int:
    return (number > 0) - (number < 0)


def _build_pair_polynomial(scene: Scene, i: int, j: int) -> tuple[Fraction, Fraction, Fraction]:
    """Return the coefficients of ``a t^2 + 2 b t + c`` (see the module's docstring) for two discs."""
    p, q = scene.discs[i], scene.discs[j]
    d = subtract(to_exact(q.position_m), to_exact(p.position_m))
    u = subtract(to_exact(q.drive.velocity_at(0.0)), to_exact(p.drive.velocity_at(0.0)))
    return dot(u, u), dot(d, u), dot(d, d) - (Fraction(p.radius_m) + Fraction(q.radius_m)) ** 2


def _find_curvature_sign(scene: Scene, i: int, j: int, spread: Fraction) -> int:
    """Return the sign of the second derivative of two discs' squared distance at the start.

    If both discs fall or neither falls, the derivative is not negative, and 0 is returned. `spread` is the squared
    relative velocity of the discs.
    """
    fixed = [scene.discs[k].immovable for k in (i, j)]
    if fixed[0] == fixed[1] or scene.gravity_m_s2 == (0.0, 0.0):
        return 0
    p, q = scene.discs[i], scene.discs[j]
    along = dot(to_exact(scene.gravity_m_s2), subtract(to_exact(q.position_m), to_exact(p.position_m)))
    return _sign(spread + (along if fixed[0] else -along))


def _find_root_form(bodies: BallBodies, first: int, second: int) -> tuple[Fraction, Fraction, Fraction]:
    """Return P, Q and A (see the module's docstring) for a disc and another disc or a half-plane."""
    scene = bodies.scene
    if second >= 0:
        a, b, c = _build_pair_polynomial(scene, first, second)
        return -b, b * b - a * c, a
    disc, plane, wall = scene.discs[first], _plane_of(bodies, second), wall_index(bodies.trace_body(second))
    offset = dot(subtract(to_exact(disc.position_m), plane.point), plane.normal)
    rim2 = Fraction(disc.radius_m) ** 2 * dot(plane.normal, plane.normal)
    drive = to_exact(scene.arrays.drive_of_wall(wall).velocity_at(0.0))
    return offset, rim2, dot(subtract(drive, to_exact(disc.velocity_m_s)), plane.normal)


def _find_near_bodies(bodies: BallBodies) -> list[tuple[int, int]]:
    """Return all pairs whose gap at the start is at most a rounding error.

    The pairs are sorted by their first disc. For each disc, the pairs with discs come before those with half-planes.
    """
    start = bodies.scene.arrays
    numbers = [k for k, obstacle in enumerate(bodies.obstacles) if obstacle.kind is None]
    walls = np.array([start.walls[bodies.obstacles[k].wall] for k in numbers]).reshape(-1, 4)
    reach = start.radius_m + SLACK * (np.abs(start.position_m).max(axis=1) + start.radius_m)
    pairs = [
        pair for block in find_near_pairs(start.position_m, reach, start.movable) for pair in zip(*block, strict=True)
    ]
    reach += SLACK * np.abs(walls[:, :2]).max(initial=0.0)
    for block in find_near_walls(start.position_m, reach, start.movable, walls):
        pairs += [(disc, wall_body(numbers[wall])) for disc, wall in zip(*block, strict=True)]
    return sorted(((int(i), int(j)) for i, j in pairs), key=lambda pair: (pair[0], pair[1] < 0, abs(pair[1])))
