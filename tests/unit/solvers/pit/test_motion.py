"""Every kind of motion, compiled: the plain loop's bits, with all tests of a frame and with those that are due."""

import math
from collections.abc import Callable
from typing import Any

from tests.cases import each, long_until, release_after
from tests.random_scenes import draw_scene, draw_slope_scene, draw_table, draw_table_friction_scene
from tests.unit.solvers.pit.run_forms import assert_identical, collect_bits, list_compiled_forms, run_to_end

from carom import Chain, Disc, Scene, Wall
from carom.model.walls import Leg
from carom.solvers.pit.clock import FrameClock

FALL = (0.4, -9.81)


#: The scene of a number, of each kind.
DRAWN: dict[str, Callable[[int], Scene]] = {
    "damped": lambda number: draw_scene("gas", number).model_copy(update={"damping_per_s": (0.3, 20.0)[number % 2]}),
    "driven": lambda number: draw_table("driven table", number),
    "falling": lambda number: draw_scene("gas", number, rough=True, gravity=FALL).model_copy(
        update={"wall_rolling_resistance": 0.05, "wall_tangential_restitution": 0.0} if number % 2 else {}
    ),
    "falling on driven walls": lambda number: draw_table("driven table", number).model_copy(
        update={"gravity_m_s2": FALL}
    ),
    "thrown": draw_slope_scene,
    "table": draw_table_friction_scene,
}


@each("kind", DRAWN)
@each("numbers", release_after(1, [range(4), range(4, 60)]))
def test_random_scenes_match_the_plain_loop_to_the_bit(kind: str, numbers: range) -> None:
    """Random damped, driven, falling and slowed scenes have the same bits in all forms, at 37 Hz."""
    for number in numbers:
        scene = DRAWN[kind](number)
        frames = min(100, 20_000 // len(scene.discs) ** 2)
        assert_identical(scene.model_copy(update={"duration_s": frames / 37.0}), FrameClock(rate_hz=37.0))


# Many discs in cells, compared with compiled plain looping -----------------------------------------------------------


def build_crowd(*, fixed: dict[str, Any] | None = None, **fields: Any) -> Scene:
    """Return 100 discs of some sizes on a lattice of 1 m in a box, each tenth of which is as `fixed` says."""
    discs = []
    for k in range(100):
        angle, place = 2.399 * k, (k % 10 + 0.5, k // 10 + 0.5)
        radius = 0.45 - 0.03 * (k % 7)
        if fixed is not None and k % 10 == 5:
            discs.append(Disc(position_m=place, radius_m=radius, mass_kg=math.inf, **fixed))
        else:
            velocity = (1.5 * math.cos(angle), 1.5 * math.sin(angle))
            discs.append(Disc(position_m=place, velocity_m_s=velocity, radius_m=radius, mass_kg=1.0 + k % 3))
    fields = {"walls": build_box_walls(), "restitution": 0.9, "wall_restitution": 0.8, "duration_s": 2.0, **fields}
    return Scene(name="crowd", discs=discs, **fields)


def build_box_walls(**motion: Any) -> list[Wall]:
    sides = (((0, 0), (1, 0)), ((10, 0), (-1, 0)), ((0, 0), (0, 1)), ((0, 10), (0, -1)))
    return [Wall(point_m=point, normal=normal, **(motion if k == 0 else {})) for k, (point, normal) in enumerate(sides)]


def build_legs(times: int, speed: float) -> list[Leg]:
    return [Leg(from_s=0.21 * k, velocity_m_s=(speed * math.cos(k), speed * math.sin(2.0 * k))) for k in range(times)]


ROOM = Chain(points_m=[(0, 0), (10, 0), (10, 10), (5, 10), (0, 10)], bulges=[0.0, 0.2, 0.0, 0.0, 0.1], closed=True)

CROWDS: dict[str, Callable[[], Scene]] = {
    "straight": build_crowd,
    "friction": lambda: build_crowd(friction=0.3, wall_friction=0.2),
    "damped": lambda: build_crowd(damping_per_s=0.7),
    "driven wall": lambda: build_crowd(
        walls=build_box_walls(velocity_m_s=(-0.3, 0.1), surface_speed_m_s=0.5), wall_friction=0.3
    ),
    "shaken wall": lambda: build_crowd(walls=build_box_walls(legs=build_legs(9, 0.4))),
    "mallets": lambda: build_crowd(fixed={"driven": True, "legs": build_legs(9, 0.3)}),
    "falling": lambda: build_crowd(gravity_m_s2=FALL),
    "falling on fixed discs": lambda: build_crowd(gravity_m_s2=FALL, fixed={}),
    "falling on mallets": lambda: build_crowd(gravity_m_s2=FALL, fixed={"driven": True, "legs": build_legs(9, 0.3)}),
    "falling on a shaken wall": lambda: build_crowd(
        gravity_m_s2=(-5.0, -3.0), walls=build_box_walls(legs=build_legs(9, 0.4))
    ),
    "falling and rolling": lambda: build_crowd(gravity_m_s2=FALL, wall_friction=0.3, wall_rolling_resistance=0.02),
    "table": lambda: build_crowd(table_deceleration_m_s2=0.8),
    "table with fixed discs": lambda: build_crowd(table_deceleration_m_s2=0.8, fixed={}),
    "room": lambda: build_crowd(walls=[ROOM]),
    "falling in a room": lambda: build_crowd(walls=[ROOM], gravity_m_s2=FALL),
    "table in a room": lambda: build_crowd(walls=[ROOM], table_deceleration_m_s2=0.8),
}


@each("kind", CROWDS)
@each("rate_hz", long_until(1, [30.0, 7.0, 240.0]))
def test_crowds_in_any_motion_match_the_plain_loop_to_the_bit(kind: str, rate_hz: float) -> None:
    """Default, skipping and sweeping runs of 100 discs have the plain loop's bits, for every kind of motion."""
    scene, clock, forms = CROWDS[kind](), FrameClock(rate_hz=rate_hz), list_compiled_forms()
    plain = run_to_end(scene, clock, forms["plain"])
    assert len(plain.log) > 50
    for name in ("default", "always skipping", "sweeping"):
        assert collect_bits(run_to_end(scene, clock, forms[name])) == collect_bits(plain), name
