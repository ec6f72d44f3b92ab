"""Times of impact with faces, vertices and arcs against 80 digits and other formulas: which root, and how well."""

import math
import random
from collections import Counter
from collections.abc import Iterator
from dataclasses import dataclass
from fractions import Fraction
from functools import cached_property
from typing import Any

import pytest
from flint import acb, acb_poly, ctx, fmpq
from mpmath import atan2, mp, mpf, sqrt
from tests.cases import each, release_after
from tests.unit.core.feature_times import (
    build_arc,
    build_vertex,
    build_wall_features,
    compute_feature_fall_time,
    compute_feature_time,
)

from carom.core import primitives
from carom.core.input_rows import build_feature_row
from carom.core.wall_features import Arc, Face, Feature, Mover, Point
from carom.core.wall_parts import Pair
from carom.model.chain_geometry import Edge, ExactCircle, compute_circle

core = pytest.importorskip("tests.core_fall_functions")

DIGITS = 80
#: At this number of halvings of the largest length away from contact, pairs still give the last digit of a time.
NEAREST = 50
NEVER = math.inf


def to_exact(value: float | Fraction | Pair) -> Any:
    """Return a number, or the value of a pair, to 80 digits."""
    number = sum(map(Fraction, value)) if isinstance(value, tuple) else Fraction(value)
    return mpf(number.numerator) / mpf(number.denominator)


@dataclass
class Geometry:
    """A feature in rational numbers.

    A body at the distance `reach` from its line, within its ends, touches the feature.
    """

    name: str
    feature: Feature
    ends: tuple[Point, Point]
    thickness: Fraction
    bulge: float = 0.0

    def gap(self, x: Any, y: Any) -> Any:
        """Return the distance of a rim from a face's line; of a circle, the difference of the squared distances."""
        if isinstance(self.feature, Face):
            (ax, ay), (bx, by) = ((to_exact(x), to_exact(y)) for x, y in self.ends)
            nx, ny = ay - by, bx - ax
            return ((x - ax) * nx + (y - ay) * ny) / sqrt(nx * nx + ny * ny) - self.reach
        px, py = x - self.centre[0], y - self.centre[1]
        return (px * px + py * py - self.reach**2) * (-1 if self.inside else 1)

    @property
    def inside(self) -> bool:
        return isinstance(self.feature, Arc) and self.feature.inside

    @cached_property
    def reach(self) -> Any:
        if self.bulge == 0.0:
            return to_exact(self.thickness)
        circle = compute_circle(Edge(*self.ends, self.bulge))
        radius = sqrt(to_exact(circle.radius2))
        return radius - to_exact(self.thickness) if self.inside else radius + to_exact(self.thickness)

    @cached_property
    def centre(self) -> tuple[Any, Any]:
        if self.bulge == 0.0:
            return to_exact(self.ends[0][0]), to_exact(self.ends[0][1])
        circle = compute_circle(Edge(*self.ends, self.bulge))
        return to_exact(circle.x), to_exact(circle.y)

    def holds(self, x: Any, y: Any) -> bool:
        """Whether the foot of a place is between the ends: by projection, or by angles."""
        if self.name == "vertex":
            return True
        (ax, ay), (bx, by) = ((to_exact(x), to_exact(y)) for x, y in self.ends)
        if isinstance(self.feature, Face):
            ex, ey = bx - ax, by - ay
            return bool(0 <= ((x - ax) * ex + (y - ay) * ey) / (ex * ex + ey * ey) <= 1)
        cx, cy = self.centre
        first, last, here = atan2(ay - cy, ax - cx), atan2(by - cy, bx - cx), atan2(y - cy, x - cx)
        turn = 2 * mp.pi
        return bool((here - first) % turn <= (last - first) % turn)


def draw_geometries(rnd: random.Random, size: float, radius: float) -> Iterator[Geometry]:
    """Yield one feature of each kind, with the same ends."""
    ends = (rnd.gauss(0, size), rnd.gauss(0, size)), (rnd.gauss(0, size), rnd.gauss(0, size))
    half_width = rnd.choice((0.0, radius / 4, radius * rnd.random()))
    thickness = Fraction(radius) + Fraction(half_width)
    bulge = 10.0 ** rnd.uniform(-2, 1)
    circle = compute_circle(Edge(*ends, bulge))
    yield Geometry("face", Face.between(*ends, half_width), ends, thickness)
    yield Geometry("vertex", build_vertex(ends[0], half_width), ends, thickness)
    for name, inside in (("arc outside", False), ("arc inside", True)):
        yield Geometry(name, build_arc(circle, ends, half_width, inside=inside), ends, thickness, bulge)


def draw_movers(
    rnd: random.Random, geometry: Geometry, size: float, radius: float
) -> Iterator[tuple[Mover, tuple[Any, ...]]]:
    """Yield discs far away and almost in contact, half of them before a driven wall; and their exact numbers."""
    speed = 10.0 ** rnd.uniform(-3, 3)
    for _ in range(2):
        place = rnd.gauss(0, size), rnd.gauss(0, size)
        if rnd.random() < 0.5:
            place = _place_near_contact(
                rnd, geometry, find_largest_length(geometry, place) * 2.0 ** -rnd.uniform(0, NEAREST)
            )
        velocity = rnd.gauss(0, speed), rnd.gauss(0, speed)
        driven = (rnd.gauss(0, speed), rnd.gauss(0, speed)) if rnd.random() < 0.5 else (0.0, 0.0)
        disc = Mover.at(place, velocity, radius, driven)
        if driven != (0.0, 0.0):  # whose place is a pair
            x, y = ((value, value * 2.0**-54 * rnd.random()) for value in place)
            disc = disc._replace(x=x, y=y)
        yield disc, tuple(map(to_exact, disc[:4]))


def find_largest_length(geometry: Geometry, place: tuple[Any, Any]) -> float:
    """Return the largest length of a case: what pairs leave open of place, centre and radius is 2^-106 of it."""
    circle = (0,) if isinstance(geometry.feature, Face) else (*geometry.centre, geometry.reach)
    return float(max(map(abs, (*sum(geometry.ends, ()), *place, *circle))))


def _place_near_contact(rnd: random.Random, geometry: Geometry, away: float) -> Point:
    """Return a place this far from contact, as well as floats have it."""
    if isinstance(geometry.feature, Face):
        (ax, ay), (bx, by), (nx, ny), part = *geometry.ends, geometry.feature.normal, rnd.random()
        height = float(geometry.thickness) + away
        return ax + part * (bx - ax) + nx * height, ay + part * (by - ay) + ny * height
    turn, distance = rnd.uniform(0, 2 * math.pi), float(geometry.reach) + (-away if geometry.inside else away)
    cx, cy = map(float, geometry.centre)
    return cx + distance * math.cos(turn), cy + distance * math.sin(turn)


def compute_exact_time(geometry: Geometry, pull: Point, x: Any, y: Any, ux: Any, uy: Any) -> Any:
    """Return the exact time: the first root of the gap, found by ball arithmetic, at which it falls; None for never."""
    ax, ay = map(to_exact, pull)
    if isinstance(geometry.feature, Face):
        now = geometry.gap(x, y)
        powers = [now, geometry.gap(x + ux, y + uy) - now, (geometry.gap(x + ax, y + ay) - now) / 2]
    else:
        sign = -1 if geometry.inside else 1
        px, py = x - geometry.centre[0], y - geometry.centre[1]
        opening, bend = 2 * (px * ux + py * uy), ux * ux + uy * uy + px * ax + py * ay
        gap = [px * px + py * py - geometry.reach**2, opening, bend, ux * ax + uy * ay, (ax * ax + ay * ay) / 4]
        powers = [sign * power for power in gap]
    ctx.prec = 400
    roots = acb_poly([acb(fmpq(*_to_ratio(power))) for power in powers]).roots(tol=1e-70)
    for time in sorted(mpf(root.real.str(DIGITS, radius=False)) for root in roots if root.imag.contains(0)):
        falls = sum(k * power * time ** (k - 1) for k, power in enumerate(powers) if k) < 0
        if time > 0 and falls and geometry.holds(x + time * (ux + ax * time / 2), y + time * (uy + ay * time / 2)):
            return time
    return None


def _to_ratio(number: Any) -> tuple[int, int]:
    """Return a number of mpmath, a binary fraction, as numerator and denominator."""
    sign, mantissa, exponent, _ = number._mpf_
    mantissa = int(-mantissa if sign else mantissa)
    return (mantissa << exponent, 1) if exponent >= 0 else (mantissa, 1 << -exponent)


@each("falling, seed, count", release_after(2, [(False, 7, 60), (True, 11, 30), (False, 7, 1500), (True, 11, 800)]))
def test_feature_times_match_80_digit_arithmetic(falling: bool, seed: int, count: int) -> None:
    """Times of impact and of fall onto faces, vertices and arcs are within 1 ulp of 80 digits; no hit is wrong."""
    # Discs start far away or as near as 2^-50 of the largest length; walls are resting or driven.
    mp.dps, rnd = DIGITS, random.Random(seed)
    hits = Counter[str]()
    for _ in range(count):
        size = 10.0 ** rnd.uniform(-3, 3)
        radius = size * 10.0 ** rnd.uniform(-3, 0)
        pull = (rnd.gauss(0, 1) * size, -9.81 * size) if falling else (0.0, 0.0)
        for geometry in draw_geometries(rnd, size, radius):
            if geometry.reach <= 0:
                continue
            for disc, numbers in draw_movers(rnd, geometry, size, radius):
                # A gap of squares is a short distance times twice the reach.
                unit = 1 if isinstance(geometry.feature, Face) else 2 * geometry.reach
                if geometry.gap(*numbers[:2]) <= find_largest_length(geometry, numbers[:2]) * 2.0**-NEAREST * unit:
                    continue
                exact = compute_exact_time(geometry, pull, *numbers)
                if falling:
                    time = compute_feature_fall_time(disc, geometry.feature, pull)
                    # A feature that is met is not ruled out for the time up to then.
                    row = build_feature_row(geometry.feature, 0)
                    assert time == NEVER or not core.misses_feature(row, disc, pull, time * (1 + 2.0**-40))
                else:
                    time, _ = compute_feature_time(disc, geometry.feature)
                assert (time == NEVER) is (exact is None), geometry
                if exact is not None:
                    assert abs(to_exact(time) - exact) <= math.ulp(float(exact)), geometry
                    hits[geometry.name] += 1
    assert set(hits) == {"face", "vertex", "arc outside", "arc inside"}
    assert min(hits.values()) > 5


FLOOR = Face.between((0.0, 0.0), (2.0, 0.0), 0.25)
HALF = compute_circle(Edge((2.0, -1.0), (2.0, 1.0), 1.0))  # the right half of a circle of radius 1 about (2, 0)
CAP, RIM = (build_arc(HALF, ((2.0, -1.0), (2.0, 1.0)), inside=inside) for inside in (True, False))
RING = build_arc(ExactCircle(Fraction(0), Fraction(0), Fraction(9)), None, 0.5, inside=True)


@each(
    "feature, place, velocity, time",
    [
        (FLOOR, (1.0, 0.5), (3.0, -1.0), 0.0),  # touches and approaches
        (FLOOR, (1.0, 0.5), (3.0, 0.0), NEVER),  # slides along
        (FLOOR, (1.0, 0.25), (0.0, -1.0), 0.0),  # overlaps
        (FLOOR, (1.0, -3.0), (0.0, -1.0), NEVER),  # behind
        (FLOOR, (2.5, 0.25), (0.0, -1.0), NEVER),  # next to it: the disc meets the vertex
        (FLOOR, (2.0, 1.5), (0.0, -1.0), 1.0),  # onto its very end
        (FLOOR, (0.0, 1.5), (0.0, -1.0), 1.0),
        (FLOOR, (4.0, 1.5), (-2.0, -1.0), 1.0),  # the same, aslant
        (FLOOR, (4.125, 1.5), (-2.0, -1.0), NEVER),
        (build_vertex((0.0, 0.0), 0.25), (1.0, 0.0), (-1.0, 0.0), 0.5),
        (build_vertex((0.0, 0.0), 0.25), (1.0, 0.5), (-1.0, 0.0), NEVER),  # a graze of depth zero
        (RIM, (4.0, 0.0), (-1.0, 0.0), 0.75),
        (RIM, (0.0, 0.0), (1.0, 0.0), NEVER),  # through the open side, to the arc's inner side
        (RIM, (2.0, 2.25), (0.0, -1.0), 1.0),  # onto its very end
        (RIM, (1.875, 2.25), (0.0, -1.0), NEVER),
        (CAP, (0.0, 0.0), (1.0, 0.0), 2.75),
        (CAP, (4.0, 0.0), (-1.0, 0.0), NEVER),  # from behind; it would leave the circle where the arc is open
        (CAP, (2.75, 0.0), (1.0, 0.0), 0.0),  # touches and approaches
        (CAP, (2.75, 0.0), (-1.0, 0.0), NEVER),
        (RING, (0.0, 1.5), (0.0, -2.0), 1.875),
        (RING, (0.0, 0.0), (0.0, 0.0), NEVER),
    ],
)
def test_feature_time_of_representable_cases_is_exact(
    feature: Feature, place: Point, velocity: Point, time: float
) -> None:
    """Times onto faces, vertices and arcs are exact in cases whose numbers are exact in floats."""
    assert compute_feature_time(Mover.at(place, velocity, 0.25), feature) == (time, False)


@each(
    "place, velocity, time",
    [
        ((0.0, -0.75), (1.0, 0.0), 2.0),  # comes along the tangent at the arc's first point, as from a stadium's side
        ((2.0, -0.75), (1.0, 0.0), 0.0),
        ((2.0, -0.75), (-1.0, 0.0), NEVER),  # and off along that side
        ((2.0, 0.75), (-1.0, 0.0), NEVER),
        ((2.75, 0.0), (0.0, 1.0), 0.0),
        ((0.0, math.nextafter(-0.75, -1.0)), (1.0, 0.0), 2.0),  # an ulp out: its path stays out of the circle
        ((4.0, math.nextafter(0.75, 1.0)), (-1.0, 0.0), NEVER),  # from outside of the arc
        ((0.5, -3.0), (0.0, 1.0), NEVER),  # past it, along the direction in which it begins
        ((2.0, math.nextafter(-0.75, -1.0)), (1.0, 0.0), 0.0),
        ((math.nextafter(2.75, 3.0), 0.0), (-1e-9, 1.0), 0.0),  # comes away, by less than leads back into the circle
    ],
)
def test_tangential_contact_inside_an_arc_is_gliding(place: Point, velocity: Point, time: float) -> None:
    """A disc that reaches the inside of an arc along its tangent is reported to glide, at the exact time."""
    # Contact without approach is neither an impact nor an exit at the arc's end.
    assert compute_feature_time(Mover.at(place, velocity, 0.25), CAP) == (time, time < NEVER)


def test_just_left_feature_is_met_again_only_inside_an_arc() -> None:
    """A disc that just left the inside of an arc meets it again after a chord of 4.5 m; other features it does not."""
    disc = Mover.at((2.25 + 1e-15, 0.0), (-1.0, 0.0), 0.25)
    assert compute_feature_time(disc, RING, just_left=True) == (2 * (2.25 + 1e-15), False)
    assert compute_feature_time(disc._replace(ux=(0.0, 0.0), uy=(1.0, 0.0)), RING, just_left=True) == (0.0, True)
    for feature in (FLOOR, build_vertex((0.0, 0.0)), RIM):
        assert compute_feature_time(Mover.at((1.0, 0.5), (0.0, -1.0), 0.25), feature, just_left=True)[0] == NEVER


def test_disc_does_not_slip_through_a_smooth_joint() -> None:
    """A disc aimed at the smooth joint of an edge and an arc meets one of them after 1 s, within 1e-12 s."""
    rnd = random.Random(3)
    for _ in range(200):
        turn, joint = rnd.uniform(0, 2 * math.pi), (rnd.gauss(0, 1), rnd.gauss(0, 1))
        step = math.ldexp(round(math.cos(turn) * 2**20), -20), math.ldexp(round(math.sin(turn) * 2**20), -20)
        start = joint[0] - step[0], joint[1] - step[1]
        across = joint[0] - 2 * step[1], joint[1] + 2 * step[0]  # half a circle to the left: its tangent is the edge's
        wall = (
            Face.between(start, joint),
            build_arc(compute_circle(Edge(joint, across, 1.0)), (joint, across), inside=True),
        )
        before = rnd.uniform(0.1, 1.5), rnd.uniform(-0.5, 0.5)
        touch = joint[0] - 0.25 * step[1], joint[1] + 0.25 * step[0]
        place = (
            touch[0] + before[1] * step[0] - before[0] * step[1],
            touch[1] + before[1] * step[1] + before[0] * step[0],
        )
        velocity = touch[0] - place[0], touch[1] - place[1]
        disc = Mover.at(place, velocity, 0.25 * math.hypot(*step))
        assert min(compute_feature_time(disc, feature)[0] for feature in wall) == pytest.approx(1.0, abs=1e-12)


@each(
    "feature, place, velocity, leaving, time",
    [
        (FLOOR, (1.0, 4.5), (0.0, 0.0), None, 1.0),  # 4 m of free fall at 8 m/s^2
        (FLOOR, (3.0, 4.5), (0.0, 0.0), None, NEVER),  # next to it
        (FLOOR, (-1.0, 0.25), (1.0, 8.0), None, 1 + math.sqrt(15 / 16)),  # thrown up next to it: falls onto it
        (FLOOR, (-5.0, 0.25), (2.0, 8.0), None, NEVER),
        (FLOOR, (1.0, 0.5), (0.5, 0.0), None, 0.0),  # rests
        (FLOOR, (1.0, 0.5), (0.0, -1e-17), 4.0, 1.0),  # back after 2 v/g, whatever rounding has made of its velocity
        (FLOOR, (1.5, 0.5), (1.0, 4.0), 4.0, NEVER),  # bounces over the edge
        (build_vertex((0.0, 0.0), 0.25), (0.0, 4.5), (0.0, 0.0), None, 1.0),
        (build_vertex((0.0, 0.0), 0.25), (0.0, 0.5), (0.0, 4.0), 4.0, 1.0),
        (RING, (0.0, 1.75), (0.0, 0.0), None, 1.0),
        (RING, (0.0, -2.25), (0.0, 0.0), None, 0.0),  # rests in the bowl
        (RING, (0.0, -2.25), (0.0, 4.0), 4.0, 1.0),
        (CAP, (2.0, 2.0), (0.0, 0.0), None, math.sqrt(2.75 / 4)),  # through its circle onto its first point
        (CAP, (1.75, 2.0), (0.0, 0.0), None, NEVER),
        (CAP, (2.5, 0.0), (0.0, 0.0), None, math.sqrt(math.sqrt(5 / 16) / 4)),
        (CAP, (1.5, 0.0), (0.0, 0.0), None, NEVER),  # would leave the circle where the arc is open
        (RIM, (2.5, 4.0), (0.0, 0.0), None, math.sqrt((4 - math.sqrt(21 / 16)) / 4)),
        (RIM, (1.5, 4.0), (0.0, 0.0), None, NEVER),
    ],
)
def test_fall_time_onto_a_feature_matches_free_fall(
    feature: Feature, place: Point, velocity: Point, leaving: float | None, time: float
) -> None:
    """Falls at 8 m/s^2 onto faces, vertices and arcs take the time that v^2 = 2 g h gives, to 1e-15."""
    found = compute_feature_fall_time(Mover.at(place, velocity, 0.25), feature, (0.0, -8.0), leaving)
    assert found == pytest.approx(time, rel=1e-15)


def test_normal_points_from_the_wall_to_the_disc() -> None:
    """The normal of a face points to its left; that of an arc is the line through its centre to the disc."""
    disc = Mover.at((3.0, 4.0), (0.0, 0.0), 0.25)
    assert build_wall_features(FLOOR).normal(0, disc) == (0.0, 1.0)
    assert build_wall_features(build_vertex((0.0, 0.0))).normal(0, disc) == (0.6, 0.8)
    assert build_wall_features(RING).normal(0, disc) == (-0.6, -0.8)
    assert build_wall_features(RIM).normal(0, Mover.at((2.0, -3.0), (0.0, 0.0), 0.25)) == (0.0, -1.0)


def test_face_gap_has_its_exact_sign() -> None:
    """The gap to a 3:4:5 face is 0 for a touching disc, and has the right sign 1 ulp nearer or farther."""
    face = Face.between((0.0, 0.0), (8.0, 6.0))
    for y, sign in ((5.0, 0), (math.nextafter(5.0, 6.0), 1), (math.nextafter(5.0, 4.0), -1)):
        disc = Mover.at((0.0, y), (0.0, -1.0), 4.0)
        gap = build_wall_features(face).gap(0, disc)
        assert (gap > 0) - (gap < 0) == sign
        assert compute_feature_time(disc, face) == (0.0 if sign <= 0 else 2.0**-50, False)


def test_first_listed_feature_wins_at_one_instant() -> None:
    """If a disc meets several features at the same instant, the one that is listed first is returned."""
    disc, vertex = Mover.at((2.0, 1.5), (0.0, -1.0), 0.25), build_vertex((2.0, 0.0), 0.25)
    for order, first in (((FLOOR, vertex), 0), ((vertex, FLOOR), 0), ((RING, vertex, FLOOR), 1)):
        wall = primitives.WallFeatures([build_feature_row(feature, 0) for feature in order])
        assert wall.first_touch(disc, -1) == (1.0, first, False)
        assert wall.first_fall(disc, 0.0, 0.0, -1, 0.0) == (1.0, first)
