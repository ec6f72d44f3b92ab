"""PIC and PIT of finite walls: order, edges, corners, gliding, and pieces that change no bit."""

import math
import random
from collections.abc import Callable
from typing import Any

import numpy as np
import pytest
from tests.cases import each, release_after
from tests.scene_builders import disc_at, require_value, staged, wall_at
from tests.unit.solvers.run_kinds import all_pairs

from carom import Chain, Disc, Outcome, Ring, Scene, solve_pic, solve_pic_framewise, solve_pit
from carom.errors import CaromError
from carom.model.chain_geometry import Outline
from carom.model.trace import EdgeKind, Trace

FACE, VERTEX, ARC = (kind.value for kind in EdgeKind)
STADIUM = Chain(points_m=[(-2, -2), (2, -2), (2, 2), (-2, 2)], bulges=[0, 1, 0, 1], closed=True)
CUP = Chain(points_m=[(-1, 0), (1, 0)], bulges=[1])
CHANNEL = Chain(points_m=[(-1, 2), *CUP.points_m, (1, 2)], bulges=[0, 1, 0])


def build_scene(*bodies: Any, **fields: Any) -> Scene:
    """Return a scene of ten seconds of discs and walls in any order."""
    return staged("table", *bodies, **{"duration_s": 10.0, **fields})


def list_edges(trace: Trace) -> list[tuple[int, int]]:
    """Return the edges of a trace."""
    return [tuple(edge) for edge in require_value(trace.edges).tolist()]


def test_disc_that_hops_beyond_an_edge_does_not_hit_it_again() -> None:
    """A disc that hops off an edge and past its end misses that edge and hits the next one, if there is one."""
    hop = {"gravity_m_s2": (0.0, -0.25), "duration_s": 2.5}
    for speed, bodies in ((0.25, 0), (0.1, 1)):  # it would come back to the edge's line after two seconds
        trace = solve_pic(build_scene(disc_at(1.75, 2.5, speed, 0.25, r=0.5), Chain(points_m=[(-2, 2), (2, 2)]), **hop))
        assert trace.impacts["time_s"].tolist() == [2.0] * bodies
    ramp = Chain(points_m=[(-2, 2), (2, 2), (4, 1)])
    for solved in (solve_pic, lambda scene: solve_pit(scene, frame_rate_hz=1e5)):
        trace = solved(build_scene(disc_at(1.75, 2.5, 0.25, 0.25, r=0.5), ramp, **hop))
        # The gap to the ramp's line, times sqrt(5): 0.75 (1 + t) - t^2 / 4 - sqrt(5) / 2.
        met_s = 1.5 + 2.0 * math.sqrt(0.5625 - (0.5 * math.sqrt(5.0) - 0.75))
        assert trace.impacts["time_s"].tolist() == pytest.approx([met_s], abs=1e-5 if trace.dt_s else 1e-14)
        assert list_edges(trace) == [(1, FACE)]


def test_impact_on_a_merged_face_names_the_edge_below_the_disc() -> None:
    """An impact on a floor of four collinear edges names the edge below the disc; at a seam, the lower number."""
    floor = Chain(points_m=[(0, 0), (1, 0), (2, 0), (3, 0), (4, 0)])
    for x, edge in ((0.5, 0), (1.0, 0), (2.5, 2), (3.75, 3)):
        scene = build_scene(disc_at(x, 2, 0, -1), floor)
        trace, plain = solve_pic(scene), all_pairs(scene)
        plain.advance_to(10.0)
        assert (trace.impacts["time_s"].tolist(), list_edges(trace)) == ([1.5], [(edge, FACE)])
        assert require_value(plain.log.edges()).tolist() == [(edge, FACE)]


def test_simultaneous_wall_impacts_are_ordered_by_edge() -> None:
    """A disc that reaches both edges of a right-angled corner at 1.5 s hits the edge of lower number first."""
    trace = solve_pic(build_scene(disc_at(2, 2, -1, -1), Chain(points_m=[(9, 0), (0, 0), (0, 9)])))
    assert trace.impacts["time_s"].tolist() == [1.5, 1.5]
    assert list_edges(trace) == [(0, FACE), (1, FACE)]
    assert trace.final_velocity_m_s.tolist() == [[1.0, 1.0]]


@each(
    "corner, fields, ambiguous",
    [
        pytest.param([(9, 0), (0, 0), (0, 9)], {}, False, id="90 degrees"),
        pytest.param([(9, 0), (0, 0), (0, 9)], {"wall_restitution": 0.5}, False, id="90 degrees with losses"),
        pytest.param([(9, 0), (0, 0), (0, 9)], {"wall_friction": 0.5}, True, id="90 degrees with friction"),
        pytest.param([(9, 0), (0, 0), (9, 9)], {}, False, id="45 degrees"),
        pytest.param([(9, 0), (0, 0), (9, 9)], {"wall_restitution": 0.5}, True, id="45 degrees with losses"),
    ],
)
def test_corners_are_ambiguous_unless_the_order_is_irrelevant(
    corner: list[tuple[float, float]], fields: dict[str, float], ambiguous: bool
) -> None:
    """A corner of 90 degrees is ambiguous only with friction, one of 45 degrees only with energy loss."""
    middle = (math.atan2(corner[2][1], corner[2][0])) / 2
    apex = 1.0 / math.sin(middle)  # of the paths of a centre of radius 1, on the bisector
    way = complex(math.cos(middle), math.sin(middle))
    # To rounding both faces are met at one instant.
    start, velocity = (apex + 2) * way, -way
    disc = disc_at(start.real, start.imag, velocity.real, velocity.imag, r=1.0)
    trace = solve_pic(build_scene(disc, Chain(points_m=corner), **fields))
    assert len(trace.impacts) >= 2
    assert bool(trace.ambiguous) is ambiguous


@each(
    "disc, wall, time_s",
    [
        pytest.param(disc_at(1, 0, 0, 1, r=0.25), Ring(centre_m=(0, 0), radius_m=1.25), 0.0),
        pytest.param(disc_at(0, -1.5, 1), STADIUM, 2.0),
    ],
)
def test_gliding_along_an_arc_ends_the_run(disc: Disc, wall: Any, time_s: float) -> None:
    """Contact with an arc without approach ends PIC, also frame-wise, with GLIDES and a note on disc and wall."""
    for trace in (solve_pic(build_scene(disc, wall)), solve_pic_framewise(build_scene(disc, wall))):
        assert trace.outcome is Outcome.GLIDES
        assert (trace.end_time_s, len(trace.impacts)) == (time_s, 0)
        assert trace.notes == (f"disc 0 glides along wall 0 from {time_s:g} s on",)


def draw_pushed_disc(rnd: random.Random) -> tuple[Scene, float]:
    """Return a disc that a bar takes along into a ring, and when it comes there; the bar gives nothing back."""
    ring, radius, turn, gap, speed = (
        rnd.uniform(*ends) for ends in ((1.5, 3), (0.1, 0.4), (0.3, 0.75), (0.1, 0.5), (0.2, 1))
    )
    x, y = (ring - radius) * math.cos(turn) - gap, (ring - radius) * math.sin(turn)
    ends = [(x - radius, -5), (x - radius, 5)]
    walls = [
        Ring(centre_m=(0, 0), radius_m=ring, restitution=rnd.choice((0.0, 0.5, 1.0))),
        Chain(points_m=ends, velocity_m_s=(speed, 0), restitution=0.0),
    ]
    return build_scene(Disc(position_m=(x, y), radius_m=radius), *rnd.sample(walls, 2)), gap / speed


def draw_sliding_disc(rnd: random.Random) -> tuple[Scene, float]:
    """Return a disc that slides along the side of a stadium, and the time at which it reaches its round end."""
    x, y, length, height, vx, vy = (rnd.uniform(*ends) for ends in ((-3, 0), (-3, 0), (1, 4), (1, 3), (0.5, 2), (4, 9)))
    corners = [(x, y), (x + length, y), (x + length, y + height), (x, y + height)]
    stadium = Chain(points_m=corners, bulges=[0, 1, 0, 1], closed=True, restitution=0.0)
    disc = Disc(position_m=(x + 0.1, y + 0.5 * height), velocity_m_s=(vx, -vy), radius_m=height / 5)
    return build_scene(disc, stadium), (length - 0.1) / vx


@pytest.mark.long
@each(
    "drawn, fields",
    [
        (draw_pushed_disc, {}),
        (draw_sliding_disc, {}),
        (draw_sliding_disc, {"damping_per_s": 1e-9}),
        (draw_sliding_disc, {"table_deceleration_m_s2": 1e-9}),
        (draw_sliding_disc, {"gravity_m_s2": (1e-9, 0.0)}),
    ],
)
def test_gliding_along_an_arc_is_detected_despite_rounding(
    drawn: Callable[[random.Random], tuple[Scene, float]], fields: dict[str, Any]
) -> None:
    """Discs that are pushed or slide onto an arc's tangent end their run there within 1e-6 s."""
    # The outcome is GLIDES, or AT_REST under gravity. A pushed disc may also end in STANDSTILL.
    outcomes = set[Outcome]()
    for number in range(7):
        scene, time_s = drawn(random.Random(number))
        trace = solve_pic(Scene(**{**dict(scene), **fields}), max_impacts=1000)
        assert trace.end_time_s == pytest.approx(time_s, abs=1e-6)
        outcomes.add(trace.outcome)
    # One that is pushed may turn back and forth on a last bit, at one instant.
    ends = Outcome.AT_REST if "gravity_m_s2" in fields else Outcome.GLIDES
    assert ends in outcomes
    assert outcomes <= {ends, Outcome.STANDSTILL} if drawn is draw_pushed_disc else outcomes == {ends}


@each("place", [0.0, 1.0, 1e3])
@each("numbers", release_after(1, [range(10), range(10, 40)]))
def test_impact_on_the_inside_of_an_arc_with_restitution_0_is_the_last(place: float, numbers: range) -> None:
    """A disc glides along the inside of an arc from the instant of its impact on, wherever the arc is."""
    for number in numbers:
        rnd = random.Random(number)
        x, y = rnd.uniform(-place, place), rnd.uniform(-place, place)
        ring, radius, vx, vy = (rnd.uniform(*ends) for ends in ((0.02, 2), (0.001, 0.01), (0.2, 1), (-1, 1)))
        disc = disc_at(x + 0.3 * ring, y - 0.2 * ring, vx, vy, r=radius)
        half = [(x - ring, y), (x + ring, y)]
        for wall in (Ring(centre_m=(x, y), radius_m=ring), Chain(points_m=half, bulges=[1, 1], closed=True)):
            trace = solve_pic(build_scene(disc, wall, wall_restitution=0.0, duration_s=1e4))
            assert (trace.outcome, len(trace.impacts)) == (Outcome.GLIDES, 1)
            assert trace.end_time_s == trace.impacts["time_s"][0]


def test_disc_that_an_impact_stops_does_not_glide_along_the_arc() -> None:
    """A disc from the centre of a ring with restitution 0 rests where it hits the ring, and the run goes on."""
    for number in range(40):
        angle = random.Random(number).uniform(0.0, 2.0 * math.pi)
        disc = disc_at(0.0, 0.0, math.cos(angle), math.sin(angle), r=0.1)
        trace = solve_pic(build_scene(disc, Ring(centre_m=(0, 0), radius_m=1.0), wall_restitution=0.0, duration_s=3.0))
        assert (trace.outcome, len(trace.impacts)) == (Outcome.COMPLETED, 1)
        assert not trace.final_velocity_m_s.any()


@each("restitution", [0.0, 0.2, 0.5, 0.9])
def test_disc_in_an_inelastic_ring_glides_after_infinite_impacts(restitution: float) -> None:
    """In a ring with restitution below 1 a run ends with GLIDES at the sum of all chord times, to 1e-12."""
    # Impact k multiplies the speed w across by e and keeps u along: the next chord takes 2 R w / (u^2 + w^2).
    for number in range(12):
        rnd = random.Random(number)
        (x, y), (vx, vy) = ((rnd.uniform(-0.5, 0.5), rnd.uniform(0.1, 0.5)), (rnd.uniform(0.2, 1), rnd.uniform(-1, 1)))
        ring, radius = rnd.uniform(1, 3), rnd.uniform(0.1, 0.4)
        scene = build_scene(
            disc_at(x, y, vx, vy, r=radius),
            Ring(centre_m=(0, 0), radius_m=ring),
            wall_restitution=restitution,
            duration_s=1e4,
        )
        trace = solve_pic(scene, max_impacts=1000)
        a, b, c = vx * vx + vy * vy, x * vx + y * vy, x * x + y * y - (ring - radius) ** 2
        time_s, across = (math.sqrt(b * b - a * c) - b) / a, math.sqrt(b * b - a * c) / (ring - radius)
        along = abs(x * vy - y * vx) / (ring - radius)
        for _ in range(400):
            across *= restitution
            time_s += 2 * (ring - radius) * across / (along * along + across * across)
        assert trace.outcome is Outcome.GLIDES
        assert trace.end_time_s == pytest.approx(time_s, rel=1e-12)


@each("g, time_s", [(0.0, 1.0), (1.0, math.sqrt(3) - 1)])
def test_disc_as_wide_as_a_half_circle_bounces_straight_back(g: float, time_s: float) -> None:
    """A disc as wide as a cup, to a few ulp, has one impact with the arc and returns along its path."""
    for wall, ulps in ((CUP, (-1, 0)), (CHANNEL, (-4, -2, -1, 0, 2))):
        for radius in (1.0 + 2.0**-53 * n for n in ulps):
            disc, wide = disc_at(0, 1, 0, -1, r=radius), {"gravity_m_s2": (0, -g), "wall_restitution": 0.5}
            trace = solve_pic(build_scene(disc, wall, **wide, duration_s=1.25))
            assert (len(trace.impacts), trace.ambiguous) == (1, ())
            assert trace.impacts["time_s"][0] == pytest.approx(time_s, abs=1e-15)
            assert trace.impacts["velocity_first_after"][0] == pytest.approx((0, 0.5 * (1 + g * time_s)), abs=1e-15)
            assert list_edges(trace)[0][1] == ARC


@each("restitution", [1.0, 0.5])
def test_disc_that_fills_its_ring_ends_in_standstill(restitution: float) -> None:
    """A disc that fills a circle, or a larger part of one than half, ends in STANDSTILL within 1e-12 s."""
    halves = Chain(points_m=[(-1, 0), (1, 0)], bulges=[1, 1], closed=True)
    hook = Chain(points_m=[(-1, -0.75), (1, -0.75)], bulges=[-2])
    for ring, radius in ((Ring(centre_m=(0, 0), radius_m=1), 1), (halves, 1), (hook, 1.25)):
        trace = solve_pic(build_scene(disc_at(0, 0, 0.25, 0.5, r=radius), ring, wall_restitution=restitution))
        assert trace.outcome is Outcome.STANDSTILL
        assert trace.end_time_s < 1e-12
        assert np.abs(trace.final_position_m).max() < 1e-12


def draw_wide_disc(number: int) -> Scene:
    """Return a disc, about as wide as an arc, that approaches it along its axis or in another direction."""
    rnd = random.Random(number)
    bulge, (u, v) = rnd.choice((1, 1, 0.5, 0.25, 2, 1 - 2**-40)), rnd.choice(((0, -1), (0, -1), (3, -4), (-1, -2)))
    across, up = (1 + bulge * bulge) / (2 * bulge), (1 - bulge * bulge) / (2 * bulge)
    points, bulges = [(-1.0, 0), (1.0, 0)], [bulge]
    if rnd.random() < 0.75:  # edges that go on smoothly
        points, bulges = [(-1 - 2 * up, 2), *points, (1 + 2 * up, 2)], [0, bulge, 0]
    turn = rnd.choice((1, 1j, 3 + 4j, complex(math.cos(1), math.sin(1))))
    way, off = rnd.choice((0.5, 1, 2)), rnd.choice((0, 0, 1e-16, 1e-12, 1e-8, 0.05))
    place, speed, *ends = ((complex(*p) * turn) for p in ((off - way * u, up - way * v), (u, v), *points))
    disc = disc_at(
        place.real, place.imag, speed.real, speed.imag, r=across * abs(turn) * (1 + rnd.randint(-9, 4) * 2**-52)
    )
    wall = Chain(points_m=[(end.real, end.imag) for end in ends], bulges=bulges)
    return build_scene(disc, wall, wall_restitution=rnd.choice((1.0, 0.5)), duration_s=5.0)


@each("first", release_after(1, [*range(0, 50, 25), *range(50, 1000, 25)]))
def test_disc_does_not_slip_through_an_arc_of_its_own_width(first: int) -> None:
    """A disc about as wide as an arc never overlaps it by 1e-6 of its radius, however its numbers are rounded."""
    kept = 0
    for number in range(first, first + 25):
        try:
            scene = draw_wide_disc(number)
        except CaromError:  # it overlaps the wall at the start
            continue
        trace, kept = solve_pic(scene, max_impacts=100), kept + 1
        (disc,), (outline,), begun = scene.discs, scene.arrays.walls, 0.0
        assert isinstance(outline, Outline)
        (x, y), (vx, vy) = disc.position_m, disc.velocity_m_s
        ends = [*trace.impacts["time_s"].tolist(), trace.end_time_s]
        for end, after in zip(ends, [*trace.impacts["velocity_first_after"].tolist(), (0, 0)], strict=True):
            for wait in np.linspace(0, end - begun, 10):
                gap = outline.compute_gap(x + vx * wait, y + vy * wait, disc.radius_m)
                assert gap > -1e-6 * disc.radius_m, scene
            x, y, begun, (vx, vy) = x + vx * (end - begun), y + vy * (end - begun), end, after
    assert kept >= 7


def split_edges(points: list[tuple[float, float]], n: int, closed: bool) -> list[tuple[float, float]]:
    """Return the points of a chain each edge of which is in n pieces; n is a power of two, so no point is rounded."""
    ends = [*points[1:], *points[:1]]
    found = [
        (a[0] + (b[0] - a[0]) * k / n, a[1] + (b[1] - a[1]) * k / n)
        for a, b in zip(points, ends, strict=True)
        for k in range(n)
    ]
    return found if closed else found[: n * (len(points) - 1) + 1]


def build_split_table(n: int, seed: int) -> Scene:
    """Return a table with a re-entrant corner, a thick bar and an island, all of which are in n pieces an edge."""
    draw = random.Random(seed)
    room = [(0.0, 0.0), (8.0, 0.0), (8.0, 4.0), (4.0, 4.0), (4.0, 8.0), (0.0, 8.0)]
    return build_scene(
        disc_at(2, 2, draw.gauss(0, 1), draw.gauss(0, 1), r=0.25),
        disc_at(1, 1, draw.gauss(0, 1), draw.gauss(0, 1), r=0.25, m=2),
        Chain(points_m=split_edges(room, n, closed=True), closed=True),
        Chain(points_m=split_edges([(1.0, 5.0), (3.0, 7.0)], n, closed=False), half_width_m=0.125),
        Chain(points_m=split_edges([(5.0, 1.0), (7.0, 1.0), (6.0, 2.5)], n, closed=True), closed=True, solid=True),
        duration_s=100.0,
    )


@each("seed", release_after(2, range(4)))
def test_splitting_edges_changes_no_bit(seed: int) -> None:
    """Points exactly on an edge change no bit of any impact or final position, only the numbers of edges."""
    whole = solve_pic(build_split_table(1, seed), max_impacts=60)
    assert len(whole.impacts) == 60
    for n in (2, 8):
        parts = solve_pic(build_split_table(n, seed), max_impacts=60)
        assert parts.impacts.tobytes() == whole.impacts.tobytes()
        assert parts.final_position_m.tobytes() == whole.final_position_m.tobytes()
        of_whole = [(edge // n if edge >= 0 else edge, kind) for edge, kind in list_edges(parts)]
        assert [kind for _, kind in of_whole] == [kind for _, kind in list_edges(whole)]


def test_wall_restitution_and_friction_override_the_scene() -> None:
    """The restitution and friction of a wall replace those of the scene."""
    disc = disc_at(0, 0, 4)
    walls = (wall_at(2, 0, -1, 0, restitution=0.5), Chain(points_m=[(-2, -1), (-2, 1)], restitution=0.25))
    trace = solve_pic(build_scene(disc, *walls, wall_restitution=0.9))
    assert trace.impacts["velocity_first_after"][:, 0].tolist()[:3] == [-2.0, 0.5, -0.25]
    rough = build_scene(disc_at(0, 2, 1, -1), Chain(points_m=[(-9, 0), (9, 0)], friction=0.1))
    # Coulomb: the tangential velocity loses friction times what the normal one changes by.
    assert solve_pic(rough).final_velocity_m_s.tolist()[0] == pytest.approx([1.0 - 0.1 * 2.0, 1.0], abs=1e-15)


@each("angle", [0.0, 0.7, math.pi / 2, 4.0])
@each("side", [-1, 1])
def test_pit_finds_the_end_of_an_arc_in_any_direction(angle: float, side: int) -> None:
    """PIT finds a disc that comes along the chord at either end of an arc, at the first frame, along the chord."""
    chord = complex(math.cos(angle), math.sin(angle))
    along, place, end = side * chord, 1.5 * side * chord, 0.5 * chord
    arc = Chain(points_m=[(-end.real, -end.imag), (end.real, end.imag)], bulges=(0.5,))
    scene = staged("arc", disc_at(place.real, place.imag, -along.real, -along.imag, r=0.25), arc, duration_s=2.0)
    (impact,) = solve_pit(scene, frame_rate_hz=64.0).impacts
    assert impact["time_s"] == pytest.approx(0.75, abs=1 / 64 + 1e-9)
    assert impact["normal"] == pytest.approx((-along.real, -along.imag), abs=1e-12)
