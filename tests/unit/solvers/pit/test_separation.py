"""What PIT does not take for an impact: rounding after an impact with restitution 0."""

import math

import numpy as np
from tests.cases import each
from tests.scene_builders import disc_at, drive_on_legs, staged, wall_at
from tests.unit.solvers.pit.run_forms import assert_identical

from carom import Chain, Scene, solve_pit
from carom.solvers.pit.clock import FrameClock

CLOCK = FrameClock(rate_hz=60.0)


def list_struck_bodies(scene: Scene) -> list[int]:
    """Return the second bodies of all impacts; every form has them."""
    found: list[int] = assert_identical(scene, CLOCK).log.array()["second"].tolist()
    return found


def test_sliding_into_a_perpendicular_wall_adds_one_impact() -> None:
    """A disc that slides along a driven wall into a perpendicular one has one impact with each wall."""
    # The second impact changes nothing along the normal of the first wall.
    floor, side = wall_at(0, 0, 0, 1, velocity_m_s=(0.0, 0.1)), wall_at(3, 0, -1, 0, velocity_m_s=(0.3, 0.0))
    for k in range(20):
        disc = disc_at(0.0, 1.0, 1.7 + 0.0137 * k, -1.3 - 0.0071 * k, r=0.3)
        scene = staged("corner", disc, floor, side, wall_restitution=0.0, duration_s=6.0)
        assert list_struck_bodies(scene) == [-1, -2]


@each("angle", np.linspace(0.1, 6.1, 25).tolist())
def test_sliding_along_an_edge_is_one_impact(angle: float) -> None:
    """A disc that slides along an edge after an inelastic impact has no second one, at any angle of the edge."""
    # The normal from the nearest point is rounded differently at each place.
    (ux, uy), (nx, ny) = (math.cos(angle), math.sin(angle)), (-math.sin(angle), math.cos(angle))
    edge = Chain(points_m=[(-9.0 * ux, -9.0 * uy), (9.0 * ux, 9.0 * uy)])
    disc = disc_at(-3.0 * ux + 2.0 * nx, -3.0 * uy + 2.0 * ny, 1.3 * ux - 2.0 * nx, 1.3 * uy - 2.0 * ny, r=0.5)
    assert list_struck_bodies(staged("slide", disc, edge, wall_restitution=0.0, duration_s=3.0)) == [-1]


def test_disc_meets_the_inside_of_an_arc_repeatedly() -> None:
    """A disc in a half-circle bowl with restitution 0 has over 20 impacts with it in 2 s."""
    bodies = disc_at(0.3, 0.0, 0.7, -1.0, r=0.25), Chain(points_m=[(-2.0, 0.0), (2.0, 0.0)], bulges=[1.0])
    assert len(list_struck_bodies(staged("bowl", *bodies, wall_restitution=0.0, duration_s=2.0))) > 20


def test_joined_discs_do_not_collide_again_on_a_floor() -> None:
    """Two discs that move together after an inelastic impact do not collide again when both land on a floor."""
    for k in range(20):
        first, second = disc_at(0.0, 1.0, 1.1 + 0.0137 * k, -0.3, m=1.3), disc_at(2.0, 1.0, 0.0, -0.3, m=1.7)
        bodies = first, second, wall_at(0.0, 0.2, 0.0, 1.0)
        scene = staged("side by side", *bodies, restitution=0.0, wall_restitution=0.0, duration_s=4.0)
        assert list_struck_bodies(scene) == [1, -1, -1]


@each("turned", [1, 1j, -1, -1j])
@each("at", [0j, 16.0 + 8.0j, -16.0 - 8.0j])
def test_disc_sent_back_by_a_wall_strikes_an_overlapped_disc_again(turned: complex, at: complex) -> None:
    """A disc that PIT lets overlap an immovable one strikes it again after a ceiling has sent it back."""
    # The first impact is at the first frame, at a quarter of a metre of overlap. All numbers are exact in floats.
    place, velocity, top, down = at + turned * (-1.25 - 0.0625j), turned * (32.0 + 4.0j), at + turned * 1j, turned * -1j
    first = disc_at(place.real, place.imag, velocity.real, velocity.imag, r=0.5)
    second = disc_at(at.real, at.imag, r=0.5, m=math.inf)
    ceiling = wall_at(top.real, top.imag, down.real, down.imag)
    scene = staged("back", first, second, ceiling, restitution=0.0, wall_restitution=1.0, duration_s=1.0)
    assert solve_pit(scene, frame_rate_hz=64.0).impacts["second"].tolist() == [1, -1, 1]


def test_shaken_wall_strikes_a_disc_on_each_approaching_leg() -> None:
    """A shaken wall strikes the disc on it once for each leg on which it approaches: three times in all."""
    legs = drive_on_legs(*((0.5 * k, (0.0, speed)) for k, speed in enumerate((0.0, 0.1, 0.3, 0.2))))
    bodies = disc_at(0.0, 0.6, 0.3, -1.0), wall_at(0.0, 0.0, 0.0, 1.0, **legs)
    assert list_struck_bodies(staged("shaken", *bodies, wall_restitution=0.0, duration_s=2.0)) == [-1, -1, -1]


def test_discs_of_equal_velocity_on_a_table_collide_once() -> None:
    """Two discs that move together after an inelastic impact on a decelerating table do not collide again."""
    for k in range(20):
        first, second = disc_at(0.0, 0.0, 1.3 + 0.0113 * k, 0.0, r=0.5, m=1.7), disc_at(1.5, 0.0, r=0.5)
        scene = staged("together", first, second, restitution=0.0, table_deceleration_m_s2=0.2, duration_s=3.0)
        assert list_struck_bodies(scene) == [1]
