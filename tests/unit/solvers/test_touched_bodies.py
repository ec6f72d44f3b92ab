"""An impact with restitution 0 leaves contact, and no later impact that is only rounding."""

import cmath
import math
import random
from collections.abc import Callable
from functools import partial
from typing import Any

import numpy as np
import pytest
from tests.cases import each, release_after
from tests.scene_builders import disc_at, staged, wall_at

import carom
from carom import Chain, Disc, Ring, Scene, Wall
from carom.model.trace import Outcome
from carom.model.walls import Leg

#: Directions of the first wall's normal, in radians: along an axis, and not.
ANGLES = (0.0, 0.3, 1.0, math.pi / 3, 2.5)


def build_wall(kind: str, at: complex, normal: complex, drive: complex = 0.0, **more: Any) -> Wall | Chain:
    """Return a half-plane, or a long straight edge, through a point."""
    velocity = (drive.real, drive.imag)
    if kind == "half-plane":
        return Wall(point_m=(at.real, at.imag), normal=(normal.real, normal.imag), velocity_m_s=velocity, **more)
    ends = [at + side * 40j * normal for side in (1, -1)]
    return Chain(points_m=[(end.real, end.imag) for end in ends], velocity_m_s=velocity, **more)


@each("kind", ["half-plane", "edge"])
@each("angle", ANGLES)
@each("drive", [0.0, 0.125, 0.3, -0.1])
def test_disc_moving_with_a_wall_does_not_hit_it_again(kind: str, angle: float, drive: float) -> None:
    """A disc that moves with a driven wall (e = 0) and bounces off a perpendicular wall has only two impacts."""
    normal = complex(math.cos(angle), math.sin(angle))
    across = complex(-normal.imag, normal.real)
    velocity = -2.0 * normal + 0.7 * across
    place = 3.0 * normal
    scene = staged(
        "pushed",
        disc_at(place.real, place.imag, velocity.real, velocity.imag),
        build_wall(kind, 0.0, normal, drive * normal, restitution=0.0),
        build_wall(kind, 4.0 * across, -across, restitution=1.0),
        duration_s=12.0,
    )
    trace = carom.solve_pic(scene)
    assert trace.impacts["second"].tolist() == [-1, -2]


@each("kind", ["half-plane", "edge"])
@each("angle", ANGLES)
@each("radii, floor_impacts", [((0.5, 0.5), 2), ((0.5, 0.6), 3)])
def test_equal_discs_that_collide_along_a_floor_do_not_hit_the_floor_again(
    kind: str, angle: float, radii: tuple[float, float], floor_impacts: int
) -> None:
    r"""Equal discs that land on a floor with e = 0 hit it once each, however often they collide along it.

    The larger of two unequal discs rises and pushes the smaller one into the floor: a third floor impact.
    """
    normal = complex(math.cos(angle), math.sin(angle))
    along = complex(-normal.imag, normal.real)
    origin = 137.31 * along + 61.77 * normal
    discs = []
    for radius, height, place, speed in zip(radii, (0.7, 1.1), (-3.1, 3.3), (1.3, -0.9), strict=True):
        centre, velocity = origin + (radius + height) * normal + place * along, -1.7 * normal + speed * along
        discs.append(disc_at(centre.real, centre.imag, velocity.real, velocity.imag, r=radius, m=1.0 + height))
    sides = [
        build_wall("half-plane", origin + side * 5.0 * along, -side * along, restitution=1.0)
        for side in (1, -1)
        if radii[0] == radii[1]
    ]
    scene = staged(
        "along a floor",
        *discs,
        build_wall(kind, origin, normal, restitution=0.0),
        *sides,
        duration_s=60.0 if sides else 4.0,
    )
    trace = carom.solve_pic(scene)
    assert trace.impacts["second"].tolist().count(-1) == floor_impacts
    assert trace.impacts["second"].tolist().count(1) >= (8 if sides else 1)
    if sides:
        heights = [(complex(*centre) - origin) / normal for centre in trace.final_position_m.tolist()]
        assert [height.real for height in heights] == pytest.approx(radii, abs=1e-11)


CEILING = staged(
    "ceiling",
    disc_at(0.0, -1.0, 0.5, 2.0),
    disc_at(2.0, -1.5, -0.7, 2.0),
    wall_at(0.0, 0.0, 0.0, -1.0),
    wall_restitution=0.0,
    gravity_m_s2=(0.0, -1.0),
    duration_s=1.5,
)
LEDGE = staged(
    "ledge",
    *[disc_at(0.3125, y, -1.0, r=0.25, spin_rad_s=spin) for y, spin in ((0.25, -70.0), (1.25, -50.0))],
    wall_at(0.0, 0.0, 0.0, 1.0),
    wall_at(0.0, 0.0, 1.0, 0.0, restitution=0.0, friction=0.0),
    Chain(points_m=[(-1.0, 1.0), (0.8125, 1.0)]),
    wall_restitution=0.5,
    wall_friction=0.5,
    gravity_m_s2=(0.0, -9.75),
    duration_s=2.0,
)


@each("scene, axis", [(CEILING, 1), (LEDGE, 0)])
def test_discs_that_have_left_a_wall_exchange_momentum_along_their_normal(scene: Scene, axis: int) -> None:
    """Gravity or friction moves two discs off a wall that they have touched, so their impact is oblique to it."""
    impacts = carom.solve_pic(scene).impacts
    row = impacts[impacts["second"] == 1][0]
    normal = row["normal"]
    assert abs(float(normal[axis])) > 0.1
    before, after = (row[f"velocity_first_{when}"] - row[f"velocity_second_{when}"] for when in ("before", "after"))
    assert after @ normal == pytest.approx(-before @ normal, rel=1e-12)
    change = row["velocity_first_after"] - row["velocity_first_before"]
    assert change / np.hypot(*change) == pytest.approx(-normal, abs=1e-14)


@each("driven", [False, True])
def test_discs_that_part_along_a_tangent_do_not_collide_again(driven: bool) -> None:
    """After an impact with restitution 0, two discs have no other impact than one on a side wall."""
    pusher = {"mass_kg": math.inf, "driven": True} if driven else {"mass_kg": 1.0}
    scene = staged(
        "tangent",
        Disc(position_m=(0.0, 0.0), velocity_m_s=(0.0, 0.3), radius_m=0.5, **pusher),
        disc_at(-0.7, 3.0, 0.35, -0.9),
        wall_at(2.0, 0.0, -1.0, 0.0),
        wall_at(-2.0, 0.0, 1.0, 0.0),
        restitution=0.0,
        wall_restitution=1.0,
        duration_s=14.0,
    )
    impacts = carom.solve_pic(scene).impacts
    assert impacts[["first", "second"]].tolist() == [(0, 1), (1, -1)]
    assert abs(float(impacts["normal"][0][0])) <= 0.2


@each("solve", [carom.solve_pic, partial(carom.solve_pit, frame_rate_hz=240.0)])
def test_impact_without_tangential_impulse_keeps_wall_contact(
    solve: Callable[[Scene], carom.Trace],
) -> None:
    r"""A wall with tangential restitution -1 does not end a disc's contact with a perpendicular driven wall.

    PIC and PIT report one impact with each wall.
    """
    scene = staged(
        "rounding",
        disc_at(-5.0, 0.0, 34.84694149, 27.94789776, spin_rad_s=3.0),
        wall_at(-3.3, 0.0, -1.0, 0.0, velocity_m_s=(0.6498171847389411, 0.7), restitution=0.0),
        wall_at(0.0, 2.4, 0.0, -1.0, surface_speed_m_s=31.7, restitution=1.0),
        wall_friction=0.05,
        wall_tangential_restitution=-1.0,
        duration_s=1.0,
    )
    assert solve(scene).impacts["second"].tolist() == [-1, -2]


@each("kind", ["half-plane", "edge"])
@each("angle", ANGLES)
@each("solve", [carom.solve_pic, partial(carom.solve_pit, frame_rate_hz=240.0)])
def test_wall_moving_along_itself_does_not_hit_a_touching_disc(
    kind: str, angle: float, solve: Callable[[Scene], carom.Trace]
) -> None:
    """A wall hits the disc that touches it only when it moves towards the disc at 4 s, not along itself before."""
    normal = complex(math.cos(angle), math.sin(angle))
    along = complex(-normal.imag, normal.real)
    drives = {0.0: 0.3 * along, 2.0: -0.7 * along, 3.0: 0.2 * along, 4.0: 0.25 * normal}
    legs = tuple(Leg(from_s=at, velocity_m_s=(drive.real, drive.imag)) for at, drive in drives.items())
    place, velocity = 1.5 * normal, -1.9 * normal + 0.7 * along
    scene = staged(
        "sliding wall",
        disc_at(place.real, place.imag, velocity.real, velocity.imag),
        build_wall(kind, 0.0, normal, legs=legs),
        wall_restitution=0.0,
        duration_s=6.0,
    )
    assert solve(scene).impacts["time_s"].tolist() == pytest.approx([1.0 / 1.9, 4.0], abs=1 / 240)


def build_struck_body(
    kind: str, radius: float, at: complex, place: complex, velocity: complex, drives: dict[float, complex], end_s: float
) -> Scene:
    """Return a disc of radius 0.5 that flies from `place` towards a round driven body at `at`; restitution 0."""
    legs = tuple(Leg(from_s=from_s, velocity_m_s=(drive.real, drive.imag)) for from_s, drive in drives.items())
    centre = (at.real, at.imag)
    disc = Disc(position_m=(place.real, place.imag), velocity_m_s=(velocity.real, velocity.imag), radius_m=0.5)
    driven = Disc(position_m=centre, radius_m=radius or 1.0, mass_kg=math.inf, driven=True, legs=legs)
    return staged(
        "struck",
        *([driven, disc] if kind == "disc" else [disc]),
        *([] if kind == "disc" else [Ring(centre_m=centre, radius_m=radius, legs=legs)]),
        restitution=0.0,
        wall_restitution=0.0,
        duration_s=end_s,
    )


@each("kind", ["disc", "circle"])
@each("angle", ANGLES)
@each("at", [0j, 1.5 + 0.3j, 20.0 + 10.0j, -20.0 - 10.0j])
def test_round_body_that_slides_past_a_touching_disc_hits_it_only_on_its_return(
    kind: str, angle: float, at: complex
) -> None:
    """PIC reports an impact at 1 s and one at 3.4 s, when the body returns, and none when it begins to slide."""
    # The body slides for a second. When it comes back, the distance is 1 m again after 0.4 s:
    # (1 - t/2)^2 + (1 - t)^2 = 1.
    turned = cmath.rect(1.0, angle)
    drives = {0.0: 0j, 2.0: 1j * turned, 3.0: (0.5 - 1j) * turned}
    scene = build_struck_body(kind, 0.5, at, at + 2.0 * turned, -turned, drives, 3.5)
    assert carom.solve_pic(scene).impacts["time_s"].tolist() == pytest.approx([1.0, 3.4], rel=1e-13)


@each("kind", ["disc", "circle", "point"])
@each("seeds", release_after(1, [range(20), range(20, 100)]))
@each("solve, late_s", [(carom.solve_pic, 1e-12), (partial(carom.solve_pit, frame_rate_hz=240.0), 1 / 240)])
def test_legs_along_the_contact_cause_no_impact(
    kind: str, seeds: range, solve: Callable[[Scene], carom.Trace], late_s: float
) -> None:
    """A round body that keeps its speed along the normal after an impact does not hit the disc again.

    On its legs the body moves with the disc, or along the tangent in one direction.
    """
    for seed in seeds:
        rng = random.Random(seed)
        normal = cmath.exp(1j * rng.uniform(-4.0, 4.0))
        radius = 0.0 if kind == "point" else rng.uniform(0.1, 2.0)
        at = complex(rng.uniform(-50.0, 50.0), rng.uniform(-50.0, 50.0))
        before = complex(rng.uniform(-1.0, 1.0), rng.uniform(-1.0, 1.0))
        place, side = at + (radius + 1.5) * normal, rng.choice([-1j, 1j])
        slips = {at_s: rng.choice([0.0, rng.uniform(0.0, 1.0)]) for at_s in (0.75, 1.0, 1.5, 2.25)}
        drives = {0.0: before} | {at_s: before + slip * side * normal for at_s, slip in slips.items()}
        scene = build_struck_body(kind, radius, at, place, before - 2.0 * normal, drives, 3.0)
        assert solve(scene).impacts["time_s"].tolist() == pytest.approx([0.5], abs=late_s), seed


@each("kind", ["disc", "circle"])
@each("approach_m_s, slides_s", [(1e-15, 4.0), (1e-15, 1024.0), (1e-9, 1.0)])
def test_round_body_that_returns_slightly_nearer_hits_the_disc(kind: str, approach_m_s: float, slides_s: float) -> None:
    r"""A body slides for T along the tangent, returns with a speed w along the normal, and hits the disc before T.

    The centres are 1 m apart at the contact. After the time t of the return they are at (w t, T - t) from there, so
    the impact is at a distance y along the tangent with y^2 = 2 w (T - y), except for w^2 T^2.
    """
    end_s = 2.0 + 2.0 * slides_s
    drives = {0.0: 0j, 2.0: 1j, 2.0 + slides_s: approach_m_s - 1j}
    scene = build_struck_body(kind, 0.5, 0j, 2.0 + 0j, -1.0 + 0j, drives, end_s + 1.0)
    distance_m = -approach_m_s + math.sqrt(approach_m_s**2 + 2.0 * approach_m_s * slides_s)
    times = carom.solve_pic(scene).impacts["time_s"]
    assert times.tolist() == pytest.approx([1.0, end_s - distance_m], abs=1e-3 * distance_m)


@each("kind", ["disc", "circle"])
def test_disc_that_a_wall_sends_back_hits_the_body_that_it_has_left(kind: str) -> None:
    """A disc slides along a round body, returns from a wall, and hits the body, which has moved on by d = 1.5e-12 m.

    The centres are 1 m apart at the contact. On the way back this is so at a distance y along the tangent with
    y^2 = 2 d, except for d^2.
    """
    legs = (Leg(from_s=0.0, velocity_m_s=(0.0, 0.0)), Leg(from_s=513.0, velocity_m_s=(1e-15, 0.0)))
    driven = Disc(position_m=(0.0, 0.0), radius_m=0.5, mass_kg=math.inf, driven=True, legs=legs)
    disc = Disc(position_m=(2.0, -1.0), velocity_m_s=(-1.0, 1.0), radius_m=0.5)
    ceiling = Chain(points_m=[(-50.0, 1024.5), (50.0, 1024.5)], restitution=1.0)
    scene = staged(
        "sent back",
        *([disc] if kind == "circle" else [disc, driven]),
        ceiling,
        *([Ring(centre_m=(0.0, 0.0), radius_m=0.5, legs=legs)] if kind == "circle" else []),
        restitution=0.0,
        wall_restitution=0.0,
        duration_s=3000.0,
    )
    distance_m = math.sqrt(2.0 * 1e-15 * (2049.0 - 513.0))
    times = carom.solve_pic(scene).impacts["time_s"]
    assert times.tolist() == pytest.approx([1.0, 1025.0, 2049.0 - distance_m], abs=1e-3 * distance_m)


@each("kind", ["disc", "circle"])
def test_round_body_that_returns_slowly_hits_a_disc_that_came_fast(kind: str) -> None:
    """A disc comes at 1024 m/s. The body slides by 64 m in 64 s, returns in 65536 s at w = 2e-9 m/s, and hits it.

    The impact is at a distance y along the tangent with y^2 = 2 w 65536, far from the origin.
    """
    at, back_m_s, approach_m_s = 2.0**30, 2.0**-10, 2e-9
    drives = {0.0: 0j, 2.0: 1j, 66.0: approach_m_s - 1j * back_m_s}
    scene = build_struck_body(kind, 0.5, at + 0j, at + 1025.0 + 0j, -1024.0 + 0j, drives, 70000.0)
    distance_m = math.sqrt(2.0 * approach_m_s * 65536.0)
    times = carom.solve_pic(scene).impacts["time_s"]
    assert times.tolist() == pytest.approx([1.0, 66.0 + (64.0 - distance_m) / back_m_s], abs=0.1)


@each("at_m", [2.0**10, 2.0**20])
@each("gain_m_s", [1e-6, 1e-4])
def test_driven_disc_that_speeds_up_hits_the_disc_before_it_again(at_m: float, gain_m_s: float) -> None:
    """A driven disc pushes another disc at 1 m/s, and hits it again when the driven disc becomes a little faster.

    Far from the origin, floats resolve the direction between two discs of a micrometre only roughly.
    """
    radius = 2.0**-20
    legs = (Leg(from_s=0.0, velocity_m_s=(1.0, 0.0)), Leg(from_s=1.0, velocity_m_s=(1.0 + gain_m_s, 0.0)))
    driven = Disc(position_m=(at_m, 0.0), radius_m=radius, mass_kg=math.inf, driven=True, legs=legs)
    disc = Disc(position_m=(at_m + 0.5, 0.0), radius_m=radius)
    times = carom.solve_pic(Scene(name="push", discs=[driven, disc], restitution=0.0, duration_s=9.0)).impacts["time_s"]
    assert times.tolist() == [0.5 - 2.0 * radius, 1.0]


@each("speed_m_s", [2e-7, 5e-7])
def test_driven_disc_that_slides_and_then_approaches_hits_the_disc_again(speed_m_s: float) -> None:
    """A disc hits a driven one that slides past for a nanosecond more, approaches slowly, and hits it again.

    It slides by s, so the gap is s^2 / 4 R. The slip must not hide the approach, which is millions of times slower.
    """
    radius, slide_s = 2.0**-20, 2.0**-30
    legs = (Leg(from_s=0.0, velocity_m_s=(0.0, 1.0)), Leg(from_s=0.5 + slide_s, velocity_m_s=(-speed_m_s, 0.0)))
    driven = Disc(position_m=(1024.0, 0.0), radius_m=radius, mass_kg=math.inf, driven=True, legs=legs)
    disc = Disc(position_m=(1023.5 - 2.0 * radius, 0.5), velocity_m_s=(1.0, 0.0), radius_m=radius)
    times = carom.solve_pic(Scene(name="slow", discs=[driven, disc], restitution=0.0, duration_s=9.0)).impacts["time_s"]
    expected_s = 0.5 + slide_s + slide_s**2 / (4.0 * radius) / speed_m_s
    assert times.tolist() == pytest.approx([0.5, expected_s], abs=5.0 * math.ulp(1024.0) / speed_m_s)


@each("opening", [0.5 * math.pi - 0.02, 1.6, 1.75, 1.9, 2.2])
def test_frictionless_corner_ends_at_the_sum_of_its_slides(opening: float) -> None:
    r"""A frictionless disc in an inelastic corner ends with CORNER after the total time of its slides, to 1e-12.

    It slides up one wall and the other in turn, at speeds w, c w, c^2 w, ... It returns from each within 2 w / a,
    where a is gravity along the wall. With -c the cosine of the angle between the walls this takes 2 w (1/a + c/b)
    / (1 - c^2). If the angle is acute, the rest of the first descent leads into the corner, and nothing rises
    again.
    """
    c = max(-math.cos(opening), 0.0)
    left, right = 0.9, 0.9 + opening  # directions of the walls, from the corner upwards
    gravity, radius = 9.81, 0.25
    middle = 0.5 * (left + right)
    one, other = (complex(math.cos(angle), math.sin(angle)) for angle in (left, right))
    # The disc touches both walls at the start, and is sent up the first of them.
    corner = radius / math.sin(0.5 * opening) * complex(math.cos(middle), math.sin(middle))
    speed = 0.5
    ends = [40.0 * one, 0j, 40.0 * other]
    scene = staged(
        "wedge",
        disc_at(corner.real, corner.imag, speed * one.real, speed * one.imag, r=radius),
        Chain(points_m=[(end.real, end.imag) for end in ends]),
        wall_restitution=0.0,
        gravity_m_s2=(0.0, -gravity),
        duration_s=10.0,
    )
    trace = carom.solve_pic(scene)
    along = [abs(gravity * direction.imag) for direction in (one, other)]
    expected_s = 2.0 * speed * (1.0 / along[0] + c / along[1]) / (1.0 - c * c)
    assert trace.outcome is Outcome.CORNER
    assert trace.end_time_s == pytest.approx(expected_s, rel=1e-12)
    assert trace.notes[0].startswith("disc 0 is wedged between edges 0 and 1 of wall 0")


@each("tilt", [0.0, 0.3, 0.7])
def test_right_angled_corner_ends_at_the_sum_of_its_hops(tilt: float) -> None:
    r"""A disc that rolls into a rough, right-angled corner ends with CORNER after the time of all hops, to 1e-12.

    Friction lifts the disc off each wall in turn. A disc that rolls into a wall at speed w rolls along this wall at
    w/3, with 2/3 of gravity's part g along it. So it is back after w/g, at the speed w/3. The parts are 4 and 8
    m/s^2 in turn, so all hops take 9/8 w (1/8 + 1/12) seconds.
    """
    one = complex(math.cos(tilt), math.sin(tilt))
    place, gravity = (0.5 + 0.25j) * one, -(4.0 + 8.0j) * one
    scene = staged(
        "rolling corner",
        disc_at(place.real, place.imag, r=0.25),
        *[wall_at(0.0, 0.0, normal.real, normal.imag) for normal in (one, 1j * one)],
        wall_restitution=0.0,
        wall_friction=1.0,
        gravity_m_s2=(gravity.real, gravity.imag),
        duration_s=4.0,
    )
    arrives_s = math.sqrt(2.0 * 0.25 / (4.0 * 2.0 / 3.0))
    speed = arrives_s * 4.0 * 2.0 / 3.0
    trace = carom.solve_pic(scene)
    assert trace.outcome is Outcome.CORNER
    assert trace.end_time_s == pytest.approx(arrives_s + 9.0 / 8.0 * speed * (1.0 / 8.0 + 1.0 / 12.0), rel=1e-12)


def build_corner(
    kind: str, restitution: float, opening: float, *, at: complex, speed: float, friction: float = 0.0
) -> Scene:
    """Return a disc that touches a slope at 0.3 rad with restitution 0, and a second body, and goes up the slope.

    Args:
        kind: The second body: half-plane, edge, circle, point or disc.
        restitution: Of an impact on it.
        opening: The angle between the slope and the second body's tangent, in radians.
        at: Where the two tangents meet.
        speed: Of the disc.
        friction: Of the slope. It does not turn the disc, whose moment of inertia is infinite.
    """
    slope, gravity, radius = 0.3, 9.81, 0.25
    up, other = (complex(math.cos(angle), math.sin(angle)) for angle in (slope, slope + opening))
    middle = complex(math.cos(slope + 0.5 * opening), math.sin(slope + 0.5 * opening))
    place = at + radius / math.sin(0.5 * opening) * middle
    ground = Wall(point_m=(at.real, at.imag), normal=(-up.imag, up.real), restitution=0.0, friction=friction)
    walls: list[Wall | Chain | Ring] = [ground]
    fixed = []
    size = 0.0 if kind == "point" else 2.0
    centre = place + (radius + size) * 1j * other
    if kind == "half-plane":
        walls.append(Wall(point_m=(at.real, at.imag), normal=(other.imag, -other.real), restitution=restitution))
    elif kind == "edge":
        ends = (at - 20.0 * other, at + 20.0 * other)
        walls.append(Chain(points_m=[(end.real, end.imag) for end in ends], restitution=restitution))
    elif kind == "disc":
        fixed.append(Disc(position_m=(centre.real, centre.imag), radius_m=size, mass_kg=math.inf))
    else:
        walls.append(Ring(centre_m=(centre.real, centre.imag), radius_m=size, restitution=restitution))
    disc = disc_at(
        place.real, place.imag, speed * up.real, speed * up.imag, r=radius, inertia_factor=math.inf if friction else 0.5
    )
    return staged(
        "corner", disc, *fixed, *walls, restitution=restitution, gravity_m_s2=(0.0, -gravity), duration_s=10.0
    )


@each("kind, other", [("half-plane", "wall 1"), ("edge", "edge 0 of wall 1"), ("disc", "disc 1")])
def test_note_of_a_corner_names_both_bodies(kind: str, other: str) -> None:
    """The note of a run that ends in a corner names the slope and the second body."""
    trace = carom.solve_pic(build_corner(kind, 0.3, 1.7, at=0j, speed=0.5))
    assert trace.notes == (f"disc 0 is wedged between wall 0 and {other}, after infinitely many impacts",)


@each("kind", ["half-plane", "edge", "circle", "point", "disc"])
@each("restitution", [0.3, 0.6])
@each("at", [0j, 200.0 - 700.0j])
def test_corner_that_lifts_a_disc_ends_at_the_sum_of_its_bounces(kind: str, restitution: float, at: complex) -> None:
    r"""A disc that slides down a slope and is thrown back again and again ends with CORNER at the total time.

    Where it touches both bodies, their normals have the sine s of the angle between the walls as component of one
    along the other. The disc arrives at speed w and leaves at b w along the slope, with b = (1 + e) s^2 - 1, and
    rises a little. In flight and on the slope gravity has the same part a along the slope. So the disc is back
    after 2 b w / a, at the speed b w. The start is like the end of an impact at w / b: all of it takes 2 w / (a (1
    - b)).
    """
    opening, speed = 1.7, 0.5
    trace = carom.solve_pic(build_corner(kind, restitution, opening, at=at, speed=speed))
    back = (1.0 + restitution) * math.sin(opening) ** 2 - 1.0
    assert trace.outcome is Outcome.CORNER
    expected_s = 2.0 * speed / (9.81 * math.sin(0.3) * (1.0 - back))
    # The rounding of the first position counts; roundings of later gaps would be a thousand times as much.
    assert trace.end_time_s == pytest.approx(expected_s, rel=1e-14, abs=8.0 * math.ulp(abs(at)) / speed)


@each("kind", ["half-plane", "edge", "circle", "point", "disc"])
@each("restitution", [0.3, 0.6])
@each("at", [0j, 200.0 - 700.0j])
def test_right_angled_corner_ends_at_the_sum_of_its_slides(kind: str, restitution: float, at: complex) -> None:
    r"""A disc that slides up a slope, back, and bounces at a right angle ends with CORNER at the total time.

    Gravity along the slope is g, friction f: it rises for v / (g + f) and comes back after s v / (g - f), at speed
    s v, where s^2 = (g - f) / (g + f). It leaves again at e s v. All slides are 1 / (1 - e s) times as long.
    """
    speed, friction = 0.5, 0.1
    trace = carom.solve_pic(build_corner(kind, restitution, 0.5 * math.pi, at=at, speed=speed, friction=friction))
    along, rubs = 9.81 * math.sin(0.3), friction * 9.81 * math.cos(0.3)
    slows = math.sqrt((along - rubs) / (along + rubs))
    expected_s = speed * (1.0 / (along + rubs) + slows / (along - rubs)) / (1.0 - restitution * slows)
    assert trace.outcome is Outcome.CORNER
    assert trace.end_time_s == pytest.approx(expected_s, rel=1e-14, abs=8.0 * math.ulp(abs(at)) / speed)


#: Hops after the end of the slip have another acceleration, and end shorter than the clock resolves.
TWO_GROUNDS = staged(
    "two grounds",
    disc_at(
        1.4058744332066526,
        -1.3500096894196019,
        0.7454916716659294,
        4.866294030352831,
        r=0.2641865576788216,
        spin_rad_s=47.670056812145084,
        inertia_factor=0.001,
    ),
    wall_at(3.0, 0.0, -1.0, 0.0, friction=0.3),
    wall_at(0.0, 3.0, 0.0, -1.0, friction=0.5),
    wall_restitution=0.0,
    wall_tangential_restitution=1.0,
    gravity_m_s2=(22.023568656479455, 40.09935269917041),
    duration_s=3.0,
)
#: Hops end closer to the second wall than coordinates resolve.
LANDING = staged(
    "landing in a corner",
    disc_at(
        -4.930177343985503,
        -17.6400797035545,
        -0.03949651575857991,
        6.820884779775449,
        r=1.8525386436867646,
        spin_rad_s=-2.398145693466247,
        inertia_factor=0.4,
    ),
    wall_at(0.0, -27.788079655301466, 0.0, 1.0, friction=1.0),
    wall_at(-9.86596178204611, -25.97768598325464, 0.3550429502300589, 0.9348499898336288, friction=0.5),
    wall_at(
        28.453433926299542,
        -17.138977516061246,
        -0.8566028654191159,
        0.5159762891410419,
        restitution=0.5,
        friction=0.5,
    ),
    wall_restitution=0.0,
    gravity_m_s2=(0.0, -171.12076363368686),
    duration_s=3.0,
)


@each("scene, resolved", [(TWO_GROUNDS, 10), (LANDING, 38)])
def test_hops_in_a_rough_corner_match_the_certified_ones(scene: Scene, resolved: int) -> None:
    """A run has the certified impacts up to its end with CORNER, to four units in the last place."""
    # The clock resolves at least `resolved` impacts. Later ones, at the time of the end, are not compared.
    trace = carom.solve_pic(scene)
    certified = carom.certify(scene, max_impacts=len(trace.impacts)).trace
    assert trace.outcome is Outcome.CORNER
    rounding_s = 4.0 * math.ulp(trace.end_time_s)
    count = int(np.sum(trace.impacts["time_s"] < trace.end_time_s - rounding_s))
    assert count >= resolved
    assert trace.impacts["second"][:count].tolist() == certified.impacts["second"][:count].tolist()
    late_s = trace.impacts["time_s"][:count] - certified.impacts["time_s"][:count]
    assert np.abs(late_s).max() <= rounding_s
    assert abs(certified.end_time_s - trace.end_time_s) <= rounding_s


@each("mass_kg", [1e4, 1e6, 1e8])
@each("gap_m", [1e-4, 1e-9])
def test_blocks_that_compress_the_last_gap_have_all_their_impacts(mass_kg: float, gap_m: float) -> None:
    """Galperin: a light disc between a wall and a heavy disc has floor(pi sqrt(M / m)) impacts.

    The smallest gap is 1e-13 m and the shortest time between impacts is far below the resolution of the clock.
    Source: G. Galperin, Regular and Chaotic Dynamics 8 (2003) 375.
    """
    scene = staged(
        "blocks",
        disc_at(0.1 + gap_m, 0.0, r=0.1),
        disc_at(1.3 + gap_m, 0.0, -1.0, r=0.1, m=mass_kg),
        wall_at(0.0, 0.0, 1.0, 0.0),
        duration_s=3.0,
    )
    trace = carom.solve_pic(scene)
    assert trace.outcome is Outcome.COMPLETED
    assert len(trace.impacts) == math.floor(math.pi * math.sqrt(mass_kg))
