"""Discs, walls and scenes: what is accepted, what is refused, and how the refusal reads."""

import math
import pickle
import re
from collections.abc import Callable
from fractions import Fraction
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from tests.cases import each

from carom.errors import InputError, SceneError
from carom.model.scene import Disc, Need, Scene, Wall
from carom.support.limits import LARGEST, MOST_STEPS, SMALLEST, SPAN

NAN, INF = math.nan, math.inf


def disc_fields(**fields: Any) -> dict[str, Any]:
    """Return a valid disc as in a file, except for the fields given."""
    return {"position_m": [0.0, 0.0], "radius_m": 1.0, **fields}


def build_scene(**fields: Any) -> Scene:
    """Return a scene of one disc, except for the fields given."""
    return Scene(**{"name": "test", "duration_s": 1.0, "discs": [disc_fields()], **fields})


def catch_message(make: Callable[[], object]) -> str:
    """Return the message of the SceneError that `make` raises."""
    with pytest.raises(SceneError) as caught:
        make()
    return str(caught.value)


# One row an invalid input: the disc's field, its value, and what the message must say of field and value.
BAD_DISC_FIELDS = [
    ("radius_m", NAN, "radius_m: must be a finite number, got nan"),
    ("radius_m", -1.5, "radius_m: must be greater than 0, got -1.5"),
    ("radius_m", True, "radius_m: must be a valid number, got True"),
    ("radius_m", "1.5", "radius_m: must be a valid number, got '1.5'"),
    ("radius_m", 10**5000, "radius_m: must be a valid number, got an integer with too many digits"),
    ("mass_kg", -2.5, "mass_kg: must be greater than 0, got -2.5"),
    ("mass_kg", 1e200, "mass_kg: must be between 1.49e-154 and 6.7e153 (measure in other units), got 1e+200"),
    ("radius_m", 1e160, "radius_m: must be at most 6.7e153 in magnitude (measure in other units), got 1e+160"),
    ("position_m", [0, -1e160], "position_m[1]: must be at most 6.7e153 in magnitude (measure in other units), got "),
    ("position_m", [NAN, 0.0], "position_m[0]: must be a finite number, got nan"),
    ("position_m", [1.0, 2.0, 3.0], "position_m: must hold two numbers, got [1.0, 2.0, 3.0]"),
    ("position_m", [1.0], "position_m[1]: is required, but missing"),
    ("position_m", "12", "position_m: must be a list, got '12'"),
    ("spin_rad_s", INF, "spin_rad_s: must be a finite number, got inf"),
    ("inertia_factor", 0.0, 'inertia_factor: must be from 6.22e-61 to 1, where all mass is in the rim, or "inf"'),
    ("inertia_factor", 1.5, "inertia_factor: must be from"),
]


@each("field, value, says", BAD_DISC_FIELDS)
def test_invalid_disc_field_is_refused_with_index_and_value(field: str, value: object, says: str) -> None:
    """An invalid value of the third disc is refused with the disc's index, the field's name and the value."""
    discs = [disc_fields(), disc_fields(position_m=[9.0, 0.0]), disc_fields(position_m=[0.0, 9.0]) | {field: value}]
    assert catch_message(lambda: build_scene(discs=discs)).startswith(f"discs[2].{says}")
    assert catch_message(lambda: Disc(**discs[2])).startswith(says)


BAD_SCENE_FIELDS = [
    ("discs", [], "discs: must hold at least one disc, got []"),
    ("discs", [7], "discs[0]: must be a valid dictionary or instance of Disc, got 7"),
    ("walls", [{"point_m": [0.0, -1.0], "normal": [0.0, 0.0]}], "walls[0].normal: must not be of length zero, got "),
    ("walls", [{"normal": [0.0, 1.0]}], "walls[0].point_m: is required, but missing"),
    ("restitution", 1.5, "restitution: must be less than or equal to 1, got 1.5"),
    ("restitution", -0.25, "restitution: must be greater than or equal to 0, got -0.25"),
    ("wall_restitution", 1.0000000000000002, "wall_restitution: must be less than or equal to 1, got 1.00000000000000"),
    ("friction", -0.1, "friction: must be greater than or equal to 0, got -0.1"),
    ("friction", INF, "friction: must be a finite number, got inf"),
    ("tangential_restitution", 1.5, "tangential_restitution: must be less than or equal to 1, got 1.5"),
    ("wall_tangential_restitution", -2.0, "wall_tangential_restitution: must be greater than or equal to -1, got -2.0"),
    ("duration_s", 0.0, "duration_s: must be greater than 0, got 0.0"),
    ("duration_s", 1e-200, "duration_s: must be between 1.49e-154 and 6.7e153 (measure in other units), got 1e-200"),
    ("gravity_m_s2", [0.0, -1e200], "gravity_m_s2[1]: must be at most 6.7e153 in magnitude (measure in other units)"),
    ("frame_rate_hz", -60, "frame_rate_hz: must be greater than 0, got -60"),
    ("name", "", "name: must have at least 1 character, got ''"),
    ("name", "x" * 201, "name: must have at most 200 characters, got 'xxx"),
]


@each("field, value, says", BAD_SCENE_FIELDS)
def test_invalid_scene_field_is_refused_with_its_value(field: str, value: object, says: str) -> None:
    """An invalid value of a scene is refused with the field's name, its index in a list, and the value."""
    assert catch_message(lambda: build_scene(**{field: value})).startswith(says)


@each("field", ["colour", "self", "model_config", "__init__"])
def test_unknown_field_is_refused_with_its_path(field: str) -> None:
    """An unknown field of a scene, disc or wall is refused with its path, even one with a name of Python's."""
    says = f"{field}: is not a field of a scene; see `carom scenes --schema`"
    assert catch_message(lambda: build_scene(**{field: 1})) == says
    assert catch_message(lambda: build_scene(discs=[disc_fields(**{field: 1})])) == f"discs[0].{says}"
    wall = {"point_m": [0.0, -1.0], "normal": [0.0, 1.0], field: 1}
    assert catch_message(lambda: build_scene(walls=[wall])) == f"walls[0].{says}"


def test_deeply_nested_value_is_refused_with_its_field() -> None:
    """A value that is nested too deeply for Python to print is refused with the name of its field."""
    nested: dict[str, Any] = {}
    for _ in range(100_000):
        nested = {"a": nested}
    says = "name: must be a valid string, got a value nested too deeply to show"
    assert catch_message(lambda: build_scene(name=nested)) == says


@each("mass", [INF, "inf"])
def test_infinite_mass_makes_a_disc_immovable(mass: object) -> None:
    """Infinity and the text "inf" mean immovable, and a finite mass does not; a driven disc may move and spin."""
    assert Disc(**disc_fields(mass_kg=mass)).immovable
    assert Disc(**disc_fields(mass_kg=mass)).mass_kg == INF
    assert not Disc(**disc_fields(mass_kg=LARGEST)).immovable
    driven = {"velocity_m_s": [1.0, 0.0], "spin_rad_s": 2.0, "inertia_factor": INF, "driven": True}
    assert Disc(**disc_fields(mass_kg=mass, **driven)).immovable


def test_numpy_values_are_equivalent_to_plain_ones() -> None:
    """Arrays and NumPy scalars give the same scene as equal lists and numbers."""
    from_numpy = disc_fields(position_m=np.array([1, 2]), radius_m=np.float32(0.5), mass_kg=np.int64(3))
    plain = disc_fields(position_m=[1.0, 2.0], radius_m=0.5, mass_kg=3.0)
    assert build_scene(discs=[from_numpy], duration_s=np.float64(2.0)) == build_scene(discs=[plain], duration_s=2.0)


# Sizes that span too much ---------------------------------------------------------------------------------------------


def test_sizes_at_the_limits_are_accepted() -> None:
    """The largest and smallest numbers, and the widest span in one scene, are accepted without a warning."""
    build_scene(
        discs=[disc_fields(radius_m=LARGEST, mass_kg=SMALLEST, position_m=[-LARGEST, LARGEST])], duration_s=SMALLEST
    )
    build_scene(
        discs=[disc_fields(radius_m=1.0), disc_fields(position_m=[SPAN, 0.0], mass_kg=SPAN)], duration_s=LARGEST
    )
    for speed in (SPAN, 1 / SPAN):
        build_scene(discs=[disc_fields(velocity_m_s=[speed, 0.0])])
    build_scene(discs=[disc_fields(position_m=[x, 0.0], radius_m=LARGEST) for x in (-LARGEST, LARGEST)])


FLOOR = {"point_m": [0.0, -9.0], "normal": [0.0, 1.0]}
FLYING = "duration_s: must be so short that no disc flies further than 1.61e119 times the smallest radius, got "
#: Fields that are valid one by one, but not in one scene.
NOT_TOGETHER: list[tuple[dict[str, Any], str]] = [
    ({"discs": [{"position_m": [0, 0]}]}, "discs[0].radius_m: is required, but missing"),
    (
        {"discs": [disc_fields(mass_kg=INF, velocity_m_s=[1.0, 0.0])]},
        "discs[0].velocity_m_s: must be (0, 0) for an immovable disc (mass_kg = inf), got (1.0, 0.0); set",
    ),
    ({"discs": [disc_fields(spin_rad_s=2.5, mass_kg="inf")]}, "discs[0].spin_rad_s: must be 0 for an immovable disc"),
    ({"discs": [disc_fields(spin_rad_s=2.5, inertia_factor=INF)]}, "discs[0].spin_rad_s: must be 0 for a disc that"),
    ({"discs": [disc_fields(driven=True)]}, "discs[0].driven: needs mass_kg = inf: impacts move a disc of 1 kg"),
    ({"discs": [disc_fields(driven=1, mass_kg=INF)]}, "discs[0].driven: must be a valid boolean, got 1"),
    (
        {"walls": [{**FLOOR, "velocity_m_s": [0.0, 1.0]}], "damping_per_s": 0.5},
        "damping_per_s: must be 0 in a scene with a driven body, whose path is not damped, got 0.5",
    ),
    (
        {"walls": [FLOOR, {"point_m": [0.25, 0.0], "normal": [-4.0, 0.0]}]},
        "discs[0].position_m: must not overlap walls[1] at the start, got (0.0, 0.0): the disc reaches 0.75 m into it",
    ),
    # sizes that no choice of units brings near 1
    (
        {"discs": [disc_fields(radius_m=1.0), disc_fields(radius_m=1e-10, position_m=[1e111, 0.0])]},
        "discs[1].radius_m: must be at least 6.2e-120 of the greatest length in the scene, 1e111 m, got 1e-10",
    ),
    ({"walls": [{"point_m": [0.0, -1e121], "normal": [0.0, 1.0]}]}, "discs[0].radius_m: must be at least 6.2e-120"),
    (
        {"discs": [disc_fields(mass_kg=1e61), disc_fields(mass_kg=1e-60, position_m=[9.0, 0.0])]},
        "discs[1].mass_kg: must be at least 6.2e-120 of the greatest finite mass in the scene, 1e61 kg, got 1e-60",
    ),
    (
        {"discs": [disc_fields(velocity_m_s=[0.0, 1e111])], "duration_s": 1e10},
        f"{FLYING}10000000000.0: the path",
    ),
    ({"gravity_m_s2": [0.0, -1.0], "duration_s": 1e61}, f"{FLYING}1e+61: the path is 1e122 m"),
    ({"discs": [disc_fields(spin_rad_s=1e150)]}, FLYING),  # the rim is as fast as that
    (
        {"discs": [disc_fields(velocity_m_s=[0.0, 1e-130])]},
        "duration_s: must be so long that the fastest disc",
    ),
]


@each("fields, says", NOT_TOGETHER)
def test_inconsistent_fields_are_refused_with_field_and_value(fields: dict[str, Any], says: str) -> None:
    """Fields that exclude each other, overlaps, and sizes of too wide a span are refused with field and limit."""
    assert catch_message(lambda: build_scene(**fields)).startswith(says)


# Overlapping starts ---------------------------------------------------------------------------------------------------


TRIPLES = [(3, 4, 5), (5, 12, 13), (8, 15, 17), (7, 24, 25), (20, 21, 29), (0, 1, 1), (1, 0, 1)]
thousandths = st.integers(-(10**6), 10**6).map(lambda k: Fraction(k, 1000))


@given(st.sampled_from(TRIPLES), thousandths, thousandths, thousandths, st.integers(1, 1000))
def test_disc_that_touches_an_oblique_wall_is_accepted(
    triple: tuple[int, int, int], x: Fraction, y: Fraction, along: Fraction, size: int
) -> None:
    """A disc that touches a wall exactly in rational numbers is never refused, wherever the wall's point is."""
    nx, ny, length = triple
    radius = Fraction(size, 1000) * length
    point = (x - radius * nx / length - along * ny, y - radius * ny / length + along * nx)
    build_scene(
        discs=[disc_fields(position_m=[float(x), float(y)], radius_m=float(radius))],
        walls=[{"point_m": [float(c) for c in point], "normal": [float(nx), float(ny)]}],
    )


@each("scale", [1.0, 5.0, 1e-200, 1e200, 5e-324])
def test_wall_stores_its_normal_as_a_unit_vector(scale: float) -> None:
    """A normal of any length, from 5e-324 to 1e200, becomes the unit vector of its direction."""
    assert Wall(point_m=(0, 0), normal=(0, -scale)).normal == (0.0, -1.0)
    if scale > 1e-300:
        x, y = Wall(point_m=(0, 0), normal=(3 * scale, 4 * scale)).normal
        # Each component takes two divisions and a length, 4 units of relative rounding (2^-53) together.
        assert abs(x - 0.6) <= 5 * 2**-53
        assert abs(y - 0.8) <= 5 * 2**-53


# What a scene is ------------------------------------------------------------------------------------------------------


def test_scene_is_an_immutable_value() -> None:
    """A scene can't be changed; scenes with equal fields are equal and hash alike, also after pickling."""
    made = build_scene(
        discs=[disc_fields(mass_kg=INF), disc_fields(position_m=[5.0, 0.0], velocity_m_s=[0.1, 0.2])],
        walls=[{"point_m": [0, -1], "normal": [0.1, 1]}],
    )
    for thing, field in ((made, "name"), (made.discs[0], "radius_m"), (made.walls[0], "normal")):
        with pytest.raises(ValueError, match="frozen"):
            setattr(thing, field, 1.0)
    assert Scene(**dict(made)) == pickle.loads(pickle.dumps(made)) == made  # noqa: S301 - our own bytes
    assert build_scene() == build_scene() != build_scene(duration_s=2.0)
    assert len({build_scene(), build_scene(), build_scene(duration_s=2.0)}) == 2


def test_needs_follow_from_the_parts_of_a_scene() -> None:
    """Each need follows from a part of the scene; laws of impacts that the scene can't have are no needs."""
    floor, pair = [FLOOR], [disc_fields(), disc_fields(position_m=[9.0, 0.0])]
    law = {"friction": 0.5, "tangential_restitution": -1.0}
    wall_law = {"wall_restitution": 0.5, "wall_friction": 0.5, "wall_tangential_restitution": 1.0}
    law_needs = {Need.FRICTION, Need.TANGENTIAL_RESTITUTION}
    rows: list[tuple[dict[str, Any], set[Need]]] = [
        ({}, set()),
        (wall_law | law, set()),
        ({"walls": floor}, {Need.WALLS}),
        ({"walls": floor, **wall_law}, {Need.WALLS, Need.RESTITUTION, *law_needs}),
        ({"discs": pair, **law}, law_needs),
        ({"discs": pair, "tangential_restitution": 1.0}, set()),
        ({"restitution": 0.5}, {Need.RESTITUTION}),
        ({"discs": [disc_fields(mass_kg=INF)]}, {Need.IMMOVABLE}),
        ({"discs": [disc_fields(spin_rad_s=-1.0)]}, {Need.SPIN}),
        ({"gravity_m_s2": [0, -9.81]}, {Need.GRAVITY}),
    ]
    for fields, needs in rows:
        assert build_scene(**fields).needs == needs


@each(
    "dt, says",
    [
        *((dt, f"above 0, got {dt}") for dt in (0.0, -0.1, NAN, INF)),
        *((dt, f"at least 2.33e-10 of the scene's duration (1.0 s), got {dt}") for dt in (1e-300, 5e-324)),
        (1 / (MOST_STEPS + 1), "at least 2.33e-10 of the scene's duration"),
    ],
)
def test_invalid_time_step_is_refused_with_its_value(dt: float, says: str) -> None:
    """Zero, negative, infinite and NaN steps are refused, and steps of which a scene has more than 2^32."""
    assert build_scene().step_count(1 / MOST_STEPS) == MOST_STEPS
    with pytest.raises(InputError, match=re.escape(says)):
        build_scene().step_count(dt)


@given(st.integers(1, 10**6), st.integers(1, 10**4))
def test_step_count_of_whole_frames_is_exact(frames: int, rate: int) -> None:
    """A duration of `frames / rate` seconds has `frames` steps of `1 / rate`, whatever the rounding."""
    assert build_scene(duration_s=frames / rate).step_count(1 / rate) == frames


@given(st.floats(1e-4, 1e4), st.floats(1e-4, 1e4))
def test_steps_cover_the_duration_without_excess(duration: float, dt: float) -> None:
    """The steps reach the end of the scene, within the rounding of the inputs, and one step fewer does not."""
    steps = build_scene(duration_s=duration).step_count(dt)
    slack = Fraction(2, 2**53)  # half a unit of rounding each for duration and step, as `step_count` derives it
    assert steps >= 1
    assert steps * Fraction(dt) >= Fraction(duration) * (1 - slack)
    assert (steps - 1) * Fraction(dt) < Fraction(duration)
