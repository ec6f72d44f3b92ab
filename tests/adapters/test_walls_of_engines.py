"""What engines make of walls of edges: thin ones, those in pieces, driven ones, and two places pushed at once.

Rows of engines that are no part of `all` are run with `-m engines`: adapters build walls of capsules, lines and boxes.
"""

import importlib
import math
from collections.abc import Callable
from typing import Any

import numpy as np
import pytest
from tests.adapters.engine_scenes import (
    assert_leg_began_late,
    build_belt_scene,
    build_floor_scene,
    build_late_leg_scene,
    build_paddle_scene,
    build_thin_wall_scene,
)
from tests.cases import each, long_until, release_after
from tests.scene_builders import Finish, Named, disc_at, run_cross_check, staged

from carom import Chain, Disc, Ring, Scene, Wall
from carom.catalogue import all_scenes
from carom.engines.api import Adapter, AdapterError, unsupported_reason
from carom.execution.job import Status

STARTS = 16

#: Half widths with which an engine is run: what has no thickness, where that can be built.
HALF_WIDTHS = {"pymunk": 0.0, "box2d": 0.0, "mujoco": 0.02, "pybullet": 0.0}
#: What of a velocity of some 5 m/s is its rounding, and what is left of it in a floor in pieces.
ROUNDING_M_S = {"pymunk": 1e-12, "box2d": 0.0}
#: Error of velocities in 32-bit floats of planar engines, relative to the speed.
SINGLE = {"box2d3": 1e-5, "rapier2d": 1e-5}


def optional_engine_rows(**profiles: str) -> list[Any]:
    """Return rows of engine, profile and half width, without thickness and with, of engines not in `all`."""
    return [
        pytest.param(name, profile, width, marks=pytest.mark.engines)
        for name, several in profiles.items()
        for profile in several.split()
        for width in (0.0, 0.02)
    ]


@each("q", release_after(1, [3.0, 0.9, 1.5, 20.0]))
@each(
    "name, profile, half_width_m",
    [
        *(("pymunk", "default", 0.0), ("pymunk", "tuned", 0.0), ("mujoco", "no-ccd", 0.02)),
        ("pybullet", "no-ccd", 0.0),
        *optional_engine_rows(jolt="tuned", physx="tuned", p2="default tuned", cannon="default tuned"),
        *optional_engine_rows(matter="tuned", rapier2d="tuned ccd"),
    ],
)
def test_discrete_engines_tunnel_as_often_as_the_closed_form(
    named: Named, finish: Finish, name: str, profile: str, half_width_m: float, q: float
) -> None:
    """A share max(0, 1 - 1/q) of even starts passes a thin wall at q reaches a step, to one of sixteen."""
    scenes = [build_thin_wall_scene(q, k / STARTS, half_width_m=half_width_m) for k in range(STARTS)]
    passed = sum(finish(named(name), scene, 1 / 60, profile).position_m[0, 0] > 0 for scene in scenes)
    assert abs(passed - STARTS * max(0.0, 1 - 1 / q)) <= 1


@each("q", release_after(2, [0.9, 19.0, 1.5, 3.0]))
@each(
    "name, profile, half_width_m",
    [
        *(("box2d", "default", 0.0), ("box2d", "tuned", 0.0)),
        *optional_engine_rows(
            jolt="swept", p2="swept", physx="swept", rapier="default tuned", box2d3="default tuned swept"
        ),
        *optional_engine_rows(rapier2d="default swept"),  # of contacts ahead: from segments and capsules
    ],
)
def test_swept_discs_never_pass_a_thin_wall(
    named: Named, finish: Finish, name: str, profile: str, half_width_m: float, q: float
) -> None:
    """With a sweep a disc comes back from each of sixteen starts, its velocity reversed to 32 bits."""
    for k in range(STARTS):
        scene = build_thin_wall_scene(q, k / STARTS, half_width_m=half_width_m)
        speed = scene.discs[0].velocity_m_s[0]
        seen = finish(named(name), scene, 1 / 60, profile)
        np.testing.assert_allclose(seen.velocity_m_s[0], (-speed, 0.0), atol=SINGLE.get(name, 1e-6) * speed)


def test_tuned_mujoco_passes_no_thin_wall_and_default_passes_all(mujoco: Adapter, finish: Finish) -> None:
    """Tuned MuJoCo reflects discs of up to 20 reaches a step; past v / sqrt(1000) of its default spring, all pass."""
    for q in (0.9, 3.0, 20.0):
        for k in range(0, STARTS, 2):
            scene = build_thin_wall_scene(q, k / STARTS)
            seen = finish(mujoco, scene, 1 / 60, "tuned")
            np.testing.assert_allclose(seen.velocity_m_s[0], -np.array(scene.discs[0].velocity_m_s), rtol=1e-12)
            assert finish(mujoco, scene, 1 / 60, "default").position_m[0, 0] > 0


#: Engines, profiles, and what of a velocity of 4 m/s is rounding.
DRIVEN = [
    ("pymunk", "tuned", 1e-12),
    ("box2d", "tuned", 2e-6),
    ("mujoco", "tuned", 4e-12),
    ("pybullet", "tuned", 1e-12),
]
FURTHER = [
    (name, profile, rounding)
    for name, profiles, rounding in (
        ("planck", "default tuned", 1e-14),
        *((name, "default tuned", 2e-6) for name in ("box2d3", "rapier2d", "rapier", "jolt", "physx")),
        ("havok", "tuned", 2e-2),  # a bounce loses 9.81 m/s^2 times the step, in units of 1/16 m
        *(("p2", "tuned", 2e-6), ("cannon", "tuned", 1e-14), ("matter", "tuned", 1e-13)),
    )
    for profile in profiles.split()
]


@each("disc", [False, True])
@each("name, profile, rounding", [*DRIVEN, *(pytest.param(*row, marks=pytest.mark.engines) for row in FURTHER)])
def test_driven_bodies_add_twice_their_velocity(
    named: Named, finish: Finish, name: str, profile: str, rounding: float, *, disc: bool
) -> None:
    """An edge and a disc driven at -1 m/s send a disc of 2 m/s back at -4 m/s, 2 V - v, from four starts."""
    for k in range(0, STARTS, 4):
        seen = finish(named(name), build_paddle_scene(k / STARTS, disc=disc), 1 / 60, profile)
        np.testing.assert_allclose(seen.velocity_m_s[0], (-4.0, 0.0), rtol=0, atol=rounding)


@each(
    "name",
    [
        *(name for name, *_ in DRIVEN),
        *(pytest.param(name, marks=pytest.mark.engines) for name in dict.fromkeys(name for name, *_ in FURTHER)),
    ],
)
def test_a_leg_begins_at_the_step_at_or_after_its_instant(named: Named, finish: Finish, name: str) -> None:
    """A leg that begins within a step starts with the next step, so its body is behind by its speed times that."""
    for k in range(0, STARTS, 5):
        seen = finish(named(name), build_late_leg_scene(k / STARTS, 1 / 64), 1 / 64, "tuned")
        assert_leg_began_late(seen, k > 0, 1 / 64, rounding=2e-6)


@each("side", [1, -1])
@each(
    "name, profile, rounding",
    [
        ("box2d", "tuned", 1e-5),
        *(pytest.param("planck", profile, 1e-9, marks=pytest.mark.engines) for profile in ("default", "tuned")),
    ],
)
def test_belt_pushes_discs_the_same_way_on_both_sides(
    named: Named, finish: Finish, name: str, profile: str, rounding: float, side: int
) -> None:
    """A belt pushes a slipping disc by f (1 + e) v: up from the right, down from the left, as a half-plane."""
    edge = Chain(points_m=((0.0, -5.0), (0.0, 5.0)), surface_speed_m_s=9.0)
    plane = Wall(point_m=(0.0, 0.0), normal=(side, 0.0), surface_speed_m_s=9.0)
    for wall in (edge, plane):
        for k in range(STARTS):
            seen = finish(named(name), build_belt_scene(k / STARTS, wall, side), 1 / 64, profile)
            np.testing.assert_allclose(seen.velocity_m_s[0], (3.0 * side, 1.5 * side), rtol=0, atol=rounding)


def test_pymunk_skips_two_sided_belts_with_a_reason(pymunk: Adapter) -> None:
    """Pymunk's surface velocity is one vector: moving edges and rings are unsupported, half-planes are not."""
    laws: dict[str, Any] = {"discs": [Disc(position_m=(1.0, 0.0), radius_m=0.25)], "duration_s": 1.0}
    half_plane = Wall(point_m=(0.0, 0.0), normal=(1.0, 0.0), surface_speed_m_s=9.0)
    assert not unsupported_reason(Scene(name="half-plane", walls=[half_plane], **laws), pymunk.capabilities, 1 / 64)
    edge = Chain(points_m=((0.0, -5.0), (0.0, 5.0)), surface_speed_m_s=9.0)
    circle = Ring(centre_m=(-3.0, 0.0), radius_m=1.0, surface_speed_m_s=9.0)
    for scene in (Scene(name="belt", walls=[wall], **laws) for wall in (edge, circle)):
        said = "the scene has edges or circles with a moving surface, which this method does not support"
        assert unsupported_reason(scene, pymunk.capabilities, 1 / 64) == said
        result = run_cross_check([scene], ["pymunk"], dts=[1 / 64], profiles=["tuned"])
        assert [(row.status, row.reason) for row in result.rows] == [(Status.UNSUPPORTED, said)]
        with pytest.raises(AdapterError, match=said):
            pymunk.prepare(scene, pymunk.profiles["tuned"].settings(1 / 64))


@each("q, passing, wrong", long_until(2, [(0.9, 0, 13), (3.0, 10, 3), (1.5, 5, 8), (20.0, 15, 1)]))
def test_tuned_pybullet_passes_no_thin_wall_and_default_errs(
    pybullet: Adapter, finish: Finish, q: float, passing: int, wrong: int
) -> None:
    """Tuned PyBullet reflects a disc exactly from sixteen starts; by default given numbers pass or err."""
    ends = [
        [finish(pybullet, build_thin_wall_scene(q, k / STARTS), 1 / 60, profile) for k in range(STARTS)]
        for profile in ("tuned", "default")
    ]
    speed = build_thin_wall_scene(q, 0.0).discs[0].velocity_m_s[0]
    tuned, shipped = (np.array([end.velocity_m_s[0, 0] for end in each]) / speed for each in ends)
    np.testing.assert_allclose(tuned, -1.0, rtol=1e-12)
    assert (shipped > 0).sum() == passing
    assert (np.abs(shipped[shipped < 0] + 1) > 0.01).sum() == wrong


@each("profile", ["default", *release_after(0, ["tuned"])])
def test_pybullet_contacts_are_projected_into_the_plane(named: Named, profile: str) -> None:
    """In a box of moving edges normals have unit length, and impulses along them are the change of momentum."""
    scene, adapter = all_scenes()["driven/moving-box"].scene, named("pybullet")
    world = adapter.prepare(scene, adapter.profiles[profile].settings(1 / 60))
    last, contacts = world.observe(), 0
    for _ in range(scene.step_count(1 / 60)):
        world.advance(1)
        now = world.observe()
        pushed = sum((np.multiply(c.normal, c.impulse_n_s or 0.0) for c in now.contacts), start=np.zeros(2))
        change = scene.discs[0].mass_kg * (now.velocity_m_s[0] - last.velocity_m_s[0])
        np.testing.assert_allclose(-pushed, change, rtol=0, atol=1e-14)
        assert all(abs(math.hypot(*contact.normal) - 1.0) <= 1e-15 for contact in now.contacts)
        last, contacts = now, contacts + len(now.contacts)
    world.close()
    assert contacts > 10


def test_pybullet_refuses_spinning_or_fast_driven_discs(pybullet: Adapter) -> None:
    """Bullet bends the path of a driven disc that spins, and clamps its speed to 100 m/s, so both are refused."""
    scene = build_paddle_scene(0.0, disc=True)
    for changed in ({"spin_rad_s": 2.0}, {"velocity_m_s": (-101.0, 0.0)}):
        discs = (scene.discs[0], scene.discs[1].model_copy(update=changed))
        with pytest.raises(AdapterError, match="driven"):
            pybullet.prepare(scene.model_copy(update={"discs": discs}), pybullet.profiles["tuned"].settings(1 / 60))


def _run_pymunk_teleport(start_m: float, step_m: float) -> float:
    import pymunk

    space, disc, held = pymunk.Space(), pymunk.Body(1, math.inf), pymunk.Body(body_type=pymunk.Body.KINEMATIC)
    disc.position, disc.velocity = (start_m, 0), (2, 0)
    shapes = pymunk.Circle(disc, 0.25), pymunk.Segment(held, (0, -1), (0, 1), 0.0)
    for shape in shapes:
        shape.elasticity = 1
    space.add(disc, held, *shapes)
    for step in range(60):
        held.position = (step_m * step, 0)
        space.step(0.01)
    return float(disc.velocity.x)


def _run_box2d_teleport(start_m: float, step_m: float) -> float:
    box2d: Any = importlib.import_module("Box2D")
    world = box2d.b2World(gravity=(0, 0))
    disc = world.CreateDynamicBody(position=(start_m, 0), linearVelocity=(2, 0), fixedRotation=True, allowSleep=False)
    disc.CreateFixture(shape=box2d.b2CircleShape(radius=0.25), density=1, restitution=1, friction=0)
    held = world.CreateKinematicBody()
    held.CreateFixture(shape=box2d.b2EdgeShape(vertices=[(0, -1), (0, 1)]), restitution=1, friction=0)
    for step in range(60):
        held.position = (step_m * step, 0)
        world.Step(0.01, 8, 3)
    return float(disc.linearVelocity.x)


def _run_mujoco_teleport(start_m: float, step_m: float) -> float:
    mujoco: Any = importlib.import_module("mujoco")
    model = mujoco.MjModel.from_xml_string(
        """<mujoco><option timestep="0.01" gravity="0 0 0" integrator="Euler" jacobian="dense"/>
        <default><geom condim="1" solref="0 -200" solimp="0.9999 0.9999 0.001 0.5 2"/></default>
        <worldbody><body mocap="true"><geom type="box" size="0.01 1 1"/></body>
        <body><joint type="slide" axis="1 0 0"/><geom type="sphere" size="0.25" mass="1"/></body>
        </worldbody></mujoco>"""
    )
    data = mujoco.MjData(model)
    data.qpos[0], data.qvel[0] = start_m, 2.0
    for step in range(60):
        data.mocap_pos[0] = (step_m * step, 0, 0)
        mujoco.mj_step(model, data)
    return float(data.qvel[0])


@each("name, put", [("pymunk", _run_pymunk_teleport), ("Box2D", _run_box2d_teleport), ("mujoco", _run_mujoco_teleport)])
def test_teleported_paddle_acts_like_a_wall_at_rest(name: str, put: Callable[[float, float], float]) -> None:
    """A body moved by its position at -1 m/s (`mocap` in MuJoCo) sends a disc of 2 m/s back at only -2 m/s."""
    pytest.importorskip(name)
    for k in range(STARTS):
        assert put(-1.0 - 0.03 * k / STARTS, -0.01) == pytest.approx(-2.0, rel=1e-3)


@each("name", ["pymunk", "box2d"])
def test_tuned_floor_in_pieces_is_smooth(named: Named, finish: Finish, name: str) -> None:
    """Tuned, a floor in ten pieces acts like one in one piece from each of sixteen starts; by default it does not."""
    adapter, width = named(name), HALF_WIDTHS[name]

    def bump(profile: str, start: int) -> float:
        whole, pieces = (build_floor_scene(n, start / STARTS, half_width_m=width) for n in (1, 10))
        ends = [finish(adapter, scene, 1 / 60, profile).velocity_m_s for scene in (whole, pieces)]
        return float(np.abs(ends[1] - ends[0]).max())

    tuned, shipped = ([bump(profile, start) for start in range(STARTS)] for profile in ("tuned", "default"))
    assert max(tuned) <= ROUNDING_M_S[name]
    assert max(shipped) > 1


@pytest.mark.engines
@each("half_width_m", [0.0, 0.02])
@each(
    "name, profile, least, most, by_m_s",
    [
        ("jolt", "default", 1, 4, 1e-3),  # without `mEnhancedInternalEdgeRemoval`, which tuned has
        ("jolt", "tuned", 0, 0, 1e-3),
        ("physx", "default", 16, 16, 1e-3),  # inelastic below 2 m/s: it slides, and catches on each joint
        ("physx", "tuned", 0, 0, 1e-3),
        ("havok", "default", 1, 6, 1e-3),
        ("p2", "tuned", 0, 0, 1e-3),
        ("cannon", "tuned", 0, 3, 1e-3),
        ("matter", "tuned", 1, 5, 1e-3),
        ("box2d3", "default", 1, 4, 1e-3),
        ("box2d3", "tuned", 0, 0, 1e-3),
        ("box2d3", "swept", 0, 0, 1e-3),
        ("rapier2d", "default", 1, 7, 1.0),
        ("rapier2d", "tuned", 1, 7, 1.0),
    ],
)
def test_number_of_discs_that_catch_on_floor_joints(
    name: str, profile: str, least: int, most: int, by_m_s: float, half_width_m: float, named: Named, finish: Finish
) -> None:
    """A floor in ten pieces deflects the listed numbers of 16 discs; in one piece, none in planar engines."""

    def end(pieces: int, phase: float) -> np.ndarray:
        scene = build_floor_scene(pieces, phase, half_width_m=half_width_m)
        velocity: np.ndarray = finish(named(name), scene, 1 / 60, profile).velocity_m_s[0]
        return velocity

    caught = 0
    for phase in (k / STARTS for k in range(STARTS)):
        whole = end(1, phase)
        if name in SINGLE:
            np.testing.assert_allclose(whole, (5.0, 2.0), atol=5 * SINGLE[name])
        caught += bool(np.abs(end(10, phase) - whole).max() > by_m_s)
    assert least <= caught <= most


@each("name, rounding", [("pymunk", 1e-12), ("box2d", 1e-5)])
def test_pushes_of_two_edges_are_reported_as_one_contact(named: Named, name: str, rounding: float) -> None:
    """In a corner of a chain one contact has the whole change of velocity that both edges cause in a step."""
    width = HALF_WIDTHS[name]
    lands = 0.31  # between two steps, so that both are found in one
    disc = disc_at(0.25 + width + 3 * lands, 0.25 + width + 4 * lands, -3, -4, r=0.25)
    walls = Chain(points_m=[(5, 0), (0, 0), (0, 5)], half_width_m=width)
    scene = staged("corner", disc, walls, duration_s=1.0)
    adapter = named(name)
    world = adapter.prepare(scene, adapter.profiles["tuned"].settings(1 / 60))
    told, velocity = [], np.array([-3.0, -4.0])
    for _ in range(30):
        world.advance(1)
        seen = world.observe()
        told += [contact.impulse_n_s * np.array(contact.normal) for contact in seen.contacts]
        if len(told) == 1 and seen.contacts:
            velocity = velocity - told[0]
            np.testing.assert_allclose(seen.velocity_m_s[0], velocity, rtol=0, atol=rounding)
    world.close()
    assert len(told) == 1
    np.testing.assert_allclose(velocity, [3.0, 4.0], rtol=0, atol=rounding)
    assert math.hypot(*told[0]) == pytest.approx(10.0, abs=rounding)
